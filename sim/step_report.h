#pragma once
/// The report of World::step(). Its statistics ("figures") are grouped in structs. Each struct lists its
/// figures once (sim/core/figures.h); sums over steps, the statistics of a run and the Python dict are
/// generated from these lists. The names are documented in docs/output-files.md.

#include <cstdint>
#include <tuple>
#include <vector>

#include "sim/articulation/joint.h"
#include "sim/contact/contact_problem.h"
#include "sim/core/figures.h"
#include "sim/core/handle.h"
#include "sim/core/non_finite.h"
#include "sim/dynamics/integrator.h"
#include "sim/particles/particles.h"

namespace offstage::sim {

/// Counts of awake and sleeping bodies.
struct BodyFigures {
  uint32_t awake = 0, asleep = 0;  ///< number of bodies in the last sub-step
  uint32_t islands = 0;            ///< groups of bodies connected by contacts or joints in that sub-step
  uint64_t woken = 0, put_to_sleep = 0;  ///< times that a body woke or fell asleep

  static constexpr auto figures() {
    using T = BodyFigures;
    return std::tuple(Figure("bodies_awake", &T::awake, OverSteps::last),
                      Figure("bodies_asleep", &T::asleep, OverSteps::last),
                      Figure("islands", &T::islands, OverSteps::last), Figure("bodies_woken", &T::woken),
                      Figure("bodies_put_to_sleep", &T::put_to_sleep));
  }
};

/// Contacts of bodies, and the work of collision detection.
struct ContactFigures {
  uint64_t points = 0;        ///< contact points in the last sub-step
  Real penetration = 0;       ///< greatest penetration at the start of a sub-step or at an impact [m]
  uint64_t pairs_tested = 0;  ///< pairs of bodies with overlapping boxes
  uint64_t volume_tests = 0;  ///< tests of two bounding volumes in the trees of two bodies
  uint64_t piece_tests = 0;   ///< tests of two convex parts or triangles of two bodies
  uint64_t speculative = 0;   ///< speculative contacts of the fast solver

  static constexpr auto figures() {
    using T = ContactFigures;
    return std::tuple(Figure("contacts", &T::points, OverSteps::last),
                      Figure("penetration", &T::penetration, OverSteps::greatest),
                      Figure("pairs_tested", &T::pairs_tested), Figure("volume_tests", &T::volume_tests),
                      Figure("piece_tests", &T::piece_tests),
                      Figure("speculative_contacts", &T::speculative));
  }
};

/// Impacts of bodies.
struct ImpactFigures {
  uint64_t searches = 0;           ///< searches for the time of impact of a pair
  uint64_t collisions = 0;         ///< contacts that approached faster than WorldDef::collision_speed
  uint64_t tracebacks = 0;         ///< trace-backs of islands to a time of impact
  uint64_t toi_limit_reached = 0;  ///< pairs or islands that reached the limit of time-of-impact events, or
                                   ///< of work for impacts, in a sub-step; later impacts are not traced back
  /// Pairs whose restitution was suppressed in a sub-step because their pile had too many impacts.
  uint64_t restitution_suppressed = 0;

  static constexpr auto figures() {
    using T = ImpactFigures;
    return std::tuple(Figure("impact_searches", &T::searches), Figure("collisions", &T::collisions),
                      Figure("tracebacks", &T::tracebacks),
                      Figure("toi_limit_reached", &T::toi_limit_reached),
                      Figure("restitution_suppressed", &T::restitution_suppressed));
  }
};

/// Statistics of all cloths together. ClothReport has the statistics of a single cloth and describes each
/// figure.
struct ClothFigures {
  Real strain = 0;  ///< greatest strain of a thread
  /// Greatest depth of a vertex inside a body [m].
  Real penetration = 0;
  uint64_t contacts = 0, self_contacts = 0, springs_clamped = 0;  ///< numbers at the end of the step
  uint64_t moves_limited = 0, moves_held_back = 0, crossings = 0, springs_torn = 0, unconverged = 0;

  static constexpr auto figures() {
    using T = ClothFigures;
    return std::tuple(Figure("strain", &T::strain, OverSteps::greatest),
                      Figure("penetration", &T::penetration, OverSteps::greatest),
                      Figure("contacts", &T::contacts, OverSteps::last),
                      Figure("self_contacts", &T::self_contacts, OverSteps::last),
                      Figure("springs_clamped", &T::springs_clamped, OverSteps::last),
                      Figure("moves_limited", &T::moves_limited),
                      Figure("moves_held_back", &T::moves_held_back), Figure("crossings", &T::crossings),
                      Figure("springs_torn", &T::springs_torn), Figure("unconverged", &T::unconverged));
  }
};

/// Work of the contact solvers.
struct SolverFigures {
  ContactWork exact, fast, lcp;  ///< work of the solvers of resting contact
  ContactWork impacts;           ///< work of the solver of collisions
  ContactWork particle_lcp;      ///< contact forces of particles by pivoting

  static constexpr auto figures() {
    using T = SolverFigures;
    return std::tuple(Figure("exact_solver", &T::exact), Figure("fast_solver", &T::fast),
                      Figure("lcp_solver", &T::lcp), Figure("impact_solver", &T::impacts),
                      Figure("particle_lcp", &T::particle_lcp));
  }
};

/// The figures of a step, or of several steps. Counts cover all sub-steps unless stated otherwise.
struct StepFigures {
  uint64_t substeps = 0;
  ParticleFigures particles;
  BodyFigures bodies;
  ContactFigures contacts;
  ImpactFigures impacts;
  JointFigures joints;
  SolverFigures solvers;
  ClothFigures cloth;
  IntegratorReport integration;  ///< integration of the motion without contacts

  static constexpr auto figures() {
    using T = StepFigures;
    return std::tuple(Figure("substeps", &T::substeps), Figure("", &T::particles), Figure("", &T::bodies),
                      Figure("", &T::contacts), Figure("", &T::impacts), Figure("", &T::joints),
                      Figure("", &T::solvers), Figure("cloth", &T::cloth),
                      Figure("integration", &T::integration));
  }
  void add(const StepFigures& more) { add_figures(*this, more); }
};

/// Two bodies with approximate contact forces: the pair with the greatest error in a group of contacts for
/// which the intended solver failed.
struct RoughContact {
  BodyHandle a, b;
};

/// Statistics of a step. Numerical problems are reported here; they never throw an exception.
struct StepReport : StepFigures {
  /// Bodies that left the world's bounds; they do not move any more.
  std::vector<BodyHandle> bodies_retired;
  /// Joints that exceeded their breaking force or torque in this step.
  std::vector<JointHandle> joints_broken;
  /// One entry for each fall-back of a contact solver, in the order of occurrence.
  std::vector<RoughContact> rough_contacts;
  bool finite = true;    ///< whether all quantities are finite, not NaN or infinite
  NonFinite non_finite;  ///< the first object with a quantity that is not finite, if any
};

}  // namespace offstage::sim
