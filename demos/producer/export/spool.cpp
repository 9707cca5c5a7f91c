#include "producer/export/spool.h"

#include <array>

#include <fcntl.h>
#include <unistd.h>

#include "render/file_io.h"

namespace offstage::producer {
namespace {

constexpr std::size_t kBuffer = std::size_t{1} << 20;

}  // namespace

Spool::Spool(const std::filesystem::path& folder) : folder_(folder) {
  const std::filesystem::path place = folder.empty() ? "." : folder;
  file_ = render::Descriptor(::open(place.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
  if (!file_) {  // the file system does not support unnamed files
    std::string name = (place / ".offstage-spool-").string() + std::string(6, 'X');
    file_ = render::Descriptor(::mkostemp(name.data(), O_CLOEXEC));
    if (!file_) render::throw_file_error(place, "cannot create a temporary file");
    ::unlink(name.c_str());
  }
}

void Spool::append(std::span<const uint8_t> bytes) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  size_ += bytes.size();
  if (buffer_.size() >= kBuffer) flush();
}

void Spool::flush() {
  if (const int error = render::write_all(file_.fd(), buffer_))
    render::throw_file_error(folder_, "cannot write a temporary file", error);
  buffer_.clear();
}

void Spool::copy_to(render::OutputFile& file) {
  flush();
  std::vector<uint8_t> block(kBuffer);
  for (uint64_t at = 0; at < size_;) {
    const ssize_t n = ::pread(file_.fd(), block.data(), block.size(), static_cast<off_t>(at));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) render::throw_file_error(folder_, "cannot read a temporary file", n < 0 ? errno : EIO);
    file.write({block.data(), static_cast<std::size_t>(n)});
    at += static_cast<uint64_t>(n);
  }
}

}  // namespace offstage::producer
