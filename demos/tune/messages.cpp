#include "tune/messages.h"

#include <algorithm>
#include <ctime>

#include <fmt/format.h>

namespace offstage::tune {
namespace {

const char* name_of(engine::Detail detail) {
  return detail == engine::Detail::draft ? "draft" : detail == engine::Detail::preview ? "preview" : "final";
}

const char* name_of(engine::FilmEvent::Phase phase) {
  switch (phase) {
    case engine::FilmEvent::Phase::loading:
      return "loading";
    case engine::FilmEvent::Phase::lead_in:
      return "lead_in";
    case engine::FilmEvent::Phase::running:
      return "running";
    case engine::FilmEvent::Phase::complete:
      return "complete";
    case engine::FilmEvent::Phase::failed:
      break;
  }
  return "failed";
}

}  // namespace

std::string dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json vector_json(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

Eigen::Vector3d vector_of(const nlohmann::json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

Json version_json(const Version& version, const std::map<uint64_t, std::string>& films) {
  const auto film = films.find(version.id);
  const auto ms =
      std::chrono::duration_cast<std::chrono::milliseconds>(version.time.time_since_epoch()).count();
  return {{"id", version.id},
          {"label", version.label},
          {"paths", version.paths},
          {"time_ms", ms},
          {"film", film == films.end() ? Json() : Json(film->second)}};
}

Json problems_json(const std::vector<Problem>& problems, const std::string& file) {
  Json list = Json::array();
  for (const Problem& problem : problems) {
    const bool here = problem.where.file.empty() || problem.where.file == file;
    list.push_back(
        {{"line", here ? problem.where.line : 0},
         {"column", here ? problem.where.column : 0},
         {"path", problem.where.path},
         {"what", here ? problem.what
                       : fmt::format("{}:{}: {}", problem.where.file, problem.where.line, problem.what)}});
  }
  return list;
}

Json ranges_json(const std::vector<std::pair<int, int>>& ranges) {
  Json json = Json::array();
  for (const auto& [first, last] : ranges) json.push_back({first, last});
  return json;
}

Json figures_json(const producer::FrameFigures& figures) {
  Json json = {{"frame", figures.frame},       {"time", figures.time},
               {"sim_ms", figures.sim_ms},     {"particles", figures.particles},
               {"contacts", figures.contacts}, {"state", figures.state_hash}};
  if (figures.energy)
    json["energy"] = {figures.energy->kinetic, figures.energy->potential, figures.energy->elastic};
  return json;
}

Json event_json(const engine::FrameEvent& event) {
  Json json = {{"run", event.run},
               {"film", event.film},
               {"frame", event.frame},
               {"time", event.time},
               {"detail", name_of(event.detail)},
               {"draw_ms", event.draw_ms}};
  if (event.figures) json["figures"] = figures_json(*event.figures);
  json["camera"] = {{"eye", vector_json(event.camera.eye.cast<double>())},
                    {"target", vector_json(event.camera.target.cast<double>())},
                    {"fov", event.camera.fov_deg}};
  return json;
}

Json event_json(const engine::FilmEvent& event) {
  Json json = {{"run", event.run},         {"film", event.film},           {"phase", name_of(event.phase)},
               {"lead_in", event.lead_in}, {"simulated", event.simulated}, {"message", event.message},
               {"notes", event.notes}};
  json["statistics"] = event.statistics.empty() ? Json() : Json::parse(event.statistics);
  return json;
}

Json event_json(const engine::CellEvent& event) {
  return {
      {"sweep", event.sweep}, {"index", event.index}, {"fault", event.fault}, {"particles", event.particles}};
}

std::string kind_of(const engine::FrameEvent& event) {
  // A pinned film has no camera, and its frames do not belong to the run.
  return event.figures || event.frame == 0 ? "frame" : "other_frame";
}
std::string kind_of(const engine::FilmEvent&) {
  return "film";
}
std::string kind_of(const engine::CellEvent& event) {
  return fmt::format("cell:{}", event.index);
}

std::string with_muted(const std::string& path, const std::vector<std::string>& muted) {
  // If /emitters/0 is muted, "/emitters/1/rate" stands for /emitters/2/rate.
  const std::size_t slash = path.find('/', 1);
  if (slash == std::string::npos) return path;
  const std::size_t end = std::min(path.find('/', slash + 1), path.size());
  const std::string list = path.substr(0, slash + 1), step = path.substr(slash + 1, end - slash - 1);
  if (step.empty() || step.size() > 8 || step.find_first_not_of("0123456789") != std::string::npos)
    return path;
  std::size_t index = std::stoul(step);
  std::vector<std::size_t> gone;
  for (const std::string& item : muted)
    if (item.starts_with(list)) gone.push_back(std::stoul(item.substr(list.size())));
  std::ranges::sort(gone);
  for (const std::size_t item : gone)
    if (item <= index) ++index;
  return list + std::to_string(index) + path.substr(end);
}

}  // namespace offstage::tune
