#pragma once
/// What a picture shows, in numbers: for each pixel how far away its surface is, which way it faces, whose it
/// is and how far it moved. Of opaque things, glass and balls; smoke, streaks, sprites and what is
/// see-through have no one surface.

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
  exr,  ///< one OpenEXR file (ZIP) with Z, N.X N.Y N.Z, id, motion.X motion.Y; all numbers as they are
  png,  ///< a file each, in whole numbers: see channel_png
};

struct ChannelChoice {
  std::vector<Channel> channels;
  ChannelFormat format = ChannelFormat::exr;
  bool any() const { return !channels.empty(); }
  bool has(Channel channel) const { return std::ranges::find(channels, channel) != channels.end(); }
};

/// One value a pixel, at its centre, rows from the top down. Where nothing is, depth is infinite and the rest
/// zero.
struct Channels {
  int width_px = 0, height_px = 0;
  std::vector<float> depth;             ///< along the view axis [m]
  std::vector<Eigen::Vector3f> normal;  ///< unit, in the world, on the side that is seen
  std::vector<uint32_t> id;             ///< as set_object says; 0: none
  std::vector<Eigen::Vector2f>
      motion;  ///< in the picture since Stage::store_previous_transforms [px], x to the right, y down
};

/// What the ids stand for.
using ObjectNames = std::map<uint32_t, std::string>;

/// PNG bytes of one channel, after the conventions of public data sets; each says its own in its text
/// "Comment". depth: 16 bits, millimetres; 0 where nothing is or it is beyond 65.535 m (TUM RGB-D, Kinect).
/// normal: 16 bits, 32767.5 (1 + n) for x, y, z; 0 0 0 where nothing is.
/// id: 8 bits, a colour of its own for each: red green blue as one number is id * 0x9E3779 modulo 2^24, and
///   id = number * 0xB382C9 modulo 2^24; black: nobody. The text has a line "id #rrggbb name" for each
///   object.
/// motion: 16 bits, 32768 + 64 x, 32768 + 64 y [px]; third 1 where something is (KITTI flow).
std::vector<uint8_t> channel_png(const Channels& channels, Channel channel, const ObjectNames& objects);

/// An OpenEXR file; `objects` is its header's text attribute "objects", a line each. Throws FileError.
void write_exr(const std::filesystem::path& path, const Channels& channels, const ChannelChoice& choice,
               const ObjectNames& objects);

/// The files of a frame, which begin with `stem`: STEM.exr, or STEM.depth.png and so on.
std::vector<std::filesystem::path> channel_files(const std::filesystem::path& stem,
                                                 const ChannelChoice& choice);
/// Throws FileError.
void write_channels(const std::filesystem::path& stem, const Channels& channels, const ChannelChoice& choice,
                    const ObjectNames& objects);

}  // namespace offstage::render
