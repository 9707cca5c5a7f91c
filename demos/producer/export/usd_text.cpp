#include "producer/export/usd_text.h"

#include <cctype>

#include <fmt/format.h>

namespace offstage::producer::usd {

std::string prim_name(std::string_view name) {
  std::string out;
  for (const char c : name) out += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  if (out.empty() || std::isdigit(static_cast<unsigned char>(out.front()))) out.insert(out.begin(), '_');
  return out;
}

std::string PrimNames::operator()(std::string_view name) {
  const std::string base = prim_name(name);
  std::string unique = base;
  for (int i = 2; !taken_.insert(unique).second; ++i) unique = base + "_" + std::to_string(i);
  return unique;
}

std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (c == '\n')
      out += "\\n";
    else
      out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "\"";
}

std::string text(float value) {
  return fmt::format("{}", value);
}
std::string text(const Eigen::Vector2f& v) {
  return fmt::format("({}, {})", v.x(), v.y());
}
std::string text(const Eigen::Vector3f& v) {
  return fmt::format("({}, {}, {})", v.x(), v.y(), v.z());
}
std::string text(const Eigen::Quaternionf& q) {
  return fmt::format("({}, {}, {}, {})", q.w(), q.x(), q.y(), q.z());
}
std::string text(const std::string& token) {
  return usd::quoted(token);
}
std::string text(const Eigen::Matrix4f& m) {
  std::string out = "( ";
  for (int column = 0; column < 4; ++column)
    out += fmt::format("{}({}, {}, {}, {})", column > 0 ? ", " : "", m(0, column), m(1, column), m(2, column),
                       m(3, column));
  return out + " )";
}

}  // namespace offstage::producer::usd
