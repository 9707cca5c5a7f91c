#pragma once
/// The scenes that `offstage new` writes: the files of demos/templates, embedded at build time.

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace offstage::producer {

/// Name and text of each template, ordered by name.
using EmbeddedText = std::pair<std::string_view, std::string_view>;
std::span<const EmbeddedText> templates();

std::vector<std::string> template_names();
/// The value of a template's key "description".
std::string template_description(std::string_view text);
/// Returns the text of a scene file made from a template. `file` replaces the word SCENE in its comments.
std::string scene_from_template(std::string_view text, const std::string& file);

}  // namespace offstage::producer
