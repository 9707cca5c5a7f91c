#include "producer/build/overlays.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "producer/build/line_sketch.h"
#include "sim/collision/bounding_tree.h"
#include "sim/collision/distance.h"
#include "sim/collision/narrow_phase.h"

namespace offstage::producer {
namespace {

using Eigen::Vector4f;
using Edges = std::vector<std::pair<Vec3, Vec3>>;

constexpr Real kTrailStep = 1.0 / 120;        // [s]
constexpr float kDotWidth = 4;                // width of a dot, in widths of a line
constexpr Real kShortestArrow = 5e-3;         // [m]; a shorter one would be unrecognizable
constexpr uint64_t kByGeometry = 1ull << 63;  // flag in the ids of contacts

sim::Pose relative(const sim::Pose& a, const sim::Pose& b) {
  return {a.point_to_body(b.position), a.orientation.conjugate() * b.orientation};
}

/// Returns the radiance that a surface of this colour has in sunlight, so that lines are as bright as
/// objects.
Vector4f light(const Vector4f& color) {
  constexpr float kSunlit = 3;
  return {kSunlit * color.x(), kSunlit * color.y(), kSunlit * color.z(), color.w()};
}

// --- Volumes as edges ---

Edges box_edges(const Vec3& centre, const sim::Mat3& half_axes) {
  const auto corner = [&](int bits) -> Vec3 {
    return centre + half_axes * Vec3(bits & 1 ? 1 : -1, bits & 2 ? 1 : -1, bits & 4 ? 1 : -1);
  };
  Edges edges;
  for (int bits = 0; bits < 8; ++bits)
    for (const int axis : {1, 2, 4})
      if (!(bits & axis)) edges.push_back({corner(bits), corner(bits | axis)});
  return edges;
}
Edges edges_of(const sim::Aabb& box) {
  return box_edges(box.center(), (0.5 * box.sizes()).asDiagonal());
}
Edges edges_of(const sim::Obb& box) {
  return box_edges(box.centre, box.axes * box.half.asDiagonal());
}
/// Returns three great circles of a sphere as edges.
Edges edges_of(const sim::BoundingSphere& ball) {
  constexpr int kSegments = 32;
  Edges edges;
  for (int axis = 0; axis < 3; ++axis) {
    const auto point = [&](int i) -> Vec3 {
      const Real angle = 2 * std::numbers::pi * i / kSegments;
      Vec3 p = ball.centre;
      p[(axis + 1) % 3] += ball.radius * std::cos(angle);
      p[(axis + 2) % 3] += ball.radius * std::sin(angle);
      return p;
    };
    for (int i = 0; i < kSegments; ++i) edges.push_back({point(i), point(i + 1)});
  }
  return edges;
}

// --- Contacts ---

/// Draws the outline of a contact patch: its points in order around their centre.
void draw_patch(const std::vector<Vec3>& points, const Vec3& normal, const Vector4f& color,
                LineSketch& sketch) {
  if (points.size() < 2) return;
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : points) middle += p / static_cast<Real>(points.size());
  const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
  std::vector<std::pair<Real, Vec3>> around;
  for (const Vec3& p : points) around.emplace_back(std::atan2((p - middle).dot(v), (p - middle).dot(u)), p);
  std::ranges::sort(around, {}, &std::pair<Real, Vec3>::first);
  for (std::size_t i = 0; i < around.size(); ++i)
    sketch.line(around[i].second, around[(i + 1) % around.size()].second, color);
}

/// Draws a contact point with an arrow.
void draw_point(const Vec3& p, const Vec3& normal, const Vec3& arrow, Real size, const Vector4f& color,
                LineSketch& sketch) {
  sketch.ring(p, normal, size, color);
  sketch.dot(p, color, kDotWidth);
  if (!arrow.isZero(0)) sketch.arrow(p, p + arrow, color);
}

/// Draws the contact points and the outline of a manifold. The lines of a point have the id `object` + the id
/// of the point.
void draw_manifold(const sim::Manifold& m, const sim::Pose& world_from_a, Real size, const Vector4f& color,
                   uint64_t object, LineSketch& sketch) {
  const Vec3 normal = world_from_a.vector_to_world(m.normal);
  std::vector<Vec3> points;
  for (uint32_t i = 0; i < m.count; ++i) {
    points.push_back(world_from_a.point_to_world(0.5 * (m.points[i].on_a + m.points[i].on_b)));
    sketch.object(object + m.points[i].id);
    draw_point(points.back(), normal, 4 * size * normal, size, color, sketch);
  }
  draw_patch(points, normal, color, sketch);
}

uint64_t pair_id(sim::BodyHandle a, sim::BodyHandle b) {
  return (uint64_t{a.index} << 40) ^ (uint64_t{b.index} << 16);
}

/// Returns the contacts of the simulation between all bodies, or between two given bodies. They are sorted by
/// pair, and within a pair by their position on the body. The simulation sorts them by depth, which may
/// change while the points stay.
std::vector<sim::ContactState> contacts_of(const sim::World& world, sim::BodyHandle a, sim::BodyHandle b) {
  std::vector<sim::ContactState> contacts = world.contacts();
  if (a)
    std::erase_if(contacts, [&](const sim::ContactState& c) {
      return !(c.a == a && c.b == b) && !(c.a == b && c.b == a);
    });
  const auto along_body = [&](const sim::ContactState& c) {
    const bool a_moves = world.body_def(c.a).motion == sim::MotionType::dynamic;
    return world.body(a_moves ? c.a : c.b).pose.point_to_body(c.point).dot(Vec3(1, 0.618, 0.382));
  };
  const auto key = [&](const sim::ContactState& c) { return std::pair(pair_id(c.a, c.b), along_body(c)); };
  std::ranges::stable_sort(contacts, {}, key);
  return contacts;
}

}  // namespace

