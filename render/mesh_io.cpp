#include "render/mesh_io.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <span>
#include <string_view>
#include <type_traits>

#include "render/confined_child.h"
#include "render/error.h"
#include "render/file_io.h"
#include "render/gltf_packed.h"
#include "render/image_io.h"
#include "render/mesh_import.h"
#include "render/model_files.h"
#include "render/point_cloud.h"

// With malformed files, which a fuzzer finds within minutes, assimp overflows its stack, loops, or allocates
// whatever size a header states. The libraries for compressed data may do the same. Therefore a confined
// child process imports the model and returns it in a memory file. Only that child can crash; the caller then
// gets a message.

namespace offstage::render {
namespace {

constexpr uint64_t kMaxMeshBytes = uint64_t{2} << 30;

template <class Archive>
void transfer_image(Archive& archive, Image& image) {
  archive.value(image.width_px);
  archive.value(image.height_px);
  archive.value(image.transparent);
  archive.array(image.rgba);
}

template <class Archive>
void transfer_mesh(Archive& archive, Mesh& mesh) {
  archive.array(mesh.positions);
  archive.array(mesh.normals);
  archive.array(mesh.uvs);
  archive.array(mesh.second_uvs);
  archive.array(mesh.colors);
  archive.array(mesh.tangents);
  archive.array(mesh.indices);
}

template <class Archive>
void transfer_rig(Archive& archive, ModelRig& rig) {
  archive.list(rig.nodes, [&](RigNode& node) {
    archive.array(node.name);
    archive.value(node.parent);
    archive.value(node.translation);
    archive.value(node.rotation.coeffs());
    archive.value(node.scale);
    archive.value(node.has_matrix);
    archive.value(node.matrix);
    archive.array(node.weights);
  });
  archive.list(rig.clips, [&](RigClip& clip) {
    archive.array(clip.name);
    archive.value(clip.duration);
    archive.list(clip.channels, [&](RigChannel& channel) {
      archive.value(channel.node);
      archive.value(channel.path);
      archive.value(channel.interpolation);
      archive.array(channel.times);
      archive.array(channel.values);
    });
  });
  archive.list(rig.skins, [&](RigSkin& skin) {
    archive.array(skin.joints);
    archive.array(skin.unbind);
  });
  archive.list(rig.surfaces, [&](RigSurface& surface) {
    for (int* number : {&surface.node, &surface.skin, &surface.material}) archive.value(*number);
    transfer_mesh(archive, surface.mesh);
    archive.value(surface.flat);
    archive.value(surface.influences);
    archive.array(surface.joints);
    archive.array(surface.weights);
    archive.list(surface.targets, [&](RigTarget& target) {
      archive.array(target.positions);
      archive.array(target.normals);
    });
  });
}

/// Calls `archive` for all members of a model. The same list is used for writing and for reading.
template <class Archive>
void transfer(Archive& archive, Model& model) {
  archive.list(model.parts, [&](Model::Part& part) {
    archive.value(part.material);
    transfer_mesh(archive, part.mesh);
  });
  archive.list(model.nodes, [&](Model::Node& node) {
    archive.array(node.name);
    archive.value(node.parent);
    archive.value(node.position);
    archive.value(node.orientation.coeffs());
  });
  archive.list(model.materials, [&](Material& m) {
    archive.array(m.name);
    archive.value(m.color);
    archive.value(m.metallic);
    archive.value(m.roughness);
    archive.value(m.emission);
    archive.value(m.transmission);
    archive.value(m.refraction);
    archive.value(m.two_sided);
    for_each_texture(m, [&](TextureMap& map) {
      for (int* number : {&map.image, &map.uv_set}) archive.value(*number);
      for (Wrap* wrap : {&map.wrap_u, &map.wrap_v}) archive.value(*wrap);
      for (bool* flag : {&map.nearest, &map.mip_maps}) archive.value(*flag);
      for (Vector3f& row : map.rows) archive.value(row);
    });
    archive.value(m.normal_scale);
    archive.value(m.occlusion_strength);
    archive.value(m.alpha_cutoff);
    for (bool* flag : {&m.unlit, &m.thin, &m.vertex_colors, &m.vertex_alpha}) archive.value(*flag);
    archive.value(m.specular);
    archive.value(m.glossiness);
    archive.value(m.clearcoat);
    archive.value(m.clearcoat_roughness);
    archive.value(m.sheen_color);
  });
  archive.list(model.clips, [&](Model::Clip& clip) {
    archive.array(clip.name);
    archive.value(clip.duration);
  });
  const auto transfer_place = [&](Model::Place& place) {
    archive.array(place.name);
    archive.value(place.node);
    archive.value(place.model_from_place);
  };
  archive.list(model.cameras, [&](Model::Camera& camera) {
    transfer_place(camera);
    archive.value(camera.perspective);
    archive.value(camera.fov_deg);
  });
  archive.list(model.lights, [&](Model::Light& light) {
    transfer_place(light);
    archive.value(light.kind);
    archive.value(light.color);
    for (float* number : {&light.intensity, &light.inner_deg, &light.outer_deg, &light.range_m})
      archive.value(*number);
  });
  archive.value(model.unit_source);
  transfer_rig(archive, model.rig);
  archive.list(model.textures, [&](Image& image) { transfer_image(archive, image); });
  archive.array(model.unit);
  archive.list(model.warnings, [&](std::string& line) { archive.array(line); });
}

class Writer {
 public:
  explicit Writer(int fd) : fd_(fd) {}

