/// The part of ClothSystem that joins the points and springs of all cloths to common arrays.

#include <algorithm>
#include <optional>

#include "sim/cloth/cloth_system.h"

namespace offstage::sim {
namespace {

/// The stretch limit is at least this factor above the tear limit, because otherwise cloth could not tear.
constexpr Real kBeyondTear = 1.2;

/// Whether an integrator applies the friction of supports.
bool applies_friction(ClothIntegrator integrator) {
  return integrator == ClothIntegrator::relaxed || integrator == ClothIntegrator::implicit;
}

}  // namespace

void ClothSystem::assign(std::vector<Cloth*> cloths) {
  cloths_ = std::move(cloths);
  frozen_.assign(cloths_.size(), {});
  changed_ = true;
}

/// Joins the points and springs of all cloths to common arrays, one cloth after the other.
void ClothSystem::assemble() {
  changed_ = false;
  points_ = {};
  first_.clear();
  collides_.clear();
  seams_.clear();
  all_springs_.clear();
  first_spring_.clear();
  bend_limits_.clear();
  std::vector<StretchLimit::Limit> limits, ties;
  std::vector<Triangle> colliding, touching;  // triangles that collide with cloth; with bodies
  for (uint32_t c = 0; c < cloths_.size(); ++c) {
    Cloth& cloth = *cloths_[c];
    cloth.assign_bending();
    points_.applies_friction.push_back(applies_friction(cloth.def.integrator));
    if (cloth.def.pressure != 0) cloth.gas.assign(cloth.triangles);
    const auto first = static_cast<uint32_t>(points_.size());
    first_.push_back(first);
    for (std::size_t i = 0; i < cloth.points.size(); ++i) {
      points_.position.push_back(padded(cloth.points[i]));
      points_.velocity.push_back(padded(cloth.velocities[i]));
      points_.rest.push_back(padded(cloth.rest[i]));
      points_.mass.push_back(cloth.masses[i]);
      points_.thickness.push_back(cloth.def.thickness);
      points_.friction.push_back(cloth.def.friction);
      points_.self_friction.push_back(cloth.def.self_friction);
      points_.cloth.push_back(c);
      collides_.push_back(cloth.def.collides && !cloth.stopped);
    }
    if (cloth.def.min_bend_radius > 0 && !cloth.stopped)
      bend_limits_.emplace_back(c, first, cloth.points.size(), cloth.bending, cloth.def.min_bend_radius);
    first_spring_.push_back(all_springs_.size());
    for (ClothSpring s : cloth.springs) {
      s.a += first;
      s.b += first;
      for (uint32_t& end : s.counterpart) end += first;
      all_springs_.push_back(s);
      Real limit = s.kind == SpringKind::stretch ? cloth.def.max_stretch
                   : s.kind == SpringKind::shear ? cloth.def.max_shear
                                                 : 0;
      if (limit > 0 && s.kind == SpringKind::stretch) limit = std::max(limit, kBeyondTear * cloth.def.tear);
      if (limit > 0) limits.push_back({s.a, s.b, s.rest_length, limit * s.rest_length, cloth.def.tear > 0});
    }
    if (cloth.def.collides && !cloth.stopped)
      for (const Triangle& t : cloth.triangles)
        touching.push_back({first + t[0], first + t[1], first + t[2]});
    if (cloth.def.self_collision)
      for (const Triangle& t : cloth.triangles)
        colliding.push_back({first + t[0], first + t[1], first + t[2]});
    for (std::size_t k = 0; k < cloth.def.seams.size(); ++k) {
      seams_.push_back({c, cloth.seam_lengths[k]});
      ties.push_back({first + cloth.def.seams[k].a, first + cloth.def.seams[k].b, 0, 0});
    }
  }
  first_spring_.push_back(all_springs_.size());
  kick_.assign(points_.size(), Vec4::Zero());
  for (std::vector<Vec4>* run :
       {&points_.moves, &points_.step_start, &points_.step_velocity, &points_.step_gain})
    run->assign(points_.size(), Vec4::Zero());
  points_.start = points_.position;
  points_.outer.assign(points_.size(), Vec4::Zero());
  points_.acceleration = points_.flow = points_.outer;
  points_.field_drag.assign(points_.size(), 0);
  points_.supported.assign(points_.size(), 0);
  points_.triangle_supports.resize(cloths_.size());
  points_.pin_impulse.assign(points_.size(), Vec4::Zero());
  assign_forces();
  drift_.assign(points_.size(), Vec4::Zero());
  pieces_.assign(points_.size());
  for (const ClothSpring& s : all_springs_) pieces_.join(s.a, s.b);
  for (const StretchLimit::Limit& t : ties) pieces_.join(t.a, t.b);
  pieces_.keep();
  limit_.assign(std::move(limits), std::move(ties), points_.size());
  self_contacts_.assign(std::move(colliding), points_);
  corner_contacts_.assign(std::move(touching), points_);
}

/// Prepares the springs, the gas and the air of each cloth.
void ClothSystem::assign_forces() {
  springs_ = std::vector<ClothSprings>(cloths_.size());
  gas_.clear();
  air_.resize(cloths_.size());
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    if (cloths_[c]->def.integrator == ClothIntegrator::relaxed) springs_[c].assign(springs_of(c), points_);
    gas_.emplace_back(*cloths_[c]);
    air_[c].assign(*cloths_[c], first_[c]);
  }
}

