#pragma once
/// Messages to the page, as JSON.

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "engine/engine.h"
#include "producer/base/error.h"
#include "producer/run/production.h"
#include "tune/document.h"

namespace offstage::tune {

using Json = nlohmann::ordered_json;

/// Returns the JSON text. Invalid UTF-8 is replaced and does not cause an error.
std::string dump(const Json& json);
Json vector_json(const Eigen::Vector3d& v);
/// Returns the first three elements of a list. Throws nlohmann::json::exception if they are not three
/// numbers.
Eigen::Vector3d vector_of(const nlohmann::json& json);

Json version_json(const Version& version, const std::map<uint64_t, std::string>& films);
/// Returns the problems as JSON. `file` is the scene's own file; only problems in other files contain the
/// name of their file.
Json problems_json(const std::vector<Problem>& problems, const std::string& file);
/// Returns the ranges as a list of pairs [first, last].
Json ranges_json(const std::vector<std::pair<int, int>>& ranges);
Json figures_json(const producer::FrameFigures& figures);
Json event_json(const engine::FrameEvent& event);
Json event_json(const engine::FilmEvent& event);
Json event_json(const engine::CellEvent& event);
/// Returns the kind of a message. A later message of the same kind replaces one that is not yet sent.
std::string kind_of(const engine::FrameEvent& event);
std::string kind_of(const engine::FilmEvent& event);
std::string kind_of(const engine::CellEvent& event);

/// Converts a path in the text without muted items to the path of the same value in the whole text. `muted`:
/// paths of the muted list items in the whole text.
std::string with_muted(const std::string& path, const std::vector<std::string>& muted);

}  // namespace offstage::tune
