#pragma once
/// The text of a scene: its file, the files it includes, and the overrides of the command line, joined into
/// one tree that still knows where each value came from.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "producer/base/error.h"
#include "producer/base/json.h"
#include "producer/base/scene_folder.h"

namespace offstage::producer {

struct SceneSource {
  std::vector<std::string> files;  ///< what positions refer to
  Node root;

  /// Where the value at a JSON pointer stands; if it was not given, where what should hold it stands.
  Where locate(const std::string& path) const;
};

/// Stands for standard input where the command line names a scene file, and what messages call it.
inline constexpr std::string_view kStandardInput = "-";
inline constexpr const char* kStandardInputName = "<stdin>";

/// The text of a regular file of at most kMostTextBytes. Throws SceneError if it cannot be read.
std::string read_text(const std::filesystem::path& file);

/// All of standard input, which is read once and kept. Throws SceneError if it cannot be read or is longer
/// than 256 MiB.
const std::string& standard_input();

/// Parses `text` and what it includes. Included files are sought beside the file that names them (`folder`
/// for `text`). Objects are merged key by key and the including file wins; lists at the top are joined,
/// included first. Throws SceneError for what is no JSON, cannot be read, or includes itself.
SceneSource read_source(std::string_view text, const std::string& name, const SceneFolder& folder);

/// Lays `top` over `base`, object by object; one that names its type replaces one of another.
void lay_over(Node& base, Node top);

/// Sets "path=value" in the tree; the value is JSON or else a string, the path as in /emitters/0/rate or
/// emitters.rain.rate. What the tree lacks is made, lists with the content they have in `defaults`. Adds to
/// `problems` if the path leads nowhere.
void apply_override(SceneSource& source, const std::string& override, const Node& defaults,
                    std::vector<Problem>& problems);

}  // namespace offstage::producer
