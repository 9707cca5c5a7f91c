#include "sim/geometry/convex_decomposition.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "sim/geometry/mass_properties.h"
#include "tests/meshes.h"
#include "tests/random.h"
#include "tests/solids.h"

namespace offstage::sim {
namespace {

using Method = ConvexDecomposition::Method;

/// One part suffices where the exact method fails.
constexpr DecompositionSettings kExactOnly{.method = DecompositionMethod::exact, .max_parts = 1};

ConvexDecomposition decomposed(const TriangleMesh& mesh, const DecompositionSettings& settings = kExactOnly) {
  return decompose(mesh, MeshTopology(mesh), settings);
}

Real extent(const TriangleMesh& mesh) {
  Aabb box;
  for (const Vec3& v : mesh.vertices) box.extend(v);
  return box.diagonal().norm();
}

Real total_volume(const ConvexDecomposition& d) {
  Real sum = 0;
  for (const ConvexPolyhedron& p : d.parts) sum += mass_properties(p.triangles()).volume;
  return sum;
}

void expect_exact(const ConvexDecomposition& d, Real volume, Real size) {
  EXPECT_TRUE(d.method == Method::exact || d.method == Method::convex) << d.note;
  EXPECT_EQ(d.note, "");
  EXPECT_NEAR(total_volume(d) / volume, 1, 1e-9);
  for (const ConvexPolyhedron& p : d.parts) EXPECT_LE(concavity(p), 1e-9 * size);
}

/// Returns the winding number of the surface about a point, as the sum of all solid angles.
Real winding(const TriangleMesh& mesh, const Vec3& p) {
  Real sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = (mesh.vertices[t[0]] - p).normalized(), b = (mesh.vertices[t[1]] - p).normalized(),
               c = (mesh.vertices[t[2]] - p).normalized();
    sum += 2 * std::atan2(a.dot(b.cross(c)), 1 + a.dot(b) + b.dot(c) + c.dot(a));
  }
  return sum / (4 * std::numbers::pi);
}

/// Returns the height of a point over the highest face plane; negative inside.
Real height_over(const ConvexPolyhedron& part, const Vec3& p) {
  Real height = -std::numeric_limits<Real>::infinity();
  for (uint32_t f = 0; f < part.face_count(); ++f)
    height = std::max(height, part.plane(f).normal.dot(p) - part.plane(f).offset);
  return height;
}

/// Returns random points in the bounding box of a mesh.
std::vector<Vec3> scattered_points(const TriangleMesh& mesh, uint64_t count) {
  Aabb box;
  for (const Vec3& v : mesh.vertices) box.extend(v);
  const Scatter random{7};
  std::vector<Vec3> points;
  for (uint64_t i = 0; i < count; ++i)
    points.push_back(box.min() + box.sizes().cwiseProduct(
                                     Vec3(random.uniform(i, 0), random.uniform(i, 1), random.uniform(i, 2))));
  return points;
}

/// Checks that every point inside the solid is in exactly one part, and that no other point is in any.
void expect_tiling(const TriangleMesh& mesh, const ConvexDecomposition& d) {
  const Real margin = 1e-6 * extent(mesh);
  for (const Vec3& p : scattered_points(mesh, 2000)) {
    int inside = 0;
    bool on_border = false;
    for (const ConvexPolyhedron& part : d.parts) {
      const Real height = height_over(part, p);
      inside += height < 0;
      on_border |= std::abs(height) < margin;
    }
    if (on_border) continue;
    ASSERT_EQ(inside, static_cast<int>(std::lround(winding(mesh, p)))) << p.transpose();
  }
}

struct SampleSolid {
  const char* name;
  TriangleMesh mesh;
  Real volume;
  std::size_t parts;  // number of parts that suffices
};

Real prism_volume(uint32_t points, Real outer, Real inner, Real height) {
  return points * outer * inner * std::sin(std::numbers::pi / points) * height;
}

std::vector<SampleSolid> solids() {
  return {{"L", l_solid(), 3, 2},
          {"U", u_solid(), 7, 3},
          {"cross", cross_solid(), 5, 3},
          {"jack", jack_solid(), 7, 5},
          {"stairs", stairs(), 30, 5},
          {"frame", frame(), 32, 5},
          {"notch", notched_box(), 5, 3},
          {"pocket", pocketed_box(), 17, 5},
          {"sponge", sponge(), 20, 12},
          {"star 5", star_prism(5, 1, 0.4, 0.5), prism_volume(5, 1, 0.4, 0.5), 6},
          {"star 12", star_prism(12, 1, 0.7, 0.5), prism_volume(12, 1, 0.7, 0.5), 12},
          {"bowl", bowl(1, 0.8, 12, 4), mass_properties(bowl(1, 0.8, 12, 4)).volume, 48},
          {"torus", torus_mesh(1, 0.3, 12, 8), mass_properties(torus_mesh(1, 0.3, 12, 8)).volume, 12}};
}

TEST(Decomposition, IsExactInAnyPoseAndSize) {
  for (const SampleSolid& s : solids()) {
    SCOPED_TRACE(s.name);
    for (Real scale : {0.01, 1.0, 100.0})
      for (uint64_t seed = 0; seed < 4; ++seed) {
        const TriangleMesh mesh = placed_at_random(s.mesh, scale, seed);
        const ConvexDecomposition d = decomposed(mesh);
        EXPECT_EQ(d.method, Method::exact) << d.note;
        expect_exact(d, s.volume * scale * scale * scale, extent(mesh));
        EXPECT_LE(d.parts.size(), s.parts);
      }
  }
}

TEST(Decomposition, PartsTileTheSolid) {
  for (const SampleSolid& s : solids()) {
    SCOPED_TRACE(s.name);
    const TriangleMesh mesh = placed_at_random(s.mesh, 1, 5);
    expect_tiling(mesh, decomposed(mesh));
  }
}

TEST(Decomposition, PartsShareTheCornersOfACutBitwise) {
  const ConvexDecomposition d = decomposed(placed_at_random(l_solid(), 1, 3));
  ASSERT_EQ(d.parts.size(), 2u);
  int shared = 0;
  for (const Vec3& v : d.parts[0].vertices())
    shared += std::find(d.parts[1].vertices().begin(), d.parts[1].vertices().end(), v) !=
              d.parts[1].vertices().end();
  EXPECT_GE(shared, 2);  // at least the corners of the reflex edge
}

/// Returns an L-shaped prism whose caps are triangulated by cutting ears, as model readers do. The third ear
/// of each cap has three corners on one line.
TriangleMesh l_prism_of_ears() {
  const std::array<std::array<Real, 2>, 6> outline = {{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}};
  TriangleMesh mesh;
  for (const Real z : {0.0, 1.0})
    for (const auto& [x, y] : outline) mesh.vertices.emplace_back(x, y, z);
  for (const auto& [a, b, c] : {Triangle{1, 2, 3}, Triangle{3, 4, 5}, Triangle{1, 3, 5}, Triangle{0, 1, 5}}) {
    mesh.triangles.push_back({c, b, a});
    mesh.triangles.push_back({a + 6, b + 6, c + 6});
  }
  for (uint32_t i = 0; i < 6; ++i) {
    const uint32_t j = (i + 1) % 6;
    mesh.triangles.push_back({i, j, j + 6});
    mesh.triangles.push_back({i, j + 6, i + 6});
  }
  return mesh;
}

TEST(Decomposition, SliversOfCapsDoNotMatter) {
  for (uint64_t pose = 0; pose < 20; ++pose) {
    SCOPED_TRACE(pose);
    TriangleMesh mesh = placed_at_random(l_prism_of_ears(), 1, pose);
    for (Vec3& v : mesh.vertices) v = v.cast<float>().cast<double>();
    const ConvexDecomposition d = decomposed(mesh);
    EXPECT_EQ(d.method, Method::exact) << d.note;
    EXPECT_EQ(d.parts.size(), 2u);
    EXPECT_NEAR(total_volume(d), 3, 3e-6);
  }
}

TEST(Decomposition, FineToriAndBowlsAreExact) {
  const TriangleMesh torus = torus_mesh(1, 0.3, 64, 32);
  const ConvexDecomposition ring = decomposed(torus);
  EXPECT_EQ(ring.method, Method::exact) << ring.note;
  EXPECT_EQ(ring.parts.size(), 64u);
  EXPECT_NEAR(total_volume(ring), mass_properties(torus).volume, 1e-6);
  EXPECT_EQ(decomposed(torus, {}).method, Method::exact);  // within the default number of parts
  const TriangleMesh shell = bowl(1, 0.8, 24, 8);
  const ConvexDecomposition pieces = decomposed(shell);
  EXPECT_EQ(pieces.method, Method::exact) << pieces.note;
  EXPECT_LE(pieces.parts.size(), 24u * 8u);
  EXPECT_NEAR(total_volume(pieces), mass_properties(shell).volume, 1e-6);
}

// Unions of random cubes have many coplanar faces, collinear edges, tunnels and corners that touch.
TEST(Decomposition, RandomPolycubes) {
  int exact = 0;
  for (uint64_t seed = 0; seed < 400; ++seed) {
    const Scatter random{seed};
    int count = 0;
    const auto filled = [&](int i, int j, int k) {
      return random.uniform(static_cast<uint64_t>(16 * i + 4 * j + k), 0) < 0.85;
    };
    for (int i = 0; i < 48; ++i) count += filled(i / 12, i / 3 % 4, i % 3);
    const TriangleMesh mesh = placed_at_random(cubes(4, 4, 3, filled), 1, seed);
    if (!MeshTopology(mesh).defects().closed()) continue;  // cubes that touch only along an edge
    const ConvexDecomposition d = decomposed(mesh);
    if (d.note == "a cavity inside") continue;
    SCOPED_TRACE(seed);
    expect_exact(d, count, extent(mesh));
    ++exact;
  }
  EXPECT_GT(exact, 20);
}

// Every face of a ball with random radii has its own plane, and about half of the edges are reflex.
TEST(Decomposition, CrumpledBalls) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    TriangleMesh mesh = sphere_mesh(1, 6, 4);
    const Scatter random{seed};
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
      mesh.vertices[v] *= 0.6 + 0.8 * random.uniform(v, 3);
    SCOPED_TRACE(seed);
    const ConvexDecomposition d = decomposed(mesh);
    expect_exact(d, mass_properties(mesh).volume, extent(mesh));
    expect_tiling(mesh, d);
  }
}

