#include "sim/world/cloth_near_bodies.h"

#include <algorithm>
#include <cmath>

#include "sim/core/parallel_loop.h"

namespace offstage::sim {
namespace {

/// Cloth between two bodies is searched up to this distance of the bodies, in thicknesses.
constexpr Real kSearchDistance = 4;

void grow(Aabb& box, Real margin) {
  box.min().array() -= margin;
  box.max().array() += margin;
}

}  // namespace

void ClothNearBodies::begin(Real h) {
  for (const uint32_t slot : filled_) near_[slot].clear();
  filled_.clear();
  cloths_.clear();
  thickest_ = 0;
  world_.cloths.for_each([&](ClothHandle handle, const std::unique_ptr<Cloth>& cloth) {
    if (cloth->absent || cloth->stopped || !cloth->def.collides) return;
    thickest_ = std::max(thickest_, cloth->def.thickness);
    Real fastest2 = 0;
    Aabb box;
    for (std::size_t i = 0; i < cloth->points.size(); ++i) {
      box.extend(cloth->points[i]);
      fastest2 = std::max(fastest2, cloth->velocities[i].squaredNorm());
    }
    grow(box, h * std::sqrt(fastest2));
    cloths_.push_back({handle.index, cloth.get(), box});
  });
  for (Near& near : cloths_) grow(near.box, room());
}

Real ClothNearBodies::room() const {
  return kSearchDistance * thickest_;
}

bool ClothNearBodies::is_near(const Aabb& box) const {
  return std::ranges::any_of(cloths_, [&](const Near& near) { return near.box.intersects(box); });
}

void ClothNearBodies::find(std::span<ContactPair* const> pairs) {
  if (!any()) return;
  near_.resize(std::max<std::size_t>(near_.size(), world_.bodies.slot_count()));
  std::vector<const Body*> bodies;
  for (const ContactPair* pair : pairs)
    for (const Body* body : {&pair->a(), &pair->b()})
      if (body->is_awake() && is_near(bounds(body->solid, body->pose))) bodies.push_back(body);
  const auto by_slot = [](const Body* x, const Body* y) { return x->handle.index < y->handle.index; };
  std::sort(bodies.begin(), bodies.end(), by_slot);
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  for_each_index(bodies.size(), [&](std::size_t i) {
    Aabb box =
        bounds(bodies[i]->solid, bodies[i]->start_pose).merged(bounds(bodies[i]->solid, bodies[i]->pose));
    grow(box, room());
    collect(box, near_[bodies[i]->handle.index]);
  });
  for (const Body* body : bodies)
    if (!near_[body->handle.index].empty()) filled_.push_back(body->handle.index);
}

void ClothNearBodies::collect(const Aabb& box, std::vector<LayerTriangle>& found) const {
  found.clear();
  for (const auto& [slot, cloth, around] : cloths_) {
    if (!around.intersects(box)) continue;
    const std::vector<Vec3>& at = cloth->points;
    for (std::size_t k = 0; k < cloth->triangles.size(); ++k) {
      const Triangle& t = cloth->triangles[k];
      const Vec3 low = at[t[0]].cwiseMin(at[t[1]]).cwiseMin(at[t[2]]),
                 high = at[t[0]].cwiseMax(at[t[1]]).cwiseMax(at[t[2]]);
      if ((low.array() > box.max().array()).any() || (high.array() < box.min().array()).any()) continue;
      const std::vector<Vec3>& v = cloth->velocities;
      found.push_back({{at[t[0]], at[t[1]], at[t[2]]},
                       (v[t[0]] + v[t[1]] + v[t[2]]) / 3,
                       cloth->def.thickness,
                       cloth->def.friction,
                       slot,
                       static_cast<uint32_t>(k)});
    }
  }
}

std::span<const LayerTriangle> ClothNearBodies::between(const ContactPair& pair) const {
  if (filled_.empty()) return {};
  for (const Body* body : {&pair.a(), &pair.b()})
    if (body->is_awake() && body->handle.index < near_.size() && !near_[body->handle.index].empty())
      return near_[body->handle.index];
  return {};
}

}  // namespace offstage::sim
