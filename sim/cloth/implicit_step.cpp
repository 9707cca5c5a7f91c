#include <algorithm>
#include <utility>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_integrators.h"
#include "sim/cloth/spring_run.h"
#include "sim/cloth/support_bodies.h"
#include "sim/linear/mobility_root.h"

namespace offstage::sim {
namespace {

constexpr int kMaxIterations = 300;
/// Square of the accepted residual as a fraction of the right side's, in the preconditioner's norm.
constexpr Real kTolerance2 = 1e-12;
/// The same as a fraction of the right side with the given motions. What is left of cloth that lies still may
/// be nothing but rounding.
constexpr Real kRounding2 = 1e-28;
/// Greatest number of solutions with other sets of supports. What is left then is up to the contacts.
constexpr int kMaxTurnsOfSupports = 2;
/// A support that is missing or pulls is left to the contacts up to this displacement, in thicknesses.
constexpr Real kSupportTolerance = 1e-3;

/// The linear system of an implicit step of cloth by backward Euler (step_implicit()). Its matrix consists of
/// the masses, the matrix of bending, and a block alpha u u^T + beta 1 for each spring, between its ends. The
/// unknowns are the velocities of the points, followed by six values y for each body under a support. The
/// body gains the velocity and the angular velocity L y, with its mobility W = L L^T. Joints make W singular,
/// so it has no inverse; with y, the matrix of the body is the unit matrix. A point that rests on a support
/// has the velocity of the support along the normal.
class ImplicitSystem {
 public:
  ImplicitSystem(const ClothPoints& points, const ClothRange& cloth, const SupportBodies& bodies, Real h)
      : points_(points),
        cloth_(cloth),
        bodies_(bodies),
        size_(cloth.end - cloth.begin),
        bending_(cloth.bending.empty() ? 0 : h * (h + cloth.bending.damping())) {
    block_.assign(cloth.end - cloth.begin, Mat3::Zero());
    for (std::size_t i = 0; i < block_.size(); ++i)
      block_[i].diagonal().setConstant(
          points.mass[cloth.begin + i] +
          (bending_ > 0 ? bending_ * cloth.bending.diagonal(static_cast<uint32_t>(i)) : 0));
    if (!cloth.air.empty()) {
      for (std::size_t i = 0; i < block_.size(); ++i) {
        drag_.push_back(h * points.mass[cloth.begin + i] * cloth.air.resistance(i));
        block_[i] += drag_[i];
      }
    }
    for (const ClothSpring& s : cloth.springs) {
      const Vec4 d = points.start[s.a] - points.start[s.b];
      const Real length = d.norm();
      const Vec4 u = length > 0 ? Vec4(d / length) : Vec4(Vec4::Zero());
      const Real elongation = s.elongation(length, points.start);
      const Real sideways = elongation > 0 ? elongation / length : 0;
      const Real stiff = h * h * s.stiffness;
      const Link link{u, stiff * (1 - sideways) + h * s.damping, stiff * sideways, s.stiffness * elongation};
      links_.push_back(link);
      const Mat3 k = link.along * u.head<3>() * u.head<3>().transpose() + link.across * Mat3::Identity();
      block_[s.a - cloth.begin] += k;
      block_[s.b - cloth.begin] += k;
    }
    for (Mat3& b : block_) b = b.inverse().eval();
    for (std::size_t k = 0; k < bodies.count(); ++k)
      body_factor_.push_back(mobility_root(bodies.body(k).mobility(Mat6::Zero())));
    body_block_.resize(bodies.count());
  }

  /// A point that rests on its support: its motion along the normal is that of the support.
  struct Resting {
    Support* support;
    std::size_t index;  // of the support
  };
  /// Sets the points that rest on their supports.
  void set_resting(std::vector<Resting> resting) {
    resting_ = std::move(resting);
    std::ranges::fill(body_block_, Mat6::Identity());
    for (const auto& [s, index] : resting_) {
      const uint32_t body = bodies_.body_of(index);
      if (body == SupportBodies::kNone) continue;
      const Vec3 normal = s->normal.head<3>();
      const Vec6 row = body_factor_[body].transpose() * stacked(normal, bodies_.arm(index).cross(normal));
      body_block_[body] += row * row.transpose() / normal.dot(block_[s->point - cloth_.begin] * normal);
    }
    for (Mat6& b : body_block_) b = b.inverse().eval();
  }
  std::span<const Resting> resting() const { return resting_; }

