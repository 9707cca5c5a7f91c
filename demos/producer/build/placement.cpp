#include "producer/build/placement.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "effects/random.h"
#include "producer/build/articulation_defs.h"
#include "producer/build/fill.h"

namespace offstage::producer {
namespace {

using Eigen::Vector2d;
using sim::Pose;

/// Returns the rotation about +Y.
Quat turn(Real radians) {
  const auto [sin, cos] = effects::sincos(radians / 2);
  return {cos, 0, sin, 0};
}

/// Returns the motion that rotates about the vertical axis through `pivot` and then moves by `shift`.
Pose turn_about(const Vec3& pivot, const Quat& q, const Vec3& shift) {
  return {pivot - q * pivot + shift, q};
}

Pose operator*(const Pose& a, const Pose& b) {
  return {a.point_to_world(b.position), a.orientation * b.orientation};
}

Pose repeated(const Repeat& repeat, int i) {
  const Real angle = std::fmod(i * repeat.turn_deg, 360.0) * (std::numbers::pi / 180);
  return turn_about(repeat.pivot, turn(angle), i * repeat.offset);
}

Pose on_grid(const Grid& grid, int i) {
  const int x = i % grid.count.x(), z = i / grid.count.x() % grid.count.z(),
            y = i / (grid.count.x() * grid.count.z());
  const Vec3 cell(x - 0.5 * (grid.count.x() - 1), y, z - 0.5 * (grid.count.z() - 1));
  return {cell.cwiseProduct(grid.spacing), Quat::Identity()};
}

/// Scatters copies by dart throwing: if a random place is too close to an earlier one, another place is
/// tried, up to a limit.
class Scatterer {
 public:
  Scatterer(const Scatter& scatter, uint64_t seed, std::string_view name)
      : scatter_(scatter),
        random_(seed,
                effects::stream_id("scatter " + std::to_string(scatter.seed) + " " + std::string(name))),
        cell_(std::max(scatter.min_distance, scatter.size.maxCoeff() / kMostCells)) {}

  void begin_group() { cells_.clear(); }

  /// Returns the i-th scattered copy, counted over all originals, for an original at `position`; nothing if
  /// there is no room.
  std::optional<std::pair<Pose, Real>> place(uint64_t i, const Vec3& position) {
    for (uint64_t attempt = 0; attempt < kAttempts; ++attempt) {
      const uint64_t index = i * kAttempts + attempt;
      const Vector2d fraction(random_.uniform(index, kX) - 0.5, random_.uniform(index, kZ) - 0.5);
      const Vector2d p = fraction.cwiseProduct(scatter_.size);
      if (scatter_.min_distance > 0 && !claim(p)) continue;
      const Quat q =
          scatter_.turn ? turn(random_.uniform(index, kTurn) * 2 * std::numbers::pi) : Quat::Identity();
      const Real scale = effects::sample(scatter_.scale, random_.uniform(index, kScale), 0);
      return {{turn_about(position, q, {p.x(), 0, p.y()}), scale}};
    }
    return {};
  }

 private:
  static constexpr uint64_t kAttempts = 64;
  static constexpr Real kMostCells = 1000;  // along one side
  enum Property : uint32_t { kX, kZ, kTurn, kScale };
  using Cell = std::pair<int, int>;

  /// Reserves the place unless another place of its group is closer than min_distance. Returns whether it
  /// did. Only the neighbouring cells can contain such a place.
  bool claim(const Vector2d& p) {
    const Cell cell(static_cast<int>(std::floor(p.x() / cell_)), static_cast<int>(std::floor(p.y() / cell_)));
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dz = -1; dz <= 1; ++dz) {
        const auto it = cells_.find({cell.first + dx, cell.second + dz});
        if (it == cells_.end()) continue;
        for (const Vector2d& other : it->second)
          if ((other - p).norm() < scatter_.min_distance) return false;
      }
    }
    cells_[cell].push_back(p);
    return true;
  }

  const Scatter& scatter_;
  effects::RandomStream random_;
  Real cell_;
  std::map<Cell, std::vector<Vector2d>> cells_;
};

