#pragma once
/// Values and names in the text format of USD.

#include <set>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include <Eigen/Geometry>

namespace offstage::producer::usd {

/// Converts a name to a valid prim name of USD, which has only letters, digits and '_', and does not begin
/// with a digit.
std::string prim_name(std::string_view name);
/// Makes prim names that are unique among the children of one prim.
class PrimNames {
 public:
  std::string operator()(std::string_view name);

 private:
  std::set<std::string> taken_;
};

/// Returns a text as a quoted string of USD.
std::string quoted(std::string_view text);

// Each function returns a value in the text format of USD.
std::string text(float value);
std::string text(const Eigen::Vector2f& v);
std::string text(const Eigen::Vector3f& v);
/// Returns the rotation as a quatf of USD, with the real part first.
std::string text(const Eigen::Quaternionf& q);
/// Returns the transform as a matrix4d of USD. In USD, a row vector is multiplied by the matrix from the
/// right, so the text has the transpose of `transform`.
std::string text(const Eigen::Matrix4f& transform);
/// Returns the text as a token of USD.
std::string text(const std::string& token);

/// Returns a list of values: "[a, b, ...]".
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
