#pragma once
/// Values and names in the text format of USD.

#include <set>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include <Eigen/Geometry>

namespace offstage::producer::usd {

/// Returns a valid prim name of USD: letters, digits and '_', not beginning with a digit.
std::string prim_name(std::string_view name);
/// Makes prim names unique below one parent.
class PrimNames {
 public:
  std::string operator()(std::string_view name);

 private:
  std::set<std::string> taken_;
};

/// Text of a quoted string.
std::string quoted(std::string_view text);

std::string text(float value);
std::string text(const Eigen::Vector2f& v);
std::string text(const Eigen::Vector3f& v);
/// Text of a quatf, with the real part first.
std::string text(const Eigen::Quaternionf& q);
/// Text of a matrix4d. USD multiplies row vectors by a matrix, so the text has the transpose of Eigen's
/// matrix.
std::string text(const Eigen::Matrix4f& transform);
/// Text of a token.
std::string text(const std::string& token);

/// Text of a list: "[a, b, ...]".
template <class T>
std::string list(std::span<const T> values) {
  std::string out = "[";
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) out += ", ";
    if constexpr (std::is_integral_v<T>)
      out += std::to_string(values[i]);
    else
      out += text(values[i]);
  }
  return out + "]";
}

}  // namespace offstage::producer::usd