  /// Returns the number of unknown vectors.
  std::size_t size() const { return size_ + 2 * bodies_.count(); }
  std::span<const Vec4> of_points(const SpringRun& v) const { return {v.data(), size_}; }
  std::span<Vec4> of_points(SpringRun& v) const { return {v.data(), size_}; }

  /// Returns the gain of the surface's velocity along the normal of support k by the impulses.
  Real surface_gain(std::size_t k, const Support& support, const SpringRun& v) const {
    const uint32_t body = bodies_.body_of(k);
    if (body == SupportBodies::kNone) return 0;
    const Vec6 gain = body_factor_[body] * of_body(body, v);
    return support.normal.head<3>().dot(gain.head<3>() + gain.tail<3>().cross(bodies_.arm(k)));
  }

  /// Computes y = A p.
  void multiply_all(const SpringRun& p, SpringRun& y) const {
    for (std::size_t i = 0; i < size_; ++i) y[i] = points_.mass[cloth_.begin + i] * p[i];
    for (std::size_t i = size_; i < size(); ++i) y[i] = p[i];
    for (std::size_t i = 0; i < drag_.size(); ++i) y[i] += dragged(i, p[i]);
    for (std::size_t k = 0; k < links_.size(); ++k) {
      const ClothSpring& s = cloth_.springs[k];
      const Link& link = links_[k];
      const std::size_t a = s.a - cloth_.begin, b = s.b - cloth_.begin;
      const Vec4 q = p[a] - p[b];
      const Vec4 f = link.along * link.direction.dot(q) * link.direction + link.across * q;
      y[a] += f;
      y[b] -= f;
    }
    if (bending_ > 0) cloth_.bending.multiply(of_points(p), bending_, of_points(y));
  }

  /// y = A p, without the components of given motions.
  void multiply(const SpringRun& p, SpringRun& y) const {
    multiply_all(p, y);
    clear_given(y);
  }

  /// Removes the components along which motion is given: all of pinned points, and the normal one of those
  /// that rest on supports, which acts on the bodies.
  void clear_given(SpringRun& y) const {
    for (std::size_t i = 0; i < size_; ++i)
      if (is_held(points_, cloth_.begin + i)) y[i].setZero();
    for (const auto& [s, index] : resting_) {
      Vec4& at = y[s->point - cloth_.begin];
      const Vec4 normal = s->normal.dot(at) * s->normal;
      at -= normal;
      const uint32_t body = bodies_.body_of(index);
      if (body == SupportBodies::kNone) continue;
      const Vec3 impulse = normal.head<3>();
      add_to_body(body, body_factor_[body].transpose() * stacked(impulse, bodies_.arm(index).cross(impulse)),
                  y);
    }
  }
  /// Gives points that rest on supports the motion of these along the normals, for velocities without it.
  void follow_bodies(SpringRun& v) const {
    for (const auto& [s, index] : resting_)
      v[s->point - cloth_.begin] += surface_gain(index, *s, v) * s->normal;
  }

  /// Adds the impulses of springs on pinned points, for points that move with v throughout the step.
  void pass_on(ClothPoints& points, const SpringRun& v, Real h) const {
    if (bending_ > 0 || cloth_.gas.acts()) {
      SpringRun force(size_, Vec4::Zero());
      if (bending_ > 0) {
        cloth_.bending.add_forces(cloth_.part(points.start), h * h, force);
        cloth_.bending.multiply(of_points(v), -h * bending_, force);
      }
      if (cloth_.gas.acts()) cloth_.gas.add_forces(cloth_.part(points.start), h * h, force);
      for (std::size_t i = 0; i < force.size(); ++i)
        if (is_held(points, cloth_.begin + i)) points.pin_impulse[cloth_.begin + i] += force[i];
    }
    for (std::size_t k = 0; k < links_.size(); ++k) {
      const ClothSpring& s = cloth_.springs[k];
      const Link& link = links_[k];
      const Vec4 q = v[s.a - cloth_.begin] - v[s.b - cloth_.begin];
      const Vec4 impulse =
          h * ((h * link.force + link.along * link.direction.dot(q)) * link.direction + link.across * q);
      if (is_held(points, s.a)) points.pin_impulse[s.a] -= impulse;
      if (is_held(points, s.b)) points.pin_impulse[s.b] += impulse;
    }
  }

