#pragma once
/// The simulation computes in double, the renderer in float; this is where numbers change sides.

namespace offstage::producer {

inline float to_float(double value) {
  return static_cast<float>(value);
}

}  // namespace offstage::producer
