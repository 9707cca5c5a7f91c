#include "producer/format/scene_source.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <iterator>
#include <optional>
#include <unordered_map>

#include <poll.h>
#include <unistd.h>

#include "producer/base/interrupt.h"
#include "producer/base/log.h"
#include "producer/base/suggest.h"
#include "render/error.h"
#include "render/file_io.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

// --- Paths ---

/// Splits a path into its steps. The path is a JSON pointer (/a/0/b) or has dots (a.0.b).
std::vector<std::string> split_path(std::string_view path) {
  const bool pointer = path.starts_with('/');
  if (pointer) path.remove_prefix(1);
  std::vector<std::string> steps(1);
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (path[i] == (pointer ? '/' : '.')) {
      steps.emplace_back();
    } else if (pointer && path[i] == '~' && i + 1 < path.size() &&
               (path[i + 1] == '0' || path[i + 1] == '1')) {
      steps.back() += path[++i] == '0' ? '~' : '/';
    } else {
      steps.back() += path[i];
    }
  }
  return steps;
}

std::optional<std::size_t> to_index(std::string_view step) {
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(step.data(), step.data() + step.size(), index);
  if (error != std::errc() || end != step.data() + step.size()) return {};
  return index;
}

std::vector<std::string> names_in(const List& list) {
  std::vector<std::string> names;
  for (const Node& item : list) {
    const Node* name = item.find("name");
    const std::string* text = name ? name->as<std::string>() : nullptr;
    names.push_back(text ? *text : "");
  }
  return names;
}

/// Returns the index of the item that a step names, by its index or by its key "name"; nothing if there is no
/// such item.
std::optional<std::size_t> find_item(const List& list, const std::string& step) {
  if (const auto index = to_index(step)) return *index < list.size() ? index : std::nullopt;
  const std::vector<std::string> names = names_in(list);
  const auto it = std::find(names.begin(), names.end(), step);
  if (step.empty() || it == names.end()) return {};
  return static_cast<std::size_t>(it - names.begin());
}

/// Sets the position of all nodes of a tree to `at`, the position of the override from which the tree comes.
void stamp(Node& node, Position at) {
  node.at = at;
  if (List* list = node.as<List>())
    for (Node& item : *list) stamp(item, at);
  if (Object* object = node.as<Object>()) {
    for (Member& member : *object) {
      member.at = at;
      stamp(member.value, at);
    }
  }
}

// --- Includes ---

void merge(Node& base, Node top, bool at_root);

/// Returns a path that is the same for all names of a file. If the path cannot be resolved, returns it
/// unchanged.
fs::path identity_of(const fs::path& file) {
  std::error_code error;
  fs::path identity = fs::weakly_canonical(file, error);
  return error ? file : identity;
}

class Includer {
 public:
  Includer(std::vector<std::string>& files, const SceneFolder& scene) : files_(files), scene_(scene) {}

  std::vector<Problem> problems;

  /// Returns the tree of one text, merged with all of its includes.
  Node read(std::string_view text, const std::string& name, const fs::path& folder) {
    const int file = static_cast<int>(files_.size());
    files_.push_back(name);
    Node own;
    try {
      own = parse_json(text, name, file);
    } catch (const SceneError& error) {
      problems.insert(problems.end(), error.problems().begin(), error.problems().end());
    }
    Object* object = own.as<Object>();
    if (!object) return own;
    const Node includes = take(*object, "include");
    const Node editor_schema = take(*object, "$schema");
    if (given(editor_schema) && !editor_schema.as<std::string>())
      problems.push_back(
          {where_of(editor_schema, "/$schema"), "must be a string, got " + describe(editor_schema)});
    Node all = Object{};
    if (const List* list = includes.as<List>()) {
      for (std::size_t i = 0; i < list->size(); ++i) {
        const Where where = where_of((*list)[i], "/include/" + std::to_string(i));
        merge(all, read_included((*list)[i], where, folder), true);
      }
    } else if (given(includes)) {
      problems.push_back(
          {where_of(includes, "/include"), "must be a list of file names, got " + describe(includes)});
    }
    merge(all, std::move(own), true);
    return all;
  }

