#pragma once
/// Colour and size keyed over age (F4).

#include <vector>

#include <Eigen/Core>

#include "effects/random.h"

namespace offstage::effects {

using Rgba = Eigen::Vector4f;  ///< linear, straight alpha; above 1 glows

/// Value over normalised age in [0, 1], piecewise linear, held at the ends.
template <class T>
struct AgeRamp {
  struct Key {
    Real age = 0;
    T value;
  };
  std::vector<Key> keys;  ///< ascending ages; must not be empty when evaluated

  T at(Real age) const {
    if (age <= keys.front().age) return keys.front().value;
    for (std::size_t i = 1; i < keys.size(); ++i) {
      if (age > keys[i].age) continue;
      const Real span = keys[i].age - keys[i - 1].age;
      const float w = span > 0 ? static_cast<float>((age - keys[i - 1].age) / span) : 1.f;
      return keys[i - 1].value * (1 - w) + keys[i].value * w;
    }
    return keys.back().value;
  }
};

using ColorRamp = AgeRamp<Rgba>;
using SizeRamp = AgeRamp<float>;

}  // namespace offstage::effects
