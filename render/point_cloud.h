#pragma once
/// Point clouds of PLY and OBJ files. They are read in a confined child, as models are.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "render/file_io.h"
#include "render/input_folders.h"
#include "render/mesh.h"

namespace offstage::render {

inline constexpr std::size_t kMostCloudPoints = 20'000'000;

struct PointCloud {
  std::vector<Vector3f> positions;
  std::vector<Vector4f> colors;  ///< linear; empty, or as many as positions
};

/// Reads all vertices of a PLY file (text or binary) or of an OBJ file, whether faces use them or not.
/// Colours of vertices are taken as sRGB. Points that are not finite are omitted. Throws FileError for a file
/// that is missing, broken, outside of `folders`, of another format, or without points; StoppedError after a
/// request by `stop`.
PointCloud read_points(const std::filesystem::path& path, const InputFolders& folders = {},
                       const StopTest& stop = {});

/// Parses the bytes of a PLY file, which are not trusted. Only the render library and its tests use this
/// function. Throws FileError.
PointCloud parse_ply_points(std::span<const uint8_t> bytes);
PointCloud parse_obj_points(std::span<const uint8_t> bytes);

}  // namespace offstage::render
