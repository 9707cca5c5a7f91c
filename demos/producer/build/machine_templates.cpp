#include <array>
#include <cmath>
#include <numbers>

#include "producer/build/articulation_builder.h"

namespace offstage::producer {
namespace {

constexpr Real kGravity = 9.81;
constexpr Real kDegrees = 180 / std::numbers::pi;

/// Returns a motor that follows keys along a smooth curve. It follows them rigidly unless this needs more
/// than the maximum effort.
JointMotor follow(sim::Motor::Mode mode, const std::vector<MotorKey>& keys,
                  std::optional<Real> max_effort = {}) {
  return {.mode = mode, .keys = keys, .smooth = true, .max_effort = max_effort};
}

std::vector<MotorKey> mapped(std::vector<MotorKey> keys, auto&& value) {
  for (MotorKey& key : keys) key.target = value(key.target);
  return keys;
}

/// Builds a machine at a pose. Positions and directions are in the machine's frame.
class MachineBuilder {
 public:
  template <class Machine>
  explicit MachineBuilder(const Machine& machine)
      : make(machine.where, machine.name), position_(machine.position), orientation_(machine.orientation) {
    if constexpr (requires { machine.velocity; }) velocity_ = machine.velocity;
  }

  Vec3 place(const Vec3& p) const { return position_ + orientation_ * p; }

  Body& part(const std::string& name, const std::string& material, const Shape& shape, Real volume, Real mass,
             const Vec3& centre, const Quat& turn = Quat::Identity()) {
    Body& b = make.body(name, material);
    b.shape = shape;
    b.position = place(centre);
    b.orientation = (orientation_ * turn).normalized();
    b.velocity = velocity_;
    b.density = mass / volume;
    return b;
  }
  Body& box(const std::string& name, const std::string& material, const Vec3& size, Real mass,
            const Vec3& centre) {
    return part(name, material, sim::Box{size}, size.prod(), mass, centre);
  }
  /// Returns the angular velocity with which a wheel of this radius about the machine's X axis rolls along Z.
  Vec3 rolling(Real radius) const {
    return orientation_ * Vec3((orientation_.conjugate() * velocity_).z() / radius, 0, 0);
  }
  Joint& join(sim::JointType type, const std::string& name, const std::string& a, const std::string& b,
              const Vec3& anchor, const Vec3& axis = Vec3::UnitY()) {
    Joint& j = make.joint(name, make.own(a), make.own(b), place(anchor));
    j.behaviour.type = type;
    j.behaviour.axis = orientation_ * axis;
    return j;
  }

  ArticulationBuilder make;

