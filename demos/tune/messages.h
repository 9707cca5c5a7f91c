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

/// Invalid UTF-8 is replaced instead of causing an error.
std::string dump(const Json& json);
Json vector_json(const Eigen::Vector3d& v);
/// Throws nlohmann::json::exception unless it is a list of three numbers.
Eigen::Vector3d vector_of(const nlohmann::json& json);

Json version_json(const Version& version, const std::map<uint64_t, std::string>& films);
/// `file` is the scene's own file; problems in other files name theirs.
Json problems_json(const std::vector<Problem>& problems, const std::string& file);
/// Ranges as pairs of the first and the last number.
Json ranges_json(const std::vector<std::pair<int, int>>& ranges);
Json figures_json(const producer::FrameFigures& figures);
Json event_json(const engine::FrameEvent& event);
Json event_json(const engine::FilmEvent& event);
Json event_json(const engine::CellEvent& event);
/// Kind of a message; the next message of the same kind replaces it.
std::string kind_of(const engine::FrameEvent& event);
std::string kind_of(const engine::FilmEvent& event);
std::string kind_of(const engine::CellEvent& event);

/// Converts a path that is valid in the text without the muted items (at `muted`) to the path of the same
/// value in the whole text.
std::string with_muted(const std::string& path, const std::vector<std::string>& muted);

}  // namespace offstage::tune
