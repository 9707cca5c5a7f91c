// Implements channel_png(), channel_files() and write_channels() of channels.h.

#include <array>
#include <cmath>
#include <cstdio>

#include "render/channels.h"
#include "render/image_io.h"
#include "render/png.h"

namespace offstage::render {
namespace {

namespace fs = std::filesystem;

constexpr std::array kNames = {"depth", "normal", "id", "motion"};

uint32_t color_of_id(uint32_t id) {
  constexpr uint32_t kGolden = 0x9E3779;  // odd, so that no two ids have the same colour
  return id * kGolden & 0xFFFFFF;
}

void append(std::vector<uint8_t>& out, double value) {
  const auto number = static_cast<uint16_t>(std::lround(std::clamp(value, 0.0, 65535.0)));
  out.push_back(static_cast<uint8_t>(number >> 8));
  out.push_back(static_cast<uint8_t>(number));
}

std::string comment_of(Channel channel, const ObjectNames& objects) {
  switch (channel) {
    case Channel::depth:
      return "depth along the view axis in millimetres; 0: nothing, or beyond 65.535 m";
    case Channel::normal:
      return "normal in the world: 32767.5 (1 + n) for x, y, z; 0 0 0: nothing";
    case Channel::motion:
      return "pixels since the previous frame: 32768 + 64 x (to the right), 32768 + 64 y (down), 1; third 0: "
             "nothing";
    case Channel::id:
      break;
  }
  std::string text = "black: no object\n";
  for (const auto& [id, name] : objects) {
    std::array<char, 32> line{};
    std::snprintf(line.data(), line.size(), "%u #%06x ", id, color_of_id(id));
    text += line.data() + name + "\n";
  }
  return text;
}

}  // namespace

std::vector<uint8_t> channel_png(const Channels& channels, Channel channel, const ObjectNames& objects) {
  std::vector<uint8_t> samples;
  switch (channel) {
    case Channel::depth:
      for (const float depth : channels.depth) {
        const double mm = 1000.0 * static_cast<double>(depth);
        append(samples, mm < 65535.5 ? mm : 0);
      }
      break;
    case Channel::normal:
      for (const Eigen::Vector3f& n : channels.normal)
        for (int k = 0; k < 3; ++k)
          append(samples, n.isZero() ? 0 : 32767.5 * (1 + static_cast<double>(n[k])));
      break;
    case Channel::id:
      for (const uint32_t id : channels.id)
        for (int shift = 16; shift >= 0; shift -= 8)
          samples.push_back(static_cast<uint8_t>(color_of_id(id) >> shift));
      break;
    case Channel::motion:
      for (std::size_t i = 0; i < channels.motion.size(); ++i) {
        for (int k = 0; k < 2; ++k) append(samples, 32768 + 64 * static_cast<double>(channels.motion[i][k]));
        append(samples, std::isfinite(channels.depth[i]) ? 1 : 0);
      }
      break;
  }
  return encode_png({.width_px = channels.width_px,
                     .height_px = channels.height_px,
                     .channels = channel == Channel::depth ? 1 : 3,
                     .bits = channel == Channel::id ? 8 : 16,
                     .samples = samples,
                     .comment = comment_of(channel, objects)});
}

std::vector<fs::path> channel_files(const fs::path& stem, const ChannelChoice& choice) {
  if (!choice.any()) return {};
  if (choice.format == ChannelFormat::exr) return {stem.string() + ".exr"};
  std::vector<fs::path> files;
  for (const Channel channel : choice.channels)
    files.push_back(stem.string() + "." + kNames[static_cast<std::size_t>(channel)] + ".png");
  return files;
}

void write_channels(const fs::path& stem, const Channels& channels, const ChannelChoice& choice,
                    const ObjectNames& objects) {
  const std::vector<fs::path> files = channel_files(stem, choice);
  if (choice.format == ChannelFormat::exr) {
    write_exr(files.front(), channels, choice, objects);
    return;
  }
  for (std::size_t i = 0; i < files.size(); ++i)
    write_file_atomically(files[i], channel_png(channels, choice.channels[i], objects));
}

}  // namespace offstage::render