TEST(Decomposition, SinglePrecisionCoordinatesAreFlatEnough) {
  for (const SampleSolid& s : solids()) {
    SCOPED_TRACE(s.name);
    TriangleMesh mesh = placed_at_random(s.mesh, 1, 11);
    for (Vec3& v : mesh.vertices) v = v.cast<float>().cast<double>();
    const ConvexDecomposition d = decomposed(mesh);
    EXPECT_EQ(d.method, Method::exact) << d.note;
    EXPECT_LE(d.parts.size(), s.parts);
    EXPECT_LE(d.volume_error, 1e-6);
  }
}

TEST(Decomposition, ConvexSolidsStayWhole) {
  for (const TriangleMesh& mesh :
       {box_mesh(Vec3(1, 2, 3)), sphere_mesh(0.5, 16, 9), box_mesh(Vec3(1, 1, 1e-3))}) {
    const ConvexDecomposition d = decomposed(placed_at_random(mesh, 1, 2));
    EXPECT_EQ(d.method, Method::convex);
    ASSERT_EQ(d.parts.size(), 1u);
    EXPECT_LE(d.volume_error, 1e-12);
  }
}

TEST(Decomposition, SolidsApartAreTakenOneByOne) {
  TriangleMesh mesh = l_solid();
  const auto n = static_cast<uint32_t>(mesh.vertices.size());
  const TriangleMesh box = box_mesh(Vec3::Ones());
  for (const Vec3& v : box.vertices) mesh.vertices.push_back(v + Vec3(1.5, 1.5, 0.5));  // shares no vertex
  for (const Triangle& t : box.triangles) mesh.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
  const ConvexDecomposition d = decomposed(mesh);
  EXPECT_EQ(d.parts.size(), 3u);
  expect_exact(d, 4, extent(mesh));
}

