// The part of picture.h that moves all objects to their states between two snapshots.

#include <cmath>
#include <numbers>
#include <unordered_map>

#include "effects/distribution.h"
#include "effects/random.h"
#include "producer/base/to_float.h"
#include "producer/build/animated_bodies.h"
#include "producer/build/lights.h"
#include "producer/build/picture.h"
#include "sim/core/rotation.h"

namespace offstage::producer {
namespace {

using Eigen::Affine3f;
using Eigen::Vector3f;

Affine3f affine(const BodySample& s) {
  return Eigen::Translation3f(s.position) * s.orientation;
}

BodySample interpolate(const BodySample& a, const BodySample& b, float w) {
  return {a.position + w * (b.position - a.position), a.orientation.slerp(w, b.orientation)};
}

/// Returns the position of a particle at the fraction w of the interval `dt` between two states. The path is
/// the cubic through both states if the particle flew freely. It is a straight line if the particle bounced
/// in between, because a cubic would overshoot.
Vector3f interpolate(const render::Point& a, const render::Point& b, float w, float dt) {
  const Vector3f step = b.position - a.position;
  const Vector3f mean_velocity = 0.5f * (a.velocity + b.velocity);
  const bool free_flight = (step - mean_velocity * dt).norm() <= 0.1f * mean_velocity.norm() * dt;
  if (!free_flight) return a.position + w * step;
  const float w2 = w * w, w3 = w2 * w;
  return a.position + (3 * w2 - 2 * w3) * step +
         dt * ((w3 - 2 * w2 + w) * a.velocity + (w3 - w2) * b.velocity);
}

/// Returns the position of a cloth point between two states, by the cubic through both. If there was an
/// impact in between, the velocities at both ends are misleading; their deviation from the mean velocity is
/// limited to half of it.
Vector3f interpolate(const Vector3f& a, const Vector3f& va, const Vector3f& b, const Vector3f& vb, float w,
                     float dt) {
  const Vector3f step = b - a;
  const float most = 0.5f * step.norm();
  const auto limited = [&](const Vector3f& v) -> Vector3f {
    const Vector3f off = dt * v - step;
    const float length = off.norm();
    return length > most ? Vector3f(off * (most / length)) : off;
  };
  const float rest = 1 - w;
  return a + w * step + w * rest * (rest * limited(va) - w * limited(vb));
}

/// Returns a direction that depends only on the number. The directions are uniformly distributed on the
/// sphere.
Vector3f direction_of(uint64_t id) {
  const effects::RandomStream random(0, effects::stream_id("axis of a mesh"));
  const Real z = 2 * random.uniform(id, 0) - 1, r = std::sqrt(std::max(1 - z * z, 0.0));
  const effects::SinCos turn = effects::sincos(2 * std::numbers::pi * random.uniform(id, 1));
  return Vec3(r * turn.cos, r * turn.sin, z).cast<float>();
}

/// Returns the pose and size of a particle that is drawn as a mesh.
Affine3f pose_of(const render::Point& point, const Eigen::Quaternionf& by_contacts, const LookMesh& look) {
  const Vector3f axis = look.axis ? Vector3f(look.axis->cast<float>().normalized()) : direction_of(point.id);
  Eigen::Quaternionf turn(Eigen::AngleAxisf(point.angle, axis));
  if (look.along_motion && point.velocity.norm() > 1e-6f)
    turn = sim::rotation_between(Vector3f::UnitY(), point.velocity) * turn;
  return Eigen::Translation3f(point.position) * (by_contacts * turn) * Eigen::Scaling(point.radius);
}

}  // namespace

float Picture::subframe_time() const {
  const int n = subframes(scene_.render.quality);
  return n == 1 ? 0
                : to_float(scene_.render.shutter / scene_.output.fps.per_second()) / static_cast<float>(n);
}

void Picture::set_balls(std::size_t set, std::span<const render::Point> balls) {
  // A ball that moves by more than its radius between sub-frames would appear as a row of balls.
  std::vector<render::Point> still;
  scratch_blur_streaks_.clear();
  for (const render::Point& ball : balls) {
    const float path_length = subframe_time() * ball.velocity.norm();
    if (path_length < ball.radius) {
      still.push_back(ball);
      continue;
    }
    scratch_blur_streaks_.push_back(ball);
    scratch_blur_streaks_.back().color.w() *=
        1 / (1 + path_length * 2 / (std::numbers::pi_v<float> * ball.radius));
  }
  stage_.set_points(points_[set], still);
  stage_.set_points(blur_streaks_[set], scratch_blur_streaks_);
}

void Picture::place_animated(const AnimatedLook& look, const Affine3f& world_from_body, double time) {
  const double duration = double{look.rig->clips[static_cast<std::size_t>(look.clip)].duration};
  const render::RigPose pose =
      render::pose_at(*look.rig, look.clip, to_float(clip_time(*look.animation, duration, time)));
  const Affine3f world_from_model = world_from_body * look.body_from_model;
  for (const AnimatedLook::Surface& surface : look.surfaces) {
    const render::RigSurface& source = *surface.source;
    if (source.deforms()) stage_.set_mesh(surface.mesh, render::deformed(*look.rig, source, pose));
    stage_.set_transform(
        surface.instance,
        source.skin >= 0 ? world_from_model
                         : Affine3f(world_from_model * pose.world[static_cast<std::size_t>(source.node)]));
  }
}

void Picture::place_body(const DrawnBody& body, const Affine3f& world_from_body, double time) {
  const float explode = body.overlay ? to_float(effects::mean(body.overlay->explode, time)) : 0;
  const bool has_lifetime = body.appear_at > 0 || body.remove_at < kForever;
  const bool visible = exists(body.appear_at, body.remove_at, time);
  if (body.animated) {
    if (visible) place_animated(*body.animated, world_from_body, time);
    for (const AnimatedLook::Surface& surface : body.animated->surfaces)
      if (has_lifetime) stage_.set_visible(surface.instance, visible);
  }
  for (const DrawnPart& part : body.parts) {
    if (has_lifetime) stage_.set_visible(part.instance, visible);
    stage_.set_transform(
        part.instance, world_from_body * Eigen::Translation3f(explode * part.outwards) * part.body_from_part);
  }
}

void Picture::place_rods(const Snapshot& previous, const Snapshot& current, float w) {
  for (std::size_t i = 0; i < rods_.size(); ++i) {
    if (!rods_[i]) continue;
    const RodSample &s0 = previous.rods[i], &s1 = current.rods[i];
    const Vector3f a = s0.a + w * (s1.a - s0.a), b = s0.b + w * (s1.b - s0.b), d = b - a;
    const bool drawn = d.allFinite() && d.norm() > 1e-6f;
    stage_.set_visible(rods_[i], drawn);
    if (drawn)
      stage_.set_transform(rods_[i], Eigen::Translation3f(0.5f * (a + b)) *
                                         sim::rotation_between(Vector3f::UnitY(), d) *
                                         Eigen::Scaling(1.f, d.norm(), 1.f));
  }
}

void Picture::place_points(const Snapshot& previous, const Snapshot& current, float w, double frame_time) {
  for (std::size_t set = 0; set < points_.size(); ++set) {
    // A streak contains its own motion blur: it stays at its position at the end of the frame, with the
    // length of its style.
    std::span<const render::Point> points = current.point_sets[set].points;
    if (w != 1 && styles_[set] != render::PointStyle::streak) {
      scratch_.clear();
      points_at(set, previous, current, w, frame_time, false, scratch_);
      points = scratch_;
    }
    if (meshes_[set].look)
      place_meshes(meshes_[set], points,
                   orientations_at(previous.point_sets[set], current.point_sets[set], w, points));
    else if (blur_streaks_[set])
      set_balls(set, points);
    else
      stage_.set_points(points_[set], points);
  }
}

void Picture::points_at(std::size_t set, const Snapshot& previous, const Snapshot& current, float w,
                        double frame_time, bool all, std::vector<render::Point>& points) const {
  const PointSet &before = previous.point_sets[set], &now = current.point_sets[set];
  const auto dt = static_cast<float>(frame_time);
  const float back = (1 - w) * dt;
  std::size_t j = 0;
  for (std::size_t i = 0; i < now.points.size(); ++i) {
    render::Point p = now.points[i];
    while (j < before.points.size() && before.points[j].id < p.id) ++j;
    if (j < before.points.size() && before.points[j].id == p.id)
      p.position = interpolate(before.points[j], p, w, dt);
    else if (now.ages[i] < back && !all)
      continue;  // not created yet
    else
      p.position -= back * p.velocity;
    if (!now.spins.empty()) p.angle -= back * now.spins[i];
    if (ages_within_frame_[set]) p.age -= back;
    points.push_back(p);
  }
}

std::vector<Eigen::Quaternionf> Picture::orientations_at(const PointSet& before, const PointSet& now, float w,
                                                         std::span<const render::Point> points) {
  std::vector<Eigen::Quaternionf> all;
  if (now.orientations.empty()) return all;
  std::size_t i = 0, j = 0;
  for (const render::Point& point : points) {
    while (now.points[i].id != point.id) ++i;
    while (j < before.points.size() && before.points[j].id < point.id) ++j;
    const bool known = j < before.orientations.size() && before.points[j].id == point.id;
    all.push_back(known ? before.orientations[j].slerp(w, now.orientations[i]) : now.orientations[i]);
  }
  return all;
}

void Picture::place_meshes(DrawnMeshes& drawn, std::span<const render::Point> points,
                           std::span<const Eigen::Quaternionf> orientations) {
  const std::size_t parts = drawn.parts.size();
  while (drawn.instances.size() < points.size() * parts)
    for (const DrawnMeshes::Part& part : drawn.parts) {
      drawn.instances.push_back(stage_.add_instance(part.mesh, part.material, drawn.casts_shadow));
      stage_.set_object(drawn.instances.back(), drawn.object);
    }
  for (std::size_t i = 0; i < std::max(points.size(), drawn.shown); ++i) {
    const bool exists = i < points.size();
    const Affine3f world_from_unit =
        exists ? pose_of(points[i], orientations.empty() ? Eigen::Quaternionf::Identity() : orientations[i],
                         *drawn.look)
               : Affine3f::Identity();
    for (std::size_t k = 0; k < parts; ++k) {
      const render::InstanceHandle instance = drawn.instances[i * parts + k];
      stage_.set_visible(instance, exists && points[i].radius > 0);
      if (exists) stage_.set_transform(instance, world_from_unit * drawn.parts[k].unit_from_part);
    }
  }
  drawn.shown = points.size();
}

void Picture::give_mesh(DrawnCloth& drawn, const ClothSample& sample) {
  if (drawn.version == sample.version) return;
  drawn.version = sample.version;
  if (sample.version == 0) return stage_.set_cloth_mesh(drawn.cloth, drawn.triangles, drawn.uvs);
  std::vector<Eigen::Vector2f> uvs;
  for (const uint32_t source : sample.sources) uvs.push_back(drawn.uvs[source]);
  stage_.set_cloth_mesh(drawn.cloth, sample.triangles, uvs);
}

void Picture::place_cloths(const Snapshot& previous, const Snapshot& current, float w, double frame_time) {
  const auto dt = static_cast<float>(frame_time);
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    if (!cloths_[c].cloth) continue;
    const ClothSample &before = previous.cloths[c], &now = current.cloths[c];
    if (!exists(cloths_[c].appear_at, cloths_[c].remove_at, current.time)) {
      // A surface of points at one place has no area.
      stage_.set_cloth(cloths_[c].cloth, std::vector<Vector3f>(now.points.size(), Vector3f::Zero()));
      continue;
    }
    give_mesh(cloths_[c], now);
    scratch_places_ = now.points;
    for (std::size_t i = 0; w < 1 && i < now.points.size(); ++i)
      scratch_places_[i] =
          i < before.points.size()
              ? interpolate(before.points[i], before.velocities[i], now.points[i], now.velocities[i], w, dt)
              : Vector3f(now.points[i] - (1 - w) * dt * now.velocities[i]);
    stage_.set_cloth(cloths_[c].cloth, scratch_places_);
  }
}