  template <class T>
  void value(const T& value) {
    bytes(&value, sizeof value);
  }
  template <class Container>
  void array(const Container& values) {
    value(uint64_t{values.size()});
    bytes(values.data(), values.size() * sizeof values[0]);
  }
  template <class T, class Each>
  void list(std::vector<T>& values, Each each) {
    value(uint64_t{values.size()});
    for (T& element : values) each(element);
  }

 private:
  void bytes(const void* data, std::size_t size) {
    if (write_all(fd_, {static_cast<const uint8_t*>(data), size}) != 0) throw std::bad_alloc();
  }
  int fd_;
};

FileError damaged_answer() {
  return FileError("the model reader gave a damaged answer");
}

/// Checks all counts, because the child may have been corrupted before it wrote.
class Reader {
 public:
  explicit Reader(std::span<const uint8_t> bytes) : rest_(bytes) {}

  template <class T>
  void value(T& value) {
    const uint8_t* bytes = take(sizeof value);
    if (std::is_same_v<T, bool> && *bytes > 1) throw damaged_answer();
    std::memcpy(static_cast<void*>(&value), bytes, sizeof value);
  }
  template <class Container>
  void array(Container& values) {
    constexpr std::size_t kSize = sizeof(typename Container::value_type);
    values.resize(count(kSize));
    if (!values.empty())
      std::memcpy(static_cast<void*>(values.data()), take(values.size() * kSize), values.size() * kSize);
  }
  template <class T, class Each>
  void list(std::vector<T>& values, Each each) {
    // reserve() is not called: with a wrong count, the bytes end before much memory is allocated.
    for (std::size_t left = count(1); left > 0; --left) each(values.emplace_back());
  }