/// Prepares the data that the overlays of one scene draw.
struct Overlays::Builder {
  const Scene& scene;
  const sim::World& world;
  const BodiesByName& bodies;
  const ClothsByName& cloths;
  Overlays& out;

  Source operator()(const TreeOverlay& overlay) const {
    TreeLines tree{&overlay, bodies.at(overlay.body), {}};
    const auto& shape = std::get<sim::MeshShape>(world.body_def(tree.body).shape);
    const sim::TriangleMesh& mesh = world.mesh(shape.mesh);
    switch (overlay.volume) {
      case BoundingVolumeKind::aabb:
        add_volumes(sim::BoundingTree<sim::Aabb>(mesh), tree);
        break;
      case BoundingVolumeKind::obb:
        add_volumes(sim::BoundingTree<sim::Obb>(mesh), tree);
        break;
      case BoundingVolumeKind::sphere:
        add_volumes(sim::BoundingTree<sim::BoundingSphere>(mesh), tree);
        break;
    }
    return tree;
  }
  Source operator()(const PartsOverlay&) const { return NoLines{}; }
  Source operator()(const ClosestOverlay& overlay) const {
    return ClosestLines{&overlay, pair(overlay.a, overlay.b)};
  }
  Source operator()(const ContactsOverlay& overlay) const {
    if (!overlay.a.empty()) {
      ContactLines contacts{&overlay, bodies.at(overlay.a), bodies.at(overlay.b), {}};
      if (!is_dynamic(contacts.a) && !is_dynamic(contacts.b))
        contacts.pairs.push_back(pair(overlay.a, overlay.b));
      return contacts;
    }
    ContactLines contacts{&overlay, {}, {}, {}};
    for (std::size_t i = 0; i < scene.bodies.size(); ++i)
      for (std::size_t j = i + 1; j < scene.bodies.size(); ++j)
        if (touch_by_geometry(scene.bodies[i], scene.bodies[j]))
          contacts.pairs.push_back(pair(scene.bodies[i].name, scene.bodies[j].name));
    return contacts;
  }
  Source operator()(const VelocitiesOverlay& overlay) const {
    VelocityLines velocities{&overlay, {}};
    for (const Body& body : scene.bodies)
      if (overlay.body.empty() ? body.motion != sim::MotionType::static_body : body.name == overlay.body)
        velocities.bodies.push_back(bodies.at(body.name));
    return velocities;
  }
  Source operator()(const IslandsOverlay& overlay) const {
    IslandLines islands{&overlay, {}};
    for (const Body& body : scene.bodies) {
      const sim::BodyHandle handle = bodies.at(body.name);
      if (!is_dynamic(handle)) continue;
      const sim::Shape& shape = world.body_def(handle).shape;
      islands.bodies.push_back({handle, edges_of(sim::local_bounds({&shape, collision_mesh_of(shape)}))});
    }
    return islands;
  }
  Source operator()(const JointsOverlay& overlay) const {
    JointLines lines{&overlay, {}};
    world.for_each_joint([&](sim::JointHandle joint) {
      if (overlay.joint.empty() || overlay.joint == world.joint_def(joint).name)
        lines.joints.push_back(joint);
    });
    return lines;
  }
  Source operator()(const TrailsOverlay& overlay) const {
    TrailLines lines{&overlay, {}};
    for (const Body& body : scene.bodies) {
      if (overlay.body.empty() ? body.motion != sim::MotionType::dynamic : body.name != overlay.body)
        continue;
      Vector4f color;
      color << distinct_color(lines.trails.size()), 1;
      if (overlay.color) color = overlay.color->rgba;
      lines.trails.push_back({bodies.at(body.name), color, {}});
    }
    return lines;
  }
  Source operator()(const TextOverlay&) const { return NoLines{}; }
  Source operator()(const ClothOverlay& overlay) const {
    ClothLines lines{&overlay, {}};
    for (const Cloth& cloth : scene.cloths)
      if (overlay.cloth.empty() || cloth.name == overlay.cloth) lines.cloths.push_back(cloths.at(cloth.name));
    return lines;
  }

