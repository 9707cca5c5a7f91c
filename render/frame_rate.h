#pragma once
/// Frames per second as a fraction, so that 30000/1001 stays exact from the scene to the video file.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace offstage::render {

struct FrameRate {
  int numerator = 30, denominator = 1;  ///< the fraction in lowest terms; a valid rate is positive

  constexpr FrameRate(int n = 30, int d = 1) : numerator(n), denominator(d) {}
  bool operator==(const FrameRate&) const = default;

  double per_second() const { return static_cast<double>(numerator) / denominator; }
  /// Returns the duration of a number of frames [s], rounded once. The product is exact, so a long film does
  /// not drift.
  double seconds(int64_t frames) const {
    return static_cast<double>(frames * denominator) / static_cast<double>(numerator);
  }
  /// Returns the rate as text, such as "30" or "30000/1001".
  std::string text() const;
};

/// Returns the simplest fraction that rounds to a number: 29.97 becomes 2997/100, 1/0.0625 becomes 16.
/// Denominators are at most 1 000 000. If no such fraction rounds to the number, returns the nearest
/// convergent of its continued fraction, which differs by less than 1e-12. The number must be in (0, 2000].
FrameRate frame_rate_of(double per_second);

/// Parses "30", "29.97" or "30000/1001". Returns nothing for other text, for a rate that is not positive, or
/// if a part of a fraction is too large (above 1 000 000 000 over 1 000 000).
std::optional<FrameRate> parse_frame_rate(std::string_view text);

}  // namespace offstage::render
