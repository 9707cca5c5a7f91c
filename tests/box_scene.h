#pragma once
/// Boxes that fall, slide and rest, for tests of the fast contact solver. The simulation is a minimal
/// combination of free motion, collision detection and this solver. The scenes are the same as in the
/// benchmarks against other engines.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <vector>

#include "sim/collision/broad_phase.h"
#include "sim/collision/convex.h"
#include "sim/collision/gjk.h"
#include "sim/collision/manifold.h"
#include "sim/contact/relaxation.h"
#include "sim/geometry/shape.h"

namespace offstage::sim {

struct BoxBody {
  Vec3 size = Vec3::Ones();
  Real mass = 0;  ///< mass [kg]; 0: the box is static
  Pose pose;
  Vec3 velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();

  Mat3 inverse_inertia() const {
    if (mass == 0) return Mat3::Zero();
    const Vec3 q = size.cwiseAbs2(), inertia = mass / 12 * (Vec3::Constant(q.sum()) - q);
    const Mat3 R = pose.orientation.toRotationMatrix();
    return R * inertia.cwiseInverse().asDiagonal() * R.transpose();
  }
  Aabb box(Real margin) const {
    const Vec3 half = pose.orientation.toRotationMatrix().cwiseAbs() * size / 2 + Vec3::Constant(margin);
    return {pose.position - half, pose.position + half};
  }
};

inline Quat turned(const Quat& q, const Vec3& by) {
  const Real angle = by.norm();
  return angle > 0 ? Quat(Quat(Eigen::AngleAxisd(angle, by / angle)) * q).normalized() : q;
}

class BoxScene {
 public:
  std::vector<BoxBody> bodies;
  Real friction = 0.5;
  Vec3 gravity = Vec3(0, -9.81, 0);
  uint32_t substeps = 0;  ///< number of sub-steps; 0: the number that the solver recommends

  void add(const Vec3& size, Real mass, const Vec3& position, const Quat& q = Quat::Identity()) {
    bodies.push_back({size, mass, {position, q}});
  }
  void add_ground() { add(Vec3(200, 10, 200), 0, Vec3(0, -5, 0)); }

  /// Sets up the contact problem of the next step.
  void prepare(Real h) {
    set_bodies(h);
    find_patches(h);
  }
  ContactWork solve(Real h) {
    return solver_.solve(relaxed_, patches_, {h, substeps > 0 ? substeps : relaxation_substeps(h)});
  }
  void finish(Real h) {
    for (std::size_t i = 0; i < bodies.size(); ++i) move(bodies[i], relaxed_[i], h);
    keep_forces();
  }
  void step(Real h) {
    prepare(h);
    solve(h);
    finish(h);
  }
  void run(Real duration, Real h) {
    for (int k = 0; k < static_cast<int>(std::lround(duration / h)); ++k) step(h);
  }

  std::vector<RelaxedBody>& relaxed() { return relaxed_; }
  std::vector<ContactPatch>& patches() { return patches_; }

  Real deepest() {
    Real depth = 0;
    prepare(1e-9);
    for (const ContactPatch& p : patches_)
      for (uint32_t i = 0; i < p.count; ++i) depth = std::max(depth, -p.points[i].separation);
    return depth;
  }
  Real kinetic_energy() const {
    Real e = 0;
    for (const BoxBody& b : bodies) {
      if (b.mass == 0) continue;
      const Vec3& w = b.angular_velocity;
      e += (b.mass * b.velocity.squaredNorm() + w.dot(b.inverse_inertia().inverse() * w)) / 2;
    }
    return e;
  }

 private:
  struct Kept {
    ContactPatch patch;
    Manifold manifold;
  };

