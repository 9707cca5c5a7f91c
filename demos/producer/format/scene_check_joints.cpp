#include "producer/format/scene_check_joints.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "producer/base/suggest.h"
#include "producer/build/articulation_defs.h"
#include "producer/format/scene_checker.h"

namespace offstage::producer {
namespace {

constexpr Real kMostSteering = 35;  // [degrees]
/// Greatest number of links of an elastic chain. The shorter a link is, the faster it vibrates, and the
/// shorter the sub-step must be.
constexpr int kMostElasticLinks = 32;

class JointChecker : CheckBase {
 public:
  JointChecker(const Scene& scene, const Scene& flat, Findings& findings)
      : CheckBase(findings), scene_(scene), flat_(flat) {}

  void run() {
    check_unique();
    for (const Joint& joint : scene_.joints) check(joint);
    for (const ArticulationTemplate& articulation : scene_.articulations)
      std::visit(
          [this](const auto& a) {
            // The path is empty if the type was invalid. The articulation was not read then.
            if (!a.where.path.empty()) check(a);
          },
          articulation);
  }

 private:
  void check_unique() {
    std::set<std::string> names;
    for (const Joint& joint : flat_.joints)
      if (!names.insert(joint.name).second)
        return fail(joint.where.path + "/name",
                    "the name '" + joint.name + "' is already used by another joint");
  }

  const Body* body(const std::string& path, const std::string& name) {
    for (const std::vector<Body>* bodies : {&flat_.bodies, &scene_.bodies}) {
      const auto it = std::ranges::find(*bodies, name, &Body::name);
      if (it != bodies->end()) return &*it;
    }
    std::vector<std::string> names;
    for (const Body& b : flat_.bodies) names.push_back(b.name);
    fail(path, "there is no body '" + name + "'" + suggestion(name, names));
    return nullptr;
  }

  void check(const Joint& joint) {
    const std::string& path = joint.where.path;
    const Body* a = joint.a.empty() ? nullptr : body(path + "/a", joint.a);
    const Body* b = joint.b.empty() ? nullptr : body(path + "/b", joint.b);
    if (!joint.a.empty() && joint.a == joint.b) fail(path + "/b", "is the same body as \"a\"");
    const auto moves = [](const Body* body) { return body && body->motion == sim::MotionType::dynamic; };
    if (a && (joint.b.empty() || b) && !moves(a) && !moves(b))
      fail(path, "has no dynamic body: at least one of \"a\" and \"b\" must be dynamic");
    check(path, joint.behaviour);
    check_lifetime(path, joint.appear_at, joint.remove_at);
    check_rope(path, joint);
  }

  void check_rope(const std::string& path, const Joint& joint) {
    const JointBehaviour& how = joint.behaviour;
    using enum sim::JointType;
    if ((how.type == gear || how.type == rack) && joint.b.empty())
      fail(path + "/b", "is needed: a gear or rack couples two bodies");
    if (how.type != pulley)
      for (const auto& [key, point] : {std::pair("/pulley_a", joint.pulley_a), {"/pulley_b", joint.pulley_b}})
        if (!point.isZero(0)) fail(path + key, "is for pulleys");
    if (how.type != rack && !has_rope(how.type) && !joint.anchor_b.isZero(0))
      fail(path + "/anchor_b", "is for distance joints, racks and pulleys");
    if (how.type == pulley) {
      if (!(how.ratio > 0)) fail(path + "/ratio", "must be greater than 0 for a pulley");
      for (const auto& [key, strand] : {std::pair("/pulley_a", Vec3(joint.anchor - joint.pulley_a)),
                                        {"/pulley_b", Vec3(joint.anchor_b - joint.pulley_b)}})
        if (!(strand.norm() > 1e-9))
          fail(path + key, "is at the anchor; each strand of the rope must be longer than 0");
    }
    if (!how.length_limits || !has_rope(how.type)) return;
    const Real length = rope_length(joint);
    const auto& [least, most] = *how.length_limits;
    constexpr Real kRounding = 1e-9;
    if (!(least <= length + kRounding && most >= length - kRounding))
      fail(path + "/length_limits",
           "must be a range that contains the length at time 0, " + std::to_string(length) + " m");
  }

