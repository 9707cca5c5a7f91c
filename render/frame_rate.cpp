#include "render/frame_rate.h"

#include <charconv>
#include <cmath>
#include <numeric>
#include <utility>

namespace offstage::render {
namespace {

constexpr int64_t kMostNumerator = 1'000'000'000, kMostDenominator = 1'000'000;
constexpr double kMostPerSecond = 2000;

/// Parses a text that consists of one number.
template <class N>
std::optional<N> number_in(std::string_view text) {
  N value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

}  // namespace

std::string FrameRate::text() const {
  std::string out = std::to_string(numerator);
  if (denominator != 1) out += "/" + std::to_string(denominator);
  return out;
}

FrameRate frame_rate_of(double per_second) {
  // Convergents p/q of the continued fraction. Each convergent is the best approximation among fractions with
  // a denominator of at most q.
  int64_t p = 1, q = 0, p_before = 0, q_before = 1;
  double rest = per_second;
  constexpr int kMostTerms = 64;
  for (int i = 0; i < kMostTerms; ++i) {
    const double term = std::floor(rest);
    if (q > 0 && term * static_cast<double>(q) + static_cast<double>(q_before) > kMostDenominator) break;
    const auto a = static_cast<int64_t>(term);
    p_before = std::exchange(p, a * p + p_before);
    q_before = std::exchange(q, a * q + q_before);
    if (static_cast<double>(p) / static_cast<double>(q) == per_second || rest == term) break;
    rest = 1 / (rest - term);
  }
  return {static_cast<int>(p), static_cast<int>(q)};
}

std::optional<FrameRate> parse_frame_rate(std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) {
    const auto value = number_in<double>(text);
    if (!value || !(*value > 0 && *value <= kMostPerSecond)) return {};
    return frame_rate_of(*value);
  }
  const auto n = number_in<int64_t>(text.substr(0, slash)), d = number_in<int64_t>(text.substr(slash + 1));
  if (!n || !d || *n < 1 || *d < 1 || *n > kMostNumerator || *d > kMostDenominator) return {};
  const int64_t common = std::gcd(*n, *d);
  return FrameRate(static_cast<int>(*n / common), static_cast<int>(*d / common));
}

}  // namespace offstage::render
