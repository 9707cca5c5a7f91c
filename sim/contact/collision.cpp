#include "sim/contact/collision.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "sim/contact/bounded_collision.h"
#include "sim/contact/friction_lcp.h"
#include "sim/contact/jointed_sweeps.h"
#include "sim/contact/proximal_newton.h"

namespace offstage::sim {
namespace {

using Eigen::Vector2d;

constexpr Real kRounding = 1e-13;  ///< relative rounding error of products of impulses and velocities
/// The circle of directions is divided into this number of arcs; each is searched for a change of sign.
constexpr int kArcs = 64;
constexpr int kHalvings = 60;  ///< number of bisection steps; they reach the last bit
/// Greatest number of solutions of a cluster while the restitution that conserves energy is searched.
constexpr int kSolves = 20;
constexpr Real kKeptEnergy = 1e-9;  ///< fraction of the energy added by restitution that may be lost instead
constexpr std::size_t kDense = 24;  ///< clusters of at most this many contacts are solved by pivoting
constexpr Real kAcceptedResidual = 1e-6;  ///< fraction of the velocities: accepted residual of an impact
/// A result whose residual is larger than this fraction of the velocities is rejected.
constexpr Real kRoughResidual = 1e-3;
constexpr uint32_t kCollisionSweeps = 200, kPlasticSweeps = 400, kJointedSweeps = 60;
/// Limits under Effort::bounded. kUpdates: updates of single contacts in a sweep or a sequence (60 ns each);
/// kMoreUpdates: the same for later solutions of the same cluster. kBoundedSolves: solutions in the search
/// for the restitution. kJointBudget: cost of a solution with joints [ns].
constexpr std::size_t kUpdates = 4'000, kMoreUpdates = 1'000;
/// Sweeps under Effort::bounded that cannot be improved end when no velocity changes by more than this
/// fraction of the velocities.
constexpr Real kSweptRest = 1e-4;
constexpr int kBoundedSolves = 3;
constexpr Real kJointBudget = 1e6;
/// Clusters of at most this many contacts whose sweeps did not converge are solved by the proximal method, if
/// the budget allows. Errors of sweeps depend on the order of the contacts, and would break the symmetry of a
/// scene.
constexpr std::size_t kImproved = 100;
constexpr Real kResting = 1e-11;  ///< speeds of approach below this fraction of the greatest one are ignored
/// Contacts collide together if their speeds of approach differ by less than this fraction of the greatest
/// one.
constexpr Real kTie = 1e-6;
/// Greatest number of impulses per contact of a sequence, without and with joints. With joints, each impulse
/// takes a solution of the whole system.
constexpr std::size_t kImpulses = 200, kJointedImpulses = 12;

/// Returns the impulse that changes the normal velocity by du_n, with friction at its limit against the
/// direction `d`. Returns nothing if this friction would pull the points together faster than the normal
/// impulse separates them.
std::optional<Vec3> sliding_impulse(const Mat3& K, Real du_n, Real mu, const Vector2d& d) {
  const Real resistance = K(0, 0) - mu * (K(0, 1) * d.x() + K(0, 2) * d.y());
  if (!(resistance > 0)) return std::nullopt;
  const Real normal = du_n / resistance;
  return Vec3(normal, -mu * normal * d.x(), -mu * normal * d.y());
}

/// Returns a unit direction for each s in [0, 4). s runs along the boundary of a square, so that no
/// trigonometric functions are needed.
Vector2d direction_at(Real s) {
  const int side = std::min(static_cast<int>(s), 3);
  const Real x = 2 * (s - side) - 1;
  constexpr std::array<std::array<int, 4>, 4> kTurns = {
      {{1, 0, 0, 1}, {0, -1, 1, 0}, {-1, 0, 0, -1}, {0, 1, -1, 0}}};
  const auto& turn = kTurns[static_cast<std::size_t>(side)];
  return Vector2d(turn[0] + turn[1] * x, turn[2] + turn[3] * x).normalized();
}

/// Computes the impulse of sliding friction on the round cone. The friction acts against the sliding velocity
/// after the impact, so d and u_tk(after) are parallel. With P_n = du_n / D(d), D(d) = K_nn - mu K_n,tk.d,
/// their cross product times D is
///   g(d) = d x (D u_tk + du_n (K_tk,n - mu K_tk d)),
/// a trigonometric polynomial of the second degree with at most four roots. With a diagonal K one root is the
/// direction of sliding before the impact. If there are several, the one nearest to this direction is used.
class RoundSlide {
 public:
  RoundSlide(const Mat3& K, const Vec3& u, Real du_n, Real mu) : K_(K), u_(u), du_n_(du_n), mu_(mu) {}

