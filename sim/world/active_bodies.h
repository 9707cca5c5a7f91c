#pragma once
/// Lists of the awake, the kinematic and the sleeping bodies. A group of bodies that has been almost at rest
/// for some time falls asleep: it is not simulated until something disturbs it.

#include <map>
#include <span>
#include <vector>

#include "sim/contact/contact_graph.h"
#include "sim/world/world_state.h"

namespace offstage::sim {

class ActiveBodies {
 public:
  explicit ActiveBodies(const WorldState& world) : world_(world) {}

  /// Awake dynamic bodies, and moving kinematic bodies, each in the order of rank. The lists are valid until
  /// the next update().
  std::span<Body* const> awake() const { return awake_; }
  std::span<Body* const> kinematic() const { return kinematic_; }
  std::size_t asleep() const { return asleep_; }
  /// Calls f(body) for each sleeping body.
  template <class F>
  void for_each_asleep(F&& f) const {
    for (const auto& [number, group] : sleeping_)
      for (Body* body : group) f(*body);
  }

  /// Marks the lists as outdated. Call it after a body has been added or removed, or has appeared or
  /// disappeared.
  void note_new_set() { is_ranked_ = false, note_change(); }
  /// Marks the lists as outdated. Call it after a body has become able or unable to move.
  void note_change() { is_current_ = false, ++version_; }
  /// Number of changes of the set of moving bodies so far.
  uint64_t version() const { return version_; }
  /// Updates the lists after changes.
  void update();

  /// Begins a sampling step. All bodies that may move in this step are collected in stepped().
  void begin_step();
  std::span<Body* const> stepped() const { return stepped_; }
  void add_stepped(Body& body) { stepped_.push_back(&body); }
  void forget(Body& body) { std::erase(stepped_, &body); }

  /// Wakes a body and its whole sleeping group, and returns these bodies. Returns an empty list if the body
  /// is awake.
  std::vector<Body*> wake(Body& body);
  void wake_all();
  /// Wakes the bodies on which the force of a field or a spring has changed since they fell asleep.
  void wake_pushed(Real time);
  /// Puts islands at rest to sleep at the end of a sub-step, which begins at time `start` and has length h
  /// [s].
  void put_to_sleep(std::span<const Island> islands, Real start, Real h);
  /// Adds the numbers of bodies that woke or fell asleep since the last call to the report.
  void count(StepReport& report);

 private:
  void rank();
  void watch_springs(std::span<Body* const> group);
  Wrench time_dependent_wrench(const Body& body, Real time) const;

  const WorldState& world_;
  bool is_ranked_ = true, is_current_ = false;
  uint64_t version_ = 0;
  std::vector<Body*> awake_, kinematic_, stepped_;
  std::map<uint32_t, std::vector<Body*>> sleeping_;
  uint32_t sleeping_groups_ = 0;  // number of groups so far
  std::size_t asleep_ = 0;        // number of sleeping bodies
  std::size_t watched_ = 0;       // number of springs of sleeping bodies whose other ends can move
  uint64_t woken_ = 0, put_to_sleep_ = 0;
};

/// Whether the wrench `push` could move a body that was at rest under the wrench `at_rest` when it fell
/// asleep.
bool is_pushed(const Body& body, const Wrench& push, const Wrench& at_rest);

}  // namespace offstage::sim
