#include <algorithm>
#include <cmath>
#include <numbers>

#include "producer/build/articulation_builder.h"
#include "sim/core/rotation.h"

namespace offstage::producer {
namespace {

/// Returns the name of the body that holds an end; nothing if there is none.
std::optional<std::string> holder(const std::string& end) {
  if (end.empty()) return std::nullopt;
  return end == "world" ? std::string() : end;
}

/// Returns the corners of a polygonal chain of `n` sides of the length `side` that hangs between two points
/// at any heights.
std::vector<Vec3> hanging_nodes(const Vec3& from, const Vec3& to, int n, Real side) {
  const Vec3 across = to - from;
  const Real span = across.norm();
  std::vector<Vec3> nodes;
  if (n * side <= span * (1 + 1e-9)) {
    for (int i = 0; i <= n; ++i) nodes.push_back(from + across * i / n);
    return nodes;
  }
  // The corners lie on a circle: span = 2 R sin(n asin(side / 2R)). Bisection finds half the angle of a side.
  Real low = 0, high = std::numbers::pi / n;
  for (int k = 0; k < 80; ++k) {
    const Real half = (low + high) / 2;
    (side * std::sin(n * half) / std::sin(half) > span ? low : high) = half;
  }
  const Vec3 x = across / span, up = Vec3::UnitY() - Vec3::UnitY().dot(x) * x;
  const Vec3 down = up.norm() > 1e-6 ? Vec3(-up.normalized()) : x.unitOrthogonal();
  const Real radius = side / (2 * std::sin(low)), whole = n * low;
  for (int i = 0; i <= n; ++i) {
    const Real angle = (2.0 * i / n - 1) * whole;
    nodes.push_back(from + x * (span / 2 + radius * std::sin(angle)) +
                    down * radius * (std::cos(angle) - std::cos(whole)));
  }
  return nodes;
}

}  // namespace

/// Returns points in equal steps along a polyline. A polyline without length, which the checks of the scene
/// refuse later, gives the same point for each step.
std::vector<Vec3> along_path(const std::vector<Vec3>& path, int steps) {
  Real total = 0;
  for (std::size_t i = 1; i < path.size(); ++i) total += (path[i] - path[i - 1]).norm();
  if (!(total > 0)) return std::vector<Vec3>(static_cast<std::size_t>(steps) + 1, path.front());
  std::vector<Vec3> points = {path.front()};
  std::size_t piece = 1;
  Real passed = 0;  // length of the pieces before this one
  for (int k = 1; k < steps; ++k) {
    const Real wanted = total * k / steps;
    Real length = (path[piece] - path[piece - 1]).norm();
    while (passed + length < wanted && piece + 1 < path.size()) {
      passed += length;
      ++piece;
      length = (path[piece] - path[piece - 1]).norm();
    }
    points.push_back(path[piece - 1] +
                     std::min(1.0, (wanted - passed) / length) * (path[piece] - path[piece - 1]));
  }
  points.push_back(path.back());
  return points;
}

Parts build(const Chain& chain) {
  ArticulationBuilder make(chain.where, chain.name);
  const Real hanging_side = (chain.to - chain.from).norm() * chain.sag / chain.links;
  const std::vector<Vec3> nodes = chain.path.empty()
                                      ? hanging_nodes(chain.from, chain.to, chain.links, hanging_side)
                                      : along_path(chain.path, chain.links);
  const auto side = [&](std::size_t k) {
    return chain.path.empty() ? hanging_side : (nodes[k + 1] - nodes[k]).norm();
  };
  const auto link = [](int i) { return "link_" + std::to_string(i); };
  for (int i = 0; i < chain.links; ++i) {
    Body& b = make.body(link(i), chain.material);
    const auto k = static_cast<std::size_t>(i);
    b.shape = sim::Capsule{chain.radius, std::max(side(k) - 2 * chain.radius, 0.0)};
    b.position = (nodes[k] + nodes[k + 1]) / 2;
    b.orientation = sim::rotation_between(Vec3::UnitY(), nodes[k + 1] - nodes[k]);
    b.density = chain.density;
  }
  const auto join = [&](int i, const std::string& a, const std::string& b) {
    const auto k = static_cast<std::size_t>(i);
    Joint& j = make.joint("joint_" + std::to_string(i), a, b, nodes[k]);
    j.behaviour.axis = i < chain.links ? nodes[k + 1] - nodes[k] : nodes[k] - nodes[k - 1];
    if (chain.swing_deg < 180) j.behaviour.swing_deg = chain.swing_deg;
    // The stiffness of a joint stands for the bending of the half links on both sides of it. A joint at an
    // end has only one half link.
    const Real length = ((i > 0 ? side(k - 1) : 0) + (i < chain.links ? side(k) : 0)) / 2;
    if (chain.bend_stiffness > 0) j.behaviour.stiffness = chain.bend_stiffness / length;
    j.behaviour.friction = chain.friction;
    j.behaviour.damping = chain.damping;
    j.behaviour.max_force = chain.max_force;
  };
  if (const auto start = holder(chain.start)) join(0, make.own(link(0)), *start);
  for (int i = 1; i < chain.links; ++i) join(i, make.own(link(i)), make.own(link(i - 1)));
  if (const auto end = holder(chain.end)) join(chain.links, make.own(link(chain.links - 1)), *end);
  return std::move(make.parts);
}

Parts build(const Bridge& bridge) {
  ArticulationBuilder make(bridge.where, bridge.name);
  const Real side = (bridge.to - bridge.from).norm() * bridge.sag / bridge.planks;
  const std::vector<Vec3> nodes = hanging_nodes(bridge.from, bridge.to, bridge.planks, side);
  const Vec3 hinge = (bridge.to - bridge.from).cross(Vec3::UnitY()).normalized();
  const auto plank = [](int i) { return "plank_" + std::to_string(i); };
  for (int i = 0; i < bridge.planks; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Vec3 x = (nodes[k + 1] - nodes[k]).normalized();
    sim::Mat3 axes;
    axes << x, hinge.cross(x), hinge;
    Body& b = make.body(plank(i), bridge.material);
    b.shape = sim::Box{{side * 0.94, bridge.thickness, bridge.width}};
    b.position = (nodes[k] + nodes[k + 1]) / 2;
    b.orientation = Quat(axes).normalized();
    b.density = bridge.density;
  }
  for (int i = 0; i <= bridge.planks; ++i) {
    const bool is_last = i == bridge.planks;
    Joint& j = make.joint("hinge_" + std::to_string(i), make.own(plank(is_last ? i - 1 : i)),
                          i == 0 || is_last ? std::string() : make.own(plank(i - 1)),
                          nodes[static_cast<std::size_t>(i)]);
    j.behaviour.type = sim::JointType::revolute;
    j.behaviour.axis = hinge;
    j.behaviour.damping = bridge.damping;
    j.behaviour.max_force = bridge.max_force;
  }
  return std::move(make.parts);
}

/// Builds a ragdoll. Lengths are fractions of the height; x points to the figure's left, z to its front.
Parts build(const Ragdoll& doll) {
  ArticulationBuilder make(doll.where, doll.name);
  const Real H = doll.height;
  const auto place = [&](const Vec3& p) { return Vec3(doll.position + doll.orientation * (H * p)); };
  const auto part = [&](const std::string& name, const std::string& material, const Shape& shape,
                        const Vec3& centre) {
    Body& b = make.body(name, material);
    b.shape = shape;
    b.position = place(centre);
    b.orientation = doll.orientation;
    b.velocity = doll.velocity;
    b.density = doll.density;
  };
  const auto box = [&](Real x, Real y, Real z) { return sim::Box{H * Vec3(x, y, z)}; };
  /// Returns a limb with round ends between two heights.
  const auto limb = [&](Real top, Real bottom, Real radius) {
    return sim::Capsule{H * radius, H * (top - bottom - 2 * radius)};
  };
  // The volume of all parts is kVolume H^3. The dry friction of a limp joint can bear the fraction kLimp of
  // the torque that would hold the whole figure horizontally at its feet.
  constexpr Real kVolume = 0.0098, kLimp = 0.004, kGravity = 9.81;
  // The knees are in front of the axes of the legs, so that the weight of the figure bends them. With all
  // joints in one line, the friction in the joints would keep the figure standing.
  constexpr Real kKnee = 0.025;
  const Real torque = doll.stiffness * kLimp * kVolume * doll.density * H * H * H * kGravity * H;
  const auto join = [&](const std::string& a, const std::string& b, const Vec3& anchor, const Vec3& axis,
                        Real fraction) -> Joint& {
    Joint& j = make.joint(a, make.own(a), make.own(b), place(anchor));
    j.behaviour.axis = doll.orientation * axis;
    j.behaviour.friction = fraction * torque;
    j.behaviour.damping = 0.05 * fraction * torque;
    return j;
  };
  const auto ball = [&](const std::string& a, const std::string& b, const Vec3& anchor, const Vec3& axis,
                        Real swing, Real twist, Real fraction) {
    Joint& j = join(a, b, anchor, axis, fraction);
    j.behaviour.swing_deg = swing;
    j.behaviour.limits_deg = std::array{-twist, twist};
  };
  const auto hinge = [&](const std::string& a, const std::string& b, const Vec3& anchor, const Vec3& axis,
                         Real low, Real high, Real fraction) {
    Joint& j = join(a, b, anchor, axis, fraction);
    j.behaviour.type = sim::JointType::revolute;
    j.behaviour.limits_deg = std::array{low, high};
  };

  part("pelvis", doll.trousers, box(0.17, 0.1, 0.11), {0, 0.53, 0});
  part("chest", doll.shirt, box(0.19, 0.23, 0.12), {0, 0.705, 0});
  part("head", doll.skin, sim::Capsule{H * 0.06, H * 0.04}, {0, 0.915, 0});
  ball("chest", "pelvis", {0, 0.585, 0}, Vec3::UnitY(), 35, 30, 1);
  ball("head", "chest", {0, 0.83, 0}, Vec3::UnitY(), 45, 60, 0.2);
  for (const auto& [side, x] : {std::pair(std::string("_left"), 1.0), {"_right", -1.0}}) {
    part("upper_arm" + side, doll.shirt, limb(0.81, 0.62, 0.027), {x * 0.127, 0.715, 0});
    part("forearm" + side, doll.skin, limb(0.62, 0.44, 0.023), {x * 0.127, 0.53, 0});
    part("thigh" + side, doll.trousers, limb(0.5, 0.285, 0.042), {x * 0.05, 0.3925, 0});
    part("shin" + side, doll.trousers, limb(0.285, 0.05, 0.033), {x * 0.05, 0.1675, 0});
    part("foot" + side, doll.skin, box(0.055, 0.045, 0.14), {x * 0.05, 0.0225, 0.03});
    ball("upper_arm" + side, "chest", {x * 0.127, 0.79, 0}, -Vec3::UnitY(), 110, 60, 0.5);
    hinge("forearm" + side, "upper_arm" + side, {x * 0.127, 0.62, 0}, -Vec3::UnitX(), 0, 140, 0.3);
    ball("thigh" + side, "pelvis", {x * 0.05, 0.49, 0}, -Vec3::UnitY(), 75, 35, 1);
    hinge("shin" + side, "thigh" + side, {x * 0.05, 0.285, kKnee}, Vec3::UnitX(), 0, 130, 0.7);
    hinge("foot" + side, "shin" + side, {x * 0.05, 0.05, 0}, Vec3::UnitX(), -25, 35, 0.3);
  }
  return std::move(make.parts);
}

}  // namespace offstage::producer
