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

  /// Returns the position of the value at a JSON pointer. If the value is missing, returns the position of
  /// the nearest object that would contain it.
  Where locate(const std::string& path) const;
};

/// Names of standard input as a scene file: on the command line, and in messages.
inline constexpr std::string_view kStandardInput = "-";
inline constexpr const char* kStandardInputName = "<stdin>";

/// Returns the text of a regular file of at most kMostTextBytes. Throws SceneError if it cannot be read.
std::string read_text(const std::filesystem::path& file);

/// Returns the whole text of standard input. The first call reads the text and stores it for later calls.
/// Throws SceneError if the text cannot be read or is longer than 256 MiB, and Interrupted after a signal.
const std::string& standard_input();

/// Parses `text` and its includes. Names of included files are relative to the file that names them; in
/// `text`, they are relative to `folder`. Objects are merged key by key, and the including file has priority.
/// Lists at the root are concatenated; the items of included files come first. Throws SceneError for a text
/// that is not JSON, for a file that cannot be read, and for a file that includes itself. `name`: file name
/// of `text` in messages.
SceneSource read_source(std::string_view text, const std::string& name, const SceneFolder& folder);

/// Merges `top` into `base`, key by key, also in nested objects. Values of `top` have priority. An object
/// replaces an object that has another "type".
void merge(Node& base, Node top);

/// Sets a value of the tree. `override` is "path=value", with a path such as /emitters/0/rate or
/// emitters.rain.rate. A value that is not JSON becomes a string. Missing objects are created; a missing list
/// is copied from `defaults`. Adds a problem if the path does not exist.
void apply_override(SceneSource& source, const std::string& override, const Node& defaults,
                    std::vector<Problem>& problems);

}  // namespace offstage::producer