 private:
  bool is_dynamic(sim::BodyHandle body) const {
    return world.body_def(body).motion == sim::MotionType::dynamic;
  }
  template <class Tree>
  static void add_volumes(const Tree& built, TreeLines& tree) {
    const auto deepest = static_cast<int>(std::ceil(effects::upper_bound(tree.overlay->level)));
    built.for_each_node([&](auto level, const auto& volume, bool leaf) {
      if (static_cast<int>(level) <= deepest)
        tree.volumes.push_back({static_cast<int>(level), leaf, edges_of(volume)});
    });
  }
  /// Returns whether bodies may touch without contacts in the simulation: at least one moves, and neither is
  /// dynamic.
  static bool touch_by_geometry(const Body& a, const Body& b) {
    using enum sim::MotionType;
    const auto is_plane = [](const Body& body) { return std::holds_alternative<sim::Plane>(body.shape); };
    const bool scripted =
        (a.motion == kinematic && b.motion != dynamic) || (b.motion == kinematic && a.motion != dynamic);
    return scripted && a.collides && b.collides && !(is_plane(a) && is_plane(b));
  }
  const sim::CollisionMesh* collision_mesh_of(const sim::Shape& shape) const {
    const auto* mesh = std::get_if<sim::MeshShape>(&shape);
    return mesh ? &world.collision_mesh(mesh->mesh) : nullptr;
  }
  const Collider& collider(const std::string& name) const {
    const auto [it, is_new] = out.colliders_.try_emplace(name);
    Collider& made = it->second;
    if (!is_new) return made;
    made.body = bodies.at(name);
    made.shape = world.body_def(made.body).shape;
    made.collision.emplace(sim::Solid{&made.shape, collision_mesh_of(made.shape)},
                           world.body_def(made.body).motion == sim::MotionType::dynamic);
    return made;
  }
  ColliderPair pair(const std::string& a, const std::string& b) const {
    const Collider &first = collider(a), &second = collider(b);
    return first.collision->is_plane() ? ColliderPair{&second, &first} : ColliderPair{&first, &second};
  }
};

Overlays::Overlays(const Scene& scene, const sim::World& world, const BodiesByName& bodies,
                   const ClothsByName& cloths) {
  const Builder builder{scene, world, bodies, cloths, *this};
  for (const Overlay& overlay : scene.overlays) sources_.push_back(std::visit(builder, overlay));
}

std::vector<LineSet> Overlays::lines(const sim::World& world) const {
  std::vector<LineSet> all;
  for (const Source& source : sources_)
    all.push_back(std::visit([&](const auto& s) { return draw(s, world); }, source));
  return all;
}

void Overlays::record(const sim::World& world) {
  for (Source& source : sources_) {
    auto* lines = std::get_if<TrailLines>(&source);
    if (!lines) continue;
    for (TrailLines::Trail& trail : lines->trails) {
      auto& places = trail.places;
      if (!places.empty() && world.time() - places.back().first < kTrailStep) continue;
      places.emplace_back(world.time(), world.body(trail.body).centre);
      while (places.front().first < world.time() - lines->overlay->duration) places.pop_front();
    }
  }
}