Aabb ClothSystem::reach_of(const Cloth& cloth, Real h) {
  Aabb box;
  for (std::size_t i = 0; i < cloth.points.size(); ++i) {
    const Vec3 around = Vec3::Constant(2 * cloth.def.thickness + 2 * h * cloth.velocities[i].norm());
    box.extend(Vec3(cloth.points[i] - around));
    box.extend(Vec3(cloth.points[i] + around));
  }
  return box;
}

Aabb ClothSystem::reach(Real h) const {
  Aabb box;
  for (const Cloth* cloth : cloths_) box.extend(reach_of(*cloth, h));
  return box;
}

std::vector<Aabb> ClothSystem::reaches(Real h) const {
  std::vector<Aabb> boxes;
  for (const Cloth* cloth : cloths_)
    if (cloth->def.collides && !cloth->stopped) boxes.push_back(reach_of(*cloth, h));
  return boxes;
}

Real ClothSystem::thinnest() const {
  Real least = kInfinity;
  for (const Cloth* cloth : cloths_)
    if (cloth->def.collides && !cloth->stopped) least = std::min(least, cloth->def.thickness);
  return least;
}

std::optional<Real> ClothSystem::first_meeting(const Aabb& box, const Vec3& velocity, Real h) const {
  std::optional<Real> first;
  for (const Cloth* cloth : cloths_) {
    if (!cloth->def.collides || cloth->stopped) continue;
    for (const Triangle& t : cloth->triangles) {
      // The box grows by the motion of the triangle.
      Aabb around;
      Real speed = 0;
      for (const uint32_t i : t) {
        around.extend(cloth->points[i]);
        speed = std::max(speed, cloth->velocities[i].norm());
      }
      const Real margin = cloth->def.thickness + h * speed;
      Real enters = 0, leaves = first.value_or(h);
      for (int axis = 0; axis < 3; ++axis) {
        const Real low = around.min()[axis] - margin - box.max()[axis],
                   high = around.max()[axis] + margin - box.min()[axis], v = velocity[axis];
        if (v == 0) {
          if (low > 0 || high < 0) leaves = -1;
          continue;
        }
        enters = std::max(enters, std::min(low / v, high / v));
        leaves = std::min(leaves, std::max(low / v, high / v));
      }
      if (enters <= leaves) first = enters;
    }
  }
  return first;
}

}  // namespace offstage::sim