TEST(Decomposition, InsideOutIsTheSameSolid) {
  TriangleMesh mesh = u_solid();
  for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
  const ConvexDecomposition d = decomposed(mesh);
  EXPECT_EQ(d.parts.size(), 3u);
  expect_exact(d, 7, extent(mesh));
}

TEST(Decomposition, PartsAreRebuiltBitwiseFromVerticesAndFaces) {
  for (const ConvexPolyhedron& p : decomposed(bowl(1, 0.8, 12, 4)).parts) {
    std::vector<std::vector<uint32_t>> faces;
    for (uint32_t f = 0; f < p.face_count(); ++f)
      faces.emplace_back(p.face_vertices(f).begin(), p.face_vertices(f).end());
    const ConvexPolyhedron q({p.vertices().begin(), p.vertices().end()}, faces);
    for (uint32_t f = 0; f < p.face_count(); ++f) {
      EXPECT_EQ(p.plane(f).normal, q.plane(f).normal);
      EXPECT_EQ(p.plane(f).offset, q.plane(f).offset);
    }
    EXPECT_EQ(p.centre(), q.centre());
    EXPECT_EQ(p.reach(), q.reach());
  }
}

/// Returns the fraction of the points inside the surface that lie in some part.
Real covered(const TriangleMesh& mesh, const ConvexDecomposition& d, uint64_t points) {
  int inside = 0, held = 0;
  for (const Vec3& p : scattered_points(mesh, points)) {
    if (winding(mesh, p) < 0.6) continue;
    ++inside;
    held += std::any_of(d.parts.begin(), d.parts.end(),
                        [&](const ConvexPolyhedron& part) { return height_over(part, p) < 1e-9; });
  }
  return static_cast<Real>(held) / inside;
}