 private:
  std::size_t count(std::size_t element_size) {
    uint64_t n = 0;
    value(n);
    if (n > rest_.size() / element_size) throw damaged_answer();
    return n;
  }
  const uint8_t* take(std::size_t size) {
    if (size > rest_.size()) throw damaged_answer();
    const uint8_t* data = rest_.data();
    rest_ = rest_.subspan(size);
    return data;
  }
  std::span<const uint8_t> rest_;
};

bool is_whole(const Image& image) {
  return image.width_px > 0 && image.height_px > 0 && image.rgba.size() == 4 * image.pixel_count();
}

bool is_whole(const Mesh& mesh) {
  const std::size_t vertices = mesh.positions.size();
  const auto fits = [&](std::size_t size) { return size == 0 || size == vertices; };
  return fits(mesh.normals.size()) && fits(mesh.uvs.size()) && fits(mesh.second_uvs.size()) &&
         fits(mesh.colors.size()) && fits(mesh.tangents.size()) && mesh.indices.size() % 3 == 0 &&
         std::ranges::all_of(mesh.indices, [&](uint32_t index) { return index < vertices; }) &&
         std::ranges::all_of(mesh.positions, [](const Vector3f& p) { return p.allFinite(); });
}

bool is_whole(const Model::Place& place, const ModelRig& rig) {
  const bool has_node = place.node >= 0 && static_cast<std::size_t>(place.node) < rig.nodes.size();
  return place.model_from_place.allFinite() && (has_node || place.node == -1);
}

bool is_whole(const Model::Camera& camera, const ModelRig& rig) {
  return is_whole(static_cast<const Model::Place&>(camera), rig) && camera.fov_deg >= 0 &&
         camera.fov_deg < 180;
}

bool is_whole(const Model::Light& light, const ModelRig& rig) {
  const float cone = light.outer_deg;
  return is_whole(static_cast<const Model::Place&>(light), rig) &&
         static_cast<unsigned>(light.kind) <= static_cast<unsigned>(Model::Light::Kind::spot) &&
         light.color.allFinite() && light.color.minCoeff() >= 0 && std::isfinite(light.intensity) &&
         light.intensity >= 0 && light.inner_deg >= 0 && light.inner_deg <= cone &&
         (light.kind != Model::Light::Kind::spot || cone > 0) && cone <= 90 && std::isfinite(light.range_m);
}

/// Returns whether a model is consistent: all indices are valid and all sizes agree. Such a model can be
/// drawn and simulated safely.
bool is_whole(const Model& model) {
  const auto refers = [](int index, std::size_t size) {
    return index >= 0 && static_cast<std::size_t>(index) < size;
  };
  const auto texture = [&](const TextureMap& map) {
    const auto is_wrap = [](Wrap wrap) {
      return static_cast<unsigned>(wrap) <= static_cast<unsigned>(Wrap::clamp);
    };
    return (map.image == -1 || refers(map.image, model.textures.size())) && is_wrap(map.wrap_u) &&
           is_wrap(map.wrap_v);
  };
  return std::ranges::all_of(model.parts,
                             [&](const Model::Part& part) {
                               return refers(part.material, model.materials.size()) && is_whole(part.mesh);
                             }) &&
         std::ranges::all_of(model.nodes,
                             [&](const Model::Node& node) {
                               const auto own = static_cast<std::size_t>(&node - model.nodes.data());
                               return (node.parent == -1 || refers(node.parent, own)) &&
                                      node.position.allFinite() && node.orientation.coeffs().allFinite();
                             }) &&
         std::ranges::all_of(model.materials,
                             [&](const Material& m) {
                               bool whole = true;
                               for_each_texture(m, [&](const TextureMap& map) { whole &= texture(map); });
                               return whole;
                             }) &&
         std::ranges::all_of(model.textures, [](const Image& image) { return is_whole(image); }) &&
         std::ranges::all_of(model.clips, [](const Model::Clip& c) { return std::isfinite(c.duration); }) &&
         std::ranges::all_of(model.cameras,
                             [&](const auto& camera) { return is_whole(camera, model.rig); }) &&
         std::ranges::all_of(model.lights, [&](const auto& light) { return is_whole(light, model.rig); }) &&
         static_cast<unsigned>(model.unit_source) <= static_cast<unsigned>(Model::UnitSource::millimetres) &&
         is_whole(model.rig, model.materials.size());
}

/// Returns the longest edge of the box around a model [m].
float longest_side(const Model& model) {
  const Eigen::AlignedBox3f box = model.bounds();
  return box.isEmpty() ? 0 : box.sizes().maxCoeff();
}

/// Returns the folders that a child may read: the given folders or, if there are none, the folder of the
/// file.
InputFolders readable(const std::filesystem::path& path, const InputFolders& folders) {
  return folders.folders().empty() ? InputFolders({path.parent_path()}) : folders;
}

void check_folder(const std::filesystem::path& path, const InputFolders& folders) {
  if (!folders.folders().empty() && !folders.contain(path)) throw FileError(outside_of_folders(path));
}

/// Returns the number of pictures in the folder of a model and its subfolders. The model may refer to these
/// pictures.
uint64_t pictures_beside(const std::filesystem::path& model) {
  constexpr int kMostEntries = 4096, kMostDepth = 2;
  namespace fs = std::filesystem;
  std::error_code error;
  uint64_t pictures = 0;
  int entries = 0;
  const fs::path folder = model.has_parent_path() ? model.parent_path() : ".";
  for (fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, error),
       end;
       entry != end && !error && ++entries <= kMostEntries; entry.increment(error)) {
    if (entry.depth() >= kMostDepth) entry.disable_recursion_pending();
    for (const char* ending : {".png", ".jpg", ".jpeg", ".webp", ".tga", ".bmp"})
      if (has_ending(entry->path(), ending)) ++pictures;
  }
  return pictures;
}

/// Returns the number of pictures inside a file. It counts the first bytes of PNG, JPEG and WebP pictures,
/// and data URIs. Counting stops when more pictures would not change the limits of the child.
uint64_t pictures_inside(const std::filesystem::path& model) {
  constexpr uint64_t kMostCounted = 32;
  constexpr std::size_t kBlock = std::size_t{1} << 20, kBehind = 16;
  const std::string_view starts[] = {"\x89PNG\r\n\x1a\n", "\xFF\xD8\xFF", "data:image/", "RIFF"};
  std::ifstream file(model, std::ios::binary);
  std::string block;
  uint64_t pictures = 0;
  for (std::streamoff from = 0; file.seekg(from) && pictures < kMostCounted;
       from += static_cast<std::streamoff>(kBlock)) {
    block.resize(kBlock + kBehind);
    file.read(block.data(), static_cast<std::streamsize>(block.size()));
    block.resize(static_cast<std::size_t>(file.gcount()));
    if (block.empty()) break;
    for (const std::string_view start : starts)
      for (std::size_t at = block.find(start); at < kBlock; at = block.find(start, at + 1))
        pictures += start != "RIFF" || (at + 12 <= block.size() && block.compare(at + 8, 4, "WEBP") == 0);
    file.clear();
  }
  return std::min(pictures, kMostCounted);
}

uint64_t checked_size(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw FileError(path.string() + ": there is no such file");
  if (!std::filesystem::is_regular_file(path, error))
    throw FileError(path.string() + ": is not a regular file");
  const uint64_t size = std::filesystem::file_size(path, error);
  if (error) throw FileError(path.string() + ": cannot be read: " + error.message());
  if (size == 0) throw FileError(path.string() + ": is empty");
  if (size > kMaxMeshBytes) throw FileError(path.string() + ": is larger than 2 GiB");
  return size;
}

/// Runs `import` with the folders that the model at `path` may read, in a child process whose memory and time
/// are limited by the sizes of the file and its pictures. Returns the bytes that it writes to its descriptor.
ChildAnswer import_confined(const std::filesystem::path& path, const InputFolders& folders,
                            const StopTest& stop,
                            const std::function<void(int, const InputFolders&)>& import) {
  check_folder(path, folders);
  const uint64_t size = checked_size(path);
  const InputFolders allowed = readable(path, folders);
  return run_confined({.what = path.string(),
                       .file_bytes = size,
                       .pictures = pictures_beside(path) + pictures_inside(path),
                       .folders = &allowed,
                       .stop = stop},
                      [&](int memory) { import(memory, allowed); });
}

}  // namespace