  /// Without torques, angular momentum is conserved.
  void set_bodies(Real h) {
    relaxed_.resize(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const BoxBody& b = bodies[i];
      RelaxedBody& r = relaxed_[i];
      r = {.velocity = b.velocity, .angular_velocity = b.angular_velocity};
      if (b.mass == 0) continue;
      r.inverse_mass = 1 / b.mass;
      r.inverse_inertia = b.inverse_inertia();
      r.free_acceleration = gravity;
      const Vec3 momentum = r.inverse_inertia.inverse() * b.angular_velocity;
      BoxBody end = b;
      end.pose.orientation = turned(b.pose.orientation, h * b.angular_velocity);
      r.free_angular_acceleration = (end.inverse_inertia() * momentum - b.angular_velocity) / h;
    }
  }

  static void move(BoxBody& b, const RelaxedBody& r, Real h) {
    const Vec3 w = b.angular_velocity + h / 2 * r.free_angular_acceleration;
    b.pose.position += h * b.velocity + h * h / 2 * r.free_acceleration + r.displacement;
    b.pose.orientation = turned(turned(b.pose.orientation, h * w), r.rotation_vector);
    b.velocity = r.velocity;
    b.angular_velocity = r.angular_velocity;
  }

  static Real reach(const BoxBody& b, Real h) {
    return h * (b.velocity.norm() + b.angular_velocity.norm() * b.size.norm() / 2);
  }

  void find_patches(Real h) {
    for (uint32_t i = 0; i < bodies.size(); ++i) {
      const Aabb box = bodies[i].box(0.01 + reach(bodies[i], h));
      if (broad_phase_.contains(i))
        broad_phase_.move(i, box);
      else
        broad_phase_.insert(i, box, bodies[i].mass == 0);
    }
    patches_.clear();
    manifolds_.clear();
    for (const IndexPair& pair : broad_phase_.pairs()) find_patch(pair.a, pair.b, h);
  }

  void find_patch(uint32_t i, uint32_t j, Real h) {
    const BoxBody &a = bodies[i], &b = bodies[j];
    const Convex x = convex(Shape(Box{a.size})), y = convex(Shape(Box{b.size}));
    const Quat q = a.pose.orientation.conjugate();
    const Pose a_from_b{q * (b.pose.position - a.pose.position), q * b.pose.orientation};
    GjkCache cache;
    const Real margin = 0.01 + reach(a, h) + reach(b, h);
    const Manifold m = placed(manifold(x, y, a_from_b, gjk(x, y, a_from_b, cache), margin), a.pose);
    if (m.count == 0) return;
    ContactPatch p;
    set_points(p, m, contact_frame(m.normal), a.pose.position, b.pose.position);
    p.a = i;
    p.b = j;
    p.friction_t = p.friction_k = friction;
    if (const auto kept = kept_.find({i, j}); kept != kept_.end()) reuse(kept->second, m, p);
    patches_.push_back(p);
    manifolds_.push_back(m);
  }

  /// Initial guess: copies the forces of the last step to a patch. Points are matched by their features.
  /// Points whose features changed are matched by position.
  static void reuse(const Kept& kept, const Manifold& m, ContactPatch& p) {
    p.force_t = kept.patch.force_t;
    p.force_k = kept.patch.force_k;
    p.torque_n = kept.patch.torque_n;
    p.mean_friction = kept.patch.mean_friction;
    std::array<bool, 4> taken{}, found{};
    const auto take = [&](uint32_t to, uint32_t from) {
      p.points[to].force = kept.patch.points[from].force;
      p.points[to].mean_force = kept.patch.points[from].mean_force;
      found[to] = taken[from] = true;
    };
    for (uint32_t i = 0; i < p.count; ++i)
      for (uint32_t j = 0; j < kept.patch.count; ++j)
        if (!found[i] && !taken[j] && kept.manifold.points[j].id == m.points[i].id) take(i, j);
    for (uint32_t i = 0; i < p.count; ++i) {
      Real nearest = 0.1;
      uint32_t best = 4;
      for (uint32_t j = 0; j < kept.patch.count; ++j) {
        const Real d =
            std::hypot(p.points[i].t - kept.patch.points[j].t, p.points[i].k - kept.patch.points[j].k);
        if (!taken[j] && d < nearest) nearest = d, best = j;
      }
      if (!found[i] && best < 4) take(i, best);
    }
  }

