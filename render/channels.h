#pragma once
/// What a picture shows, in numbers: for each pixel how far away its surface is, which way it faces, whose it
/// is and how far it moved. Of opaque things, glass and balls; smoke, streaks, sprites and what is
/// see-through have no one surface.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace offstage::render {

struct ChannelChoice {
  bool depth = false, normal = false, id = false, motion = false;
  bool any() const { return depth || normal || id || motion; }
};

/// One value a pixel, at its centre, rows from the top down. Where nothing is, depth is infinite and the rest
/// zero.
struct Channels {
  int width_px = 0, height_px = 0;
  std::vector<float> depth;             ///< along the view axis [m]
  std::vector<Eigen::Vector3f> normal;  ///< unit, in the world, on the side that is seen
  std::vector<uint32_t> id;             ///< as set_object says; 0: none
  std::vector<Eigen::Vector2f> motion;  ///< in the picture since Stage::remember [px], x to the right, y down
};

/// An OpenEXR file (ZIP) of the chosen channels: Z, N.X N.Y N.Z, id (whole numbers), motion.X motion.Y;
/// `objects` names the ids in the header's text attribute "objects", a line each. Throws FileError.
void write_exr(const std::filesystem::path& path, const Channels& channels, const ChannelChoice& choice,
               const std::map<uint32_t, std::string>& objects);

}  // namespace offstage::render
