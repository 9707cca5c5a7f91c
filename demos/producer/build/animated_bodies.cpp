#include "producer/build/animated_bodies.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "sim/geometry/convex_hull.h"

namespace offstage::producer {
namespace {

using Eigen::Affine3d;

/// Returns the transform of a node without its scaling.
Affine3d rigid(const Eigen::Affine3f& world) {
  const Affine3d m = world.cast<double>();
  Eigen::Matrix3d rotation = m.rotation();
  if (!rotation.allFinite()) rotation.setIdentity();
  return Eigen::Translation3d(m.translation()) * rotation;
}

void append(const render::Mesh& mesh, const Affine3d& piece_from_mesh, sim::TriangleMesh& out) {
  const auto base = static_cast<uint32_t>(out.vertices.size());
  for (const Eigen::Vector3f& p : mesh.positions) out.vertices.push_back(piece_from_mesh * p.cast<double>());
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
    out.triangles.push_back({base + mesh.indices[i], base + mesh.indices[i + 1], base + mesh.indices[i + 2]});
}

/// Returns the node of the joint with the largest weight for a vertex; -1 if the vertex has no joint.
int leading_joint(const render::RigSurface& surface, const render::RigSkin& skin, std::size_t vertex) {
  float most = 0;
  int node = -1;
  for (std::size_t k = vertex * surface.influences; k < (vertex + 1) * surface.influences; ++k) {
    if (surface.weights[k] <= most || surface.joints[k] >= skin.joints.size()) continue;
    most = surface.weights[k];
    node = skin.joints[surface.joints[k]];
  }
  return node;
}

/// Returns whether the convex hull of some points has a volume: they must not lie in a plane.
bool is_solid(const std::vector<Vec3>& points) {
  sim::Aabb box;
  for (const Vec3& p : points) box.extend(p);
  return points.size() >= 4 && box.sizes().minCoeff() > 1e-4 * box.sizes().maxCoeff();
}

sim::Pose pose_of(const Affine3d& transform, double scale) {
  return {scale * transform.translation(), Quat(transform.linear()).normalized()};
}

bool differ(const sim::Pose& a, const sim::Pose& b) {
  constexpr double kPlace_m = 1e-3, kAngle = 1e-2;
  return (a.position - b.position).norm() > kPlace_m || a.orientation.angularDistance(b.orientation) > kAngle;
}

}  // namespace

double clip_time(const ModelAnimation& animation, double duration, double time) {
  const double played = std::max(time - animation.start, 0.0) * animation.speed;
  if (duration <= 0) return 0;
  return animation.loop ? std::fmod(played, duration) : std::min(played, duration);
}

std::vector<AnimatedPiece> collision_pieces(const render::ModelRig& rig, int clip,
                                            const DecompositionCache& cache) {
  const render::RigPose start = render::pose_at(rig, clip, 0);
  std::map<int, sim::TriangleMesh> solids;
  std::map<int, std::vector<Vec3>> bones;
  for (const render::RigSurface& surface : rig.surfaces) {
    const auto node = static_cast<std::size_t>(surface.node);
    const render::Mesh mesh = surface.deforms() ? render::deformed(rig, surface, start) : surface.mesh;
    if (surface.skin < 0) {
      const Eigen::Affine3f& world = start.world[node];
      append(mesh, rigid(world).inverse() * world.cast<double>(), solids[surface.node]);
      continue;
    }
    const render::RigSkin& skin = rig.skins[static_cast<std::size_t>(surface.skin)];
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
      if (const int joint = leading_joint(surface, skin, i); joint >= 0)
        bones[joint].push_back(rigid(start.world[static_cast<std::size_t>(joint)]).inverse() *
                               mesh.positions[i].cast<double>());
  }
  std::vector<AnimatedPiece> pieces;
  const auto name_of = [&](int node) { return rig.nodes[static_cast<std::size_t>(node)].name; };
  for (auto& [node, mesh] : solids) {
    if (mesh.triangles.empty()) continue;
    sim::ConvexDecomposition parts = cache.decompose(sim::weld(mesh));
    pieces.push_back({name_of(node), node, std::move(mesh), std::move(parts)});
  }
  for (const auto& [joint, points] : bones) {
    if (!is_solid(points)) continue;
    const sim::ConvexPolyhedron hull = sim::convex_hull(points);
    pieces.push_back({name_of(joint),
                      joint,
                      hull.triangles(),
                      {.method = sim::ConvexDecomposition::Method::convex, .parts = {hull}, .note = {}}});
  }
  return pieces;
}

sim::KeyframeTrack piece_track(const render::ModelRig& rig, const AnimatedPiece& piece,
                               const ModelAnimation& animation, const sim::KeyframeTrack& own,
                               const sim::Pose& rest, double scale, double end) {
  constexpr double kRate = 120;
  constexpr double kMostKeys = 100'000;  // a longer film is sampled more coarsely
  const int clip = rig.clip(animation.clip);
  const double duration = double{rig.clips[static_cast<std::size_t>(clip)].duration};
  const auto node_pose = [&](double at) {
    const render::RigPose pose = render::pose_at(rig, clip, static_cast<float>(at));
    return pose_of(rigid(pose.world[static_cast<std::size_t>(piece.node)]), scale);
  };
  const auto placed = [&](const sim::Pose& node, double time) {
    const sim::Pose body = own.at(time, rest).pose;
    return sim::Pose{body.point_to_world(node.position), (body.orientation * node.orientation).normalized()};
  };
  sim::KeyframeTrack track;
  // An animation that repeats in place needs the keys of one period only.
  const bool repeats =
      animation.loop && animation.start == 0 && animation.speed > 0 && duration > 0 && !own.moves();
  const double length = repeats ? duration / animation.speed : std::max(end, 0.0);
  track.loop = repeats;
  const double count = std::clamp(std::ceil(length * kRate), 1.0, kMostKeys);
  const bool closed = !differ(node_pose(0), node_pose(duration));
  double before = 0;
  for (int k = 0; k <= static_cast<int>(count); ++k) {
    const double time = length * k / count;
    const double at = repeats ? duration * k / count : clip_time(animation, duration, time);
    if (at < before && !closed) track.keys.back().interpolation = sim::Interpolation::step;
    before = at;
    track.keys.push_back({time, placed(node_pose(at), time)});
  }
  return track;
}

}  // namespace offstage::producer
