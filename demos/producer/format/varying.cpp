/// Varying numbers: the JSON form of effects::Varying.

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "effects/distribution.h"
#include "producer/format/values.h"

namespace offstage::producer {
namespace {

using effects::Curve;
using effects::Normal;
using effects::Uniform;

constexpr Real kUnbounded = 1e300;  // bound of a Normal that has no bound

/// The keys of a normal distribution, for a number with the given Spec.
struct NormalSpecs {
  Spec mean, deviation, min, max, clip;

  explicit NormalSpecs(const Spec& of)
      : mean{"mean", "mean of the normal distribution", of.unit, of.limits, true},
        deviation{"deviation", "standard deviation", of.unit, kNotNegative},
        min{"min", "smallest value", of.unit, of.limits},
        max{"max", "largest value", of.unit, of.limits},
        clip{"clip", "truncate the distribution at mean - deviation and mean + deviation", "", {}} {}

  std::array<const Spec*, 5> all() const { return {&mean, &deviation, &min, &max, &clip}; }
};

/// Returns the distribution, truncated at the limits. A limit that is itself an allowed value truncates the
/// distribution. An excluded limit, such as "greater than 0", does not, because there is no smallest allowed
/// value.
Normal within(const Limits& limits) {
  Normal normal;
  if (!limits.open_low) normal.min = std::max(normal.min, limits.low);
  if (!limits.open_high) normal.max = std::min(normal.max, limits.high);
  return normal;
}

Normal read_normal(Reader& in, const Node& node, const Spec& spec) {
  const NormalSpecs specs(spec);
  Normal v = within(spec.limits);
  in.keys(node, "varying number", specs.all(), false, [&](std::size_t i, const Node& value) {
    if (i == 4) return Codec<bool>::read(in, value, specs.clip, v.clip);
    Codec<Real>::read(in, value, *specs.all()[i], *std::array{&v.mean, &v.deviation, &v.min, &v.max}[i]);
  });
  if (v.min > v.max) in.fail(node.at, fmt::format("min ({:g}) is greater than max ({:g})", v.min, v.max));
  return v;
}

Uniform read_uniform(Reader& in, const Node& node, const Spec& spec) {
  const Spec range{"range", "", spec.unit, spec.limits};
  Eigen::Vector2d ends(0, 0);
  in.keys(node, "range", std::array{&range}, false, [&](std::size_t, const Node& value) {
    Codec<Eigen::Vector2d>::read(in, value, range, ends);
    if (ends[0] > ends[1])
      in.fail(value.at,
              fmt::format("must be [low, high] with low <= high, got [{:g}, {:g}]", ends[0], ends[1]));
  });
  return {ends[0], ends[1]};
}

Curve read_curve(Reader& in, const Node& node, const Spec& spec) {
  const Spec key{"curve", "", spec.unit, spec.limits}, time{"", "", "s", {}};
  Curve curve;
  const auto read_key = [&](const Node& item) {
    const List* pair = in.list(item, "a pair of time and value", 2, 2);
    if (!pair) return;
    std::pair<Real, Real>& added = curve.keys.emplace_back();
    in.within("0", [&] { Codec<Real>::read(in, (*pair)[0], time, added.first); });
    in.within("1", [&] { Codec<Real>::read(in, (*pair)[1], key, added.second); });
    if (const std::size_t n = curve.keys.size(); n > 1 && added.first <= curve.keys[n - 2].first)
      in.fail(item.at, "times must increase");
  };
  in.keys(node, "curve", std::array{&key}, false, [&](std::size_t, const Node& value) {
    const List* list = in.list(value, "a list of at least one [time, value]", 1);
    for (std::size_t i = 0; list && i < list->size(); ++i)
      in.within(std::to_string(i), [&] { read_key((*list)[i]); });
  });
  return curve;
}

/// Returns the name of the schema of varying numbers with some limits, such as "varying_over_0".
std::string schema_name(const Limits& limits) {
  std::string name = "varying";
  if (limits.low > -kInfinity) name += (limits.open_low ? "_over_" : "_from_") + to_text(limits.low);
  if (limits.high < kInfinity) name += (limits.open_high ? "_below_" : "_to_") + to_text(limits.high);
  return name;
}

Node object_schema(Object properties, List required) {
  return Object{{"type", "object"},
                {"properties", std::move(properties)},
                {"required", std::move(required)},
                {"additionalProperties", false}};
}

}  // namespace

void Codec<Varying>::read(Reader& in, const Node& node, const Spec& spec, Varying& out) {
  if (node.as<int64_t>() || node.as<double>()) {
    if (const auto v = in.number(node, spec)) out = *v;
    return;
  }
  if (!node.as<Object>())
    return in.refuse(
        node, R"(a number, {"mean": m, "deviation": d}, {"range": [a, b]} or {"curve": [[t, v], ...]})");
  const std::size_t before = in.problems().size();
  Varying v;
  if (node.find("range"))
    v = read_uniform(in, node, spec);
  else if (node.find("curve"))
    v = read_curve(in, node, spec);
  else
    v = read_normal(in, node, spec);
  if (in.problems().size() > before) return;
  // Only a normal distribution can still exceed the limits, where a limit itself is excluded.
  if (!spec.limits.allows(effects::lower_bound(v)))
    return in.fail(node.at,
                   "can become too small: must be " + spec.limits.rule(spec.unit) + "; give \"min\"");
  if (!spec.limits.allows(effects::upper_bound(v)))
    return in.fail(node.at,
                   "can become too large: must be " + spec.limits.rule(spec.unit) + "; give \"max\"");
  out = std::move(v);
}

Node Codec<Varying>::write(const Varying& value) {
  if (const Real* constant = std::get_if<Real>(&value)) return *constant;
  if (const Uniform* v = std::get_if<Uniform>(&value)) return Object{{"range", List{v->low, v->high}}};
  if (const Curve* v = std::get_if<Curve>(&value)) {
    List keys;
    for (const auto& [t, x] : v->keys) keys.push_back(List{t, x});
    return Object{{"curve", std::move(keys)}};
  }
  const Normal& v = std::get<Normal>(value);
  Object object = {{"mean", v.mean}, {"deviation", v.deviation}};
  if (v.min > -kUnbounded) object.push_back({"min", v.min});
  if (v.max < kUnbounded) object.push_back({"max", v.max});
  object.push_back({"clip", v.clip});
  return object;
}

Description Codec<Varying>::describe(Catalogue& all, const Spec& spec) {
  const Object number = Codec<Real>::describe(all, spec).schema, any = Codec<Real>::describe(all, {}).schema;
  Object normal;
  const NormalSpecs specs(spec);
  for (const Spec* key : {&specs.mean, &specs.deviation, &specs.min, &specs.max})
    normal.push_back({key->key, Codec<Real>::describe(all, *key).schema});
  normal.push_back({"clip", Codec<bool>::describe(all, specs.clip).schema});
  const Object range = Codec<Eigen::Vector2d>::describe(all, spec).schema;
  const Object pair = {{"type", "array"}, {"items", List{any, number}}, {"minItems", 2}, {"maxItems", 2}};
  const Object curve = {{"type", "array"}, {"items", pair}, {"minItems", 1}};
  const Node schema = Object{{"oneOf", List{number, object_schema(std::move(normal), {"mean"}),
                                            object_schema({{"range", range}}, {"range"}),
                                            object_schema({{"curve", curve}}, {"curve"})}}};
  return {all.share(schema_name(spec.limits), schema), "[varying](#numbers-that-vary)"};
}

}  // namespace offstage::producer
