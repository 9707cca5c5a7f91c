#include "producer/scene/forces.h"

namespace offstage::producer {

NamedForce& named(Force& force) {
  return std::visit([](NamedForce& f) -> NamedForce& { return f; }, force);
}
const NamedForce& named(const Force& force) {
  return std::visit([](const NamedForce& f) -> const NamedForce& { return f; }, force);
}

}  // namespace offstage::producer
