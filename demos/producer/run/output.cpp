#include "producer/run/output.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <fstream>
#include <regex>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "render/error.h"
#include "render/image_io.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

constexpr int kMostFrames = 10'000'000;  // that a manifest can make us look for

nlohmann::ordered_json to_json(const Manifest& m, const fs::path& pattern) {
  return {{"pattern", pattern.filename().string()},
          {"scene", m.scene},
          {"settings", m.settings},
          {"width", m.width_px},
          {"height", m.height_px},
          {"frames", m.frames},
          {"fps", fps_json(m.fps)}};
}

void remove_channels_of(const fs::path& stem, int count) {
  std::error_code error;
  for (int k = 1; k <= count; ++k)
    for (const fs::path& path : all_channel_files(stem, k)) fs::remove(path, error);
}

/// What a film of any length left in its folder of channels.
std::vector<fs::path> channels_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string(), number = name.substr(0, name.find('.'));
    constexpr std::size_t kMostDigits = 9;
    if (number.empty() || number.size() > kMostDigits ||
        !std::ranges::all_of(number, [](unsigned char c) { return std::isdigit(c); }))
      continue;
    const std::vector<fs::path> known = all_channel_files(folder / "####", std::stoi(number));
    if (std::ranges::find(known, entry.path()) != known.end()) files.push_back(entry.path());
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

OutputTarget parse_output(const std::string& out) {
  if (out == "-") return {OutputKind::pipe, {}};
  const std::vector<std::string> endings = render::video_endings();
  const auto is_ending = [&](const std::string& text) {
    return std::ranges::find(endings, text) != endings.end();
  };
  if (out.empty() || is_ending(fs::path(out).filename().string()))
    throw OutputError("'" + out + "': the output has no name");
  const fs::path path = out;
  if (out.ends_with('/') || fs::is_directory(path)) return {OutputKind::frames, path / "####.png"};
  const std::string ending = path.extension().string();
  if (const std::string meant = hash_pattern(out); !meant.empty() && (ending.empty() || ending == ".png"))
    throw OutputError(out + ": the numbers of frames are written as #; did you mean '" + meant + "'?");
  if (path.filename().string().find('#') != std::string::npos) {
    if (ending != ".png")
      throw OutputError(out + ": frames are PNG files; give a pattern such as frames/####.png");
    return {OutputKind::frames, path};
  }
  if (ending.empty()) return {OutputKind::frames, path / "####.png"};
  if (!is_ending(ending))
    throw OutputError(out +
                      ": unknown kind of output; give a folder, a pattern such as frames/####.png, one of " +
                      fmt::format("{}", fmt::join(endings, " ")) + ", or - for standard output");
  return {OutputKind::video, path};
}

bool is_whole_png(const fs::path& path, int width_px, int height_px) {
  std::ifstream in(path, std::ios::binary);
  std::array<uint8_t, 24> head{};
  std::array<uint8_t, 12> tail{};
  if (!in.read(reinterpret_cast<char*>(head.data()), head.size())) return false;
  if (!in.seekg(-static_cast<int>(tail.size()), std::ios::end)
           .read(reinterpret_cast<char*>(tail.data()), tail.size()))
    return false;
  const auto number = [&](std::size_t at) {
    return (head[at] << 24) | (head[at + 1] << 16) | (head[at + 2] << 8) | head[at + 3];
  };
  return std::memcmp(head.data(), "\x89PNG\r\n\x1a\n", 8) == 0 && number(16) == width_px &&
         number(20) == height_px && std::memcmp(tail.data() + 4, "IEND", 4) == 0;
}

std::vector<int> prepare_frames(const fs::path& pattern, const ChannelFiles& channels,
                                const std::vector<int>& frames, const Manifest& manifest, Existing existing) {
  const fs::path folder = pattern.has_parent_path() ? pattern.parent_path() : ".";
  const fs::path manifest_path = folder / "manifest.json";
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw render::FileError(folder.string() + ": cannot make the folder: " + error.message());

  bool same_settings = false;  // without a manifest nobody knows what the frames there are
  if (std::ifstream in(manifest_path); in) {
    const auto old = nlohmann::json::parse(in, nullptr, false);
    same_settings = old.is_object() && old.value("settings", std::string()) == manifest.settings &&
                    old.value("pattern", std::string()) == pattern.filename().string();
    if (!same_settings && existing != Existing::replace)
      throw OutputError(
          folder.string() +
          ": holds frames of another scene or other settings; choose another folder, or replace them with "
          "--force");
    if (!same_settings && old.is_object()) {
      const fs::path old_name = old.value("pattern", pattern.filename().string());
      const int count = std::min(old.value("frames", 0), kMostFrames);
      for (int k = 1; k <= count; ++k) fs::remove(render::frame_path(folder / old_name.filename(), k), error);
      remove_channels_of(fs::path(folder / old_name.filename()).replace_extension(), count);
    }
  }

  std::vector<int> missing;
  for (const int frame : frames) {
    const fs::path path = render::frame_path(pattern, frame);
    const bool there = fs::exists(path);
    if (there && existing == Existing::refuse)
      throw OutputError(path.string() +
                        ": exists already; keep finished frames with --resume, or replace them with --force");
    const bool keep =
        there && same_settings && existing == Existing::keep &&
        is_whole_png(path, manifest.width_px, manifest.height_px) &&
        std::ranges::all_of(channels.of(frame), [](const fs::path& p) { return fs::exists(p); });
    if (!keep) missing.push_back(frame);
  }
  const std::string text = to_json(manifest, pattern).dump(2) + "\n";
  render::write_file_atomically(manifest_path, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  return missing;
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
  fs::remove(folder, error);  // unless it holds something else
}

void prepare_channels(const fs::path& folder, bool replace) {
  if (replace) remove_channels(folder);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw render::FileError(folder.string() + ": cannot make the folder: " + error.message());
  if (!replace && !fs::is_empty(folder))
    throw OutputError(folder.string() + ": holds channels already; replace them with --force");
}

}  // namespace offstage::producer