std::vector<std::string> missing_model_libraries() {
  std::vector<std::string> missing;
  if (!has_draco()) missing.emplace_back("libdraco-dev");
  if (!has_meshopt()) missing.emplace_back("libmeshoptimizer-dev");
  if (!has_webp()) missing.emplace_back("libwebp-dev");
  return missing;
}

std::string outside_of_folders(const std::filesystem::path& path) {
  return path.string() + ": is outside of the scene's folder; allow its folder with --allow DIR";
}

ModelPath split_node(const std::filesystem::path& path) {
  const std::string text = path.string();
  const std::size_t mark = text.rfind('#');
  std::error_code error;
  if (mark == std::string::npos || std::filesystem::exists(path, error)) return {path, ""};
  return {text.substr(0, mark), text.substr(mark + 1)};
}

void write_model(Model& model, int fd) {
  Writer writer(fd);
  transfer(writer, model);
}

Model decode_model(std::span<const uint8_t> bytes) {
  Model model;
  Reader reader(bytes);
  transfer(reader, model);
  if (!is_whole(model)) throw damaged_answer();
  return model;
}

Model read_model(const std::filesystem::path& file, const InputFolders& folders, const StopTest& stop,
                 bool with_rig) {
  const ModelPath place = split_node(file);
  const ChildAnswer answer =
      import_confined(place.file, folders, stop, [&](int memory, const InputFolders& allowed) {
        Model model = import_model(place.file, place.node, allowed, with_rig);
        write_model(model, memory);
      });
  Model model = decode_model(answer.bytes());
  for (Model::Part& part : model.parts) {
    if (part.mesh.normals.empty()) compute_normals(part.mesh);
  }
  if (place.node.empty()) model.file_size = longest_side(model);
  return model;
}

