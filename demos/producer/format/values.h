#pragma once
/// JSON forms of plain values in a scene file: numbers, text, vectors, orientations, colours, varying
/// numbers, keys over age.

#include <array>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "producer/format/fields.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

template <>
struct Codec<bool> {
  static void read(Reader& in, const Node& node, const Spec& spec, bool& out);
  static Node write(const bool& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
template <>
struct Codec<std::string> {
  static void read(Reader& in, const Node& node, const Spec& spec, std::string& out);
  static Node write(const std::string& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
template <>
struct Codec<Real> {
  static void read(Reader& in, const Node& node, const Spec& spec, Real& out);
  static Node write(const Real& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
/// A number of single precision, which structs of the renderer use. Its JSON form is the same as for other
/// numbers.
template <>
struct Codec<float> {
  static void read(Reader& in, const Node& node, const Spec& spec, float& out) {
    Real value = static_cast<Real>(out);
    Codec<Real>::read(in, node, spec, value);
    out = static_cast<float>(value);
  }
  static Node write(const float& value) { return Codec<Real>::write(static_cast<Real>(value)); }
  static Description describe(Catalogue& all, const Spec& spec) { return Codec<Real>::describe(all, spec); }
};
template <>
struct Codec<int> {
  static void read(Reader& in, const Node& node, const Spec& spec, int& out);
  static Node write(const int& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
template <>
struct Codec<uint32_t> {
  static void read(Reader& in, const Node& node, const Spec& spec, uint32_t& out);
  static Node write(const uint32_t& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
template <>
struct Codec<int64_t> {
  static void read(Reader& in, const Node& node, const Spec& spec, int64_t& out);
  static Node write(const int64_t& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
template <>
struct Codec<uint64_t> {
  static void read(Reader& in, const Node& node, const Spec& spec, uint64_t& out);
  static Node write(const uint64_t& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
/// [w, x, y, z], or {"axis": [x, y, z], "angle_deg": a}. The value is normalized when it is read; a zero
/// quaternion or axis is an error.
template <>
struct Codec<Quat> {
  static void read(Reader& in, const Node& node, const Spec& spec, Quat& out);
  static Node write(const Quat& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
/// "#rrggbb" or "#rrggbbaa" in sRGB, their short forms "#rgb" and "#rgba", or a list of linear components [r,
/// g, b] or [r, g, b, a].
template <>
struct Codec<Color> {
  static void read(Reader& in, const Node& node, const Spec& spec, Color& out);
  static Node write(const Color& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
/// A cube around the origin, written as half the length of its edge.
template <>
struct Codec<sim::Aabb> {
  static void read(Reader& in, const Node& node, const Spec& spec, sim::Aabb& out);
  static Node write(const sim::Aabb& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
/// A number, or a fraction such as "30000/1001".
template <>
struct Codec<render::FrameRate> {
  static void read(Reader& in, const Node& node, const Spec& spec, render::FrameRate& out);
  static Node write(const render::FrameRate& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
/// A number or "auto".
template <>
struct Codec<ModelScale> {
  static void read(Reader& in, const Node& node, const Spec& spec, ModelScale& out);
  static Node write(const ModelScale& value);
  static Description describe(Catalogue& all, const Spec& spec);
};
/// A number, {"mean", "deviation", "min", "max", "clip"}, {"range": [a, b]} or {"curve": [[time, value],
/// ...]}. All possible values must be within the limits. A limit that is itself allowed also truncates a
/// normal distribution.
template <>
struct Codec<Varying> {
  static void read(Reader& in, const Node& node, const Spec& spec, Varying& out);
  static Node write(const Varying& value);
  static Description describe(Catalogue& all, const Spec& spec);
};

template <>
struct Names<sim::Interpolation> {
  static constexpr std::array kNames = {"monotone", "smooth", "linear", "step"};
};
inline constexpr const char* kInterpolationHelp =
    "interpolation between keys: `monotone` is a smooth curve that never overshoots, and stays constant "
    "where two keys are equal; `smooth` (Catmull-Rom) is rounder and may overshoot; `linear` has a constant "
    "velocity; `step` holds each value until the next key";

Description describe_vector(Description item, int size, bool nonzero);

/// A vector as a list, such as [x, y, z]. Limits apply to each component.
template <class S, int N>
struct Codec<Eigen::Matrix<S, N, 1>> {
  using V = Eigen::Matrix<S, N, 1>;

  static void read(Reader& in, const Node& node, const Spec& spec, V& out) {
    const List* list = in.list(node, "a list of " + std::to_string(N) + " numbers", N, N);
    if (!list) return;
    V value = out;
    for (int i = 0; i < N; ++i)
      in.within(std::to_string(i),
                [&] { Codec<S>::read(in, (*list)[static_cast<std::size_t>(i)], spec, value[i]); });
    if (spec.limits.nonzero && value.isZero(0)) return in.refuse(node, "a vector that is not zero");
    out = value;
  }
  static Node write(const V& value) {
    List list;
    for (const S& component : value) list.push_back(Codec<S>::write(component));
    return list;
  }
  static Description describe(Catalogue& all, const Spec& spec) {
    return describe_vector(Codec<S>::describe(all, spec), N, spec.limits.nonzero);
  }
};

Description describe_tuple(Description item, std::size_t size);

/// A list of N values of one kind.
template <class V, std::size_t N>
struct Codec<std::array<V, N>> {
  static void read(Reader& in, const Node& node, const Spec& spec, std::array<V, N>& out) {
    const List* list = in.list(node, "a list of " + std::to_string(N) + " values", N, N);
    if (!list) return;
    for (std::size_t i = 0; i < N; ++i)
      in.within(std::to_string(i), [&] { Codec<V>::read(in, (*list)[i], spec, out[i]); });
  }
  static Node write(const std::array<V, N>& values) {
    List list;
    for (const V& value : values) list.push_back(Codec<V>::write(value));
    return list;
  }
  static Description describe(Catalogue& all, const Spec& spec) {
    return describe_tuple(Codec<V>::describe(all, spec), N);
  }
};

Description describe_age_key(const Description& age, const Description& value);

/// A key over age: [age, value] with an age in [0, 1]. Limits apply to the value.
template <class V>
struct Codec<std::pair<Real, V>> {
  static void read(Reader& in, const Node& node, const Spec& spec, std::pair<Real, V>& out) {
    const List* list = in.list(node, "a pair of age and value", 2, 2);
    if (!list) return;
    in.within("0", [&] { Codec<Real>::read(in, (*list)[0], kAge, out.first); });
    in.within("1", [&] { Codec<V>::read(in, (*list)[1], spec, out.second); });
  }
  static Node write(const std::pair<Real, V>& value) {
    return List{value.first, Codec<V>::write(value.second)};
  }
  static Description describe(Catalogue& all, const Spec& spec) {
    return describe_age_key(Codec<Real>::describe(all, kAge), Codec<V>::describe(all, spec));
  }

 private:
  static inline const Spec kAge{"", "", "", kFraction};
};

}  // namespace offstage::producer