  void check(const std::string& path, const JointBehaviour& joint) {
    using enum sim::JointType;
    const bool slides = joint.type == prismatic || has_rope(joint.type);
    const bool is_coupling = joint.type == gear || joint.type == rack;
    if (joint.length_limits && !has_rope(joint.type))
      fail(path + "/length_limits", "is for distance joints and pulleys; use \"limits\" or \"limits_deg\"");
    if (joint.length_limits && joint.limits)
      fail(path + "/length_limits", "replaces \"limits\"; give one of them");
    if (joint.stiffness > 0 && joint.type != spherical)
      fail(path + "/stiffness", "is for spherical joints; use a motor with a \"stiffness\"");
    if (joint.second_axis && joint.type != universal && !is_coupling)
      fail(path + "/second_axis", "is for universal joints, gears and racks");
    if (joint.ratio == 0) fail(path + "/ratio", "must not be 0");
    if (joint.ratio != 1 && !is_coupling && joint.type != screw && joint.type != pulley)
      fail(path + "/ratio", "is for gears, racks, screws and pulleys");
    if (joint.restitution > 0 && !joint.limits && !joint.length_limits && !joint.limits_deg &&
        !joint.swing_deg && joint.type != pulley)
      fail(path + "/restitution", "has no effect: it is for impacts at limits, and the joint has none");
    if (is_coupling && (joint.limits || joint.limits_deg || joint.motor))
      fail(path, "a gear or rack has no limits and no motor; give them to the joints of its bodies");
    if (joint.limits && !slides)
      fail(path + "/limits", "is for prismatic and distance joints and pulleys; use \"limits_deg\"");
    if (joint.limits_deg && slides) fail(path + "/limits_deg", "is for joints that rotate; use \"limits\"");
    check_limits(path + "/limits", joint.limits);
    check_limits(path + "/limits_deg", joint.limits_deg);
    if (joint.limits_deg && joint.type == fixed) fail(path + "/limits_deg", "has no effect on a fixed joint");
    if (joint.swing_deg && joint.type != spherical && joint.type != universal)
      fail(path + "/swing_deg", "is for spherical and universal joints");
    Joint whole;
    whole.behaviour = joint;
    if (!joint_def(whole).has_free_coordinate())
      for (const auto& [key, value] : {std::pair("/friction", joint.friction), {"/damping", joint.damping}})
        if (value > 0)
          fail(path + key, "has no effect: a fixed joint, or a rod without limits and motor, does not move");
    if (!joint.motor) return;
    if (joint.type != revolute && joint.type != prismatic && joint.type != distance && joint.type != screw)
      fail(path + "/motor", "drives revolute, prismatic, screw and distance joints only");
    if (joint.motor->mode == sim::Motor::Mode::speed)
      for (const auto& [key, value] :
           {std::pair("/stiffness", joint.motor->stiffness), {"/damping", joint.motor->damping}})
        if (value > 0) fail(path + "/motor" + key, "is for the mode \"position\"");
    if (!joint.motor->keys.empty() && joint.motor->target != 0)
      fail(path + "/motor/target", "is replaced by \"keys\"; remove one of them");
    check_keys(path + "/motor/keys", joint.motor->keys);
  }

  void check_limits(const std::string& path, const std::optional<std::array<Real, 2>>& limits) {
    if (limits && !((*limits)[0] <= 0 && (*limits)[1] >= 0))
      fail(path, "must be a range that contains 0, the position of the joint at time 0");
  }

  void check_keys(const std::string& path, const std::vector<MotorKey>& keys) {
    for (std::size_t i = 1; i < keys.size(); ++i)
      if (!(keys[i].time > keys[i - 1].time))
        fail(path + "/" + std::to_string(i) + "/time", "must be later than the time of the previous key");
  }