void scale_size(sim::Sphere& s, Real k) {
  s.radius *= k;
}
void scale_size(sim::Box& s, Real k) {
  s.size *= k;
}
template <class T>
requires requires(T s) {
  s.radius, s.height;
}
void scale_size(T& s, Real k) {
  s.radius *= k;
  s.height *= k;
}
void scale_size(sim::Frustum& s, Real k) {
  s.radius *= k;
  s.top_radius *= k;
  s.height *= k;
}
void scale_size(sim::Ellipsoid& s, Real k) {
  s.radii *= k;
}
void scale_size(sim::Torus& s, Real k) {
  s.radius *= k;
  s.tube_radius *= k;
}
void scale_size(sim::Tube& s, Real k) {
  s.radius *= k;
  s.height *= k;
  s.thickness *= k;
}
void scale_size(sim::OpenBox& s, Real k) {
  s.size *= k;
  s.thickness *= k;
}
void scale_size(Compound& s, Real k) {
  for (CompoundPart& part : s.parts) {
    std::visit([k](auto& own) { scale_size(own, k); }, part.shape);
    part.position *= k;
  }
}
void scale_size(sim::Plane&, Real) {}
void scale_size(MeshFile& s, Real k) {
  s.scale *= k;
}

Body moved(Body body, const PlacedCopy& copy) {
  const Pose& motion = copy.motion;
  const auto turn_pose = [&](Quat& q) { q = motion.orientation * q; };
  body.name += copy.suffix;
  body.placement = {};
  body.position = motion.point_to_world(body.position);
  turn_pose(body.orientation);
  body.velocity = motion.vector_to_world(body.velocity);
  body.angular_velocity = motion.vector_to_world(body.angular_velocity);
  for (BodyKey& key : body.keyframes) {
    if (key.position) key.position = motion.point_to_world(*key.position);
    if (key.orientation) turn_pose(*key.orientation);
  }
  std::visit([&](auto& shape) { scale_size(shape, copy.scale); }, body.shape);
  if (body.model) {
    body.model->scale *= copy.scale;
    body.model->position *= copy.scale;
  }
  return body;
}

void turn_surface(PlaneSurface& surface, const Quat& q) {
  const Quat turned = q * surface.orientation();
  surface.direction = q * surface.direction;
  surface.turn_deg = 0;
  const Quat turn = surface.orientation().conjugate() * turned;  // rotation about +Y only
  surface.turn_deg = 2 * std::atan2(turn.y(), turn.w()) * 180 / std::numbers::pi;
}
void turn_surface(SphereSurface&, const Quat&) {}
void turn_surface(FaceSurface&, const Quat&) {}
void turn_surface(DiscSurface& surface, const Quat& q) {
  surface.direction = q * surface.direction;
}
void turn_surface(MeshSurface& surface, const Quat& q) {
  surface.orientation = q * surface.orientation;
}

Emitter moved(Emitter emitter, const PlacedCopy& copy) {
  emitter.name += copy.suffix;
  emitter.placement = {};
  std::visit(
      [&](auto& surface) {
        surface.position = copy.motion.point_to_world(surface.position);
        turn_surface(surface, copy.motion.orientation);
      },
      emitter.surface);
  emitter.direction = copy.motion.vector_to_world(emitter.direction);
  return emitter;
}

Cloth moved(Cloth cloth, const PlacedCopy& copy) {
  cloth.name += copy.suffix;
  cloth.placement = {};
  cloth.position = copy.motion.point_to_world(cloth.position);
  cloth.orientation = copy.motion.orientation * cloth.orientation;
  cloth.velocity = copy.motion.vector_to_world(cloth.velocity);
  if (auto* grid = std::get_if<GridShape>(&cloth.shape))
    grid->size *= copy.scale;
  else if (auto* sphere = std::get_if<SphereCloth>(&cloth.shape))
    sphere->radius *= copy.scale;
  else
    std::get<MeshFile>(cloth.shape).scale *= copy.scale;
  for (ClothCord& cord : cloth.cords) {
    cord.from *= copy.scale;
    cord.to *= copy.scale;
    cord.length *= copy.scale;
  }
  return cloth;
}

const Vec3& position_of(const Cloth& cloth) {
  return cloth.position;
}
const Vec3& position_of(const Body& body) {
  return body.position;
}
const Vec3& position_of(const Emitter& emitter) {
  return position_of(emitter.surface);
}

