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
  /// The system that moved the island since the interval's start, and that can restore the state at that
  /// time; may be null.
  CoupledSystem* motion = nullptr;
  Real from = 0;  ///< start of the island's interval, counted from the start of the sub-step [s]
};

class ContactGraph {
 public:
  /// Updates the list of pairs from the candidates of the broad phase. Candidates without a dynamic body are
  /// ignored. Existing pairs are kept; new pairs get their surface from surface_of(a, b). If `adds` is false,
  /// pairs that are not among the candidates are removed. body_at(slot) returns a body.
  template <class BodyAt, class SurfaceOf>
  void update(std::span<const IndexPair> candidates, bool adds, BodyAt&& body_at, SurfaceOf&& surface_of);

  void forget(uint32_t slot);  ///< removes all pairs of a body
  void forget_all() { entries_.clear(); }

  /// Calls f(pair) for all pairs, in ascending order of the bodies' slots.
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

/// Whether a pair has contact points, so that the bodies may touch in the interval.
bool may_touch(const ContactPair& pair);
/// Whether two bodies touch, or had a contact force in the last solved interval.
bool touch_or_push(const ContactPair& pair);

/// Groups awake bodies into islands by contacts and springs, and sets Body::island. `bodies` must be in the
/// order of rank. The islands are in the order of their first bodies; Island::motion and
/// Island::articulations are not set. The memory of `islands` is reused. A pair joins its bodies into one
/// island if `connect` returns true for it. Islands do not contain pairs without contact points, nor pairs
/// between different islands.
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