  Vec3 impulse() {
    if (mu_ > 0) {
      consider(u_.tail<2>().norm() > 0 ? Vector2d(u_.tail<2>().normalized()) : Vector2d(1, 0), kRounding);
      if (!best_) search();
    }
    return best_ ? *best_ : Vec3(du_n_ / K_(0, 0), 0, 0);
  }

 private:
  /// Returns D u_tk(after) for friction along -d.
  Vector2d sliding(const Vector2d& d) const {
    const Vector2d coupling = K_.block<2, 1>(1, 0);
    return (K_(0, 0) - mu_ * coupling.dot(d)) * u_.tail<2>() +
           du_n_ * (coupling - mu_ * K_.block<2, 2>(1, 1) * d);
  }
  static Real cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }
  Real g(Real s) const { return cross(direction_at(s), sliding(direction_at(s))); }

  void consider(const Vector2d& d, Real tolerance) {
    const Vector2d after = sliding(d);
    if (after.dot(d) < -kRounding || std::abs(cross(d, after)) > tolerance * after.norm()) return;
    const Real nearness = d.dot(u_.tail<2>());
    const std::optional<Vec3> p = sliding_impulse(K_, du_n_, mu_, d);
    if (!p || (best_ && nearness <= nearness_)) return;
    best_ = p;
    nearness_ = nearness;
  }

  void search() {
    for (int arc = 0; arc < kArcs; ++arc) {
      Real low = 4.0 * arc / kArcs, high = 4.0 * (arc + 1) / kArcs;
      const bool rises = g(low) < 0;
      if (rises == (g(high) < 0)) continue;
      for (int k = 0; k < kHalvings; ++k)
        ((g((low + high) / 2) < 0) == rises ? low : high) = (low + high) / 2;
      consider(direction_at((low + high) / 2), 1);
    }
  }

