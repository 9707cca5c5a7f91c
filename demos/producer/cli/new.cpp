// The command new: writes a first scene.

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "producer/base/json.h"
#include "producer/base/suggest.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/format/scene_templates.h"
#include "producer/run/output.h"

namespace offstage::producer {
namespace {

struct NewOptions {
  /// File and template. Empty template: the template named like the file, or "basic".
  std::string name, from;
  bool list = false, force = false;
};

constexpr const char* kFirstTemplate = "basic";

std::string list_of_templates() {
  std::string list;
  for (const auto& [name, text] : templates())
    list += fmt::format("  {:<12}{}\n", name, template_description(text));
  return list;
}

std::string_view template_text(const std::string& name) {
  for (const auto& [known, text] : templates())
    if (known == name) return text;
  const std::vector<std::string> names = template_names();
  const std::string near = nearest(name, names);
  // In one line, because messages are printed with their control characters escaped.
  throw std::invalid_argument(
      fmt::format("there is no template '{}'{} The templates are {}; `offstage new --list` describes them",
                  name, near.empty() ? "." : "; did you mean '" + near + "'?", fmt::join(names, ", ")));
}

/// Returns the file name as one types it in a shell.
std::string typed(const std::string& file) {
  if (file.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-") ==
      std::string::npos)
    return file;
  std::string quoted_file = "'";
  for (const char c : file) quoted_file += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted_file + "'";
}

}  // namespace

std::vector<std::string> template_names() {
  std::vector<std::string> names;
  for (const auto& [name, text] : templates()) names.emplace_back(name);
  return names;
}

std::string template_description(std::string_view text) {
  const Node scene = parse_json(text, "template");
  const Node* description = scene.find("description");
  return description && description->as<std::string>() ? *description->as<std::string>() : "";
}

std::string scene_from_template(std::string_view text, const std::string& file) {
  constexpr std::string_view kPlaceholder = "SCENE";
  std::string scene(text);
  for (std::size_t at = 0; (at = scene.find(kPlaceholder, at)) != std::string::npos; at += file.size())
    scene.replace(at, kPlaceholder.size(), file);
  return scene;
}

namespace {

/// Writes a first scene, or lists the templates.
int new_command(const NewOptions& options) {
  if (options.list || options.name.empty()) {
    fmt::print("{}", list_of_templates());
    return kOk;
  }
  // `offstage new rain` uses the template "rain".
  std::filesystem::path path = options.name;
  const std::string stem = path.stem().string();
  const std::vector<std::string> names = template_names();
  const bool named_so = std::ranges::find(names, stem) != names.end();
  const std::string_view text = template_text(!options.from.empty() ? options.from
                                              : named_so            ? stem
                                                                    : kFirstTemplate);
  if (options.name == kStandardInput) {
    fmt::print("{}", scene_from_template(text, "scene.json"));
    return kOk;
  }
  if (path.extension() != ".json") path += ".json";
  if (path.stem().empty() || options.name.ends_with('/'))
    throw OutputError(options.name + ": the scene has no name");
  check_file(path.string(), options.force);
  if (std::ranges::any_of(options.name, [](unsigned char c) { return std::iscntrl(c); }))
    throw OutputError("the name of the scene has a control character");
  const std::string file = typed(path.string());
  write_text_file(path.string(), scene_from_template(text, file));
  fmt::print("wrote {}\nrender it:  offstage {}\n", path.string(), file);
  return kOk;
}

}  // namespace

Command add_new(CLI::App& app) {
  const auto options = std::make_shared<NewOptions>();
  NewOptions& given = *options;
  CLI::App* command = app.add_subcommand("new",
                                         "Write a commented scene to start from, which can be rendered at "
                                         "once; without NAME: list the templates");
  command->add_option("name", given.name, "NAME or NAME.json; - for standard output");
  command->add_option("--template", given.from,
                      "Template to use (default: the one called NAME, as in `new rain`, or else `basic`)");
  command->add_flag("--list", given.list, "List the templates");
  command->add_flag("--force", given.force, "Replace an existing file");
  return {command, [options] { return new_command(*options); }};
}

}  // namespace offstage::producer
