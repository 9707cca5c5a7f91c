#pragma once
/// The scenes that `offstage new` writes: the files of demos/templates, embedded at build time.

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace offstage::producer {

/// Name and text of a template.
using EmbeddedText = std::pair<std::string_view, std::string_view>;
/// Returns all templates, ordered by name.
std::span<const EmbeddedText> templates();

std::vector<std::string> template_names();
/// Returns the value of the key "description" of a template.
std::string template_description(std::string_view text);
/// Returns the text of a scene file made from a template. `file` replaces the word SCENE in its comments.
std::string scene_from_template(std::string_view text, const std::string& file);

}  // namespace offstage::producer
