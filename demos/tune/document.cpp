#include "tune/document.h"

#include <algorithm>
#include <cstdlib>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "producer/format/scene_source.h"
#include "render/error.h"

namespace offstage::tune {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = 64u << 20;  // limit for the texts of versions
constexpr std::size_t kMostVersions = 400;

[[noreturn]] void refuse_file(const fs::path& file, const std::string& what, int error) {
  throw render::FileError(file.string() + ": " + what + ": " + std::generic_category().message(error));
}

/// Writes the text to a file descriptor, flushes it to the disk and closes the descriptor. Returns the error
/// number, or 0.
int write_through(int fd, const std::string& text) {
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t n = ::write(fd, text.data() + written, text.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const int error = errno;
      ::close(fd);
      return error ? error : EIO;
    }
    written += static_cast<std::size_t>(n);
  }
  const int failed = fsync(fd) != 0 && errno != EINVAL ? errno : 0;  // some file systems do not support fsync
  return ::close(fd) != 0 && !failed ? errno : failed;
}

/// Replaces a file atomically; a symbolic link and the file's permissions are kept.
void replace_file(const fs::path& file, const std::string& text) {
  std::error_code error;
  fs::path place = fs::canonical(file, error);
  if (error) place = file;
  std::string name = (place.parent_path() / ("." + place.filename().string() + ".XXXXXX")).string();
  const int fd = mkostemp(name.data(), O_CLOEXEC);
  if (fd < 0) refuse_file(place.parent_path(), "a file cannot be created there", errno);
  struct stat before {};
  const mode_t mask = umask(0);
  umask(mask);
  fchmod(fd, stat(place.c_str(), &before) == 0 ? before.st_mode & 07777 : 0666 & ~mask);
  int failed = write_through(fd, text);
  if (!failed && rename(name.c_str(), place.c_str()) != 0) failed = errno;
  if (!failed) return;
  unlink(name.c_str());
  refuse_file(place, "cannot be written", failed);
}

}  // namespace

Document::Document(fs::path file) : file_(std::move(file)), saved_(producer::read_text(file_)) {
  history_.push_back({++ids_, "opened", {}, std::chrono::system_clock::now(), saved_});
  remember(history_.back());
}

bool Document::change(std::string text, std::string label, std::vector<std::string> paths,
                      const std::string& group) {
  if (text == this->text()) return false;
  history_.resize(now_ + 1);
  Version version{++ids_, std::move(label), std::move(paths), std::chrono::system_clock::now(),
                  std::move(text)};
  const bool same_step = !group.empty() && group == group_ && now_ > 0;
  group_ = group;
  if (same_step) {
    if (!versions_.empty() && versions_.back().id == history_[now_].id) {
      bytes_ -= versions_.back().text.size();
      versions_.pop_back();
    }
    history_[now_] = std::move(version);
  } else {
    history_.push_back(std::move(version));
    if (history_.size() > kMostVersions) history_.pop_front();
    now_ = history_.size() - 1;
  }
  remember(history_[now_]);
  return true;
}

void Document::remember(const Version& version) {
  versions_.push_back(version);
  bytes_ += version.text.size();
  while (versions_.size() > 1 && (bytes_ > kMostBytes || versions_.size() > kMostVersions)) {
    bytes_ -= versions_.front().text.size();
    versions_.pop_front();
  }
}

bool Document::undo() {
  group_.clear();
  if (!can_undo()) return false;
  --now_;
  return true;
}

bool Document::redo() {
  group_.clear();
  if (!can_redo()) return false;
  ++now_;
  return true;
}

const Version* Document::find(uint64_t id) const {
  const auto it = std::ranges::find(versions_, id, &Version::id);
  return it == versions_.end() ? nullptr : &*it;
}

std::optional<std::string> Document::changed_outside() const {
  std::error_code error;
  if (!fs::is_regular_file(file_, error)) return {};  // between two steps of an editor, or removed
  std::string theirs = producer::read_text(file_);
  if (theirs == saved_) return {};
  return theirs;
}

void Document::save() {
  if (const auto theirs = changed_outside(); theirs && *theirs != text()) throw FileConflict{*theirs};
  replace_file(file_, text());
  saved_ = text();
}

void Document::reload(const std::string& theirs) {
  saved_ = theirs;
  change(theirs, "reloaded from disk", {}, "");
}

}  // namespace offstage::tune