/// Returns the greatest height of a point of the surface over the part that is nearest, as a fraction of the
/// mesh's extent.
Real greatest_gap(const TriangleMesh& mesh, const ConvexDecomposition& d) {
  Real gap = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    for (const Vec3& p : {a, Vec3((a + b) / 2), Vec3((a + b + c) / 3)}) {
      Real least = extent(mesh);
      for (const ConvexPolyhedron& part : d.parts) least = std::min(least, height_over(part, p));
      gap = std::max(gap, least);
    }
  }
  return gap / extent(mesh);
}

/// Trimmed hulls lose at most this fraction of the solid: rims around hollows, which lie about as far outside
/// of the hull as the ground of the hollow lies inside. A limit of 0.01 leaves 7.7 % more volume than the
/// model in the bowl that comes with offstage, and 8.0 % in the goblet; 0.03 leaves 3.3 and 4.3 %.
constexpr Real kMostUncovered = 0.03;
/// No rim lies farther outside than this fraction of the extent.
constexpr Real kDeepestGap = 0.02;

TEST(ApproximateDecomposition, HolesAreBridgedAndSidesStaySmooth) {
  TriangleMesh mesh = placed_at_random(u_solid(), 1, 4);
  mesh.triangles.pop_back();
  const ConvexDecomposition d = decomposed(mesh, {.max_error = 0.001, .resolution = 32});
  EXPECT_EQ(d.method, Method::approximate);
  EXPECT_EQ(d.note, "3 border edges");
  EXPECT_EQ(d.parts.size(), 3u);
  EXPECT_NEAR(total_volume(d), 7, 1e-6);
  EXPECT_GT(covered(mesh, d, 2000), 0.999);
  // The parts keep the corners of the surface, without voxel steps.
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    EXPECT_TRUE(std::any_of(d.parts.begin(), d.parts.end(), [&](const ConvexPolyhedron& part) {
      return std::abs(height_over(part, mesh.vertices[v])) < 1e-9;
    }));
}

TEST(ApproximateDecomposition, CubesJoinedAlongAnEdge) {
  const TriangleMesh mesh = cubes(2, 2, 1, [](int i, int j, int) { return i == j; });
  const ConvexDecomposition d = decomposed(mesh, {});
  EXPECT_EQ(d.method, Method::approximate);
  EXPECT_EQ(d.note, "1 non-manifold edge");
  EXPECT_EQ(d.parts.size(), 2u);
  EXPECT_NEAR(total_volume(d), 2, 1e-9);
}

