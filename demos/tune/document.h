#pragma once
/// The text of a scene that is edited on the tuning page, with its file, undo and redo, and all versions of
/// the session.

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace offstage::tune {

/// A version of the scene's text.
struct Version {
  uint64_t id = 0;
  std::string label;               ///< description of the change: "rate", "pasted text"
  std::vector<std::string> paths;  ///< paths of the changed values
  std::chrono::system_clock::time_point time;
  std::string text;
};

/// Exception: another program has changed the file since it was last read or written. `theirs` is the file's
/// current content.
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
  /// Returns the content of the file when it was last read or written.
  const std::string& saved() const { return saved_; }

  /// Makes `text` the current version; `label` and `paths` describe the change. Consecutive changes with the
  /// same non-empty `group` (a drag, a sequence of typing) form one undo step. Returns false, without a new
  /// version, if the text is the same.
  bool change(std::string text, std::string label, std::vector<std::string> paths, const std::string& group);
  bool undo();
  bool redo();
  bool can_undo() const { return now_ > 0; }
  bool can_redo() const { return now_ + 1 < history_.size(); }
  /// Labels of the changes that undo() and redo() would revert or repeat; empty if there is none.
  std::string undo_label() const { return can_undo() ? history_[now_].label : ""; }
  std::string redo_label() const { return can_redo() ? history_[now_ + 1].label : ""; }

  /// Versions of this session, oldest first, including versions that were undone. The oldest versions are
  /// removed when there are too many or they take too much memory.
  const std::deque<Version>& versions() const { return versions_; }
  /// Returns the version with this id; null if there is none or it was removed.
  const Version* find(uint64_t id) const;

  /// Writes the text to the file atomically. If the file was changed by another program, throws FileConflict
  /// and writes nothing. Throws render::FileError if the file cannot be written.
  void save();
  /// Returns the file's current content if another program has changed it since it was last read or written;
  /// otherwise nothing.
  std::optional<std::string> changed_outside() const;
  /// Makes `theirs`, the file's current content, a new version.
  void reload(const std::string& theirs);
  /// Keeps the text of this session. `theirs` is the file's current content, which save() may then overwrite.
  void keep_own(const std::string& theirs) { saved_ = theirs; }

 private:
  void remember(const Version& version);

  std::filesystem::path file_;
  std::string saved_;
  std::deque<Version> history_;  // for undo and redo
  std::size_t now_ = 0;
  std::string group_;  // group of the latest change
  std::deque<Version> versions_;
  std::size_t bytes_ = 0;  // size of the texts in versions_ [bytes]
  uint64_t ids_ = 0;
};

}  // namespace offstage::tune
