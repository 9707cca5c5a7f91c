#include "producer/base/time_code.h"

#include <cmath>

#include <fmt/format.h>

namespace offstage::producer {

std::string time_code(double seconds) {
  const auto hundredths = static_cast<long long>(std::llround(std::abs(seconds) * 100));
  return fmt::format("{}{}:{:02}.{:02}", seconds < 0 && hundredths > 0 ? "-" : "", hundredths / 6000,
                     hundredths / 100 % 60, hundredths % 100);
}

}  // namespace offstage::producer
