// Arbitrary bytes as files of the program's own formats: a snapshot, a golden, a manifest.

#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include "producer/base/packed_file.h"
#include "producer/build/snapshot.h"
#include "producer/run/golden.h"
#include "producer/run/output.h"
#include "render/error.h"

namespace {

using namespace offstage::producer;

void write(const std::filesystem::path& file, const uint8_t* data, size_t size) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
}

template <class F>
void refused_or_read(F&& read) {
  try {
    read();
  } catch (const offstage::render::FileError&) {
  } catch (const OutputError&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const std::filesystem::path folder = [] {
    std::string name = (std::filesystem::temp_directory_path() / "offstage-fuzz-XXXXXX").string();
    return std::filesystem::path(mkdtemp(name.data()));
  }();
  if (size < 1) return 0;
  const uint8_t kind = data[0] % 4;
  ++data;
  --size;
  if (kind == 0) refused_or_read([&] { deserialize({data, size}, "fuzz"); });
  // Puts the bytes behind a valid header and checksum, which a fuzzer would not find by itself.
  if (kind == 1)
    refused_or_read([&] { deserialize(pack({"offsnap", 4, "snapshot"}, {data, size}), "fuzz"); });
  if (kind == 2) {
    write(folder / "g.json", data, size);
    refused_or_read([&] { read_golden(folder, "g"); });
  }
  if (kind == 3) {
    write(folder / "manifest.json", data, size);
    refused_or_read([&] {
      prepare_frames(folder / "####.png", {}, {1},
                     {.scene = "s", .settings = "x", .width_px = 1, .height_px = 1, .frames = 1, .fps = 30},
                     Existing::replace);
    });
  }
  return 0;
}
