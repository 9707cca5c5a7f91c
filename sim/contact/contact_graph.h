#pragma once
/// Pairs of bodies near each other, their contacts, and their islands: bodies connected, directly or through
/// other bodies, by contacts or springs. Islands are independent of each other (physics E6, E7, P6).

#include <memory>
#include <span>
#include <vector>

#include "sim/collision/broad_phase.h"
#include "sim/contact/contact_pair.h"

namespace offstage::sim {

class Articulation;
class CoupledSystem;

/// Connected bodies, ordered by rank, and the pairs among them or with bodies that are not dynamic. Within a
/// sub-step all bodies of an island are at the same time.
struct Island {
  std::vector<Body*> bodies;
  std::vector<ContactPair*> pairs;
  std::vector<Articulation*> articulations;
  /// System that has moved the island from the interval's start, and can restore its state.
  CoupledSystem* motion = nullptr;
  Real from = 0;  ///< start of the island's interval, since the sub-step's start [s]
};

class ContactGraph {
 public:
  /// Updates the pairs to those of the broad phase of which at least one body is dynamic. Existing pairs are
  /// kept, and new pairs get their surface from `surface_of(a, b)`. Pairs that the broad phase no longer
  /// reports are removed, unless `adds`. `body_at` returns the body in a slot.
  template <class BodyAt, class SurfaceOf>
  void update(std::span<const IndexPair> candidates, bool adds, BodyAt&& body_at, SurfaceOf&& surface_of);

  void forget(uint32_t slot);  ///< removes all pairs of a body
  void forget_all() { entries_.clear(); }

  /// All pairs in ascending order of their slots.
  template <class F>
  void for_each(F&& f) const {
    for (const Entry& e : entries_) f(*e.pair);
  }
  std::size_t size() const { return entries_.size(); }
  ContactPair& operator[](std::size_t i) const { return *entries_[i].pair; }

 private:
  struct Entry {
    uint32_t low, high;
    std::unique_ptr<ContactPair> pair;
  };
  std::vector<Entry> entries_, next_;
};

/// Whether two bodies may touch in the interval: they have contact points.
bool may_touch(const ContactPair& pair);
/// Whether two bodies touch, or push each other in the interval that was solved last.
bool touch_or_push(const ContactPair& pair);

/// Groups awake bodies, which must be in the order of ranks, by links between them, and sets Body::island.
/// The islands are in the order of their first bodies, without motion or articulations; their memory is
/// reused. Pairs without contact points are omitted, and so are pairs that do not `connect` their bodies and
/// are not within one island.
void find_islands(std::span<Body* const> bodies, std::span<ContactPair* const> pairs,
                  bool (*connect)(const ContactPair&), std::span<const std::pair<Body*, Body*>> springs,
                  std::vector<Island>& islands);

template <class BodyAt, class SurfaceOf>
void ContactGraph::update(std::span<const IndexPair> candidates, bool adds, BodyAt&& body_at,
                          SurfaceOf&& surface_of) {
  next_.clear();
  std::size_t old = 0;
  const auto pass = [&] {
    if (adds) next_.push_back(std::move(entries_[old]));
    ++old;
  };
  for (const auto& [low, high] : candidates) {
    while (old < entries_.size() && std::pair(entries_[old].low, entries_[old].high) < std::pair(low, high))
      pass();
    if (old < entries_.size() && entries_[old].low == low && entries_[old].high == high) {
      next_.push_back(std::move(entries_[old++]));
      continue;
    }
    Body *a = body_at(low), *b = body_at(high);
    if (!a->is_dynamic() && !b->is_dynamic()) continue;
    if (b->rank < a->rank) std::swap(a, b);
    if (a->collision_shape().is_plane()) std::swap(a, b);
    next_.push_back({low, high, std::make_unique<ContactPair>(*a, *b, surface_of(*a, *b))});
  }
  while (old < entries_.size()) pass();
  std::swap(entries_, next_);
}

}  // namespace offstage::sim
