#include "sim/contact/collision.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "sim/contact/friction_lcp.h"
#include "sim/contact/proximal_newton.h"

namespace offstage::sim {
namespace {

using Eigen::Vector2d;

constexpr Real kRounding = 1e-13;   ///< of products of impulses and velocities
constexpr int kArcs = 64;           ///< of the circle of directions, each searched for a change of sign
constexpr int kHalvings = 60;       ///< of a bisection: to the last bit
constexpr int kSolves = 30;         ///< of a cluster, to find the restitution that keeps the energy
constexpr std::size_t kDense = 24;  ///< contacts of a cluster that are solved by pivoting
constexpr Real kAcceptedResidual = 1e-6;  // of the velocities, for an impact
constexpr uint32_t kCollisionSweeps = 2000;
constexpr Real kResting = 1e-11;  ///< of the fastest approach: slower ones are left, equal ones are ties
constexpr std::size_t kImpulses = 200;  ///< for each contact of a sequence

/// The impulse with normal part du_n and friction at its limit against the direction `d`; none if friction
/// then pulls the points together faster than the normal impulse parts them.
std::optional<Vec3> sliding_impulse(const Mat3& K, Real du_n, Real mu, const Vector2d& d) {
  const Real resistance = K(0, 0) - mu * (K(0, 1) * d.x() + K(0, 2) * d.y());
  if (!(resistance > 0)) return std::nullopt;
  const Real normal = du_n / resistance;
  return Vec3(normal, -mu * normal * d.x(), -mu * normal * d.y());
}

/// A direction for each s in [0, 4): to the points around a square, without trigonometry.
Vector2d direction_at(Real s) {
  const int side = std::min(static_cast<int>(s), 3);
  const Real x = 2 * (s - side) - 1;
  constexpr std::array<std::array<int, 4>, 4> kTurns = {
      {{1, 0, 0, 1}, {0, -1, 1, 0}, {-1, 0, 0, -1}, {0, 1, -1, 0}}};
  const auto& turn = kTurns[static_cast<std::size_t>(side)];
  return Vector2d(turn[0] + turn[1] * x, turn[2] + turn[3] * x).normalized();
}

/// Friction on the round cone against the sliding that it leaves: d and u_tk(after) are parallel. With
/// P_n = du_n / D(d), D(d) = K_nn - mu K_n,tk.d, their cross product times D is
///   g(d) = d x (D u_tk + du_n (K_tk,n - mu K_tk d)),
/// a trigonometric polynomial of the second degree: at most four roots. With a diagonal K the sliding before
/// the impact is one. Of several the one nearest to that is right.
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
  /// D u_tk(after).
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

/// The cases of 4.8: each axis sticks, or slides with its sign (+1, -1) against friction at the limit.
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

/// For any restitution, whatever it does to the energy.
Vec3 impulse_for(const Mat3& K, const Vec3& u, Real restitution, Real mu_t, Real mu_k) {
  const Real du_n = -(1 + restitution) * u.x();
  const Vec3 stick = K.llt().solve(Vec3(du_n, -u.y(), -u.z()));
  if (mu_t != mu_k) return separate_slide(K, u, du_n, {0, mu_t, mu_k});
  if (stick.tail<2>().norm() <= mu_t * stick.x()) return stick;
  return RoundSlide(K, u, du_n, mu_t).impulse();
}

/// The kinetic energy that an impulse adds is p.(u + u+) / 2. More than rounding?
bool adds_energy(const Mat3& K, const Vec3& u, const Vec3& p) {
  return p.dot(u + K * p / 2) > kRounding * p.norm() * u.norm();
}

/// Approaching speed, 0 if parting.
Real approach(const Contact& c, std::span<const ContactBody> bodies) {
  return std::max(0.0, -c.relative_velocity(bodies).x());
}

/// Few contacts by pivoting; many by sweeps, whose impulses the proximal method takes further if need be;
/// with joints by that alone.
void solve_together(std::span<ContactBody> bodies, std::span<Contact> contacts, const JointProblem& joints,
                    ContactWork& work) {
  if (!joints.empty()) {
    for (Contact& c : contacts) c.is_guessed = false;
    return work.add(*ProximalNewton().solve(bodies, contacts, joints));
  }
  if (contacts.size() <= kDense) return work.add(solve_by_pivoting(bodies, contacts));
  const std::vector<ContactBody> before(bodies.begin(), bodies.end());
  Real fastest = 0;
  for (Contact& c : contacts) {
    c.impulse.setZero();
    c.is_guessed = true;
    fastest = std::max(fastest, c.relative_velocity(bodies).cwiseAbs().maxCoeff());
  }
  const uint32_t sweeps = relax(bodies, contacts, kCollisionSweeps, kRounding * fastest);
  const Real left = residual(bodies, contacts);
  work.add({.solves = 1, .iterations = sweeps, .residual = left});
  if (left <= kAcceptedResidual * fastest) return;
  std::copy(before.begin(), before.end(), bodies.begin());
  work.add(*ProximalNewton().solve(bodies, contacts));
  --work.solves;
}

/// A cluster's collision with its restitutions scaled down by the factor that keeps the energy.
class Cluster {
 public:
  Cluster(std::span<ContactBody> bodies, std::span<Contact> contacts, std::span<const Real> restitution,
          const JointProblem& joints)
      : bodies_(bodies),
        contacts_(contacts),
        restitution_(restitution),
        joints_(joints),
        before_(bodies.begin(), bodies.end()) {
    for (const Contact& c : contacts) velocities_.push_back(c.relative_velocity(bodies));
  }

