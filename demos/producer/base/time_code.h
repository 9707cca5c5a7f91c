#pragma once
/// Times of a film as text.

#include <string>

namespace offstage::producer {

/// Returns a time as minutes, seconds and hundredths, such as "0:02.50" for 2.5 s.
std::string time_code(double seconds);

}  // namespace offstage::producer