TEST(ApproximateDecomposition, CavitiesAndTooManyReflexEdges) {
  const ConvexDecomposition hollow = decomposed(hollow_box(), {.max_error = 0.001});
  EXPECT_EQ(hollow.method, Method::approximate);
  EXPECT_EQ(hollow.note, "a cavity inside");
  EXPECT_NEAR(total_volume(hollow), 26, 1e-6);  // cuts along the sides of the cavity
  EXPECT_LE(hollow.difference, 0.001);
  expect_tiling(hollow_box(), hollow);

  const TriangleMesh torus = torus_mesh(1, 0.3, 24, 16);
  const ConvexDecomposition ring = decomposed(torus, {.max_reflex_edges = 100});
  EXPECT_EQ(ring.method, Method::approximate);
  EXPECT_EQ(ring.note, "192 reflex edges, more than 100");
  EXPECT_LE(ring.parts.size(), 16u);
  EXPECT_LE(ring.difference, 0.05);
  EXPECT_LE(ring.volume_error, ring.difference);
  EXPECT_GT(covered(torus, ring, 2000), 1 - kMostUncovered);
  EXPECT_LE(greatest_gap(torus, ring), kDeepestGap);
}

TEST(ApproximateDecomposition, SurfacesWithoutInsideHaveNoParts) {
  TriangleMesh terrain;
  for (uint32_t i = 0; i < 9; ++i)
    for (uint32_t j = 0; j < 9; ++j)
      terrain.vertices.emplace_back(i, 0.3 * std::sin(1.3 * i) * std::cos(0.7 * j), j);
  for (uint32_t i = 0; i < 8; ++i)
    for (uint32_t j = 0; j < 8; ++j) {
      const uint32_t a = 9 * i + j;
      terrain.triangles.push_back({a, a + 1, a + 9});
      terrain.triangles.push_back({a + 1, a + 10, a + 9});
    }
  const ConvexDecomposition d = decomposed(terrain);
  EXPECT_EQ(d.method, Method::none);
  EXPECT_TRUE(d.parts.empty());
  EXPECT_EQ(d.note, "the surface encloses no volume: 32 border edges");
  EXPECT_EQ(decomposed({}).method, Method::none);
  EXPECT_EQ(decomposed({{Vec3::Ones(), Vec3::Ones(), Vec3::Ones()}, {{0, 1, 2}}}).method, Method::none);
  // A two-sided sheet is closed but has no volume.
  EXPECT_EQ(decomposed({{Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY()}, {{0, 1, 2}, {0, 2, 1}}}).method,
            Method::none);
}

TEST(ApproximateDecomposition, IsTheSameOnAnyNumberOfThreads) {
  TriangleMesh mesh = jack_solid();
  mesh.triangles.pop_back();
  const DecompositionSettings coarse{.max_parts = 5, .most_parts = 5, .resolution = 24};
  ConvexDecomposition one, many = decomposed(mesh, coarse);
  tbb::task_arena(1).execute([&] { one = decomposed(mesh, coarse); });
  ASSERT_EQ(one.parts.size(), many.parts.size());
  for (std::size_t k = 0; k < one.parts.size(); ++k)
    EXPECT_TRUE(std::ranges::equal(one.parts[k].vertices(), many.parts[k].vertices()));
}

/// Returns the volume in which the parts and the solid differ, by random points, as a fraction of the
/// solid's.
Real sampled_difference(const TriangleMesh& mesh, const ConvexDecomposition& d, uint64_t points) {
  int inside = 0, different = 0;
  for (const Vec3& p : scattered_points(mesh, points)) {
    const bool in_solid = winding(mesh, p) > 0.5;
    const bool in_parts = std::any_of(d.parts.begin(), d.parts.end(),
                                      [&](const ConvexPolyhedron& part) { return height_over(part, p) < 0; });
    inside += in_solid;
    different += in_solid != in_parts;
  }
  return static_cast<Real>(different) / inside;
}

