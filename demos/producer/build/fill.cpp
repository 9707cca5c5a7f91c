#include "producer/build/fill.h"

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <type_traits>

#include "effects/random.h"
#include "sim/collision/collision_mesh.h"
#include "sim/collision/distance.h"

namespace offstage::producer {
namespace {

/// A closed model, and a search structure for distances to its surface.
struct SolidModel {
  explicit SolidModel(const sim::TriangleMesh& solid) : mesh(solid) {
    for (const Vec3& v : solid.vertices) box.extend(v);
  }
  sim::CollisionMesh mesh;
  sim::Aabb box;
};

/// Returns half the size of the box around a volume.
Vec3 half_size(const BoxFill& b) {
  return b.size / 2;
}
Vec3 half_size(const CylinderFill& c) {
  return {c.radius, c.height / 2, c.radius};
}
Vec3 half_size(const SphereFill& s) {
  return Vec3::Constant(s.radius);
}

Vec3 half_size(const SolidModel& m) {
  return m.box.sizes() / 2;
}

/// Returns the middle of the box around a volume.
template <class Volume>
Vec3 middle(const Volume& volume) {
  if constexpr (std::is_same_v<Volume, SolidModel>)
    return volume.box.center();
  else
    return Vec3::Zero();
}

/// Returns whether a ball with the centre p and the radius r is inside the volume.
bool holds(const BoxFill& b, const Vec3& p, Real r) {
  return ((b.size / 2 - p.cwiseAbs()).array() >= r).all();
}
bool holds(const CylinderFill& c, const Vec3& p, Real r) {
  return std::hypot(p.x(), p.z()) <= c.radius - r && std::abs(p.y()) <= c.height / 2 - r;
}
bool holds(const SphereFill& s, const Vec3& p, Real r) {
  return p.norm() <= s.radius - r;
}

bool holds(const SolidModel& m, const Vec3& p, Real r) {
  return sim::signed_distance(m.mesh, p).distance <= -r;
}

Real row_step(Real d, bool cubic) {
  return cubic ? d : d * std::numbers::sqrt3 / 2;
}
Real layer_step(Real d, bool cubic) {
  return cubic ? d : d * std::sqrt(2.0 / 3);
}

/// Calls `add` for the places of the closest packing of balls, or of a cubic grid, until it returns false.
/// The closest packing consists of layers of rows. Each row is shifted by half a step from the previous one,
/// and each second layer is shifted by a third of the distance of rows.
template <class Add>
void lay_lattice(const Vec3& half, Real d, bool cubic, Add&& add) {
  const Real row = row_step(d, cubic), layer = layer_step(d, cubic);
  constexpr Real kRounding = 1e-9;
  const auto steps = [&](Real length, Real step) {
    return length < 0 ? -1 : static_cast<int64_t>(std::floor(length / step + kRounding));
  };
  const Vec3 room = 2 * half - Vec3::Constant(d), low = -half + Vec3::Constant(d / 2);
  const int64_t layers = steps(room.y(), layer);
  for (int64_t k = 0; k <= layers; ++k) {
    const Real shift_z = !cubic && k % 2 == 1 ? row / 3 : 0;
    const int64_t rows = steps(room.z() - shift_z, row);
    for (int64_t j = 0; j <= rows; ++j) {
      const Real shift_x = !cubic && (j + k) % 2 == 1 ? d / 2 : 0;
      const int64_t columns = steps(room.x() - shift_x, d);
      for (int64_t i = 0; i <= columns; ++i)
        if (!add(low + Vec3(static_cast<Real>(i) * d + shift_x, static_cast<Real>(k) * layer,
                            static_cast<Real>(j) * row + shift_z)))
          return;
    }
  }
}

/// Calls `add` for random places (random sequential addition). Ends when many places in succession have no
/// room.
template <class Add>
void lay_random(const Vec3& half, Real d, uint64_t seed, Add&& add) {
  constexpr int kTries = 2000;
  const effects::RandomStream random(seed, effects::stream_id("fill"));
  using Cell = std::array<int64_t, 3>;
  std::map<Cell, std::vector<Vec3>> cells;
  const auto cell_of = [d](const Vec3& p) {
    return Cell{static_cast<int64_t>(std::floor(p.x() / d)), static_cast<int64_t>(std::floor(p.y() / d)),
                static_cast<int64_t>(std::floor(p.z() / d))};
  };
  const auto is_free = [&](const Vec3& p) {
    const Cell c = cell_of(p);
    for (int64_t x = -1; x <= 1; ++x)
      for (int64_t y = -1; y <= 1; ++y)
        for (int64_t z = -1; z <= 1; ++z)
          if (const auto near = cells.find({c[0] + x, c[1] + y, c[2] + z}); near != cells.end())
            for (const Vec3& q : near->second)
              if ((p - q).squaredNorm() < d * d) return false;
    return true;
  };
  int failures = 0;
  for (uint64_t number = 0; failures < kTries; ++number) {
    const auto u = [&](uint32_t axis) { return 2 * random.uniform(number, axis) - 1; };
    const Vec3 p = half.cwiseProduct(Vec3(u(0), u(1), u(2)));
    if (!is_free(p) || !add(p, true)) {
      ++failures;
      continue;
    }
    failures = 0;
    cells[cell_of(p)].push_back(p);
  }
}

}  // namespace

/// Returns whether a volume certainly has more than `most` places, or is much thinner than the spacing. The
/// number follows from the box around the volume, which is less than twice as large as a cylinder or ball in
/// it.
bool exceeds(const Vec3& half, const Fill& fill, Real spacing, std::size_t most) {
  const bool cubic = fill.packing == Packing::cubic;
  const Vec3 counts =
      (2 * half).cwiseQuotient(Vec3(spacing, layer_step(spacing, cubic), row_step(spacing, cubic)));
  return (counts + Vec3::Ones()).prod() > 8 * static_cast<Real>(most);
}

std::vector<Vec3> fill_places(const Fill& fill, Real spacing, std::size_t most) {
  std::vector<Vec3> places;
  constexpr Real kRounding = 1e-9;
  const auto fill_volume = [&](const auto& volume) {
    const Vec3 offset = middle(volume), half = half_size(volume);
    // Adds a place if it is inside. Returns whether the search continues; for a random place, returns whether
    // it was added.
    const auto add = [&](const Vec3& from_middle, bool random = false) {
      const Vec3 p = offset + from_middle;
      const bool inside = holds(volume, p, spacing / 2 * (1 - kRounding)) && places.size() <= most;
      if (inside) places.push_back(p);
      return random ? inside : places.size() <= most;
    };
    if (exceeds(half, fill, spacing, most)) {
      places.assign(most + 1, Vec3::Zero());
      return;
    }
    if (fill.packing == Packing::random)
      lay_random(half, spacing, fill.seed, add);
    else
      lay_lattice(half, spacing, fill.packing == Packing::cubic, add);
  };
  std::visit(
      [&](const auto& shape) {
        if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, MeshFill>) {
          if (!shape.solid.triangles.empty()) fill_volume(SolidModel(shape.solid));
        } else {
          fill_volume(shape);
        }
      },
      fill.shape);
  return places;
}

}  // namespace offstage::producer
