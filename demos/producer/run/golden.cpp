#include "producer/run/golden.h"

#include <algorithm>
#include <cctype>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/base/interrupt.h"
#include "producer/base/json_file.h"
#include "producer/base/markup.h"
#include "producer/run/fingerprint.h"
#include "render/context.h"
#include "render/error.h"
#include "render/image_io.h"
#include "render/sink.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

/// Stores the frames in memory.
class MemorySink : public render::FrameSink {
 public:
  explicit MemorySink(std::vector<GoldenFrame>& frames) : frames_(frames) {}
  void write(int frame, const render::Image& image) override {
    frames_.push_back(
        {.frame = frame, .state_hash = {}, .pixel_hash = render::pixel_hash(image), .image = image});
  }
  void close() override {}

 private:
  std::vector<GoldenFrame>& frames_;
};

fs::path picture_file(const fs::path& folder, const std::string& scene, int frame) {
  return folder / fmt::format("{}-{:04}.png", scene, frame);
}

void write_golden_text(const fs::path& path, const std::string& text) {
  render::write_file_atomically(path, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

/// Returns the source that a golden records. Returns an empty text if it records none, or if the file is not
/// a golden.
std::string source_of(const fs::path& golden) {
  const std::optional<JsonObject> json = read_json_file(golden);
  return json ? json->text("source") : "";
}

/// Converts a name to a file name that stays in its folder and needs no quotes.
std::string file_name_of(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '+' ||
                       (c == '.' && !out.empty()) || static_cast<unsigned char>(c) >= 0x80;
    out += plain ? c : '_';
  }
  return out.empty() ? "scene" : out;
}

/// Returns the name of the golden in the folder that records this source; nothing if there is none.
std::optional<std::string> golden_made_of(const fs::path& folder, const std::string& source) {
  std::vector<std::string> names;
  if (!fs::is_directory(folder)) return {};
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".json" && source_of(entry.path()) == source)
      names.push_back(entry.path().stem().string());
  if (names.empty()) return {};
  return *std::ranges::min_element(names);
}

/// Returns the line of the verdict about one frame, and sets `pass`.
std::string judge_frame(const GoldenFrame& expected, const GoldenFrame& actual, bool same_class, bool& pass) {
  const bool same_state = expected.state_hash == actual.state_hash;
  if (same_state && expected.pixel_hash == actual.pixel_hash) return "identical";
  if (expected.image.width_px != actual.image.width_px ||
      expected.image.height_px != actual.image.height_px) {
    pass = false;
    return "the pictures differ in size";
  }
  const render::ImageDifference d = render::difference(expected.image, actual.image);
  const std::string amount =
      fmt::format("{} pixels ({:.3f} %) differ by more than 2 of 255, largest difference {}, mean {:.4f}",
                  d.pixels_over, 100 * d.fraction_over, d.max_delta, d.mean_delta);
  const std::string cause =
      same_state ? "the simulated state is the same; the renderer differs" : "the simulated state differs";
  const bool ok = !same_class && d.within_tolerance();
  pass = pass && ok;
  return fmt::format("{}: {}; {}", ok ? "within tolerance (another machine class)" : "DIFFERENT", cause,
                     amount);
}

/// Returns the cache of convex decompositions for a golden. It neither uses the user's cache nor results of
/// an earlier program, so that goldens test decompositions, too.
DecompositionCache parts_cache(const GoldenStates& states) {
  if (!states.from.empty()) return DecompositionCache(fs::path(states.from) / "parts");
  if (!states.keep.empty()) return DecompositionCache(fs::path(states.keep) / "parts", false);
  return {};
}

}  // namespace

std::vector<std::string> golden_overrides() {
  return {"/render/size=[256,144]", "/render/quality=preview"};
}