void Picture::place_overlays(const Snapshot& previous, const Snapshot& current, float w) {
  for (std::size_t i = 0; i < overlays_.size(); ++i) {
    if (!overlays_[i]) continue;
    const LineSet &before = previous.overlays[i], &now = current.overlays[i];
    scratch_lines_ = now.lines;
    if (w < 1) {
      // New lines have no motion between the two states.
      std::unordered_map<uint64_t, std::size_t> places;
      for (std::size_t k = 0; k < before.ids.size(); ++k) places.emplace(before.ids[k], k);
      for (std::size_t k = 0; k < scratch_lines_.size(); ++k) {
        const auto place = places.find(now.ids[k]);
        if (place == places.end()) continue;
        const render::Line& was = before.lines[place->second];
        render::Line& line = scratch_lines_[k];
        line.a = was.a + w * (line.a - was.a);
        line.b = was.b + w * (line.b - was.b);
      }
    }
    stage_.set_lines(overlays_[i], scratch_lines_);
  }
}

void Picture::place(const Snapshot& previous, const Snapshot& current, float w, double frame_time) {
  std::vector<BodySample> samples(current.bodies.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = w == 1 ? current.bodies[i] : interpolate(previous.bodies[i], current.bodies[i], w);
  const double time = current.time - (1 - w) * frame_time;
  for (const DrawnBody& body : bodies_)
    place_body(body, body.slot ? affine(samples[*body.slot]) : body.world_from_body, time);
  place_rods(previous, current, w);
  place_points(previous, current, w, frame_time);
  place_cloths(previous, current, w, frame_time);
  place_overlays(previous, current, w);
  latest_camera_ = camera_.at(time, places_, samples);
  stage_.set_camera(latest_camera_);
  stage_.set_lamps(lamps_of(scene_, library_, time, places_, samples));
  stage_.set_time(to_float(time));
}

}  // namespace offstage::producer