LineSet Overlays::draw(const TreeLines& tree, const sim::World& world) {
  const sim::Pose pose = world.body(tree.body).pose;
  const Real shown = effects::mean(tree.overlay->level, world.time());
  const int upper = static_cast<int>(std::floor(shown));
  const auto lower_fraction = static_cast<float>(shown - upper);
  LineSketch sketch;
  for (std::size_t i = 0; i < tree.volumes.size(); ++i) {
    const TreeLines::Volume& volume = tree.volumes[i];
    const auto belongs = [&](int level) {
      return volume.level == level || (volume.leaf && volume.level < level);
    };
    const float alpha = (belongs(upper) ? 1 - lower_fraction : 0) + (belongs(upper + 1) ? lower_fraction : 0);
    if (alpha <= 0) continue;
    Vector4f color;
    color << hue_color(0.07 + 0.13 * volume.level), alpha;
    sketch.object(i);
    for (const auto& [a, b] : volume.edges)
      sketch.line(pose.point_to_world(a), pose.point_to_world(b), light(color));
  }
  return sketch.take();
}

LineSet Overlays::draw(const ClosestLines& closest, const sim::World& world) {
  const auto [first, second] = closest.pair;
  const sim::Pose a = world.body(first->body).pose, b = world.body(second->body).pose;
  sim::PairCache cache;  // a new cache each time, so that the picture does not depend on earlier frames
  const auto found = sim::separation(*first->collision, *second->collision, relative(a, b), cache);
  if (!found) return {};
  const bool apart = found->distance >= 0;
  const Vector4f color = light((apart ? closest.overlay->color : closest.overlay->penetrating).rgba);
  const Vec3 on_a = a.point_to_world(found->on_a), on_b = a.point_to_world(found->on_b);
  LineSketch sketch;
  sketch.object(apart);
  sketch.line(on_a, on_b, color);
  sketch.dot(on_a, color, kDotWidth);
  sketch.dot(on_b, color, kDotWidth);
  return sketch.take();
}

LineSet Overlays::draw(const ContactLines& contacts, const sim::World& world) {
  const ContactsOverlay& overlay = *contacts.overlay;
  const Vector4f color = light(overlay.color.rgba);
  LineSketch sketch;
  uint64_t pair = 0, number = 0;
  for (const sim::ContactState& c : contacts_of(world, contacts.a, contacts.b)) {
    number = pair == pair_id(c.a, c.b) ? number + 1 : 0;
    pair = pair_id(c.a, c.b);
    sketch.object(pair + number);
    const Vec3 arrow =
        overlay.force_scale > 0 ? Vec3(overlay.force_scale * c.force) : 4 * overlay.size * c.normal;
    draw_point(c.point, c.normal, arrow, overlay.size, color, sketch);
  }
  std::vector<sim::Manifold> manifolds;
  for (std::size_t i = 0; i < contacts.pairs.size(); ++i) {
    const auto [first, second] = contacts.pairs[i];
    const sim::Pose a = world.body(first->body).pose, b = world.body(second->body).pose;
    sim::PairCache cache;
    manifolds.clear();
    sim::find_manifolds(*first->collision, *second->collision, relative(a, b), overlay.margin, cache,
                        sim::DistanceMethod::gjk, manifolds);
    for (std::size_t k = 0; k < manifolds.size(); ++k)
      draw_manifold(manifolds[k], a, overlay.size, color, kByGeometry + (i << 44) + (k << 32), sketch);
  }
  return sketch.take();
}

LineSet Overlays::draw(const VelocityLines& velocities, const sim::World& world) {
  const VelocitiesOverlay& overlay = *velocities.overlay;
  LineSketch sketch;
  const auto arrow = [&](uint64_t id, const Vec3& from, const Vec3& along, const Color& color) {
    sketch.object(id);
    if (along.norm() > kShortestArrow) sketch.arrow(from, from + along, light(color.rgba));
  };
  for (const sim::BodyHandle body : velocities.bodies) {
    const sim::BodyState s = world.body(body);
    arrow(2 * body.index, s.centre, overlay.scale * s.velocity, overlay.color);
    arrow(2 * body.index + 1, s.centre, overlay.angular_scale * s.angular_velocity, overlay.angular_color);
  }
  return sketch.take();
}

