#include "producer/scene.h"

#include <cmath>
#include <numbers>

namespace offstage::producer {

int subframes(Quality quality) {
  switch (quality) {
    case Quality::draft:
      return 1;
    case Quality::preview:
      return 4;
    case Quality::final:
      return 16;
  }
  return 1;
}

Quat PlaneSurface::orientation() const {
  const Quat turned(Eigen::AngleAxisd(turn_deg * std::numbers::pi / 180, Vec3::UnitY()));
  return Quat::FromTwoVectors(Vec3::UnitY(), direction) * turned;
}

NamedForce& named(Force& force) {
  return std::visit([](NamedForce& f) -> NamedForce& { return f; }, force);
}
const NamedForce& named(const Force& force) {
  return std::visit([](const NamedForce& f) -> const NamedForce& { return f; }, force);
}

int Scene::frame_count() const {
  return static_cast<int>(std::lround(output.duration * output.fps));
}

}  // namespace offstage::producer
