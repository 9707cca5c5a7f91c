/// Cloths in the interface of the world.

#include <cmath>
#include <stdexcept>

#include "sim/world/world_impl.h"

namespace offstage::sim {

ClothHandle World::add_cloth(const ClothDef& def) {
  const std::string object = def.name.empty() ? "cloth" : "cloth \"" + def.name + '"';
  std::string wrong = problem(def);
  if (!(def.appear_at >= 0) || !std::isfinite(def.appear_at) || !(def.remove_at > def.appear_at))
    wrong = "appear_at must be >= 0 and remove_at later than appear_at";
  if (!wrong.empty()) throw std::invalid_argument(object + ": " + wrong);
  for (std::size_t i = 0; i < def.pins.size(); ++i)
    if (def.pins[i].body && !impl_->bodies.find(def.pins[i].body))
      throw std::invalid_argument(object + ": pins[" + std::to_string(i) +
                                  "] is on a body that does not exist");
  const ClothHandle handle = impl_->cloths.insert(nullptr);
  impl_->cloths[handle] = std::make_unique<Cloth>(handle, def);
  impl_->cloths[handle]->absent = def.appear_at > impl_->now;
  impl_->has_lifetimes |= def.appear_at > impl_->now || std::isfinite(def.remove_at);
  impl_->cloth_motion.arrange();
  return handle;
}

bool World::remove(ClothHandle cloth) {
  if (!impl_->cloths.erase(cloth)) return false;
  impl_->active.wake_all();
  impl_->cloth_motion.arrange();
  return true;
}

ClothView World::cloth(ClothHandle cloth) const {
  return impl_->cloths[cloth]->view();
}
const ClothDef& World::cloth_def(ClothHandle cloth) const {
  return impl_->cloths[cloth]->def;
}
ClothGasState World::cloth_gas(ClothHandle cloth) const {
  return gas_state(*impl_->cloths[cloth]);
}

const ClothReport& World::cloth_report(ClothHandle cloth) const {
  return impl_->cloths[cloth]->report;
}
void World::for_each_cloth(const std::function<void(ClothHandle)>& f) const {
  impl_->cloths.for_each([&](ClothHandle handle, const auto&) { f(handle); });
}
std::size_t World::cloth_count() const {
  return impl_->cloths.size();
}

}  // namespace offstage::sim
