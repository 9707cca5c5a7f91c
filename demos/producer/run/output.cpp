#include "producer/run/output.h"

#include <algorithm>
#include <charconv>
#include <regex>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/base/json_file.h"
#include "render/error.h"
#include "render/frame_files.h"
#include "render/output_file.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifestName = "manifest.json";

nlohmann::ordered_json to_json(const Manifest& m, const fs::path& pattern) {
  return {{"pattern", pattern.filename().string()},
          {"scene", m.scene},
          {"settings", m.settings},
          {"width", m.width_px},
          {"height", m.height_px},
          {"frames", m.frames},
          {"fps", fps_json(m.fps)}};
}

/// Returns the frame number of a channel file; nothing for other files.
std::optional<int> channel_number(const fs::path& stem, const fs::path& file) {
  const std::string name = file.filename().string();
  std::optional<int> number;
  for (const std::string_view ending : {".exr", ".depth.png", ".normal.png", ".id.png", ".motion.png"})
    if (name.ends_with(ending))
      number = frame_number(stem, stem.parent_path() / name.substr(0, name.size() - ending.size()));
  if (!number) return {};
  const std::vector<fs::path> known = all_channel_files(stem, *number);
  return std::ranges::find(known, file) != known.end() ? number : std::nullopt;
}

/// Returns all channel files in a folder, for any frame number.
std::vector<fs::path> channels_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (fs::is_regular_file(entry.symlink_status(error)) && channel_number(folder / "####", entry.path()))
      files.push_back(entry.path());
  }
  return files;
}

}  // namespace

std::vector<fs::path> all_channel_files(const fs::path& stem, int frame) {
  using render::Channel;
  std::vector<fs::path> files;
  for (const auto format : {render::ChannelFormat::exr, render::ChannelFormat::png}) {
    const ChannelFiles all{{{Channel::depth, Channel::normal, Channel::id, Channel::motion}, format}, stem};
    for (fs::path& path : all.of(frame)) files.push_back(std::move(path));
  }
  return files;
}

nlohmann::ordered_json fps_json(const render::FrameRate& fps) {
  if (fps.denominator == 1) return fps.per_second();
  return fps.text();
}

std::string hash_pattern(const std::string& pattern) {
  // printf's %d and %04d, Houdini's $F4, Python's {:04d} and {frame:04}
  static const std::regex number(R"(%0?(\d*)[diu]|\$F(\d*)|\{\w*(?::0?(\d*)d?)?\})");
  std::smatch found;
  const std::size_t slash = pattern.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : pattern.substr(0, slash + 1),
                    name = pattern.substr(folder.size());
  if (!std::regex_search(name, found, number)) return {};
  std::string digits;
  for (std::size_t group = 1; group < found.size(); ++group) digits += found[group].str();
  constexpr std::size_t kUsual = 1, kMost = 9;
  const std::size_t width = digits.empty() || digits.size() > 2 ? kUsual : std::stoul(digits);
  return folder + found.prefix().str() + std::string(std::clamp(width, kUsual, kMost), '#') +
         found.suffix().str();
}

void check_folder(const fs::path& file) {
  const fs::path folder = file.parent_path();
  std::error_code error;
  if (folder.string().find('#') == std::string::npos || fs::is_directory(folder, error)) return;
  throw OutputError(file.string() +
                    ": the frame number (#) can only be in the name of the file, not in that of its folder");
}

OutputTarget parse_output(const std::string& out) {
  if (out == "-") return {OutputKind::pipe, {}};
  check_folder(out);
  const std::vector<std::string> endings = render::video_endings();
  const auto is_ending = [&](const std::string& text) {
    return std::ranges::find(endings, text) != endings.end();
  };
  if (out.empty() || is_ending(fs::path(out).filename().string()))
    throw OutputError(out.empty() ? "the output needs a name, such as film.mp4"
                                  : "'" + out + "' is only an extension; give a name such as film" + out);
  const fs::path path = out;
  std::error_code error;
  if (out.ends_with('/') || fs::is_directory(path, error)) return {OutputKind::frames, path / "####.png"};
  const std::string ending = path.extension().string();
  const bool is_picture = render::frame_format(path).has_value();
  if (const std::string meant = hash_pattern(out); !meant.empty() && (ending.empty() || is_picture))
    throw OutputError(out + ": write the frame number as #; did you mean '" + meant + "'?");
  if (path.filename().string().find('#') != std::string::npos) {
    if (!is_picture)
      throw OutputError(out + ": frames are PNG, JPEG or EXR files; give a pattern such as frames/####.png");
    return {OutputKind::frames, path};
  }
  if (is_picture && ending != ".png")
    throw OutputError(out + ": write the frame number as #, such as " +
                      (path.parent_path() / (path.stem().string() + "_####" + ending)).string());
  if (ending.empty()) return {OutputKind::frames, path / "####.png"};
  if (!is_ending(ending))
    throw OutputError(out +
                      ": unknown kind of output; give a folder, a pattern such as frames/####.png, one of " +
                      fmt::format("{}", fmt::join(endings, " ")) + ", or - for standard output");
  return {OutputKind::video, path};
}

std::optional<int> frame_number(const fs::path& pattern, const fs::path& file) {
  const std::string shape = pattern.filename().string(), name = file.filename().string();
  const std::size_t last = shape.find_last_of('#'), before = shape.find_last_not_of('#', last);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1, after = shape.size() - last - 1;
  if (name.size() <= begin + after) return {};
  const std::string_view digits = std::string_view(name).substr(begin, name.size() - begin - after);
  int number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc() || end != digits.data() + digits.size() || number < 0) return {};
  if (render::frame_path(pattern, number) != file) return {};
  return number;
}

