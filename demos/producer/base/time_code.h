#pragma once
/// Times of a film as text.

#include <string>

namespace offstage::producer {

/// "0:02.50" for 2.5 s: minutes, seconds and hundredths.
std::string time_code(double seconds);

}  // namespace offstage::producer
