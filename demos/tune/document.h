#pragma once
/// The text of a scene during tuning: its file, undo and redo, and the versions of the session.

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace offstage::tune {

/// A version of the scene's text that the page has shown.
struct Version {
  uint64_t id = 0;
  std::string label;               ///< description of the change: "rate", "pasted text"
  std::vector<std::string> paths;  ///< paths of the changed values
  std::chrono::system_clock::time_point time;
  std::string text;
};

/// Thrown if the file has changed since it was last read.
struct FileConflict {
  std::string theirs;
};

class Document {
 public:
  /// Reads the file. Throws SceneError if it cannot be read.
  explicit Document(std::filesystem::path file);

  const std::filesystem::path& file() const { return file_; }
  const std::string& text() const { return history_[now_].text; }
  const Version& version() const { return history_[now_]; }
  bool is_saved() const { return text() == saved_; }
  /// Content of the file when it was last read or written.
  const std::string& saved() const { return saved_; }

  /// Creates a new version. Several changes of one `group` (a drag, a sequence of typing) are one undo step;
  /// a change with an empty group is a step of its own. Returns false if the text has not changed.
  bool change(std::string text, std::string label, std::vector<std::string> paths, const std::string& group);
  bool undo();
  bool redo();
  bool can_undo() const { return now_ > 0; }
  bool can_redo() const { return now_ + 1 < history_.size(); }
  /// Label of the step that undo or redo would make.
  std::string undo_label() const { return can_undo() ? history_[now_].label : ""; }
  std::string redo_label() const { return can_redo() ? history_[now_ + 1].label : ""; }

  /// Versions of this session, oldest first, including those that were undone. The oldest are removed when
  /// the versions take too much memory.
  const std::deque<Version>& versions() const { return versions_; }
  /// Returns the version with this number, or null.
  const Version* find(uint64_t id) const;

  /// Writes the text to the file atomically. Throws FileConflict, and writes nothing, if the file has changed
  /// since it was last read; FileError if it cannot be written.
  void save();
  /// Current content of the file, if it differs from that when it was last read.
  std::optional<std::string> changed_outside() const;
  /// Makes the text of the file a new version.
  void reload(const std::string& theirs);
  /// Keeps the own text; saving will replace the current content of the file.
  void keep_own(const std::string& theirs) { saved_ = theirs; }

 private:
  void remember(const Version& version);

  std::filesystem::path file_;
  std::string saved_;
  std::deque<Version> history_;  // for undo and redo
  std::size_t now_ = 0;
  std::string group_;  // group of the latest change
  std::deque<Version> versions_;
  std::size_t bytes_ = 0;  // size of `versions_`
  uint64_t ids_ = 0;
};

}  // namespace offstage::tune