LineSet Overlays::draw(const IslandLines& islands, const sim::World& world) {
  // A group has the colour of its first body, so that it keeps its colour when other bodies come and go.
  std::map<uint32_t, std::size_t> first;
  LineSketch sketch;
  for (std::size_t i = 0; i < islands.bodies.size(); ++i) {
    const auto& [body, edges] = islands.bodies[i];
    const std::optional<uint32_t> island = world.island(body);
    const std::size_t number = island ? first.emplace(*island, i).first->second : i;
    Vector4f color;
    color << distinct_color(number), 1;
    if (world.is_asleep(body)) color.head<3>() *= static_cast<float>(islands.overlay->asleep);
    const sim::Pose pose = world.body(body).pose;
    sketch.object(body.index);
    for (const auto& [a, b] : edges)
      sketch.line(pose.point_to_world(a), pose.point_to_world(b), light(color));
  }
  return sketch.take();
}

LineSet Overlays::draw(const JointLines& joints, const sim::World& world) {
  using enum sim::JointType;
  const JointsOverlay& overlay = *joints.overlay;
  const Vector4f color = light(overlay.color.rgba);
  LineSketch sketch;
  for (const sim::JointHandle handle : joints.joints) {
    const sim::JointState joint = world.joint(handle);
    if (joint.broken) continue;
    const sim::JointDef& def = world.joint_def(handle);
    sketch.object(handle.index);
    sketch.dot(joint.anchor_a, color, kDotWidth);
    if (def.type == distance) {
      sketch.dot(joint.anchor_b, color, kDotWidth);
      sketch.line(joint.anchor_a, joint.anchor_b, color);
    }
    for (const auto& [body, anchor] : {std::pair(def.a, joint.anchor_a), {def.b, joint.anchor_b}})
      if (body && world.body_def(body).motion == sim::MotionType::dynamic)
        sketch.line(anchor, world.body(body).centre, color);
    if (def.type == revolute || def.type == prismatic || def.type == universal) {
      const Vec3 along = 2 * overlay.size * joint.axis;
      sketch.line(joint.anchor_b - along, joint.anchor_b + along, color);
      sketch.ring(joint.anchor_b, joint.axis, overlay.size, color);
    }
    if (const Vec3 arrow = overlay.force_scale * joint.force; arrow.norm() > kShortestArrow)
      sketch.arrow(joint.anchor_a, joint.anchor_a + arrow, light(overlay.force_color.rgba));
  }
  return sketch.take();
}

LineSet Overlays::draw(const TrailLines& lines, const sim::World& world) {
  LineSketch sketch;
  for (const TrailLines::Trail& trail : lines.trails) {
    const auto& places = trail.places;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto& [time, from] = places[i];
      const Vec3 to = i + 1 < places.size() ? places[i + 1].second : world.body(trail.body).centre;
      const auto fresh =
          static_cast<float>(std::clamp(1 - (world.time() - time) / lines.overlay->duration, 0.0, 1.0));
      Vector4f color = light(trail.color);
      color.w() *= fresh;
      sketch.object((uint64_t{trail.body.index} << 32) +
                    static_cast<uint64_t>(std::llround(time / kTrailStep)));
      sketch.line(from, to, color, fresh, fresh);
    }
  }
  return sketch.take();
}

LineSet Overlays::draw(const ClothLines& cloths, const sim::World& world) {
  LineSketch sketch;
  for (const sim::ClothHandle handle : cloths.cloths) {
    const sim::ClothView cloth = world.cloth(handle);
    const sim::ClothDef& def = world.cloth_def(handle);
    const std::vector<Vec3>& rest = def.rest_vertices.empty() ? def.vertices : def.rest_vertices;
    for (uint32_t t = 0; t < cloth.triangles.size(); ++t) {
      for (uint32_t k = 0; k < 3; ++k) {
        const uint32_t a = cloth.triangles[t][k], b = cloth.triangles[t][(k + 1) % 3];
        if (a > b) continue;  // only one of the two triangles at an edge draws it
        const Real length = (rest[cloth.sources[a]] - rest[cloth.sources[b]]).norm();
        const Real strain = (cloth.points[a] - cloth.points[b]).norm() / length - 1;
        const Real fraction = std::clamp(strain / cloths.overlay->strain, 0.0, 1.0);
        Vector4f color;
        color << hue_color(0.7 * (1 - fraction) + 0.06), 1;
        sketch.object((uint64_t{handle.index} << 48) + 3 * t + k);
        sketch.line(cloth.points[a], cloth.points[b], light(color));
      }
    }
  }
  return sketch.take();
}

}  // namespace offstage::producer
