#include "producer/overlays.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "producer/line_sketch.h"
#include "sim/collision/bounding_tree.h"
#include "sim/collision/narrow_phase.h"

namespace offstage::producer {
namespace {

using Eigen::Vector4f;
using Edges = std::vector<std::pair<Vec3, Vec3>>;

constexpr float kDotWidth = 4;  // in widths of a line

sim::Pose relative(const sim::Pose& a, const sim::Pose& b) {
  return {a.point_to_body(b.position), a.orientation.conjugate() * b.orientation};
}

/// The light of a colour as bright as if the sun shone on it.
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
/// Three great circles.
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

/// The outline of a patch of contact: its points in order around their middle.
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

/// `object` leaves room for the ids of points.
void draw_manifold(const sim::Manifold& m, const sim::Pose& world_from_a, Real size, const Vector4f& color,
                   uint64_t object, LineSketch& sketch) {
  const Vec3 normal = world_from_a.vector_to_world(m.normal);
  std::vector<Vec3> points;
  for (uint32_t i = 0; i < m.count; ++i) {
    const Vec3 p = world_from_a.point_to_world(0.5 * (m.points[i].on_a + m.points[i].on_b));
    points.push_back(p);
    sketch.object(object + m.points[i].id);
    sketch.ring(p, normal, size, color);
    sketch.dot(p, color, kDotWidth);
    sketch.arrow(p, p + 4 * size * normal, color);
  }
  draw_patch(points, normal, color, sketch);
}

}  // namespace

/// Makes what the overlays of one scene draw from.
struct Overlays::Builder {
  const Scene& scene;
  const sim::World& world;
  const BodiesByName& bodies;
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
    ContactLines contacts{&overlay, {}};
    if (!overlay.a.empty()) {
      contacts.pairs.push_back(pair(overlay.a, overlay.b));
      return contacts;
    }
    for (std::size_t i = 0; i < scene.bodies.size(); ++i)
      for (std::size_t j = i + 1; j < scene.bodies.size(); ++j)
        if (can_touch(scene.bodies[i], scene.bodies[j]))
          contacts.pairs.push_back(pair(scene.bodies[i].name, scene.bodies[j].name));
    return contacts;
  }

 private:
  template <class Tree>
  static void add_volumes(const Tree& built, TreeLines& tree) {
    const auto deepest = static_cast<int>(std::ceil(effects::upper_bound(tree.overlay->level)));
    built.for_each_node([&](auto level, const auto& volume, bool leaf) {
      if (static_cast<int>(level) <= deepest)
        tree.volumes.push_back({static_cast<int>(level), leaf, edges_of(volume)});
    });
  }
  static bool can_touch(const Body& a, const Body& b) {
    const auto is_plane = [](const Body& body) { return std::holds_alternative<sim::Plane>(body.shape); };
    const bool moves = a.motion != sim::MotionType::fixed || b.motion != sim::MotionType::fixed;
    return moves && a.collides && b.collides && !(is_plane(a) && is_plane(b));
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

Overlays::Overlays(const Scene& scene, const sim::World& world, const BodiesByName& bodies) {
  const Builder builder{scene, world, bodies, *this};
  for (const Overlay& overlay : scene.overlays) sources_.push_back(std::visit(builder, overlay));
}

std::vector<LineSet> Overlays::lines(const sim::World& world) const {
  std::vector<LineSet> all;
  for (const Source& source : sources_)
    all.push_back(std::visit([&](const auto& s) { return draw(s, world); }, source));
  return all;
}

LineSet Overlays::draw(const TreeLines& tree, const sim::World& world) {
  const sim::Pose pose = world.body(tree.body).pose;
  const Real shown = effects::mean(tree.overlay->level, world.time());
  const int upper = static_cast<int>(std::floor(shown));
  const auto lower_share = static_cast<float>(shown - upper);
  LineSketch sketch;
  for (std::size_t i = 0; i < tree.volumes.size(); ++i) {
    const TreeLines::Volume& volume = tree.volumes[i];
    const auto belongs = [&](int level) {
      return volume.level == level || (volume.leaf && volume.level < level);
    };
    const float alpha = (belongs(upper) ? 1 - lower_share : 0) + (belongs(upper + 1) ? lower_share : 0);
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
  sim::PairCache cache;  // a fresh one each time: what is seen does not depend on the frames before
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
  std::vector<sim::Manifold> manifolds;
  for (std::size_t i = 0; i < contacts.pairs.size(); ++i) {
    const auto [first, second] = contacts.pairs[i];
    const sim::Pose a = world.body(first->body).pose, b = world.body(second->body).pose;
    sim::PairCache cache;
    manifolds.clear();
    sim::find_manifolds(*first->collision, *second->collision, relative(a, b), overlay.margin, cache,
                        sim::DistanceMethod::gjk, manifolds);
    for (std::size_t k = 0; k < manifolds.size(); ++k)
      draw_manifold(manifolds[k], a, overlay.size, color, (i << 48) + (k << 32), sketch);
  }
  return sketch.take();
}

}  // namespace offstage::producer
