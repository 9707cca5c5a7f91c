// write_exr of channels.h.

#include <cstring>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>

#include "render/channels.h"
#include "render/file_io.h"
#include "render/image_io.h"

namespace offstage::render {
namespace {

/// A file in memory, which is then written to the disk as a whole.
class Buffer : public Imf::OStream {
 public:
  Buffer() : Imf::OStream("memory") {}
  void write(const char c[], int n) override {
    const auto size = static_cast<std::size_t>(n);
    if (bytes.size() < at_ + size) bytes.resize(at_ + size);
    std::memcpy(bytes.data() + at_, c, size);
    at_ += size;
  }
  uint64_t tellp() override { return at_; }
  void seekp(uint64_t place) override { at_ = place; }

  std::vector<uint8_t> bytes;

 private:
  std::size_t at_ = 0;
};

}  // namespace

void write_exr(const std::filesystem::path& path, const Channels& channels, const ChannelChoice& choice,
               const ObjectNames& objects) {
  Imf::Header header(channels.width_px, channels.height_px);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer pixels;
  const auto add = [&](const char* name, Imf::PixelType type, const void* first, std::size_t stride) {
    header.channels().insert(name, Imf::Channel(type));
    // The library takes a non-const pointer, but only reads.
    auto* base = static_cast<char*>(const_cast<void*>(first));
    pixels.insert(name, Imf::Slice(type, base, stride, stride * static_cast<std::size_t>(channels.width_px)));
  };
  if (choice.has(Channel::depth)) add("Z", Imf::FLOAT, channels.depth.data(), sizeof(float));
  if (choice.has(Channel::normal)) {
    const char* names[] = {"N.X", "N.Y", "N.Z"};
    for (int k = 0; k < 3; ++k)
      add(names[k], Imf::FLOAT, channels.normal.data()->data() + k, sizeof(Eigen::Vector3f));
  }
  if (choice.has(Channel::id)) {
    add("id", Imf::UINT, channels.id.data(), sizeof(uint32_t));
    std::string text;
    for (const auto& [id, name] : objects) text += std::to_string(id) + " " + name + "\n";
    header.insert("objects", Imf::StringAttribute(text));
  }
  if (choice.has(Channel::motion)) {
    const char* names[] = {"motion.X", "motion.Y"};
    for (int k = 0; k < 2; ++k)
      add(names[k], Imf::FLOAT, channels.motion.data()->data() + k, sizeof(Eigen::Vector2f));
  }
  Buffer buffer;
  {
    constexpr int kNoThreads = 0;
    Imf::OutputFile file(buffer, header, kNoThreads);
    file.setFrameBuffer(pixels);
    file.writePixels(channels.height_px);
  }
  write_file_atomically(path, buffer.bytes);
}

}  // namespace offstage::render