  /// Returns the square of the preconditioner's norm of the points' part of r, with the given motions.
  Real norm2(const SpringRun& r) const {
    Real sum = 0;
    for (std::size_t i = 0; i < size_; ++i) sum += r[i].head<3>().dot(block_[i] * r[i].head<3>());
    return sum;
  }
  void precondition(const SpringRun& r, SpringRun& z) const {
    for (std::size_t i = 0; i < size_; ++i) z[i] = padded(block_[i] * r[i].head<3>());
    clear_given(z);
    for (std::size_t k = 0; k < body_block_.size(); ++k) {
      z[size_ + 2 * k] = z[size_ + 2 * k + 1] = Vec4::Zero();
      add_to_body(k, body_block_[k] * of_body(k, r), z);
    }
    if (!body_block_.empty()) follow_bodies(z);
  }

  /// Returns the impulse of the linear part of the drag on point i at the velocity v.
  Vec4 dragged(std::size_t i, const Vec4& v) const {
    return drag_.empty() ? Vec4(Vec4::Zero()) : padded(drag_[i] * v.head<3>());
  }

  /// Returns M v + h (spring forces + M a), plus the part of the drag that the matrix does not contain.
  SpringRun right_side(const SpringRun& v, Real h) const {
    SpringRun b(size(), Vec4::Zero());
    for (std::size_t i = 0; i < size_; ++i) {
      const std::size_t k = cloth_.begin + i;
      b[i] = points_.mass[k] * (v[i] + h * points_.acceleration[k]);
    }
    for (std::size_t i = 0; i < drag_.size(); ++i) b[i] += dragged(i, cloth_.air.from(i));
    for (std::size_t k = 0; k < links_.size(); ++k) {
      const Vec4 f = h * links_[k].force * links_[k].direction;
      b[cloth_.springs[k].a - cloth_.begin] -= f;
      b[cloth_.springs[k].b - cloth_.begin] += f;
    }
    if (bending_ > 0) cloth_.bending.add_forces(cloth_.part(points_.start), h, of_points(b));
    if (cloth_.gas.acts()) cloth_.gas.add_forces(cloth_.part(points_.start), h, of_points(b));
    return b;
  }

 private:
  /// The unknowns of a body.
  Vec6 of_body(std::size_t body, const SpringRun& v) const {
    return stacked(v[size_ + 2 * body].head<3>(), v[size_ + 2 * body + 1].head<3>());
  }
  void add_to_body(std::size_t body, const Vec6& value, SpringRun& v) const {
    v[size_ + 2 * body] += padded(value.head<3>());
    v[size_ + 2 * body + 1] += padded(value.tail<3>());
  }

  struct Link {
    Vec4 direction;
    Real along, across, force;
  };

