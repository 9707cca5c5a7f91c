#pragma once
/// Which bodies are near each other, where they touch, and the islands that they form: bodies joined,
/// directly or by others, by contacts or springs. Islands are independent of each other (physics E6, E7, P6).

#include <memory>
#include <span>
#include <vector>

#include "sim/collision/broad_phase.h"
#include "sim/contact/contact_pair.h"

namespace offstage::sim {

class Articulation;
class CoupledSystem;

/// Bodies that depend on each other, by rank, and the pairs that join them or touch what does not move.
/// In a sub-step they move together from the same time on.
struct Island {
  std::vector<Body*> bodies;
  std::vector<ContactPair*> pairs;
  std::vector<Articulation*> articulations;
  CoupledSystem* motion = nullptr;  ///< that moved it from the interval's start; knows the way back
  Real from = 0;                    ///< since the sub-step's start [s]
};

class ContactGraph {
 public:
  /// Makes the pairs those that the broad phase found, of which at least one is dynamic: new ones are made by
  /// `surface_of(a, b)`, those of before are kept, others forgotten unless `adds`. `body_at` gives the body
  /// in a slot.
  template <class BodyAt, class SurfaceOf>
  void update(std::span<const IndexPair> candidates, bool adds, BodyAt&& body_at, SurfaceOf&& surface_of);

  void forget(uint32_t slot);  ///< all pairs of a body
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

/// Groups awake bodies, which must be in the order of ranks, by links between them, and sets Body::island.
/// The islands are in the order of their first bodies, without motion or articulations; what memory they had
/// is used again. Pairs without points join nothing and are left out.
void find_islands(std::span<Body* const> bodies, std::span<ContactPair* const> pairs,
                  std::span<const std::pair<Body*, Body*>> springs, std::vector<Island>& islands);

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