  /// The files that are being read. Each is included by the previous one.
  std::vector<fs::path> open;

 private:
  static constexpr std::size_t kMostFiles = 256;

  static Node take(Object& object, std::string_view key) {
    const auto it = std::find_if(object.begin(), object.end(), [&](const Member& m) { return m.key == key; });
    if (it == object.end()) return {};
    Node value = std::move(it->value);
    object.erase(it);
    return value;
  }

  static bool given(const Node& taken) { return taken.at.line > 0; }

  Where where_of(const Node& node, const std::string& path) const {
    return {files_[static_cast<std::size_t>(node.at.file)], node.at.line, node.at.column, path};
  }

  Node read_included(const Node& entry, const Where& where, const fs::path& folder) {
    const Node nothing = Object{};
    const auto refuse = [&](const std::string& what) {
      problems.push_back({where, what});
      return nothing;
    };
    const std::string* name = entry.as<std::string>();
    if (!name || name->empty()) return refuse("must be a file name, got " + describe(entry));
    const fs::path file = (folder / *name).lexically_normal();
    const fs::path identity = identity_of(file);
    if (std::find(open.begin(), open.end(), identity) != open.end())
      return refuse("'" + *name + "' includes itself");
    if (files_.size() >= kMostFiles)
      return refuse("the scene consists of more than " + std::to_string(kMostFiles) + " files");
    if (const std::string wrong = scene_.wrong_place(file); !wrong.empty()) return refuse(wrong);
    std::string text;
    try {
      text = read_text(file);
    } catch (const SceneError& error) {
      return refuse("'" + file.string() + "': " + error.problems().front().what);
    }
    open.push_back(identity);
    Node tree = read(text, file.string(), file.parent_path());
    open.pop_back();
    if (tree.as<Object>()) return tree;
    return problems.empty() ? refuse("'" + file.string() + "' must hold an object") : nothing;
  }

  std::vector<std::string>& files_;
  const SceneFolder& scene_;
};

/// Merges `top` into `base`. An object with a "type" replaces an object of another type. If `at_root`, lists
/// are concatenated.
void merge(Node& base, Node top, bool at_root) {
  Object* below = base.as<Object>();
  Object* above = top.as<Object>();
  const Node* type = top.find("type");
  const Node* old_type = base.find("type");
  if (!below || !above || (type && (!old_type || to_text(*type) != to_text(*old_type)))) {
    base = std::move(top);
    return;
  }
  base.at = top.at;
  std::unordered_map<std::string, std::size_t> known;  // keys of an object are unique
  for (std::size_t i = 0; i < below->size(); ++i) known.emplace((*below)[i].key, i);
  for (Member& member : *above) {
    const auto place = known.find(member.key);
    Node* same = place != known.end() ? &(*below)[place->second].value : nullptr;
    List* list = same ? same->as<List>() : nullptr;
    List* more = member.value.as<List>();
    if (!same) {
      below->push_back(std::move(member));
    } else if (at_root && list && more) {
      std::move(more->begin(), more->end(), std::back_inserter(*list));
    } else {
      merge(*same, std::move(member.value), false);
    }
  }
}

}  // namespace

void merge(Node& base, Node top) {
  merge(base, std::move(top), false);
}

Where SceneSource::locate(const std::string& path) const {
  const Node* node = &root;
  Position at = root.at;
  for (const std::string& step : path.empty() ? std::vector<std::string>() : split_path(path)) {
    if (const List* list = node->as<List>()) {
      const auto index = find_item(*list, step);
      node = index ? &(*list)[*index] : nullptr;
    } else {
      node = node->find(step);
    }
    if (!node) break;
    if (node->at.file >= 0) at = node->at;
  }
  return {at.file < 0 ? "" : files[static_cast<std::size_t>(at.file)], at.line, at.column, path};
}

