#pragma once
/// The text of a scene: its file, the files it includes, and the overrides of the command line, merged into
/// one tree in which every value keeps its position.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "producer/base/error.h"
#include "producer/base/json.h"
#include "producer/base/scene_folder.h"

namespace offstage::producer {

struct SceneSource {
  std::vector<std::string> files;  ///< names of the files to which positions refer
  Node root;

  /// Position of the value at a JSON pointer; if it was not given, position of the object that would contain
  /// it.
  Where locate(const std::string& path) const;
};

/// Name of standard input as a scene file on the command line and in messages.
inline constexpr std::string_view kStandardInput = "-";
inline constexpr const char* kStandardInputName = "<stdin>";

/// Returns the text of a regular file of at most kMostTextBytes. Throws SceneError if it cannot be read.
std::string read_text(const std::filesystem::path& file);

/// Returns all of standard input, which is read once and stored. Throws SceneError if it cannot be read or is
/// longer than 256 MiB.
const std::string& standard_input();

/// Parses `text` and its includes. Included files are searched beside the file that names them (`folder` for
/// `text`). Objects are merged key by key, and the including file has priority; lists at the top are
/// concatenated, included first. Throws SceneError for a text that is not JSON, cannot be read, or includes
/// itself.
SceneSource read_source(std::string_view text, const std::string& name, const SceneFolder& folder);

/// Merges `top` into `base`, object by object; an object with a "type" replaces one of another type.
void merge(Node& base, Node top);

/// Sets a value of the tree as "path=value" says. A path has the form /emitters/0/rate or emitters.rain.rate;
/// a value that is not JSON is taken as a string. Missing parts of the tree are created; a missing list gets
/// the items that it has in `defaults`. Adds to `problems` if the path does not exist.
void apply_override(SceneSource& source, const std::string& override, const Node& defaults,
                    std::vector<Problem>& problems);

}  // namespace offstage::producer