TEST(ApproximateDecomposition, DiffersAsMuchAsItSays) {
  const struct {
    const char* name;
    TriangleMesh mesh;
    std::size_t parts;
  } solids[] = {{"torus", torus_mesh(1, 0.3, 24, 16), 16},
                {"gear", star_prism(12, 1, 0.7, 0.5), 14},
                {"thick bowl", bowl(1, 0.8, 24, 12), 48},
                {"L", l_solid(), 2},
                {"sponge", sponge(), 12}};
  for (const auto& solid : solids) {
    SCOPED_TRACE(solid.name);
    const TriangleMesh mesh = placed_at_random(solid.mesh, 1, 3);
    const ConvexDecomposition d = decomposed(mesh, {.method = DecompositionMethod::approximate});
    EXPECT_EQ(d.method, Method::approximate);
    EXPECT_LE(d.parts.size(), solid.parts);
    EXPECT_LE(d.difference, 0.05);
    EXPECT_LE(d.volume_error, d.difference + 1e-9);
    EXPECT_LE(sampled_difference(mesh, d, 4000), d.difference + 0.015);  // three standard deviations
    EXPECT_GT(covered(mesh, d, 4000), 1 - kMostUncovered);
    EXPECT_LE(greatest_gap(mesh, d), kDeepestGap);
    for (const ConvexPolyhedron& p : d.parts) EXPECT_LE(concavity(p), 1e-9 * extent(mesh));
  }
}

TEST(ApproximateDecomposition, AutomaticIsExactWithinTheMostParts) {
  const TriangleMesh stair = stairs();
  EXPECT_EQ(decomposed(stair, {}).method, Method::exact);
  const ConvexDecomposition few = decomposed(stair, {.max_parts = 3, .most_parts = 3});
  EXPECT_EQ(few.method, Method::approximate);
  EXPECT_EQ(few.note, "more than 3 exact parts");
  EXPECT_LE(few.parts.size(), 3u);
}

TEST(ApproximateDecomposition, OverlappingSolidsAreMeasuredAsTheirUnion) {
  TriangleMesh mesh = box_mesh(Vec3(4, 1, 1));
  const TriangleMesh other = box_mesh(Vec3(1, 4, 1));
  for (const Vec3& v : other.vertices) mesh.vertices.push_back(v);
  for (const Triangle& t : other.triangles) mesh.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  EXPECT_EQ(decomposed(mesh, {}).method, Method::exact);
  const ConvexDecomposition d = decomposed(mesh, {.method = DecompositionMethod::approximate});
  EXPECT_EQ(d.parts.size(), 2u);
  EXPECT_LE(d.difference, 0.01);
}

// A thin shell has hollows that no cut removes; its parts hold it all the same.
TEST(ApproximateDecomposition, ThinBowlsKeepTheirVolumeAndTheirGround) {
  const TriangleMesh mesh = placed_at_random(bowl(1, 0.92, 32, 16), 1, 3);
  const ConvexDecomposition d =
      decomposed(mesh, {.method = DecompositionMethod::approximate, .most_parts = 64});
  EXPECT_LE(d.parts.size(), 64u);
  EXPECT_LE(d.volume_error, 0.05);
  EXPECT_GT(covered(mesh, d, 8000), 1 - kMostUncovered);
  EXPECT_LE(greatest_gap(mesh, d), kDeepestGap);
}

// Of a dome of the thickness t and the radius r, a part with the area A differs by at least A / (8 pi r t) of
// its volume: its inner side is at best flat (docs/models.md).
TEST(ApproximateDecomposition, DomesTakeAtMostTwiceTheLeastNumberOfParts) {
  const Real thickness = 0.05, radius = 1 - thickness / 2, error = 0.05;
  const ConvexDecomposition d = decomposed(bowl(1, 1 - thickness, 48, 24), {.max_error = error});
  const Real least =
      2 * std::numbers::pi * radius * radius / (8 * std::numbers::pi * radius * thickness * error);
  EXPECT_LE(d.difference, error);
  EXPECT_GT(static_cast<Real>(d.parts.size()), least);
  EXPECT_LT(static_cast<Real>(d.parts.size()), 2 * least);
}