  const Mat3& K_;
  const Vec3& u_;
  Real du_n_, mu_;
  std::optional<Vec3> best_;
  Real nearness_ = 0;
};

/// Solves one of the cases of section 4.8: each axis sticks (sign 0), or slides against friction at the limit
/// (sign +1 or -1).
std::optional<Vec3> axes_impulse(const Mat3& K, const Vec3& u, Real du_n, const Vec3& mu, const Vec3& signs) {
  Mat3 M = K;
  Vec3 du(du_n, -u.y(), -u.z());
  for (const int axis : {1, 2}) {
    if (signs[axis] == 0) continue;
    M.row(axis) = Vec3::Unit(axis).transpose();
    M(axis, 0) = signs[axis] * mu[axis];
    du[axis] = 0;
  }
  const Vec3 p = M.partialPivLu().solve(du), after = u + K * p;
  const Real still = kRounding * (std::abs(du_n) + u.norm());
  if (!p.allFinite() || p.x() <= 0) return std::nullopt;
  for (const int axis : {1, 2}) {
    const bool holds = signs[axis] == 0 ? std::abs(p[axis]) <= mu[axis] * p.x() * (1 + kRounding)
                                        : signs[axis] * after[axis] >= -still;
    if (!holds) return std::nullopt;
  }
  return p;
}

Vec3 separate_slide(const Mat3& K, const Vec3& u, Real du_n, const Vec3& mu) {
  const Real t = u.y() < 0 ? -1 : 1, k = u.z() < 0 ? -1 : 1;
  for (const Real sign_t : {0.0, t, -t})
    for (const Real sign_k : {0.0, k, -k})
      if (const auto p = axes_impulse(K, u, du_n, mu, {0, sign_t, sign_k})) return *p;
  return {du_n / K(0, 0), 0, 0};
}

/// Returns the impulse for a restitution. This impulse may add kinetic energy, which the caller must check.
Vec3 impulse_for(const Mat3& K, const Vec3& u, Real restitution, Real mu_t, Real mu_k) {
  const Real du_n = -(1 + restitution) * u.x();
  const Vec3 stick = K.llt().solve(Vec3(du_n, -u.y(), -u.z()));
  if (mu_t != mu_k) return separate_slide(K, u, du_n, {0, mu_t, mu_k});
  if (stick.tail<2>().norm() <= mu_t * stick.x()) return stick;
  return RoundSlide(K, u, du_n, mu_t).impulse();
}

/// Whether the kinetic energy added by an impulse, p.(u + u+) / 2, is more than rounding.
bool adds_energy(const Mat3& K, const Vec3& u, const Vec3& p) {
  return p.dot(u + K * p / 2) > kRounding * p.norm() * u.norm();
}

/// Returns the speed of approach [m/s]; 0 if the points separate.
Real approach(const Contact& c, std::span<const ContactBody> bodies) {
  return std::max(0.0, -c.relative_velocity(bodies).x());
}

/// Limit of the work for a solution.
enum class Effort : uint8_t { full, bounded };

/// Solves few contacts by pivoting and many by sweeps. If necessary, the proximal method improves the
/// impulses of the sweeps. With joints only the proximal method is used.
void solve_together(std::span<ContactBody> bodies, std::span<Contact> contacts, const JointProblem& joints,
                    Effort effort, ContactWork& work) {
  const bool is_bounded = effort == Effort::bounded;
  if (!joints.empty()) {
    for (Contact& c : contacts) c.is_guessed = false;
    const auto solved =
        ProximalNewton().solve(bodies, contacts, joints, is_bounded ? kJointBudget : kInfinity);
    if (solved) return work.add(*solved);
    for (Contact& c : contacts) c.impulse.setZero();
    return work.add({.solves = 1, .fallbacks = 1, .residual = kInfinity});
  }
  if (contacts.size() <= kDense) return work.add(solve_by_pivoting(bodies, contacts));
  const std::vector<ContactBody> before(bodies.begin(), bodies.end());
  Real fastest = 0;
  for (Contact& c : contacts) {
    c.impulse.setZero();
    c.is_guessed = true;
    fastest = std::max(fastest, c.relative_velocity(bodies).cwiseAbs().maxCoeff());
  }
  const uint32_t sweeps = projected_gauss_seidel(bodies, contacts, kCollisionSweeps, kRounding * fastest);
  const Real left = residual(bodies, contacts);
  work.add({.solves = 1, .iterations = sweeps, .residual = left});
  if (left <= kAcceptedResidual * fastest) return;
  std::copy(before.begin(), before.end(), bodies.begin());
  work.add(*ProximalNewton().solve(bodies, contacts));
  --work.solves;
}

/// Computes the collision of a cluster of contacts. If it would add energy, all restitutions are scaled down
/// by the factor that conserves energy.
class Cluster {
 public:
  /// `budget`: greatest cost of improvements of sweeps [ns]. It is reduced by their cost.
  Cluster(std::span<ContactBody> bodies, std::span<Contact> contacts, std::span<const Real> restitution,
          const JointProblem& joints, Effort effort, Real* budget = nullptr)
      : bodies_(bodies),
        contacts_(contacts),
        restitution_(restitution),
        joints_(joints),
        effort_(effort),
        budget_(budget),
        before_(bodies.begin(), bodies.end()) {
    for (const Contact& c : contacts) velocities_.push_back(c.relative_velocity(bodies));
    for (BoundedRow& r : joints.bounded)
      if (r.resists_change) r.target = row_speed(r, bodies);
  }