  // Without restitution p.u+ <= 0 at each contact, and then the sum of p.(u + u+) / 2 is negative: the
  // bisection has a lower end.
  ContactWork solve() {
    ContactWork work = solve_with(1);
    Real low = 0, high = 1;
    if (!adds_energy()) return work;
    work.softened = 1;
    for (int k = 0; k < kSolves; ++k) {
      const Real middle = (low + high) / 2;
      work.add(solve_with(middle));
      (adds_energy() ? high : low) = middle;
    }
    work.add(solve_with(low));
    work.solves = 1;
    if (adds_energy()) shrink();
    return work;
  }

 private:
  ContactWork solve_with(Real factor) {
    std::copy(before_.begin(), before_.end(), bodies_.begin());
    for (std::size_t i = 0; i < contacts_.size(); ++i)
      contacts_[i].target = std::max(0.0, -factor * restitution_[i] * velocities_[i].x());
    ContactWork work;
    solve_together(bodies_, contacts_, joints_, work);
    return work;
  }

  bool adds_energy() const {
    Real energy = 0, size = 0;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      const Vec3 &p = contacts_[i].impulse, &u = velocities_[i];
      energy += p.dot(u + contacts_[i].relative_velocity(bodies_)) / 2;
      size += p.norm() * u.norm();
    }
    return energy > kRounding * static_cast<Real>(kDense) * size;
  }

  /// For an inexact answer: the energy of s p is s (p.u + s p.(u+ - u) / 2), zero at the largest s allowed.
  void shrink() {
    Real first = 0, second = 0;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      first += contacts_[i].impulse.dot(velocities_[i]);
      second += contacts_[i].impulse.dot(contacts_[i].relative_velocity(bodies_) - velocities_[i]) / 2;
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
  std::vector<ContactBody> before_;
  std::vector<Vec3> velocities_;
};

/// Sums up what several solutions do to the joints.
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

/// Impulses one at a time, the fastest approach first; those as fast but for rounding in order.
ContactWork collide_in_sequence(std::span<ContactBody> bodies, std::span<Contact> contacts,
                                std::span<const Real> restitution, const JointProblem& joints) {
  ContactWork work{.solves = 1};
  JointSums sums(joints);
  Real still = 0;
  for (Contact& c : contacts) {
    still = std::max(still, kResting * approach(c, bodies));
    c.impulse.setZero();
    c.target = 0;
  }
  for (std::size_t count = 0; count < kImpulses * contacts.size(); ++count, ++work.iterations) {
    Real fastest = 0;
    std::size_t next = contacts.size();
    for (std::size_t i = 0; i < contacts.size(); ++i)
      if (approach(contacts[i], bodies) > fastest + still) fastest = approach(contacts[next = i], bodies);
    if (next == contacts.size()) {
      sums.write();
      return work;
    }
    Contact& c = contacts[next];
    if (!joints.empty()) {
      const Vec3 before = c.impulse;
      work.add(Cluster(bodies, std::span(&c, 1), restitution.subspan(next, 1), joints).solve());
      c.impulse += before;
      c.target = 0;
      sums.add_last();
      continue;
    }
    const Vec3 u = c.relative_velocity(bodies);
    const Vec3 p = collision_impulse(mobility(c, bodies), u, restitution[next], c.friction_t, c.friction_k);
    c.impulse += p;
    apply(c, p, bodies);
    const Real missing = -restitution[next] * u.x() - c.relative_velocity(bodies).x();
    work.softened += missing > kAcceptedResidual * u.norm();
  }
  std::vector<Vec3> impulses;
  for (const Contact& c : contacts) impulses.push_back(c.impulse);
  solve_together(bodies, contacts, joints, work);
  work.solves = 1;
  sums.add_last();
  sums.write();
  for (std::size_t i = 0; i < contacts.size(); ++i) contacts[i].impulse += impulses[i];
  return work;
}

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

ContactWork collide(std::span<ContactBody> bodies, std::span<Contact> contacts,
                    std::span<const Real> restitution, ImpactLaw law, const JointProblem& joints) {
  if (contacts.empty()) return {};
  if (law == ImpactLaw::sequential) return collide_in_sequence(bodies, contacts, restitution, joints);
  return Cluster(bodies, contacts, restitution, joints).solve();
}

}  // namespace offstage::sim