 private:
  Vec3 position_;
  Quat orientation_;
  Vec3 velocity_ = Vec3::Zero();
};

}  // namespace

/// Builds a car. The chassis is low and narrow, so that the front wheels can be steered beside it; the body
/// is above the wheels. Each wheel turns on a hub, which slides up and down on a spring. Steering knuckles
/// connect the front wheels to their hubs.
Parts build(const Vehicle& car) {
  using enum sim::JointType;
  MachineBuilder make(car);
  const Real r = car.wheel_radius, tread = 0.55 * r, L = car.length, W = car.width;
  const Real track = W - tread, base = 0.62 * L;  // distances between the centres of the wheels
  const Real travel = 0.3 * r, hub_mass = 0.01 * car.mass, wheel_mass = 0.025 * car.mass;
  const Real sprung = car.mass - 4 * (hub_mass + wheel_mass) - 2 * hub_mass;

  const Real under = 0.7 * r, over = 2 * r + 1.1 * travel, body_height = 0.55 * r + 0.05 * L;
  make.box("chassis", car.trim, {W - 2 * (tread + 0.6 * r), over - under, 0.96 * L}, 0.6 * sprung,
           {0, (over + under) / 2, 0});
  make.box("body", car.paint, {0.98 * W, body_height, L}, 0.32 * sprung, {0, over + body_height / 2, 0});
  const Vec3 cabin(0.8 * W, 0.11 * L, 0.42 * L);
  make.box("cabin", car.trim, cabin, 0.08 * sprung, {0, over + body_height + cabin.y() / 2, -0.08 * L});
  make.join(fixed, "body", "body", "chassis", {0, over, 0});
  make.join(fixed, "cabin", "cabin", "body", {0, over + body_height, -0.08 * L});

  const Real w = 2 * std::numbers::pi * car.suspension_hz, load = sprung / 4, kFraction = 0.35;
  const Real stiffness = load * w * w;
  for (const bool front : {true, false})
    for (const bool left : {true, false}) {
      const std::string end = front ? "_front" : "_rear", side = left ? "_left" : "_right";
      const Real x = (left ? 1 : -1) * track / 2, z = (front ? 1 : -1) * base / 2;
      const Vec3 centre(x, r, z);
      const std::string hub = "hub" + end + side, knuckle = "knuckle" + side, wheel = "wheel" + end + side;
      const Vec3 size = Vec3::Constant(0.3 * r);
      const auto inside = [](Body& b) {
        b.collides = false;
        b.visible = false;
      };
      inside(make.box(hub, car.trim, size, hub_mass, centre));
      Joint& spring = make.join(prismatic, hub, hub, "chassis", centre);
      spring.behaviour.limits = std::array{-travel, travel};
      // The target supports the weight of the car in the gravity of the Earth.
      spring.behaviour.motor = JointMotor{.mode = sim::Motor::Mode::position,
                                          .target = -load * kGravity / stiffness,
                                          .stiffness = stiffness,
                                          .damping = 2 * kFraction * load * w};
      if (front) {
        inside(make.box(knuckle, car.trim, size, hub_mass, centre));
        Joint& steering = make.join(revolute, knuckle, knuckle, hub, centre);
        // Both front wheels roll about the same point on the line of the rear axle (Ackermann).
        const auto angle = [&](Real degrees) {
          const Real t = std::tan(degrees / kDegrees);
          return kDegrees * std::atan(base * t / (base - x * t));
        };
        steering.behaviour.motor = follow(sim::Motor::Mode::position, mapped(car.steer, angle));
      }
      make.part(wheel, car.tyre, sim::Cylinder{r, tread}, std::numbers::pi * r * r * tread, wheel_mass,
                centre, Quat(Eigen::AngleAxisd(-std::numbers::pi / 2, Vec3::UnitZ())))
          .angular_velocity = make.rolling(r);
      Joint& axle = make.join(revolute, wheel, wheel, front ? knuckle : hub, centre, Vec3::UnitX());
      if (!front && !car.speed.empty())
        axle.behaviour.motor =
            follow(sim::Motor::Mode::speed,
                   mapped(car.speed, [&](Real speed) { return kDegrees * speed / r; }), car.max_torque);
    }
  return std::move(make.make.parts);
}

Parts build(const Crane& crane) {
  using enum sim::JointType;
  MachineBuilder make(crane);
  const Real H = crane.height, R = crane.reach, beam = 0.045 * H;
  Body& mast = make.box("mast", crane.frame, {1.3 * beam, H, 1.3 * beam}, 1, {0, H / 2, 0});
  mast.motion = sim::MotionType::static_body;
  const Real back = 0.35 * R, jib_length = R + back, top = H + beam / 2;
  make.box("jib", crane.frame, {jib_length, beam, beam}, crane.load_mass, {(R - back) / 2, top, 0});
  Joint& slew = make.join(revolute, "slew", "jib", "mast", {0, H, 0});
  slew.behaviour.motor = follow(sim::Motor::Mode::position, crane.slew);
  make.box("counterweight", crane.load, {0.12 * R, 2.2 * beam, 1.8 * beam}, 1.5 * crane.load_mass,
           {-0.3 * R, H - 1.1 * beam, 0});
  make.join(fixed, "counterweight", "counterweight", "jib", {-0.3 * R, H, 0});

  const Vec3 start(0.6 * R, H - 0.3 * beam, 0);
  make.box("trolley", crane.frame, {1.6 * beam, 0.6 * beam, 1.3 * beam}, 0.1 * crane.load_mass, start);
  Joint& travel = make.join(prismatic, "travel", "trolley", "jib", start, Vec3::UnitX());
  travel.behaviour.motor = follow(sim::Motor::Mode::position, crane.trolley);

  const Real side = crane.load_size, hook = 0.45 * H;  // top of the load
  make.box("load", crane.load, Vec3::Constant(side), crane.load_mass, {start.x(), hook - side / 2, 0});
  Joint& rope = make.join(distance, "rope", "load", "trolley", {start.x(), hook, 0});
  rope.anchor_b = make.place({start.x(), start.y() - 0.3 * beam, 0});
  rope.radius = 0.1 * beam;
  rope.behaviour.motor = follow(sim::Motor::Mode::position, mapped(crane.hoist, [](Real up) { return -up; }));
  return std::move(make.make.parts);
}

}  // namespace offstage::producer