  ContactWork solve() {
    ContactWork work = solve_with(1);
    if (!is_solved(work)) return solve_plastic(work);
    if (const Real energy = added_energy(); energy > 0) return soften(work, energy);
    return work;
  }

 private:
  ContactWork solve_with(Real factor) {
    fastest_ = 0;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      contacts_[i].target = std::max(0.0, -factor * restitution_[i] * velocities_[i].x());
      fastest_ = std::max(fastest_, velocities_[i].norm());
    }
    if (is_swept()) return go_on_sweeping();
    std::copy(before_.begin(), before_.end(), bodies_.begin());
    ContactWork work;
    solve_together(bodies_, contacts_, joints_, effort_, work);
    return work;
  }

  /// Whether the limit of work allows only a number of sweeps. A residual then does not count as a failure,
  /// because contacts that still approach will collide again.
  bool is_swept() const {
    return effort_ == Effort::bounded && joints_.empty() && contacts_.size() > kFewContacts;
  }
  bool is_solved(const ContactWork& work) const {
    return is_swept() || work.residual <= kRoughResidual * fastest_;
  }

  /// Makes a bounded number of sweeps. The first call starts with the guesses of the impulses, if there are
  /// any; later calls start with the impulses of the previous call.
  ContactWork go_on_sweeping() {
    const std::size_t updates = has_swept_ ? kMoreUpdates : kUpdates;
    if (!has_swept_)
      for (Contact& c : contacts_) {
        if (!c.is_guessed) c.impulse.setZero();
        apply(c, c.impulse, bodies_);
      }
    has_swept_ = true;
    const bool may_improve = contacts_.size() <= kImproved && budget_ && *budget_ > 0;
    const uint32_t most = sweeps_of(updates),
                   sweeps = projected_gauss_seidel(bodies_, contacts_, most,
                                                   (may_improve ? kRounding : kSweptRest) * fastest_);
    ContactWork work{.solves = 1, .iterations = sweeps, .residual = residual(bodies_, contacts_)};
    if (sweeps == most && may_improve) improve(work);
    return work;
  }

  /// Improves the result of sweeps by the proximal method, if this is within its budget.
  void improve(ContactWork& work) {
    const std::vector<ContactBody> swept(bodies_.begin(), bodies_.end());
    const std::vector<Contact> contacts(contacts_.begin(), contacts_.end());
    std::copy(before_.begin(), before_.end(), bodies_.begin());
    for (Contact& c : contacts_) c.is_guessed = true;
    ProximalNewton newton;
    const std::optional<ContactWork> improved = newton.solve(bodies_, contacts_, {}, *budget_);
    *budget_ -= newton.cost();
    if (improved) {
      work.iterations += improved->iterations;
      work.factorizations += improved->factorizations;
      if (improved->residual < work.residual) {
        work.residual = improved->residual;
        return;
      }
    }
    std::copy(swept.begin(), swept.end(), bodies_.begin());
    std::copy(contacts.begin(), contacts.end(), contacts_.begin());
  }
  uint32_t sweeps_of(std::size_t updates) const {
    return static_cast<uint32_t>(std::max<std::size_t>(updates / contacts_.size(), 1));
  }

