// The part of picture.h that moves all objects to their states between two snapshots.

#include <numbers>
#include <unordered_map>

#include "effects/distribution.h"
#include "producer/base/to_float.h"
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

/// Position of a particle at share w of the interval `dt` between two states: the cubic through both states
/// if it flew freely; a straight line if it bounced in between, which a cubic would overshoot.
Vector3f interpolate(const render::Point& a, const render::Point& b, float w, float dt) {
  const Vector3f step = b.position - a.position;
  const Vector3f mean_velocity = 0.5f * (a.velocity + b.velocity);
  const bool free_flight = (step - mean_velocity * dt).norm() <= 0.1f * mean_velocity.norm() * dt;
  if (!free_flight) return a.position + w * step;
  const float w2 = w * w, w3 = w2 * w;
  return a.position + (3 * w2 - 2 * w3) * step +
         dt * ((w3 - 2 * w2 + w) * a.velocity + (w3 - w2) * b.velocity);
}

/// Position of a cloth point between two states, by the cubic through both. If there was an impact in
/// between, the velocities at both ends are misleading; their deviation from the mean velocity is limited to
/// half of it.
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
    const float way = subframe_time() * ball.velocity.norm();
    if (way < ball.radius) {
      still.push_back(ball);
      continue;
    }
    scratch_blur_streaks_.push_back(ball);
    scratch_blur_streaks_.back().color.w() *= 1 / (1 + way * 2 / (std::numbers::pi_v<float> * ball.radius));
  }
  stage_.set_points(points_[set], still);
  stage_.set_points(blur_streaks_[set], scratch_blur_streaks_);
}

void Picture::place_body(const DrawnBody& body, const Affine3f& world_from_body, double time) {
  const float explode = body.overlay ? to_float(effects::mean(body.overlay->explode, time)) : 0;
  const bool has_lifetime = body.appear_at > 0 || body.remove_at < kForever;
  for (const DrawnPart& part : body.parts) {
    if (has_lifetime) stage_.set_visible(part.instance, exists(body.appear_at, body.remove_at, time));
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
  const auto dt = static_cast<float>(frame_time);
  const float back = (1 - w) * dt;
  for (std::size_t set = 0; set < points_.size(); ++set) {
    const PointSet &before = previous.point_sets[set], &now = current.point_sets[set];
    // A streak contains its own motion blur: it stays at its position at the end of the frame, with the
    // length of its style.
    const auto show = [&](std::span<const render::Point> points) {
      blur_streaks_[set] ? set_balls(set, points) : stage_.set_points(points_[set], points);
    };
    if (w == 1 || styles_[set] == render::PointStyle::streak) {
      show(now.points);
      continue;
    }
    scratch_.clear();
    std::size_t j = 0;
    for (std::size_t i = 0; i < now.points.size(); ++i) {
      render::Point p = now.points[i];
      while (j < before.points.size() && before.points[j].id < p.id) ++j;
      if (j < before.points.size() && before.points[j].id == p.id)
        p.position = interpolate(before.points[j], p, w, dt);
      else if (now.ages[i] < back)
        continue;  // not created yet
      else
        p.position -= back * p.velocity;
      scratch_.push_back(p);
    }
    show(scratch_);
  }
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
  stage_.set_lamps(lamps_of(scene_, time, places_, samples));
  stage_.set_time(to_float(time));
}

}  // namespace offstage::producer
