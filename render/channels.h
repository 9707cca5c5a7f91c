#pragma once
/// Numeric channels of a picture: depth, surface normal, object id and motion of every pixel. They include
/// opaque objects, glass and balls. Smoke, streaks, sprites and translucent materials have no single surface
/// and are omitted.

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace offstage::render {

enum class Channel { depth, normal, id, motion };

enum class ChannelFormat {
  exr,  ///< one OpenEXR file (ZIP) with Z, N.X N.Y N.Z, id, motion.X motion.Y as unscaled numbers
  png,  ///< one file per channel, in integers: see channel_png
};

struct ChannelChoice {
  std::vector<Channel> channels;
  ChannelFormat format = ChannelFormat::exr;
  bool any() const { return !channels.empty(); }
  bool has(Channel channel) const { return std::ranges::find(channels, channel) != channels.end(); }
};

/// One value per pixel, sampled at its centre; rows run from the top down. Pixels without a surface have
/// infinite depth, and zero in the other channels.
struct Channels {
  int width_px = 0, height_px = 0;
  std::vector<float> depth;             ///< distance along the view axis [m]
  std::vector<Eigen::Vector3f> normal;  ///< unit vector in the world, on the visible side
  std::vector<uint32_t> id;             ///< id set by Stage::set_object; 0: no object
  std::vector<Eigen::Vector2f> motion;  ///< movement in the picture since
                                        ///< Stage::store_previous_transforms [px]; x to the right, y down
};

/// Names of the objects by id.
using ObjectNames = std::map<uint32_t, std::string>;

/// Encodes one channel as a PNG file in memory, in the conventions of public data sets. The PNG text
/// "Comment" states the encoding. depth: 16 bits, millimetres; 0 where there is no surface or it is
/// beyond 65.535 m (TUM RGB-D, Kinect). normal: 16 bits, 32767.5 (1 + n) for x, y, z; 0 0 0 where there is no
/// surface. id: 8 bits, a unique colour per object: red green blue as one number is id * 0x9E3779 modulo
/// 2^24, and id = number * 0xB382C9 modulo 2^24; black: no object. The text has a line "id #rrggbb name" for
/// each object. motion: 16 bits, 32768 + 64 x, 32768 + 64 y [px]; the third channel is 1 where there is a
/// surface (KITTI flow).
std::vector<uint8_t> channel_png(const Channels& channels, Channel channel, const ObjectNames& objects);

/// Writes an OpenEXR file. The header's text attribute "objects" lists `objects`, one per line. Throws
/// FileError.
void write_exr(const std::filesystem::path& path, const Channels& channels, const ChannelChoice& choice,
               const ObjectNames& objects);

/// Returns the paths of the channel files of a frame: STEM.exr, or STEM.depth.png and so on.
std::vector<std::filesystem::path> channel_files(const std::filesystem::path& stem,
                                                 const ChannelChoice& choice);
/// Writes the channel files of a frame (see channel_files). Throws FileError.
void write_channels(const std::filesystem::path& stem, const Channels& channels, const ChannelChoice& choice,
                    const ObjectNames& objects);

}  // namespace offstage::render