  /// Finds the factor of the restitutions at which no energy is added. `energy`: the energy that the unscaled
  /// restitutions add [J]. Without restitution p.u+ <= 0 at each contact, so the sum of p.(u + u+) / 2 is
  /// negative. The factor therefore lies between 0 and 1. While the same contacts close and slide, the energy
  /// is a quadratic function of the factor, and false position finds its zero in a few steps. Halving the
  /// weight of an end that stays (the Illinois rule) prevents slow convergence.
  ContactWork soften(ContactWork work, Real energy) {
    work.restitution_reduced = 1;
    struct End {
      Real factor, energy;
    } low{0, 0}, high{1, energy};
    const Real enough = kKeptEnergy * energy;
    Real factor = 0;
    bool was_low = false, was_high = false;
    for (int k = 0; k < (effort_ == Effort::bounded ? kBoundedSolves : kSolves); ++k) {
      const ContactWork one = solve_with(factor);
      work.add(one);
      const Real added = added_energy();
      if (!is_solved(one) || (k == 0 && added > 0)) return solve_plastic(work);
      if (added <= 0) {
        if (was_low) high.energy /= 2;
        low = {factor, added};
        if (added >= -enough) break;
      } else {
        if (was_high) low.energy /= 2;
        high = {factor, added};
      }
      was_low = k > 0 && added <= 0;
      was_high = added > 0;
      factor = low.factor + (high.factor - low.factor) * low.energy / (low.energy - high.energy);
    }
    if (factor != low.factor) work.add(solve_with(low.factor));
    work.solves = 1;
    if (added_energy() > 0) shrink();
    return work;
  }

  /// Solves the impact without restitution, after the solution with restitution has failed. Targets with
  /// restitution may contradict each other: a body cannot bounce off one face and be stopped by the opposite
  /// one. Without driven bodies, the targets of a plastic impact never do. If this solution fails too,
  /// Gauss-Seidel starts from zero impulses, which is safe because each of its steps dissipates energy.
  ContactWork solve_plastic(ContactWork work) {
    work.add(solve_with(0));
    work.solves = work.fallbacks = 1;
    work.residual = 0;
    if (residual(bodies_, contacts_) > kRoughResidual * fastest_ || added_energy() > 0) {
      std::copy(before_.begin(), before_.end(), bodies_.begin());
      for (Contact& c : contacts_) c.impulse.setZero();
      work.iterations +=
          joints_.empty()
              ? projected_gauss_seidel(bodies_, contacts_,
                                       effort_ == Effort::bounded ? sweeps_of(kUpdates) : kPlasticSweeps,
                                       kRounding * fastest_)
              : jointed_gauss_seidel(bodies_, contacts_, joints_, kJointedSweeps, kRounding * fastest_);
    }
    if (added_energy() > 0) shrink();
    work.residual = residual(bodies_, contacts_);
    return work;
  }

  /// Returns the kinetic energy that the impulses add, beyond rounding [J].
  Real added_energy() const {
    Real size = 0;
    for (std::size_t i = 0; i < contacts_.size(); ++i)
      size += contacts_[i].impulse.norm() * velocities_[i].norm();
    Real energy = sim::added_energy(before_, bodies_, contacts_);
    for (const BoundedRow& r : joints_.bounded)
      if (r.resists_change) energy += r.impulse * (r.target + row_speed(r, bodies_)) / 2;
    return energy - kRounding * static_cast<Real>(kDense) * size;
  }

