#include "producer/build/decomposition_cache.h"

#include <cstdlib>

#include <fmt/format.h>
#include <xxhash.h>

#include "producer/base/packed_file.h"
#include "render/image_io.h"

namespace offstage::producer {
namespace {

/// Increase the version whenever decompose() gives other results.
constexpr FileKind kPartsKind = {"offparts", 5, "convex decomposition"};

using sim::ConvexDecomposition;
using sim::ConvexPolyhedron;

/// Returns the bytes of a file with a decomposition. The file contains `mesh_hash`, a hash of the mesh and
/// the settings, so that a renamed file is not used for another mesh.
std::vector<uint8_t> serialize(const ConvexDecomposition& d, const XXH128_hash_t& mesh_hash) {
  ByteWriter out;
  out.put(uint64_t{mesh_hash.low64});
  out.put(uint64_t{mesh_hash.high64});
  out.put(static_cast<uint8_t>(d.method));
  out.put(d.volume_error);
  out.put(d.difference);
  out.put(uint64_t{d.note.size()});
  for (char c : d.note) out.put(c);
  out.put(uint64_t{d.parts.size()});
  for (const ConvexPolyhedron& part : d.parts) {
    out.put(uint64_t{part.vertices().size()});
    for (const sim::Vec3& v : part.vertices()) out.put(v);
    out.put(uint64_t{part.face_count()});
    for (uint32_t f = 0; f < part.face_count(); ++f) {
      out.put(uint64_t{part.face_vertices(f).size()});
      for (uint32_t v : part.face_vertices(f)) out.put(v);
    }
  }
  return pack(kPartsKind, out.bytes());
}

XXH128_hash_t hash_of(const sim::TriangleMesh& mesh, const sim::DecompositionSettings& settings) {
  static_assert(sizeof(sim::Vec3) == 24 && sizeof(sim::Triangle) == 12, "hashed as they lie in memory");
  XXH3_state_t* hash = XXH3_createState();
  XXH3_128bits_reset(hash);
  XXH3_128bits_update(hash, mesh.vertices.data(), mesh.vertices.size() * sizeof(sim::Vec3));
  XXH3_128bits_update(hash, mesh.triangles.data(), mesh.triangles.size() * sizeof(sim::Triangle));
  const auto add = [&](const auto& value) { XXH3_128bits_update(hash, &value, sizeof value); };
  add(settings.method);
  add(settings.min_dihedral);
  add(settings.min_distance);
  add(settings.max_reflex_edges);
  add(settings.max_error);
  add(settings.max_parts);
  add(settings.most_parts);
  add(settings.resolution);
  const XXH128_hash_t h = XXH3_128bits_digest(hash);
  XXH3_freeState(hash);
  return h;
}

ConvexPolyhedron take_part(ByteReader& in) {
  std::vector<sim::Vec3> vertices(in.take_count(sizeof(sim::Vec3)));
  for (sim::Vec3& v : vertices) v = in.take<sim::Vec3>();
  std::vector<std::vector<uint32_t>> faces(in.take_count(sizeof(uint64_t)));
  for (auto& face : faces) {
    face.resize(in.take_count(sizeof(uint32_t)));
    for (uint32_t& v : face) v = in.take<uint32_t>();
  }
  return {std::move(vertices), faces};
}

ConvexDecomposition decomposition_from(std::span<const uint8_t> bytes, const std::string& source,
                                       const XXH128_hash_t& mesh_hash) {
  const std::vector<uint8_t> payload = unpack(kPartsKind, bytes, source);
  ByteReader in(payload, source);
  const auto low = in.take<uint64_t>(), high = in.take<uint64_t>();
  if (low != mesh_hash.low64 || high != mesh_hash.high64)
    throw render::FileError(source + ": belongs to another mesh");
  ConvexDecomposition d;
  d.method = static_cast<ConvexDecomposition::Method>(in.take<uint8_t>());
  d.volume_error = in.take<double>();
  d.difference = in.take<double>();
  d.note.resize(in.take_count(1));
  for (char& c : d.note) c = in.take<char>();
  d.parts.resize(in.take_count(2 * sizeof(uint64_t)));
  for (ConvexPolyhedron& part : d.parts) part = take_part(in);
  in.expect_end();
  return d;
}

std::optional<ConvexDecomposition> read_kept(const std::filesystem::path& path,
                                             const XXH128_hash_t& mesh_hash) {
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    return decomposition_from(read_file(path), path.string(), mesh_hash);
  } catch (const render::FileError&) {
  } catch (const std::invalid_argument&) {  // the faces are not closed
  }
  return std::nullopt;
}

std::string name_of(const XXH128_hash_t& mesh_hash) {
  return fmt::format("{:016x}{:016x}-{}.parts", mesh_hash.high64, mesh_hash.low64, kPartsKind.version);
}

}  // namespace

DecompositionCache DecompositionCache::of_user() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return std::filesystem::path(value ? value : "");
  };
  if (const auto cache = variable("XDG_CACHE_HOME"); cache.is_absolute())
    return DecompositionCache(cache / "offstage");
  if (const auto home = variable("HOME"); home.is_absolute())
    return DecompositionCache(home / ".cache" / "offstage");
  return {};
}

std::filesystem::path DecompositionCache::file(const sim::TriangleMesh& mesh,
                                               const sim::DecompositionSettings& settings) const {
  return folder_.empty() ? std::filesystem::path() : folder_ / name_of(hash_of(mesh, settings));
}

ConvexDecomposition DecompositionCache::decompose(const sim::TriangleMesh& mesh,
                                                  const sim::DecompositionSettings& settings) const {
  if (folder_.empty()) return sim::decompose(mesh, sim::MeshTopology(mesh), settings);
  const XXH128_hash_t mesh_hash = hash_of(mesh, settings);
  const std::filesystem::path path = folder_ / name_of(mesh_hash);
  if (reads_)
    if (auto known = read_kept(path, mesh_hash)) return std::move(*known);
  ConvexDecomposition made = sim::decompose(mesh, sim::MeshTopology(mesh), settings);
  try {
    std::filesystem::create_directories(folder_);
    render::write_file_atomically(path, serialize(made, mesh_hash));
  } catch (const render::FileError&) {
  } catch (const std::filesystem::filesystem_error&) {
  }
  return made;
}

}  // namespace offstage::producer
