#include "render/model_files.h"

#include <algorithm>
#include <cstring>

#include <assimp/IOStream.hpp>

#include "render/error.h"
#include "render/file_io.h"
#include "render/mtl_file.h"

namespace offstage::render {
namespace {

constexpr uint64_t kMaxBytes = uint64_t{2} << 30;

/// An input file of assimp whose bytes are in memory.
class ModelStream : public Assimp::IOStream {
 public:
  explicit ModelStream(std::vector<uint8_t> bytes) : bytes_(std::move(bytes)) {}

  std::size_t Read(void* out, std::size_t size, std::size_t count) override {
    if (size == 0) return 0;
    const std::size_t whole = std::min(count, (bytes_.size() - at_) / size);
    if (whole > 0) std::memcpy(out, bytes_.data() + at_, whole * size);
    at_ += whole * size;
    return whole;
  }
  std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    // Unsigned overflow is intended for negative offsets.
    const std::size_t base = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at_ : bytes_.size();
    const std::size_t to = base + offset;
    if (to > bytes_.size()) return aiReturn_FAILURE;
    at_ = to;
    return aiReturn_SUCCESS;
  }
  std::size_t Tell() const override { return at_; }
  std::size_t FileSize() const override { return bytes_.size(); }
  void Flush() override {}

 private:
  std::vector<uint8_t> bytes_;
  std::size_t at_ = 0;
};

bool equal_ignoring_case(const std::string& a, const std::string& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

/// Converts "a%20b" to "a b", as in the URIs of glTF and Collada.
std::string percent_decoded(const std::string& text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool code = text[i] == '%' && i + 2 < text.size() &&
                      std::isxdigit(static_cast<unsigned char>(text[i + 1])) &&
                      std::isxdigit(static_cast<unsigned char>(text[i + 2]));
    result += code ? static_cast<char>(std::stoi(text.substr(i + 1, 2), nullptr, 16)) : text[i];
    if (code) i += 2;
  }
  return result;
}

class ModelFiles : public Assimp::IOSystem {
 public:
  explicit ModelFiles(const InputFolders& folders) : folders_(folders) {}

  bool Exists(const char* name) const override {
    std::error_code error;
    return folders_.contain(name) && std::filesystem::is_regular_file(name, error);
  }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char* mode) override {
    if (std::strpbrk(mode, "wa+") || !Exists(name)) return nullptr;
    try {
      std::vector<uint8_t> bytes = read_file(name, kMaxBytes);
      if (has_ending(name, ".mtl")) {
        const std::string text = mtl_for_assimp({bytes.begin(), bytes.end()});
        bytes.assign(text.begin(), text.end());
      }
      return new ModelStream(std::move(bytes));
    } catch (const FileError&) {
      return nullptr;
    }
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  const InputFolders& folders_;
};

}  // namespace

bool has_ending(const std::filesystem::path& path, const std::string& ending) {
  return equal_ignoring_case(path.extension().string(), ending);
}

std::filesystem::path find_beside(const std::filesystem::path& folder, std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  if (name.starts_with("file://")) name.erase(0, 7);
  std::error_code ignored;
  for (const std::filesystem::path path : {name, percent_decoded(name)}) {
    for (const std::filesystem::path& candidate : {folder / path, folder / path.filename()}) {
      if (std::filesystem::is_regular_file(candidate, ignored)) return candidate;
    }
  }
  const std::string file = std::filesystem::path(name).filename().string();
  const std::filesystem::path here = folder.empty() ? "." : folder;
  for (std::filesystem::directory_iterator entry(here, ignored), end; entry != end;
       entry.increment(ignored)) {
    if (equal_ignoring_case(entry->path().filename().string(), file)) return entry->path();
  }
  return {};
}

std::unique_ptr<Assimp::IOSystem> make_model_files(const InputFolders& folders) {
  return std::make_unique<ModelFiles>(folders);
}

}  // namespace offstage::render