  void keep_forces() {
    kept_.clear();
    for (std::size_t n = 0; n < patches_.size(); ++n)
      kept_[{patches_[n].a, patches_[n].b}] = {patches_[n], manifolds_[n]};
  }

  BroadPhase broad_phase_;
  RelaxationSolver solver_;
  std::vector<RelaxedBody> relaxed_;
  std::vector<ContactPatch> patches_;
  std::vector<Manifold> manifolds_;
  std::map<std::pair<uint32_t, uint32_t>, Kept> kept_;
};

inline BoxScene box_stack(int count) {
  BoxScene s;
  s.add_ground();
  for (int i = 0; i < count; ++i) s.add(Vec3::Ones(), 1, Vec3(0, 0.5 + i, 0));
  return s;
}

inline BoxScene brick_wall(int count) {
  BoxScene s;
  s.add_ground();
  const int width = std::max(2, static_cast<int>(std::ceil(std::sqrt(count))));
  for (int i = 0; i < count; ++i) {
    const int row = i / width, column = i % width;
    const Real x = 1.02 * (column - (width - 1) / 2.0) + (row % 2 ? 0.125 : -0.125);
    s.add(Vec3(1, 0.5, 0.5), 1, Vec3(x, 0.25 + 0.5 * row, 0));
  }
  return s;
}

/// Returns a box on an inclined plane that descends towards +x.
inline BoxScene box_on_incline(Real degrees) {
  BoxScene s;
  const Quat q(Eigen::AngleAxisd(-degrees * std::numbers::pi / 180, Vec3::UnitZ()));
  s.add(Vec3(100, 10, 100), 0, q * Vec3(0, -5, 0), q);
  s.add(Vec3::Ones(), 1, q * Vec3(-10, 0.5, 0), q);
  return s;
}

/// Returns a box that slides over the ground at 5 m/s.
inline BoxScene sliding_box(Real heading_degrees) {
  BoxScene s;
  s.add_ground();
  s.add(Vec3(1, 0.5, 1), 1, Vec3(0, 0.25, 0));
  const Real angle = heading_degrees * std::numbers::pi / 180;
  s.bodies.back().velocity = 5 * Vec3(std::cos(angle), 0, std::sin(angle));
  return s;
}

/// Boxes that fall into a pit with walls.
inline BoxScene box_pile(int count) {
  BoxScene s;
  constexpr Real pitch = 1.5;
  const int grid = static_cast<int>(std::ceil(std::cbrt(count) - 1e-9));
  const int layers = (count + grid * grid - 1) / (grid * grid);
  const Real w = pitch * grid / 2 + 0.25, height = pitch * layers + 2;
  s.add(Vec3(2 * w + 4, 2, 2 * w + 4), 0, Vec3(0, -1, 0));
  for (const Real side : {1.0, -1.0})
    s.add(Vec3(2, height, 2 * w + 4), 0, Vec3(side * (w + 1), height / 2, 0));
  for (const Real side : {1.0, -1.0}) s.add(Vec3(2 * w, height, 2), 0, Vec3(0, height / 2, side * (w + 1)));
  uint32_t x = 12345;
  const auto next = [&x] { return (x = 1664525 * x + 1013904223) / 4294967296.0; };
  const auto sym = [&next] { return 2 * next() - 1; };
  for (int i = 0; i < count; ++i) {
    Vec3 p(i % grid - (grid - 1) / 2.0, i / (grid * grid) + 1, i / grid % grid - (grid - 1) / 2.0), axis;
    p *= pitch;
    for (Real& c : p) c += 0.05 * sym();
    for (Real& c : axis) c = sym();
    s.add(Vec3::Ones(), 1, p, Quat(Eigen::AngleAxisd(0.3 * next(), axis.normalized())));
  }
  return s;
}

}  // namespace offstage::sim
