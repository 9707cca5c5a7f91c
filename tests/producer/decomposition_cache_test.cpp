#include "producer/build/decomposition_cache.h"

#include <algorithm>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/meshes.h"
#include "tests/render/scratch.h"

namespace offstage::producer {
namespace {

using render::ScratchFolder;

bool equal(const sim::ConvexDecomposition& a, const sim::ConvexDecomposition& b) {
  if (a.method != b.method || a.volume_error != b.volume_error || a.note != b.note) return false;
  return std::ranges::equal(
      a.parts, b.parts, [](const sim::ConvexPolyhedron& p, const sim::ConvexPolyhedron& q) {
        if (!std::ranges::equal(p.vertices(), q.vertices()) || p.face_count() != q.face_count()) return false;
        for (uint32_t f = 0; f < p.face_count(); ++f)
          if (!std::ranges::equal(p.face_vertices(f), q.face_vertices(f)) ||
              p.plane(f).normal != q.plane(f).normal || p.plane(f).offset != q.plane(f).offset)
            return false;
        return true;
      });
}

TEST(DecompositionCache, GivesBackEveryBit) {
  const ScratchFolder scratch;
  const DecompositionCache cache(scratch.path() / "cache");
  const sim::TriangleMesh mesh = sim::torus_mesh(1, 0.3, 8, 6);
  const auto made = cache.decompose(mesh);
  ASSERT_GT(made.parts.size(), 1u);
  ASSERT_TRUE(std::filesystem::exists(cache.file(mesh)));
  EXPECT_TRUE(equal(cache.decompose(mesh), made)) << "from disk";
  EXPECT_TRUE(equal(DecompositionCache().decompose(mesh), made)) << "without a cache";
}

TEST(DecompositionCache, AnotherMeshHasAnotherFile) {
  const DecompositionCache cache("/nowhere");
  sim::TriangleMesh mesh = sim::torus_mesh(1, 0.3, 8, 6);
  const auto before = cache.file(mesh);
  mesh.vertices[3].x() += 1e-15;
  EXPECT_NE(cache.file(mesh), before);
  EXPECT_TRUE(DecompositionCache().file(mesh).empty());
}

TEST(DecompositionCache, DamagedFilesAreMadeAgain) {
  const ScratchFolder scratch;
  const DecompositionCache cache(scratch.path());
  const sim::TriangleMesh mesh = sim::torus_mesh(1, 0.3, 8, 6);
  const auto made = cache.decompose(mesh);
  const auto size = std::filesystem::file_size(cache.file(mesh));
  std::filesystem::resize_file(cache.file(mesh), size / 2);
  EXPECT_TRUE(equal(cache.decompose(mesh), made));
  EXPECT_EQ(std::filesystem::file_size(cache.file(mesh)), size) << "the file is complete again";
  std::ofstream(cache.file(mesh)) << "something else altogether, longer than a header of thirty-two bytes";
  EXPECT_TRUE(equal(cache.decompose(mesh), made));
}

TEST(DecompositionCache, AFileOfAnotherMeshIsNotTaken) {
  const ScratchFolder scratch;
  const DecompositionCache cache(scratch.path());
  const sim::TriangleMesh mesh = sim::torus_mesh(1, 0.3, 8, 6), other = sim::torus_mesh(1, 0.4, 8, 6);
  const auto made = cache.decompose(mesh);
  cache.decompose(other);
  std::filesystem::rename(cache.file(other), cache.file(mesh));
  EXPECT_TRUE(equal(cache.decompose(mesh), made));
}

TEST(DecompositionCache, WorksInAReadOnlyFolder) {
  const DecompositionCache cache("/proc/offstage");
  EXPECT_GT(cache.decompose(sim::box_mesh(sim::Vec3(1, 2, 3))).parts.size(), 0u);
}

}  // namespace
}  // namespace offstage::producer
