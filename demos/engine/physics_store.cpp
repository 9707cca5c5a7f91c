#include "engine/physics_store.h"

#include <algorithm>

namespace offstage::engine {
namespace {

std::size_t bytes_of(const producer::Snapshot& state) {
  std::size_t bytes = sizeof state + state.bodies.size() * sizeof(producer::BodySample) +
                      state.rods.size() * sizeof(producer::RodSample);
  for (const producer::PointSet& set : state.point_sets)
    bytes += set.points.size() * sizeof(render::Point) + set.ages.size() * sizeof(float);
  for (const producer::ClothSample& cloth : state.cloths)
    bytes += (cloth.points.size() + cloth.velocities.size()) * sizeof(Eigen::Vector3f) +
             (cloth.triangles.size() + cloth.sources.size()) * sizeof(uint32_t);
  for (const producer::LineSet& lines : state.overlays)
    bytes += lines.lines.size() * (sizeof(render::Line) + sizeof(uint64_t));
  return bytes;
}

}  // namespace

std::shared_ptr<Physics> PhysicsStore::open(const std::string& key) {
  const auto it = std::ranges::find(entries_, key, &Entry::key);
  if (it != entries_.end()) {
    entries_.splice(entries_.begin(), entries_, it);
  } else {
    constexpr std::size_t kMostSimulations = 64;
    entries_.push_front({key, std::make_shared<Physics>(), 0});
    if (entries_.size() > kMostSimulations) {
      bytes_ -= entries_.back().bytes;
      entries_.pop_back();
    }
  }
  return entries_.front().physics;
}

void PhysicsStore::keep(const std::string& key, int frame, std::shared_ptr<const producer::Snapshot> state) {
  const auto entry = std::ranges::find(entries_, key, &Entry::key);
  if (entry == entries_.end()) return;
  const std::size_t bytes = bytes_of(*state);
  while (bytes_ + bytes > most_bytes_ && &entries_.back() != &*entry) {
    bytes_ -= entries_.back().bytes;
    entries_.pop_back();
  }
  if (bytes_ + bytes > most_bytes_) return;
  const auto place = static_cast<std::size_t>(frame - 1);
  auto& states = entry->physics->states;
  if (states.size() <= place) states.resize(place + 1);
  if (states[place]) return;
  states[place] = std::move(state);
  entry->bytes += bytes;
  bytes_ += bytes;
}

}  // namespace offstage::engine