std::string read_text(const fs::path& file) {
  std::error_code error;
  const Where where{file.string(), 0, 0, {}};
  if (fs::is_directory(file, error)) throw SceneError(where, "is a folder, not a file");
  if (!fs::exists(fs::status(file, error)))
    throw SceneError(
        where, error && error != std::errc::no_such_file_or_directory ? error.message() : "no such file");
  try {
    return render::read_text_file(file, kMostTextBytes);
  } catch (const render::FileError& wrong) {
    const std::string what = wrong.what(), name = file.string() + ": ";
    throw SceneError(where, what.starts_with(name) ? what.substr(name.size()) : what);
  }
}

const std::string& standard_input() {
  static const std::string text = [] {
    if (isatty(STDIN_FILENO)) log("reading the scene from the keyboard; end it with Ctrl-D\n");
    std::string all;
    std::array<char, 1 << 16> part{};
    while (true) {
      pollfd input{STDIN_FILENO, POLLIN, 0};
      constexpr int kWait_ms = 200;
      const int ready = ::poll(&input, 1, kWait_ms);  // the wait is limited, so that signals are noticed
      if (interrupt_signal()) throw Interrupted(interrupt_signal());
      if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
      const ssize_t got = ::read(STDIN_FILENO, part.data(), part.size());
      if (got < 0) throw SceneError({kStandardInputName, 0, 0, {}}, "cannot be read");
      if (got == 0) return all;
      all.append(part.data(), static_cast<std::size_t>(got));
      if (all.size() > kMostTextBytes)
        throw SceneError({kStandardInputName, 0, 0, {}}, "is longer than 256 MiB");
    }
  }();
  return text;
}

SceneSource read_source(std::string_view text, const std::string& name, const SceneFolder& folder) {
  SceneSource source;
  Includer includer(source.files, folder);
  includer.open.push_back(identity_of(folder / fs::path(name).filename()));
  source.root = includer.read(text, name, folder.path());
  if (!includer.problems.empty()) throw SceneError(std::move(includer.problems));
  return source;
}

void apply_override(SceneSource& source, const std::string& override, const Node& defaults,
                    std::vector<Problem>& problems) {
  const std::string name = "--set";
  const std::size_t equals = override.find('=');
  const auto refuse = [&](const std::string& path, const std::string& what) {
    problems.push_back({{name, 0, 0, path}, what});
  };
  if (equals == 0 || equals == std::string::npos)
    return refuse("", "must be path=value, got '" + override + "'");

  if (source.files.empty() || source.files.back() != name) source.files.push_back(name);
  const int file = static_cast<int>(source.files.size()) - 1;
  const Position here{file, 0, 0};
  const std::vector<std::string> steps = split_path(override.substr(0, equals));
  Node* node = &source.root;
  // The value at the same path in a scene with all defaults; null if there is none.
  const Node* guide = &defaults;
  std::string path;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const std::string& step = steps[i];
    if (List* list = node->as<List>()) {
      const auto index = find_item(*list, step);
      if (!index) {
        const std::string missing = "has no '" + step + "'";
        if (to_index(step))
          return refuse(path, missing + "; it has " + std::to_string(list->size()) + " items");
        return refuse(path, missing + suggestion(step, names_in(*list), "; it is empty"));
      }
      node = &(*list)[*index];
      const List* guides = guide ? guide->as<List>() : nullptr;
      guide = guides && *index < guides->size() ? &(*guides)[*index] : nullptr;
      path += pointer_step(std::to_string(*index));
    } else if (Object* object = node->as<Object>()) {
      guide = guide ? guide->find(step) : nullptr;
      if (!node->find(step)) {
        const bool take_default = i + 1 < steps.size() && guide && guide->as<List>();
        object->push_back({step, take_default ? *guide : Node(Object{}), here});
        stamp(object->back().value, here);
      }
      node = node->find(step);
      path += pointer_step(step);
    } else {
      return refuse(path, "is " + describe(*node) + " and has no '" + step + "'; set it as a whole");
    }
  }

  const std::string value = override.substr(equals + 1);
  try {
    *node = parse_json(value, name, file);
  } catch (const SceneError&) {
    *node = Node(value);
  }
  stamp(*node, here);
}

}  // namespace offstage::producer