  /// Scales the impulses of an inexact result down until they add no energy. The energy that s p adds is s
  /// (p.u + s p.(u+ - u) / 2), which is zero at the largest allowed s.
  void shrink() {
    Real first = 0, second = 0;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      first += contacts_[i].impulse.dot(velocities_[i]);
      second += contacts_[i].impulse.dot(contacts_[i].relative_velocity(bodies_) - velocities_[i]) / 2;
    }
    for (const BoundedRow& r : joints_.bounded)
      if (r.resists_change) {
        first += r.impulse * r.target;
        second += r.impulse * (row_speed(r, bodies_) - r.target) / 2;
      }
    const Real factor = first < 0 ? std::min(1.0, -first / second) : 0;
    for (Contact& c : contacts_) c.impulse *= factor;
    for (Vec6& p : joints_.impulses) p *= factor;
    for (BoundedRow& r : joints_.bounded) r.impulse *= factor;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      bodies_[i].velocity = before_[i].velocity + factor * (bodies_[i].velocity - before_[i].velocity);
      bodies_[i].angular_velocity =
          before_[i].angular_velocity + factor * (bodies_[i].angular_velocity - before_[i].angular_velocity);
    }
  }

  std::span<ContactBody> bodies_;
  std::span<Contact> contacts_;
  std::span<const Real> restitution_;
  const JointProblem& joints_;
  Effort effort_;
  Real* budget_;
  std::vector<ContactBody> before_;
  std::vector<Vec3> velocities_;
  Real fastest_ = 0;  ///< greatest of the velocities [m/s]
  bool has_swept_ = false;
};

/// Adds up the impulses of several solutions on the joints.
class JointSums {
 public:
  explicit JointSums(const JointProblem& joints)
      : joints_(joints),
        impulses_(joints.impulses.size(), Vec6::Zero()),
        bounded_(joints.bounded.size(), 0) {}

  void add_last() {
    for (std::size_t j = 0; j < impulses_.size(); ++j)
      impulses_[j] += std::exchange(joints_.impulses[j], Vec6::Zero());
    for (std::size_t i = 0; i < bounded_.size(); ++i)
      bounded_[i] += std::exchange(joints_.bounded[i].impulse, 0);
  }
  void write() const {
    std::copy(impulses_.begin(), impulses_.end(), joints_.impulses.begin());
    for (std::size_t i = 0; i < bounded_.size(); ++i) joints_.bounded[i].impulse = bounded_[i];
  }

 private:
  const JointProblem& joints_;
  std::vector<Vec6> impulses_;
  std::vector<Real> bounded_;
};

/// Applies impulses in sequence, always to the contact that approaches fastest. Contacts with equal speeds
/// collide together, so symmetric scenes stay symmetric and the order of the list does not matter.
class Sequence {
 public:
  Sequence(std::span<ContactBody> bodies, std::span<Contact> contacts, std::span<const Real> restitution,
           const JointProblem& joints, Effort effort)
      : bodies_(bodies),
        contacts_(contacts),
        restitution_(restitution),
        joints_(joints),
        effort_(effort),
        sums_(joints) {
    for (Contact& c : contacts) {
      still_ = std::max(still_, kResting * approach(c, bodies));
      c.impulse.setZero();
      c.is_guessed = false;
      c.target = 0;
    }
  }

  ContactWork solve() {
    std::size_t most = (joints_.empty() ? kImpulses : kJointedImpulses) * contacts_.size();
    if (effort_ == Effort::bounded) most = std::min(most, joints_.empty() ? kUpdates : kDense);
    for (std::size_t count = 0; count < most; count += next_.size()) {
      find_next();
      if (next_.empty()) {
        sums_.write();
        return work_;
      }
      work_.iterations += next_.size();
      if (joints_.empty() && share_no_body())
        for (const std::size_t i : next_) collide_alone(i);
      else
        collide_together();
    }
    end_at_once();
    return work_;
  }

 private:
  void find_next() {
    next_.clear();
    Real fastest = still_;
    for (const Contact& c : contacts_) fastest = std::max(fastest, approach(c, bodies_));
    if (!(fastest > still_)) return;
    for (std::size_t i = 0; i < contacts_.size(); ++i)
      if (approach(contacts_[i], bodies_) >= (1 - kTie) * fastest) next_.push_back(i);
  }

  /// Whether no two of the next contacts share a movable body. Each of them is then solved in closed form.
  bool share_no_body() {
    hit_.clear();
    for (const std::size_t i : next_)
      for (const uint32_t body : {contacts_[i].a, contacts_[i].b})
        if (bodies_[body].is_moved()) hit_.push_back(body);
    std::sort(hit_.begin(), hit_.end());
    return std::adjacent_find(hit_.begin(), hit_.end()) == hit_.end();
  }