constexpr const char* kNoRoom =
    "has no room for a single object; use a smaller \"spacing\" or a larger volume";

template <class T>
std::vector<T> expand_all(const std::vector<T>& originals, uint64_t seed, std::vector<Problem>& errors,
                          std::vector<Problem>& warnings) {
  std::vector<T> all;
  for (const T& original : originals) {
    if (all.size() >= kMostBodies) {
      errors.push_back(
          {original.where, "there are more than " + std::to_string(kMostBodies) +
                               " objects of this kind with all copies; a body takes up to 10 kB of memory"});
      return all;
    }
    if (needs_spacing(original.placement)) {
      Where where = original.where;
      where.path += "/fill";
      errors.push_back({where, "needs a \"spacing\", the distance between neighbouring copies"});
      all.push_back(original);
      continue;
    }
    if (copy_count(original.placement) > kMaxCopies) {
      errors.push_back(
          {original.where, "asks for more than " + std::to_string(kMaxCopies) +
                               " copies: the counts of fill, repeat, grid and scatter multiply"});
      all.push_back(original);
      continue;
    }
    const Copies copies = expand(original.placement, position_of(original), seed, original.name);
    if (copies.placed.empty() && copies.left_out == 0) {
      Where where = original.where;
      where.path += "/fill";
      errors.push_back({where, kNoRoom});
    }
    for (const PlacedCopy& copy : copies.placed) all.push_back(moved(original, copy));
    if (copies.left_out > 0) {
      Where where = original.where;
      where.path += "/scatter";
      warnings.push_back({where, std::to_string(copies.left_out) +
                                     " copies found no free place: reduce min_distance or enlarge size"});
    }
  }
  return all;
}

/// Replaces names of objects with copies by the names of all copies. A part after a slash is appended to
/// each.
template <class T>
void name_copies(const std::vector<T>& originals, const std::vector<T>& copies,
                 std::vector<std::string>& names) {
  std::vector<std::string> all;
  for (const std::string& name : names) {
    const auto is_named = [&](const T& o) { return name == o.name || name.starts_with(o.name + "/"); };
    const auto original = std::ranges::find_if(originals, is_named);
    if (original == originals.end())
      all.push_back(name);
    else
      for (const T& copy : copies)
        if (copy.where.path == original->where.path)
          all.push_back(copy.name + name.substr(original->name.size()));
  }
  names = std::move(all);
}

/// Adds the places of a particle group's fill to the group.
void resolve_fill(ParticleGroup& group, std::vector<Problem>& errors) {
  if (!group.fill) return;
  constexpr std::size_t kMostPlaces = 5'000'000;
  const Real spacing = group.fill->spacing > 0 ? group.fill->spacing : 2 * group.radius;
  std::vector<Vec3> places = fill_places(*group.fill, spacing, kMostPlaces);
  Where where = group.where;
  where.path += "/fill";
  if (places.empty()) errors.push_back({where, kNoRoom});
  if (places.size() > kMostPlaces) {
    errors.push_back(
        {where,
         "has room for more than 5000000 objects, the limit; use a larger \"spacing\" or a smaller volume"});
    places.clear();
  }
  for (const Vec3& p : places)
    group.places.push_back({.position = group.fill->position + p, .velocity = Vec3::Zero(), .color = {}});
  group.fill.reset();
}

/// Converts delays in sub-steps to seconds.
void resolve_splits(ParticleSource& source, Real step) {
  if (source.split && source.split->delay_steps > 0) source.split->delay = source.split->delay_steps * step;
  const auto all = [&](auto& children) {
    for (auto& child : children) resolve_splits(child, step);
  };
  all(source.trails);
  all(source.on_age);
  all(source.on_collision);
  all(source.on_death);
}