  const ClothPoints& points_;
  const ClothRange& cloth_;
  const SupportBodies& bodies_;
  std::size_t size_;  // number of points
  Real bending_;      // factor of the matrix of bending
  std::vector<Resting> resting_;
  std::vector<Mat6> body_factor_;  // by body: L of its mobility L L^T, with the contacts on which it rests
  std::vector<Mat6> body_block_;   // by body: inverse of its diagonal block with the points that rest on it
  std::vector<Link> links_;
  std::vector<Mat3> block_;  // by point: inverse of its diagonal block
  std::vector<Mat3> drag_;   // by point; empty without air
};

Real dot(const SpringRun& a, const SpringRun& b) {
  Real sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

/// Solves by preconditioned conjugate gradients from the guess v, which has the given motions: those of
/// pinned points, and those of resting points along their normals. Returns false if the limit of iterations
/// was reached.
bool solve(const ImplicitSystem& system, const SpringRun& b, SpringRun& v) {
  SpringRun r(v.size()), z(v.size()), y(v.size());
  system.multiply(v, y);
  for (std::size_t i = 0; i < r.size(); ++i) r[i] = b[i] - y[i];
  system.clear_given(r);
  system.precondition(b, z);
  const Real enough = std::max(kTolerance2 * dot(b, z), kRounding2 * system.norm2(b));
  system.precondition(r, z);
  SpringRun p = z;
  Real rz = dot(r, z);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (!(rz > enough)) return true;
    system.multiply(p, y);
    const Real py = dot(p, y);
    if (!(py > 0)) return false;
    const Real step = rz / py;
    for (std::size_t i = 0; i < v.size(); ++i) {
      v[i] += step * p[i];
      r[i] -= step * y[i];
    }
    system.precondition(r, z);
    const Real next = dot(r, z);
    for (std::size_t i = 0; i < p.size(); ++i) p[i] = z[i] + next / rz * p[i];
    rz = next;
  }
  return false;
}

/// Solves for the velocities v and for the supports that push, by an active-set method. It begins with the
/// supports that pushed in the last sub-step, and with those of points whose present velocities would take
/// them beyond their planes: cloth that lies still needs one solution. Returns false if a linear solution
/// reached its limit of iterations.
bool solve_on_supports(ImplicitSystem& system, ClothPoints& points, const ClothRange& cloth,
                       const SpringRun& b, Real h, SpringRun& v) {
  const std::span<Support> supports = cloth.supports(points);
  const std::span<uint8_t> pushed = cloth.part(points.supported);
  std::vector<uint8_t> rests(supports.size());
  const auto velocity = [&](const Support& s) -> Vec4& { return v[s.point - cloth.begin]; };
  const auto lacks = [&](std::size_t k) {
    const Support& s = supports[k];
    return s.least(1) + h * (system.surface_gain(k, s, v) - s.normal.dot(velocity(s)));
  };
  const auto small = [&](const Support& s) { return kSupportTolerance * points.thickness[s.point]; };
  for (std::size_t k = 0; k < supports.size(); ++k)
    rests[k] = pushed[supports[k].point - cloth.begin] || lacks(k) > small(supports[k]);
  std::ranges::fill(pushed, uint8_t{0});
  if (supports.empty()) return solve(system, b, v);
  SpringRun image(v.size());
  for (int turn = 1;; ++turn) {
    std::vector<ImplicitSystem::Resting> resting;
    for (std::size_t k = 0; k < supports.size(); ++k) {
      if (!rests[k]) continue;
      resting.push_back({&supports[k], k});
      velocity(supports[k]) += lacks(k) / h * supports[k].normal;
    }
    system.set_resting(std::move(resting));
    const bool converged = solve(system, b, v);
    system.multiply_all(v, image);
    bool changed = false;
    for (std::size_t k = 0; k < supports.size(); ++k) {
      Support& s = supports[k];
      const std::size_t i = s.point - cloth.begin;
      s.impulse = rests[k] ? h * s.normal.dot(image[i] - b[i]) : 0;
      const bool pushes =
          rests[k] ? s.impulse * points.inverse_mass[s.point] >= -small(s) : lacks(k) > small(s);
      changed |= std::exchange(rests[k], pushes) != pushes;
      s.impulse = std::max(s.impulse, 0.0);
      pushed[i] = pushes;
    }
    if (!changed || turn == kMaxTurnsOfSupports) return converged;
  }
}

/// Distributes the momentum error of the solution over all points of a free cloth that no immovable body
/// supports.
void keep_momentum(const ClothPoints& points, const ClothRange& cloth, const ImplicitSystem& system,
                   const SpringRun& b, Real h, SpringRun& v) {
  Vec4 lost = Vec4::Zero();
  for (const auto& [s, index] : system.resting()) {
    if (!s->body) return;
    lost += s->impulse / h * s->normal;
  }
  Real mass = 0;
  for (std::size_t i = 0; i < cloth.end - cloth.begin; ++i) {
    if (is_held(points, cloth.begin + i)) return;
    lost += b[i] - points.mass[cloth.begin + i] * v[i] - system.dragged(i, v[i]);
    mass += points.mass[cloth.begin + i];
  }
  for (Vec4& velocity : system.of_points(v)) velocity += lost / mass;
}

}  // namespace

bool step_implicit(ClothPoints& points, const ClothRange& cloth, Real h) {
  SpringRun x, v;
  begin_run(points, cloth, h, x, v);
  SupportBodies bodies(points, cloth.supports(points), {}, h);
  ImplicitSystem system(points, cloth, bodies, h);
  v.resize(system.size(), Vec4::Zero());
  const SpringRun b = system.right_side(v, h);
  const bool converged = solve_on_supports(system, points, cloth, b, h, v);
  keep_momentum(points, cloth, system, b, h, v);
  system.pass_on(points, v, h);
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!is_held(points, cloth.begin + i)) points.position[cloth.begin + i] = x[i] + h * v[i];
  for (const auto& [s, index] : system.resting()) bodies.push(index, -s->impulse * s->normal);
  for (const auto& [s, index] : system.resting()) {
    Vec4 move = h * v[s->point - cloth.begin];
    move += bodies.apply_friction(index, *s, 1, move);
    points.position[s->point] = points.start[s->point] + move;
  }
  bodies.advance();
  bodies.apply();
  return converged;
}

}  // namespace offstage::sim