std::vector<fs::path> files_of_frames(const fs::path& folder) {
  const std::optional<JsonObject> manifest = read_json_file(folder / kManifestName);
  if (!manifest) return {};
  std::vector<fs::path> files;
  const fs::path name = fs::path(manifest->text("pattern")).filename();
  if (name.string().find('#') != std::string::npos) {
    const int count = manifest->count("frames", 0, kMostFrames);
    const fs::path pattern = folder / name, stem = channels_stem(pattern);
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
      if (!fs::is_regular_file(entry.symlink_status(error))) continue;
      const fs::path file = folder / entry.path().filename();
      std::optional<int> number = frame_number(pattern, file);
      if (!number) number = channel_number(stem, file);
      if (number && *number >= 1 && *number <= count) files.push_back(file);
    }
  }
  // The manifest is removed last. If the removal is interrupted, the next run can still find the other files.
  files.push_back(folder / kManifestName);
  return files;
}

void remove_frames(const fs::path& folder) {
  std::error_code error;
  for (const fs::path& file : files_of_frames(folder)) fs::remove(file, error);
  fs::remove(folder, error);  // fails if the folder contains other files, which is intended
}

namespace {

bool is_ours(const std::optional<JsonObject>& manifest, const fs::path& pattern, const Manifest& wanted) {
  return manifest && manifest->text("settings") == wanted.settings &&
         manifest->text("pattern") == pattern.filename().string();
}

/// State of a frame's file before a run.
enum class Found { nothing, own, other };

Found look_at(const fs::path& path, const Manifest& manifest) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(path, error))) return Found::nothing;
  const std::optional<render::FrameFile> file = render::inspect_frame(path);
  const bool own = file && file->width_px == manifest.width_px && file->height_px == manifest.height_px &&
                   file->settings == manifest.settings;
  return own ? Found::own : Found::other;
}

}  // namespace

FrameFolder prepare_frames(const fs::path& pattern, const ChannelFiles& channels,
                           const std::vector<int>& frames, const Manifest& manifest, Existing existing) {
  const fs::path folder = pattern.has_parent_path() ? pattern.parent_path() : ".";
  const fs::path manifest_path = folder / kManifestName;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw render::FileError(folder.string() + ": cannot create the folder: " + error.message());

  const bool is_part = static_cast<int>(frames.size()) < manifest.frames;
  FrameFolder result;
  if (is_part) {
    result.lock = OutputLock::of_part(OutputLock::inside(folder), folder.string(), [&] {
      return existing != Existing::replace && is_ours(read_json_file(manifest_path), pattern, manifest);
    });
  } else {
    result.lock = OutputLock(OutputLock::inside(folder), folder.string());
  }
  render::remove_leftovers(folder);
  const std::optional<JsonObject> old = read_json_file(manifest_path);
  // Without a manifest, the settings of the frames are unknown.
  const bool same_settings = is_ours(old, pattern, manifest);
  if (!same_settings && existing != Existing::replace && fs::exists(manifest_path, error))
    throw OutputError(
        folder.string() +
        ": contains frames of another scene or other settings; choose another folder, or replace them "
        "with --force");

  std::set<int> kept;
  for (const int frame : frames) {
    const fs::path path = render::frame_path(pattern, frame);
    const Found found = look_at(path, manifest);
    if (found == Found::nothing) continue;
    if (existing == Existing::refuse)
      throw OutputError(path.string() +
                        ": already exists; keep finished frames with --resume, or replace them with --force");
    if (existing == Existing::keep && !same_settings && found == Found::other)
      throw OutputError(path.string() + ": is not a frame of this film; replace it with --force");
    const bool has_channels =
        std::ranges::all_of(channels.of(frame), [](const fs::path& p) { return fs::exists(p); });
    if (existing == Existing::keep && found == Found::own && has_channels) kept.insert(frame);
  }
  if (!same_settings && existing == Existing::replace)  // all old frames, before the new manifest is written
    for (const fs::path& file : files_of_frames(folder)) fs::remove(file, error);
  for (const int frame : frames)
    if (!kept.contains(frame)) result.missing.push_back(frame);

  const std::string text = to_json(manifest, pattern).dump(2) + "\n";
  if (!same_settings || existing == Existing::replace)
    render::write_file_atomically(manifest_path,
                                  {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  if (is_part) {
    result.lock.share();
    if (!is_ours(read_json_file(manifest_path), pattern, manifest))
      throw OutputError(
          folder.string() +
          ": another run has just begun to write here; wait for its end, or choose another output");
  }
  return result;
}

fs::path channels_stem(const fs::path& pattern) {
  const bool same_names = render::frame_format(pattern) == render::FrameFormat::exr;
  return fs::path(pattern).replace_extension(same_names ? ".channels" : "");
}

fs::path channels_folder(const fs::path& video) {
  return fs::path(video).replace_extension(".channels");
}

bool holds_channels(const fs::path& folder) {
  return !channels_in(folder).empty();
}

void remove_channels(const fs::path& folder) {
  std::error_code error;
  for (const fs::path& path : channels_in(folder)) fs::remove(path, error);
  fs::remove(folder, error);  // fails if the folder contains other files, which is intended
}

void prepare_channels(const fs::path& folder, bool replace) {
  if (replace) remove_channels(folder);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw render::FileError(folder.string() + ": cannot create the folder: " + error.message());
  if (!replace && !fs::is_empty(folder))
    throw OutputError(folder.string() + ": already contains channels; replace them with --force");
}

}  // namespace offstage::producer