/// Replaces a face as the surface of an emitter by a rectangle or a disc.
void resolve_face(const Scene& flat, Emitter& emitter, std::vector<Problem>& errors) {
  const auto* face = std::get_if<FaceSurface>(&emitter.surface);
  if (!face) return;
  const auto body = std::ranges::find(flat.bodies, emitter.body, &Body::name);
  if (!emitter.body.empty() && body == flat.bodies.end()) return;  // reported by another check
  const auto surface = face_of(*face, emitter.body.empty() ? nullptr : &*body);
  if (surface) {
    emitter.surface = *surface;
    return;
  }
  Where where = emitter.where;
  where.path += "/surface/face";
  errors.push_back(
      {where, "the body '" + emitter.body +
                  "' has no such face: boxes have six, cylinders and frusta have a top and a bottom, cones "
                  "have a bottom"});
}

}  // namespace

bool needs_spacing(const Placement& placement) {
  return placement.fill && !(placement.fill->spacing > 0);
}

int copy_count(const Placement& placement) {
  int64_t n = 1;
  const auto multiply = [&](int count) { n = std::min<int64_t>(n * count, kMaxCopies + 1); };
  if (placement.fill && !needs_spacing(placement))
    multiply(static_cast<int>(fill_places(*placement.fill, placement.fill->spacing, kMaxCopies).size()));
  if (placement.repeat) multiply(placement.repeat->count);
  if (placement.grid)
    for (const int count : placement.grid->count) multiply(count);
  if (placement.scatter) multiply(placement.scatter->count);
  return static_cast<int>(n);
}

Copies expand(const Placement& placement, const Vec3& position, uint64_t seed, std::string_view name) {
  const auto& [fill, repeat, grid, scatter] = placement;
  if (!fill && !repeat && !grid && !scatter) return {{PlacedCopy{}}, 0};
  std::vector<Vec3> filled = {Vec3::Zero()};
  if (fill && !needs_spacing(placement)) {
    filled = fill_places(*fill, fill->spacing, kMaxCopies);
    for (Vec3& p : filled) p += fill->position;
  }
  const int places = static_cast<int>(filled.size());
  const int repeats = repeat ? repeat->count : 1, cells = grid ? grid->count.prod() : 1;
  const int scattered = scatter ? scatter->count : 1;
  std::optional<Scatterer> scatterer;
  if (scatter) scatterer.emplace(*scatter, seed, name);

  Copies copies;
  for (int group = 0; group < repeats * cells * places; ++group) {
    const int cell = group / places;
    const Pose in_group =
        (repeat ? repeated(*repeat, cell / cells) : Pose{}) * (grid ? on_grid(*grid, cell % cells) : Pose{});
    const Pose motion =
        fill ? in_group * Pose{filled[static_cast<std::size_t>(group % places)], Quat::Identity()} : in_group;
    if (scatterer) scatterer->begin_group();
    for (int i = 0; i < scattered; ++i) {
      PlacedCopy copy{motion, 1, "_" + std::to_string(group * scattered + i)};
      if (scatterer) {
        const auto place = scatterer->place(
            static_cast<uint64_t>(group) * static_cast<uint64_t>(scattered) + static_cast<uint64_t>(i),
            position);
        if (!place) {
          ++copies.left_out;
          continue;
        }
        copy.motion = motion * place->first;
        copy.scale = place->second;
      }
      copies.placed.push_back(std::move(copy));
    }
  }
  return copies;
}

Scene expand(const Scene& scene, std::vector<Problem>& errors, std::vector<Problem>& warnings) {
  Scene flat = scene;
  flat.bodies = expand_all(scene.bodies, scene.world.seed, errors, warnings);
  flat.emitters = expand_all(scene.emitters, scene.world.seed, errors, warnings);
  flat.cloths = expand_all(scene.cloths, scene.world.seed, errors, warnings);
  for (ParticleGroup& group : flat.particles) resolve_fill(group, errors);
  for (Emitter& emitter : flat.emitters) {
    resolve_splits(emitter, scene.world.max_step);
    resolve_face(flat, emitter, errors);
  }
  expand_joints(scene, flat, errors, warnings);
  for (Force& force : flat.forces)
    std::visit(
        [&](auto& f) {
          if constexpr (requires { f.bodies; }) name_copies(scene.bodies, flat.bodies, f.bodies);
          if constexpr (requires { f.particles; }) name_copies(scene.emitters, flat.emitters, f.particles);
          if constexpr (requires { f.cloths; }) name_copies(scene.cloths, flat.cloths, f.cloths);
        },
        force);
  return flat;
}

}  // namespace offstage::producer
