#include "producer/format/values.h"

#include <array>
#include <charconv>
#include <climits>
#include <cmath>
#include <numbers>

#include "effects/random.h"
#include "render/tone_map.h"

namespace offstage::producer {
namespace {

/// Returns the decimal number of the shortest text of a float, so that 0.8f is written as 0.8.
double widen(float v) {
  char text[32];
  const char* end = std::to_chars(text, text + sizeof text, v).ptr;
  double wide = 0;
  std::from_chars(text, end, wide);
  return wide;
}

Limits narrowed(Limits limits, Real low, Real high) {
  if (limits.low < low) limits = {low, limits.high, false, limits.open_high, limits.nonzero};
  if (limits.high > high) limits = {limits.low, high, limits.open_low, false, limits.nonzero};
  return limits;
}

template <class I>
Spec whole(Spec spec) {
  constexpr bool kSigned = std::is_signed_v<I>;
  constexpr bool kSmall = sizeof(I) < sizeof(int64_t);
  spec.limits = narrowed(spec.limits,
                         !kSigned ? 0
                         : kSmall ? INT_MIN
                                  : -kInfinity,
                         kSmall ? INT_MAX : kInfinity);
  return spec;
}

template <class I>
void read_whole(Reader& in, const Node& node, const Spec& spec, I& out) {
  if (const auto v = in.integer(node, whole<I>(spec))) out = static_cast<I>(*v);
}

template <class I>
Description describe_whole(const Spec& spec) {
  Description d{{{"type", "integer"}}, "integer"};
  whole<I>(spec).limits.add_to(d.schema);
  return d;
}

}  // namespace

// --- bool, text, numbers ---

void Codec<bool>::read(Reader& in, const Node& node, const Spec&, bool& out) {
  if (const bool* v = node.as<bool>())
    out = *v;
  else
    in.refuse(node, "true or false");
}
Node Codec<bool>::write(const bool& value) {
  return value;
}
Description Codec<bool>::describe(Catalogue&, const Spec&) {
  return {{{"type", "boolean"}}, "boolean"};
}

void Codec<std::string>::read(Reader& in, const Node& node, const Spec& spec, std::string& out) {
  const std::string* v = node.as<std::string>();
  if (!v) return in.refuse(node, spec.help.empty() ? "a string" : "a string (" + spec.help + ")");
  if (spec.required && v->empty()) return in.fail(node.at, "must not be empty");
  out = *v;
}
Node Codec<std::string>::write(const std::string& value) {
  return value;
}
Description Codec<std::string>::describe(Catalogue&, const Spec& spec) {
  Description d{{{"type", "string"}}, "string"};
  if (spec.required) d.schema.push_back({"minLength", 1});
  return d;
}

void Codec<Real>::read(Reader& in, const Node& node, const Spec& spec, Real& out) {
  if (const auto v = in.number(node, spec)) out = *v;
}
Node Codec<Real>::write(const Real& value) {
  return value;
}
Description Codec<Real>::describe(Catalogue&, const Spec& spec) {
  Description d{{{"type", "number"}}, "number"};
  spec.limits.add_to(d.schema);
  return d;
}

void Codec<int>::read(Reader& in, const Node& node, const Spec& spec, int& out) {
  read_whole(in, node, spec, out);
}
Node Codec<int>::write(const int& value) {
  return value;
}
Description Codec<int>::describe(Catalogue&, const Spec& spec) {
  return describe_whole<int>(spec);
}

void Codec<uint32_t>::read(Reader& in, const Node& node, const Spec& spec, uint32_t& out) {
  read_whole(in, node, spec, out);
}
Node Codec<uint32_t>::write(const uint32_t& value) {
  return static_cast<int64_t>(value);
}
Description Codec<uint32_t>::describe(Catalogue&, const Spec& spec) {
  return describe_whole<uint32_t>(spec);
}

void Codec<int64_t>::read(Reader& in, const Node& node, const Spec& spec, int64_t& out) {
  read_whole(in, node, spec, out);
}
Node Codec<int64_t>::write(const int64_t& value) {
  return value;
}
Description Codec<int64_t>::describe(Catalogue&, const Spec& spec) {
  return describe_whole<int64_t>(spec);
}

void Codec<uint64_t>::read(Reader& in, const Node& node, const Spec& spec, uint64_t& out) {
  read_whole(in, node, spec, out);
}
Node Codec<uint64_t>::write(const uint64_t& value) {
  return static_cast<int64_t>(value);
}
Description Codec<uint64_t>::describe(Catalogue&, const Spec& spec) {
  return describe_whole<uint64_t>(spec);
}

void Codec<sim::Aabb>::read(Reader& in, const Node& node, const Spec& spec, sim::Aabb& out) {
  if (const auto v = in.number(node, spec)) out = sim::Aabb(Vec3::Constant(-*v), Vec3::Constant(*v));
}
Node Codec<sim::Aabb>::write(const sim::Aabb& value) {
  return value.max().x();
}
Description Codec<sim::Aabb>::describe(Catalogue& all, const Spec& spec) {
  return Codec<Real>::describe(all, spec);
}

void Codec<render::FrameRate>::read(Reader& in, const Node& node, const Spec& spec, render::FrameRate& out) {
  const std::string* text = node.as<std::string>();
  if (!text && !node.as<int64_t>() && !node.as<double>())
    return in.refuse(node, "a number or a fraction such as \"30000/1001\"");
  if (!text) {
    if (const auto v = in.number(node, spec)) out = render::frame_rate_of(*v);
    return;
  }
  const auto rate = text->find('/') == std::string::npos ? std::nullopt : render::parse_frame_rate(*text);
  if (!rate) return in.refuse(node, "a number or a fraction such as \"30000/1001\"");
  if (!spec.limits.allows(rate->per_second())) return in.refuse(node, spec.limits.rule(spec.unit));
  out = *rate;
}
Node Codec<render::FrameRate>::write(const render::FrameRate& value) {
  if (value.denominator == 1) return value.per_second();
  return value.text();
}
Description Codec<render::FrameRate>::describe(Catalogue&, const Spec& spec) {
  Object number = {{"type", "number"}};
  spec.limits.add_to(number);
  const Object fraction = {{"type", "string"}, {"pattern", "^[0-9]{1,10}/[0-9]{1,7}$"}};
  return {{{"oneOf", List{number, fraction}}}, "number or `\"n/d\"`"};
}

void Codec<ModelScale>::read(Reader& in, const Node& node, const Spec& spec, ModelScale& out) {
  const std::string* text = node.as<std::string>();
  if (text && *text == "auto") {
    out = {};
    out.automatic = true;
  } else if (text) {
    in.refuse(node, "a number or \"auto\"");
  } else if (const auto v = in.number(node, spec)) {
    out = *v;
  }
}
Node Codec<ModelScale>::write(const ModelScale& value) {
  if (value.automatic) return std::string("auto");
  return value.factor;
}
Description Codec<ModelScale>::describe(Catalogue&, const Spec& spec) {
  Object number = {{"type", "number"}};
  spec.limits.add_to(number);
  return {{{"oneOf", List{number, Object{{"const", "auto"}}}}}, "number or `\"auto\"`"};
}

// --- vectors, orientations, colours ---

Description describe_tuple(Description item, std::size_t size) {
  const auto n = static_cast<int64_t>(size);
  return {{{"type", "array"}, {"items", std::move(item.schema)}, {"minItems", n}, {"maxItems", n}},
          std::to_string(size) + " " + item.type + "s"};
}

Description describe_vector(Description item, int size, bool nonzero) {
  Description d = describe_tuple(std::move(item), static_cast<std::size_t>(size));
  if (nonzero) d.schema.push_back({"not", Object{{"items", Object{{"const", 0}}}}});
  return d;
}

Description describe_age_key(const Description& age, const Description& value) {
  return {{{"type", "array"}, {"items", List{age.schema, value.schema}}, {"minItems", 2}, {"maxItems", 2}},
          "(age, " + value.type + ")"};
}

namespace {

struct AxisAngle {
  Vec3 axis = Vec3::UnitY();
  Real angle_deg = 0;
};

const Spec kAxis{"axis", "direction of the rotation axis", "", kDirection, true};
const Spec kAngle{"angle_deg", "angle of rotation about the axis", "degrees", {}, true};

Quat to_quat(const AxisAngle& turn) {
  const auto [sin, cos] = effects::sincos(turn.angle_deg * (std::numbers::pi / 360));
  const Vec3 v = sin * turn.axis.stableNormalized();
  return {cos, v.x(), v.y(), v.z()};
}

}  // namespace

void Codec<Quat>::read(Reader& in, const Node& node, const Spec&, Quat& out) {
  if (node.as<Object>()) {
    AxisAngle turn;
    const std::size_t before = in.problems().size();
    in.keys(node, "orientation", std::array{&kAxis, &kAngle}, false, [&](std::size_t i, const Node& value) {
      if (i == 0)
        Codec<Vec3>::read(in, value, kAxis, turn.axis);
      else
        Codec<Real>::read(in, value, kAngle, turn.angle_deg);
    });
    if (in.problems().size() == before) out = to_quat(turn);
    return;
  }
  if (!node.as<List>()) return in.refuse(node, "[w, x, y, z] or {\"axis\": [x, y, z], \"angle_deg\": a}");
  Eigen::Vector4d wxyz(0, 0, 0, 0);
  const std::size_t before = in.problems().size();
  Codec<Eigen::Vector4d>::read(in, node, {"", "", "", kDirection}, wxyz);
  if (in.problems().size() > before) return;
  constexpr Real kUnit = 1e-14;  // Normalized values keep their bits, so that writing and reading agree.
  if (std::abs(wxyz.squaredNorm() - 1) > kUnit) wxyz.stableNormalize();
  out = Quat(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
}
Node Codec<Quat>::write(const Quat& q) {
  return List{q.w(), q.x(), q.y(), q.z()};
}
Description Codec<Quat>::describe(Catalogue& all, const Spec&) {
  const Object axis = Codec<Vec3>::describe(all, kAxis).schema,
               angle = Codec<Real>::describe(all, kAngle).schema;
  const Object wxyz = Codec<Eigen::Vector4d>::describe(all, {"", "", "", kDirection}).schema;
  const Object turn = {{"type", "object"},
                       {"properties", Object{{kAxis.key, axis}, {kAngle.key, angle}}},
                       {"required", List{kAxis.key, kAngle.key}},
                       {"additionalProperties", false}};
  return {all.share("orientation", Object{{"oneOf", List{wxyz, turn}}}), "[orientation](#orientations)"};
}

namespace {

/// Returns the value of two hexadecimal digits divided by 255; a negative number if a digit is invalid.
float hex_fraction(std::string_view digits) {
  int value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  return error == std::errc() && end == digits.data() + digits.size() && value >= 0
             ? static_cast<float>(value) / 255
             : -1;
}

std::optional<Eigen::Vector4f> parse_hex(std::string_view text) {
  const bool brief = text.size() == 4 || text.size() == 5;  // one digit stands for two equal ones
  if (!text.starts_with('#') || (!brief && text.size() != 7 && text.size() != 9)) return {};
  const std::size_t digits = brief ? 1 : 2;
  Eigen::Vector4f rgba(0, 0, 0, 1);
  for (std::size_t i = 0; digits * i + 1 < text.size(); ++i) {
    const std::string_view value = text.substr(digits * i + 1, digits);
    const float fraction = hex_fraction(brief ? std::string(2, value.front()) : std::string(value));
    if (fraction < 0) return {};
    rgba[static_cast<Eigen::Index>(i)] = i < 3 ? render::srgb_decode(fraction) : fraction;
  }
  return rgba;
}

}  // namespace

void Codec<Color>::read(Reader& in, const Node& node, const Spec&, Color& out) {
  constexpr std::string_view kAllowed =
      "\"#rrggbb\", \"#rrggbbaa\", \"#rgb\", \"#rgba\" or a list of 3 or 4 numbers";
  if (const std::string* text = node.as<std::string>()) {
    if (const auto rgba = parse_hex(*text))
      out.rgba = *rgba;
    else
      in.refuse(node, kAllowed);
    return;
  }
  const List* list = in.list(node, kAllowed, 3, 4);
  if (!list) return;
  Eigen::Vector4f rgba(0, 0, 0, 1);
  bool good = true;
  for (std::size_t i = 0; i < list->size(); ++i) {
    in.within(std::to_string(i), [&] {
      const auto v = in.number((*list)[i], {"", "", "", i < 3 ? between(0, 1e6) : kFraction});
      good = good && v;
      rgba[static_cast<Eigen::Index>(i)] = static_cast<float>(v.value_or(0));
    });
  }
  if (good) out.rgba = rgba;
}
Node Codec<Color>::write(const Color& color) {
  List list;
  for (const float v : color.rgba) list.emplace_back(widen(v));
  if (color.rgba[3] == 1) list.pop_back();
  return list;
}
Description Codec<Color>::describe(Catalogue& all, const Spec&) {
  const Object hex = {{"type", "string"}, {"pattern", "^#([0-9a-fA-F]{3,4}|[0-9a-fA-F]{6}|[0-9a-fA-F]{8})$"}};
  Object light = {{"type", "number"}}, alpha = {{"type", "number"}};
  between(0, 1e6).add_to(light);
  kFraction.add_to(alpha);
  const Object list = {
      {"type", "array"}, {"items", List{light, light, light, alpha}}, {"minItems", 3}, {"maxItems", 4}};
  return {all.share("colour", Object{{"oneOf", List{hex, list}}}), "[colour](#colours)"};
}

}  // namespace offstage::producer