// The water of a fountain: a flat sheet beside the solid, and one through it.
TEST(ApproximateDecomposition, SheetsBesideASolidDoNotCount) {
  TriangleMesh mesh = u_solid();
  const Real volume = mass_properties(mesh).volume;
  for (const Real z : {0.5, 4.0}) {
    const auto first = static_cast<uint32_t>(mesh.vertices.size());
    for (const auto& [x, y] : {std::pair{0.1, 0.1}, std::pair{0.9, 0.1}, std::pair{0.5, 0.8}})
      mesh.vertices.emplace_back(x, y, z);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  const ConvexDecomposition d = decomposed(mesh, {});
  EXPECT_EQ(d.note, "6 border edges");
  EXPECT_EQ(d.parts.size(), 3u);
  EXPECT_NEAR(total_volume(d), volume, 1e-6);
}

TEST(ApproximateDecomposition, HullIsOnePart) {
  const ConvexDecomposition d = decomposed(l_solid(), {.method = DecompositionMethod::hull});
  EXPECT_EQ(d.method, Method::hull);
  ASSERT_EQ(d.parts.size(), 1u);
  EXPECT_NEAR(d.volume_error, 0.5 / 3, 1e-9);
}

// Triangles between random points: open, intersecting, with edges of many faces.
TEST(ApproximateDecomposition, AnyTrianglesGiveAResult) {
  for (uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const Scatter random{seed};
    TriangleMesh mesh;
    const uint64_t points = 5 + seed % 12;
    for (uint64_t i = 0; i < points; ++i)
      mesh.vertices.emplace_back(random.uniform(i, 0), random.uniform(i, 1),
                                 seed % 5 == 0 ? 0 : random.uniform(i, 2));
    const auto pick = [&](uint64_t t, uint64_t k) {
      return static_cast<uint32_t>(random.uniform(100 + t, k) * static_cast<Real>(points));
    };
    for (uint64_t t = 0; t < 30; ++t) mesh.triangles.push_back({pick(t, 0), pick(t, 1), pick(t, 2)});
    mesh = weld(mesh);
    const ConvexDecomposition d = decomposed(mesh, {.max_parts = 6, .most_parts = 6, .resolution = 12});
    EXPECT_LE(d.parts.size(), 6u);
    for (const ConvexPolyhedron& p : d.parts) EXPECT_TRUE(p.centre().allFinite());
    EXPECT_TRUE(std::isfinite(d.difference) && std::isfinite(d.volume_error));
  }
}

TriangleMesh read_obj(const std::filesystem::path& file) {
  TriangleMesh mesh;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "v") {
      Vec3 v;
      words >> v.x() >> v.y() >> v.z();
      mesh.vertices.push_back(v);
    } else if (word == "f") {
      std::vector<uint32_t> corners;
      while (words >> word) corners.push_back(static_cast<uint32_t>(std::stoul(word)) - 1);
      for (std::size_t k = 1; k + 1 < corners.size(); ++k)
        mesh.triangles.push_back({corners[0], corners[k], corners[k + 1]});
    }
  }
  return weld(mesh);
}

TEST(LongDecomposition, RealMeshes) {
  const char* folder = std::getenv("OFFSTAGE_MESHES");
  ASSERT_NE(folder, nullptr)
      << "OFFSTAGE_MESHES must name a folder of scans: tests/run.sh --long fetches them";
  int read = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".obj") continue;
    SCOPED_TRACE(entry.path().filename().string());
    const TriangleMesh mesh = read_obj(entry.path());
    const ConvexDecomposition d = decomposed(mesh, {});
    ++read;
    EXPECT_NE(d.method, Method::none) << d.note;
    if (d.method != Method::approximate) continue;
    EXPECT_LE(d.parts.size(), DecompositionSettings().most_parts);
    // Of thin solids about 300 of the points are inside: three standard deviations are 0.03.
    EXPECT_GT(covered(mesh, d, 3000), 1 - kMostUncovered - 0.03);
    // Open sheets beside a solid have no parts.
    const bool closed = MeshTopology(mesh).defects().closed();
    EXPECT_LE(closed ? greatest_gap(mesh, d) : 0, kDeepestGap);
    EXPECT_LE(d.volume_error, 0.1);
    for (const ConvexPolyhedron& p : d.parts) EXPECT_LE(concavity(p), 1e-9 * extent(mesh));
  }
  EXPECT_GT(read, 0);
}

}  // namespace
}  // namespace offstage::sim
