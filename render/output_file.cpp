#include "render/output_file.h"

#include <algorithm>
#include <cctype>
#include <random>
#include <string_view>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/error.h"

namespace offstage::render {
namespace {

constexpr std::string_view kPrefix = ".offstage-", kEnding = ".part";
constexpr std::size_t kRandomLetters = 8;

/// Returns a random name for a temporary file. It does not contain the name of the output, which may already
/// be as long as the system allows.
std::string temporary_name() {
  static constexpr std::string_view kLetters = "0123456789abcdefghijklmnopqrstuvwxyz";
  std::random_device random;
  std::string name(kPrefix);
  for (std::size_t i = 0; i < kRandomLetters; ++i) name += kLetters[random() % kLetters.size()];
  return name + std::string(kEnding);
}

bool is_temporary_name(const std::string& name) {
  return name.size() == kPrefix.size() + kRandomLetters + kEnding.size() && name.starts_with(kPrefix) &&
         name.ends_with(kEnding) &&
         std::all_of(name.begin() + kPrefix.size(), name.end() - kEnding.size(),
                     [](unsigned char c) { return std::isalnum(c) != 0; });
}

}  // namespace

void refuse_link(const std::filesystem::path& path) {
  struct stat info {};
  if (::lstat(path.c_str(), &info) == 0 && S_ISLNK(info.st_mode))
    throw FileError(path.string() +
                    ": is a symbolic link, which outputs do not follow; name the file itself");
}

OutputFile::OutputFile(const std::filesystem::path& target) : target_(target) {
  refuse_link(target);
  constexpr int kTries = 100;
  for (int i = 0; i < kTries; ++i) {
    path_ = target.parent_path() / temporary_name();
    file_ = Descriptor(::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
    if (!file_ && errno == EEXIST) continue;
    if (!file_) throw_file_error(target_, "cannot be created");
    // Another process may remove the file as a leftover between these two calls. In this case another name is
    // tried. Leftovers on a file system without locks are not removed.
    struct stat info {};
    if (::flock(file_.fd(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK)
      if (::fstat(file_.fd(), &info) == 0 && info.st_nlink > 0) return;
  }
  throw FileError(target_.string() + ": cannot be created: all names for a temporary file are in use");
}

OutputFile::~OutputFile() {
  if (file_ && !renamed_) ::unlink(path_.c_str());
}

void OutputFile::write(std::span<const uint8_t> bytes) {
  if (const int error = write_all(file_.fd(), bytes)) throw_file_error(target_, "cannot be written", error);
}

void OutputFile::commit_as(const std::filesystem::path& other) {
  if (::fsync(file_.fd()) != 0 && errno != EINVAL) throw_file_error(other, "cannot be written");
  refuse_link(other);
  if (::rename(path_.c_str(), other.c_str()) != 0) throw_file_error(other, "cannot be created");
  renamed_ = true;
  if (const int error = file_.close()) {  // some file systems report a failed write only here
    ::unlink(other.c_str());
    throw_file_error(other, "cannot be written", error);
  }
}

int remove_leftovers(const std::filesystem::path& folder) {
  int removed = 0;
  std::error_code error;
  const std::filesystem::path here = folder.empty() ? "." : folder;
  for (std::filesystem::directory_iterator entry(here, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::filesystem::path& path = entry->path();
    if (!is_temporary_name(path.filename().string())) continue;
    const Descriptor file(::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    struct stat info {};
    if (!file || ::fstat(file.fd(), &info) != 0 || !S_ISREG(info.st_mode)) continue;
    if (::flock(file.fd(), LOCK_EX | LOCK_NB) != 0) continue;
    removed += ::unlink(path.c_str()) == 0;
  }
  return removed;
}

}  // namespace offstage::render