GoldenPlace find_golden(const fs::path& folder, const LoadedScene& scene, const fs::path& scene_file,
                        const std::set<std::string>& taken) {
  const fs::path base = fs::weakly_canonical(fs::absolute(folder)), file = fs::weakly_canonical(scene_file);
  GoldenPlace place{.name = file_name_of(scene.scene.name),
                    .source = file.lexically_relative(base).generic_string(),
                    .moved_from = {}};
  if (const auto known = golden_made_of(base, place.source)) {
    place.name = *known;
    place.exists = true;
    return place;
  }
  const auto is_free = [&](const std::string& name) {
    return !taken.contains(name) && !fs::exists(base / (name + ".json"));
  };
  if (is_free(place.name)) return place;
  if (!taken.contains(place.name)) {
    const std::string owner = source_of(base / (place.name + ".json"));
    if (owner.empty() || !fs::exists(base / owner)) {
      place.exists = true;
      place.moved_from = owner;
      return place;
    }
  }
  // The name belongs to another scene: folder names are prepended until it is unique.
  std::string name = file_name_of(file.stem().string());
  for (fs::path above = file.parent_path(); above.has_relative_path(); above = above.parent_path()) {
    name = file_name_of(above.filename().string()) + "-" + name;
    if (!is_free(name)) continue;
    place.name = name;
    return place;
  }
  throw render::FileError(folder.string() + ": all names for a golden of " + scene_file.string() +
                          " are in use");
}

Golden draw_golden(const LoadedScene& scene, const std::vector<int>& frames, int threads,
                   const GoldenStates& states, const ProgressCallback& progress) {
  Golden golden;
  golden.scene = scene.scene.name;
  const int count = scene.scene.frame_count();
  RenderJob job{.frames = frames, .threads = threads, .cache = {}, .keep = {}};
  std::erase_if(job.frames, [&](int frame) { return frame > count; });
  if (job.frames.empty()) job.frames = {std::max(1, count / 5), std::max(1, count * 3 / 5)};
  if (!states.keep.empty()) job.keep = fs::path(states.keep) / "states";
  if (!states.from.empty()) job.cache = fs::path(states.from) / "states";
  job.frames.erase(std::unique(job.frames.begin(), job.frames.end()), job.frames.end());
  std::vector<Problem> warnings;
  const ModelLibrary models(scene.scene, scene.folder, parts_cache(states), warnings);
  MemorySink sink(golden.frames);
  const RunStats stats = render_frames(scene, models, job, sink, progress);
  if (stats.interrupted_by) throw Interrupted(stats.interrupted_by);
  for (GoldenFrame& frame : golden.frames) frame.state_hash = stats.frame_states.at(frame.frame);
  golden.fingerprint = fingerprint(render::Context().info());
  return golden;
}

std::vector<int> recorded_frames(const fs::path& folder, const std::string& name) {
  std::vector<int> frames;
  const std::optional<JsonObject> json = read_json_file(folder / (name + ".json"));
  if (json && json->has("frames"))
    for (const JsonObject& f : json->objects("frames")) frames.push_back(f.count("frame", 0, kMostFrames));
  return frames;
}

std::vector<int> frames_of(const Golden& golden) {
  std::vector<int> frames;
  for (const GoldenFrame& frame : golden.frames) frames.push_back(frame.frame);
  return frames;
}

Golden read_golden(const fs::path& folder, const std::string& name) {
  const fs::path path = folder / (name + ".json");
  const std::optional<JsonObject> json = read_json_file(path);
  if (!json || !json->has("frames")) throw render::FileError(path.string() + ": is not a golden");
  Golden golden{.scene = name,
                .source = json->text("source"),
                .reason = json->text("reason"),
                .fingerprint = json->text("fingerprint"),
                .frames = {}};
  for (const JsonObject& f : json->objects("frames")) {
    const int frame = f.count("frame", 0, kMostFrames);
    const fs::path picture = picture_file(folder, name, frame);
    golden.frames.push_back({.frame = frame,
                             .state_hash = f.text("state"),
                             .pixel_hash = f.text("pixels"),
                             .image = render::read_image(picture)});
    if (render::pixel_hash(golden.frames.back().image) != golden.frames.back().pixel_hash)
      throw render::FileError(picture.string() + ": is not the picture that " + path.filename().string() +
                              " was made with: its pixels have another hash");
  }
  return golden;
}

