#include "sim/world/body_reactions.h"

#include <vector>

namespace offstage::sim {
namespace {

/// A sleeping body wakes if an impact would make it faster than this [m/s].
constexpr Real kNudge = 1e-4;

}  // namespace

void BodyReactions::apply(std::span<const Reaction> reactions, Real time, StepReport& report) {
  std::vector<uint32_t> pushed;
  for (const Reaction& r : reactions) {
    Reaction& sum = pending_.try_emplace(r.body, Reaction{r.body, Vec3::Zero(), Vec3::Zero()}).first->second;
    sum.impulse += r.impulse;
    sum.angular_impulse += r.angular_impulse;
  }
  std::erase_if(pending_, [&](const auto& entry) {
    const Reaction& sum = entry.second;
    Body& body = world_.body_at(sum.body);
    if (!body.is_dynamic()) return true;
    const Vec3 turn = body.rigid.angular_velocity(body.rigid.orientation, sum.angular_impulse);
    const Real speed = sum.impulse.norm() / body.rigid.mass + turn.norm() * body.extent;
    if (body.asleep && speed < kNudge) return false;
    if (body.asleep) active_.wake(body);
    body.rigid.momentum += sum.impulse;
    body.rigid.angular_momentum += sum.angular_impulse;
    pushed.push_back(sum.body);
    return true;
  });
  JointFigures figures;
  for (const uint32_t slot : pushed) {
    Articulation* articulation = joints_.articulation_of(slot);
    if (!articulation) continue;
    articulation->transmit_impulses(time, figures);
    for (Body* link : articulation->bodies()) link->pose = link->rigid.pose();
  }
  report.joints.add(figures);
}

}  // namespace offstage::sim
