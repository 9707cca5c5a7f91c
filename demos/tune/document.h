#pragma once
/// The text of a scene while it is tuned: the file it came from, undo and redo, and the versions of the
/// sitting.

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace offstage::tune {

/// A state of the text that was on show.
struct Version {
  uint64_t id = 0;
  std::string label;               ///< what was done: "rate", "pasted text"
  std::vector<std::string> paths;  ///< of the values that were changed
  std::chrono::system_clock::time_point time;
  std::string text;
};

/// Thrown when the file is not what it was when it was last read.
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
  /// What the file held when it was last read or written.
  const std::string& saved() const { return saved_; }

  /// Makes a new version. Several changes of one `group` (a drag, a burst of typing) are one undo step; an
  /// empty group is a step of its own. False if the text is what it was.
  bool change(std::string text, std::string label, std::vector<std::string> paths, const std::string& group);
  bool undo();
  bool redo();
  bool can_undo() const { return now_ > 0; }
  bool can_redo() const { return now_ + 1 < history_.size(); }
  /// The label of the step that undo or redo would take.
  std::string undo_label() const { return can_undo() ? history_[now_].label : ""; }
  std::string redo_label() const { return can_redo() ? history_[now_ + 1].label : ""; }

  /// Versions of this sitting, oldest first, also those that an undo left behind; the oldest go when they
  /// take too much memory.
  const std::deque<Version>& versions() const { return versions_; }
  /// Null if there is none of that number.
  const Version* find(uint64_t id) const;

  /// Writes the text to the file in one step. Throws FileConflict, and writes nothing, if the file is not
  /// what it was when it was last read; FileError if it cannot be written.
  void save();
  /// What the file holds now, if that is not what it held when it was last read.
  std::optional<std::string> changed_outside() const;
  /// Takes the file's text as a new version.
  void reload(const std::string& theirs);
  /// Goes on with the own text; saving replaces what the file holds now.
  void keep_own(const std::string& theirs) { saved_ = theirs; }

 private:
  void remember(const Version& version);

  std::filesystem::path file_;
  std::string saved_;
  std::deque<Version> history_;  // of undo and redo
  std::size_t now_ = 0;
  std::string group_;  // of the latest change
  std::deque<Version> versions_;
  std::size_t bytes_ = 0;  // of `versions_`
  uint64_t ids_ = 0;
};

}  // namespace offstage::tune