void write_golden(const fs::path& folder, const Golden& golden) {
  fs::create_directories(folder);
  const std::vector<int> drawn = frames_of(golden);
  for (const int frame : recorded_frames(folder, golden.scene))
    if (std::ranges::find(drawn, frame) == drawn.end()) {
      std::error_code harmless;  // a picture that no golden names
      fs::remove(picture_file(folder, golden.scene, frame), harmless);
    }
  nlohmann::ordered_json json = {{"scene", golden.scene},
                                 {"source", golden.source},
                                 {"reason", golden.reason},
                                 {"fingerprint", golden.fingerprint}};
  auto& frames = json["frames"] = nlohmann::ordered_json::array();
  for (const GoldenFrame& f : golden.frames) {
    render::write_png(picture_file(folder, golden.scene, f.frame), f.image);
    frames.push_back({{"frame", f.frame}, {"state", f.state_hash}, {"pixels", f.pixel_hash}});
  }
  write_golden_text(folder / (golden.scene + ".json"), json.dump(2) + "\n");
}

Verdict judge(const Golden& expected, const Golden& actual) {
  Verdict verdict;
  const bool same_class = expected.fingerprint == actual.fingerprint;
  if (!same_class)
    verdict.text +=
        fmt::format("recorded on:  {}\nthis machine: {}\n", expected.fingerprint, actual.fingerprint);
  if (expected.frames.size() != actual.frames.size()) {
    verdict.pass = false;
    verdict.difference = "the golden has other frames, because the length of the scene changed";
    verdict.text += verdict.difference + "\n";
    return verdict;
  }
  for (std::size_t i = 0; i < expected.frames.size(); ++i) {
    if (expected.frames[i].frame != actual.frames[i].frame) {
      verdict.pass = false;
      verdict.difference = "the golden has other frames, because the length of the scene changed";
      verdict.text += verdict.difference + "\n";
      return verdict;
    }
    bool same = true;
    const std::string line = fmt::format("{} frame {}: {}", actual.scene, actual.frames[i].frame,
                                         judge_frame(expected.frames[i], actual.frames[i], same_class, same));
    if (!same && verdict.pass) verdict.difference = line;
    verdict.pass = verdict.pass && same;
    verdict.text += line + "\n";
  }
  return verdict;
}

fs::path write_report(const fs::path& folder, const Golden& expected, const Golden& actual,
                      const Verdict& verdict) {
  fs::create_directories(folder);
  std::string rows;
  for (std::size_t i = 0; i < std::min(expected.frames.size(), actual.frames.size()); ++i) {
    const render::Image &a = expected.frames[i].image, &b = actual.frames[i].image;
    const std::string stem = fmt::format("{}-{:04}", actual.scene, actual.frames[i].frame);
    render::write_png(folder / (stem + "-expected.png"), a);
    render::write_png(folder / (stem + "-actual.png"), b);
    if (a.width_px == b.width_px && a.height_px == b.height_px)
      render::write_png(folder / (stem + "-difference.png"), render::amplified_difference(a, b));
    rows += fmt::format(
        "<tr><td>{0}</td><td><img src=\"{0}-expected.png\"></td><td><img src=\"{0}-actual.png\"></td>"
        "<td><img src=\"{0}-difference.png\"></td></tr>\n",
        escape_markup(stem));
  }
  const fs::path page = folder / "index.html";
  write_golden_text(
      page,
      fmt::format("<!doctype html><meta charset=\"utf-8\"><title>{0}</title>\n"
                  "<style>body{{font:14px sans-serif}}img{{image-rendering:pixelated;width:384px}}</style>\n"
                  "<h1>{0}</h1><pre>{1}</pre>\n"
                  "<table><tr><th>frame<th>expected<th>actual<th>difference x16</tr>\n{2}</table>\n",
                  escape_markup(actual.scene), escape_markup(verdict.text), rows));
  return page;
}

}  // namespace offstage::producer