  void check(const Chain& chain) {
    if (chain.path.empty() && (chain.to - chain.from).norm() < 1e-6)
      fail(chain.where.path + "/to", "must differ from \"from\"");
    if (chain.path.size() == 1) fail(chain.where.path + "/path", "needs at least two points");
    for (std::size_t i = 1; i < chain.path.size(); ++i)
      if ((chain.path[i] - chain.path[i - 1]).norm() < 1e-6)
        fail(chain.where.path + "/path/" + std::to_string(i), "must differ from the point before it");
    if (!chain.path.empty() && (chain.from != Chain().from || chain.to != Chain().to))
      fail(chain.where.path + "/path", "replaces \"from\" and \"to\"; remove them");
    if (!chain.path.empty() && chain.sag != 1)
      fail(chain.where.path + "/sag", "cannot be combined with a \"path\"; remove it");
    if (chain.bend_stiffness > 0 && chain.links > kMostElasticLinks)
      fail(chain.where.path + "/links", "must be at most " + std::to_string(kMostElasticLinks) +
                                            " with \"bend_stiffness\", got " + std::to_string(chain.links) +
                                            "; the stiffness of the chain does not depend on their number");
    const auto is_still = [this](const std::string& end) {
      const auto it = std::ranges::find(flat_.bodies, end, &Body::name);
      return end == "world" || (it != flat_.bodies.end() && it->motion != sim::MotionType::dynamic);
    };
    if (is_still(chain.start) && is_still(chain.end) && chain.path.empty() && chain.sag < 1.0005)
      fail(chain.where.path + "/sag",
           "must be above 1.0005 if both ends are fixed: a taut chain cannot carry a sideways load");
    for (const auto& [key, end] : {std::pair("/start", &chain.start), {"/end", &chain.end}})
      if (!end->empty() && *end != "world") body(chain.where.path + key, *end);
  }
  void check(const Bridge& bridge) {
    const Vec3 across = bridge.to - bridge.from;
    if (across.cross(Vec3::UnitY()).norm() < 1e-3 * across.norm() || across.norm() < 1e-6)
      fail(bridge.where.path + "/to", "must be away from \"from\", not straight above or below it");
  }
  void check(const Ragdoll&) {}
  void check(const Vehicle& vehicle) {
    const std::string& path = vehicle.where.path;
    check_keys(path + "/speed", vehicle.speed);
    check_keys(path + "/steer", vehicle.steer);
    for (std::size_t i = 0; i < vehicle.steer.size(); ++i)
      if (!(std::abs(vehicle.steer[i].target) <= kMostSteering))
        fail(path + "/steer/" + std::to_string(i) + "/target",
             "must be from -35 to 35 degrees, the limits of the steering");
    if (!(vehicle.wheel_radius <= 0.2 * std::min(vehicle.length, 2 * vehicle.width)))
      fail(path + "/wheel_radius", "must be at most a fifth of the length and two fifths of the width");
  }
  void check(const Crane& crane) {
    const std::string& path = crane.where.path;
    for (const auto& [key, keys] :
         {std::pair("/slew", &crane.slew), {"/trolley", &crane.trolley}, {"/hoist", &crane.hoist}})
      check_keys(path + key, *keys);
    if (!(crane.load_size <= 0.25 * std::min(crane.height, crane.reach)))
      fail(path + "/load_size", "must be at most a quarter of the height and of the reach");
  }
  void check(const ModelTree& tree) {
    const std::string& path = tree.where.path;
    if (!tree.base.empty() && tree.base != "world") body(path + "/base", tree.base);
    std::vector<std::string> names;
    for (const ModelTree::Link& link : tree.links) names.push_back(link.name);
    std::set<std::string> seen;
    for (const NodeJoint& joint : tree.joints) {
      check(joint.where.path, joint.behaviour);
      if (has_rope(joint.behaviour.type) || joint.behaviour.type == sim::JointType::gear ||
          joint.behaviour.type == sim::JointType::rack)
        fail(joint.where.path + "/type",
             "must not be \"distance\", \"pulley\", \"gear\" or \"rack\": the joint is at the origin of the "
             "node");
      if (!names.empty() && std::ranges::find(names, joint.node) == names.end())
        fail(joint.where.path + "/node",
             tree.file + " has no node '" + joint.node + "' with triangles" + suggestion(joint.node, names));
      else if (!seen.insert(joint.node).second)
        fail(joint.where.path + "/node", "already has a joint");
    }
  }

  const Scene &scene_, &flat_;
};

}  // namespace

void check_joints(const Scene& scene, const Scene& flat, Findings& findings) {
  JointChecker(scene, flat, findings).run();
}

}  // namespace offstage::producer