float read_file_size(const std::filesystem::path& file, const InputFolders& folders, const StopTest& stop) {
  const std::filesystem::path path = split_node(file).file;
  const ChildAnswer answer =
      import_confined(path, folders, stop, [&](int memory, const InputFolders& allowed) {
        float side = longest_side(import_model(path, "", allowed, false));
        Writer(memory).value(side);
      });
  float side = 0;
  Reader(answer.bytes()).value(side);
  if (!std::isfinite(side)) throw damaged_answer();
  return side;
}

PointCloud read_points(const std::filesystem::path& path, const InputFolders& folders, const StopTest& stop) {
  check_folder(path, folders);
  const bool is_ply = has_ending(path, ".ply");
  if (!is_ply && !has_ending(path, ".obj"))
    throw FileError(path.string() + ": point clouds are PLY or OBJ files");
  const uint64_t size = checked_size(path);
  const InputFolders allowed = readable(path, folders);
  const ChildAnswer answer = run_confined(
      {.what = path.string(), .file_bytes = size, .folders = &allowed, .stop = stop}, [&](int memory) {
        const std::vector<uint8_t> bytes = read_file(path, kMaxMeshBytes);
        PointCloud cloud;
        try {
          cloud = is_ply ? parse_ply_points(bytes) : parse_obj_points(bytes);
        } catch (const FileError& error) {
          throw FileError(path.string() + ": cannot be read as a point cloud: " + error.what());
        }
        Writer writer(memory);
        writer.array(cloud.positions);
        writer.array(cloud.colors);
      });
  PointCloud cloud;
  Reader reader(answer.bytes());
  reader.array(cloud.positions);
  reader.array(cloud.colors);
  const bool whole = cloud.colors.empty() || cloud.colors.size() == cloud.positions.size();
  if (!whole || !std::ranges::all_of(cloud.positions, [](const Vector3f& p) { return p.allFinite(); }) ||
      !std::ranges::all_of(cloud.colors, [](const Vector4f& c) { return c.allFinite(); }))
    throw damaged_answer();
  if (cloud.positions.empty()) throw FileError(path.string() + ": has no points");
  return cloud;
}

Image read_texture(const std::filesystem::path& path, const InputFolders& folders, const StopTest& stop) {
  check_folder(path, folders);
  const uint64_t size = checked_size(path);
  const InputFolders allowed = readable(path, folders);
  const ChildAnswer answer = run_confined(
      {.what = path.string(), .file_bytes = size, .folders = &allowed, .stop = stop}, [&](int memory) {
        Image image = read_image(path, kMaxTexturePixels);
        Writer writer(memory);
        transfer_image(writer, image);
      });
  Image image;
  Reader reader(answer.bytes());
  transfer_image(reader, image);
  if (!is_whole(image)) throw damaged_answer();
  return image;
}

LightImage read_light_image(const std::filesystem::path& path, const InputFolders& folders,
                            const StopTest& stop) {
  check_folder(path, folders);
  const uint64_t size = checked_size(path);
  const InputFolders allowed = readable(path, folders);
  const auto transfer_light = [](auto& archive, LightImage& light) {
    archive.value(light.image.width_px);
    archive.value(light.image.height_px);
    archive.array(light.image.rgba);
    archive.list(light.warnings, [&](std::string& line) { archive.array(line); });
  };
  // A picture of 16 bits or of floats takes more memory than its file suggests, so it counts as eight
  // pictures.
  const ChildAnswer answer = run_confined(
      {.what = path.string(), .file_bytes = size, .pictures = 8, .folders = &allowed, .stop = stop},
      [&](int memory) {
        LightImage light = decode_light_image(read_file(path, kMaxMeshBytes), path.string());
        Writer writer(memory);
        transfer_light(writer, light);
      });
  LightImage light;
  Reader reader(answer.bytes());
  transfer_light(reader, light);
  const HdrImage& image = light.image;
  if (image.width_px < 1 || image.height_px < 1 || image.rgba.size() != 4 * image.pixel_count() ||
      !std::ranges::all_of(image.rgba, [](float value) { return std::isfinite(value) && value >= 0; }))
    throw damaged_answer();
  return light;
}

}  // namespace offstage::render