  void collide_alone(std::size_t i) {
    Contact& c = contacts_[i];
    const Vec3 u = c.relative_velocity(bodies_);
    const Vec3 p = collision_impulse(mobility(c, bodies_), u, restitution_[i], c.friction_t, c.friction_k);
    c.impulse += p;
    apply(c, p, bodies_);
    const Real missing = -restitution_[i] * u.x() - c.relative_velocity(bodies_).x();
    work_.restitution_reduced += missing > kAcceptedResidual * u.norm();
  }

  void collide_together() {
    std::vector<Contact> contacts;
    std::vector<Real> restitution;
    for (const std::size_t i : next_) {
      contacts.push_back(contacts_[i]);
      restitution.push_back(restitution_[i]);
    }
    work_.add(Cluster(bodies_, contacts, restitution, joints_, effort_).solve());
    for (std::size_t k = 0; k < next_.size(); ++k) contacts_[next_[k]].impulse += contacts[k].impulse;
    sums_.add_last();
  }

  /// Ends a sequence that has reached its limit: all contacts collide at once in a plastic impact.
  void end_at_once() {
    std::vector<Vec3> impulses;
    for (const Contact& c : contacts_) impulses.push_back(c.impulse);
    const std::vector<Real> plastic(contacts_.size(), 0);
    work_.add(Cluster(bodies_, contacts_, plastic, joints_, effort_).solve());
    sums_.add_last();
    sums_.write();
    for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_[i].impulse += impulses[i];
  }

  std::span<ContactBody> bodies_;
  std::span<Contact> contacts_;
  std::span<const Real> restitution_;
  const JointProblem& joints_;
  Effort effort_;
  JointSums sums_;
  ContactWork work_;
  Real still_ = 0;
  std::vector<std::size_t> next_;
  std::vector<uint32_t> hit_;
};

}  // namespace

Vec3 collision_impulse(const Mat3& K, const Vec3& u, Real restitution, Real mu_t, Real mu_k) {
  if (!(u.x() < 0)) return Vec3::Zero();
  const Vec3 p = impulse_for(K, u, restitution, mu_t, mu_k);
  if (!adds_energy(K, u, p)) return p;
  Real low = 0, high = restitution;
  for (int k = 0; k < kHalvings; ++k) {
    const Real middle = (low + high) / 2;
    (adds_energy(K, u, impulse_for(K, u, middle, mu_t, mu_k)) ? high : low) = middle;
  }
  return impulse_for(K, u, low, mu_t, mu_k);
}

namespace {

ContactWork collide_with(std::span<ContactBody> bodies, std::span<Contact> contacts,
                         std::span<const Real> restitution, ImpactLaw law, const JointProblem& joints,
                         Effort effort, Real* budget) {
  if (contacts.empty()) return {};
  ContactWork work = law == ImpactLaw::sequential
                         ? Sequence(bodies, contacts, restitution, joints, effort).solve()
                         : Cluster(bodies, contacts, restitution, joints, effort, budget).solve();
  work.solves = 1;
  work.fallbacks = std::min<uint64_t>(work.fallbacks, 1);
  return work;
}

}  // namespace

ContactWork collide(std::span<ContactBody> bodies, std::span<Contact> contacts,
                    std::span<const Real> restitution, ImpactLaw law, const JointProblem& joints) {
  return collide_with(bodies, contacts, restitution, law, joints, Effort::full, nullptr);
}

ContactWork collide_bounded(std::span<ContactBody> bodies, std::span<Contact> contacts,
                            std::span<const Real> restitution, ImpactLaw law, const JointProblem& joints,
                            Real& budget) {
  return collide_with(bodies, contacts, restitution, law, joints, Effort::bounded, &budget);
}

}  // namespace offstage::sim
