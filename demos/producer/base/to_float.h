#pragma once
/// Conversion from double, which the simulation uses, to float, which the renderer uses.

namespace offstage::producer {

inline float to_float(double value) {
  return static_cast<float>(value);
}

}  // namespace offstage::producer
