#pragma once
/// Private: maps samples to points of a disc and to directions, for one sample or eight at a time.

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Core>

#include "render/lanes.h"
#include "render/trace/sampler.h"

namespace offstage::render {

/// Maps the unit square to the unit disc with equal areas (Shirley and Chiu, 1997). Sine and cosine of angles
/// up to pi / 4 are short series, with an error below 4e-6.
template <class T>
SquarePoint<T> on_disc(const SquarePoint<T>& uv) {
  const T x = 2.0f * uv.x - 1.0f, y = 2.0f * uv.y - 1.0f;
  const auto wide = absolute(x) > absolute(y);
  const T radius = wide ? x : y, other = wide ? y : x;
  const T angle = 0.25f * std::numbers::pi_v<float> * (other / (radius == 0.0f ? T{} + 1.0f : radius));
  const T a2 = angle * angle;
  const T sine = radius * (angle * (1.0f - a2 / 6.0f * (1.0f - a2 / 20.0f * (1.0f - a2 / 42.0f))));
  const T cosine = radius * (1.0f - a2 / 2.0f * (1.0f - a2 / 12.0f * (1.0f - a2 / 30.0f)));
  return {wide ? cosine : sine, wide ? sine : cosine};
}

/// Computes two unit directions that are perpendicular to the unit vector n and to each other (T. Duff et
/// al., "Building an Orthonormal Basis, Revisited", 2017).
template <class T>
void make_basis(const Three<T>& n, Three<T>& a, Three<T>& b) {
  const T sign = n.z < 0.0f ? T{} - 1.0f : T{} + 1.0f;
  const T s = -1.0f / (sign + n.z), t = n.x * n.y * s;
  a = {1.0f + sign * n.x * n.x * s, sign * t, -sign * n.x};
  b = {t, sign + n.y * n.y * s, -n.y};
}

inline Eigen::Vector3f to_eigen(const Three<float>& v) {
  return {v.x, v.y, v.z};
}
inline Three<float> from_eigen(const Eigen::Vector3f& v) {
  return {v.x(), v.y(), v.z()};
}
inline LaneVectors all_lanes(const Eigen::Vector3f& v) {
  return {Lanes{} + v.x(), Lanes{} + v.y(), Lanes{} + v.z()};
}

/// Returns a unit direction in the hemisphere around the unit vector n. Its density is in proportion to the
/// cosine of its angle to n.
template <class T>
Three<T> cosine_direction(const Three<T>& n, const SquarePoint<T>& uv) {
  const SquarePoint<T> d = on_disc(uv);
  Three<T> a, b;
  make_basis(n, a, b);
  const T up = square_root(larger(1.0f - d.x * d.x - d.y * d.y, T{}));
  return normalized(a * d.x + b * d.y + n * up);
}

/// Returns point k of `count` evenly distributed points of the unit square: a Fibonacci lattice that is moved
/// so that it contains `first`.
inline SquarePoint<float> lattice_point(const SquarePoint<float>& first, int k, int count) {
  const auto wrapped = [](float x) { return x - std::floor(x); };
  const auto number = static_cast<float>(k);
  return {wrapped(first.x + number / static_cast<float>(count)), wrapped(first.y + 0.618034f * number)};
}

/// Returns a unit direction that is uniformly distributed over the sphere.
inline Eigen::Vector3f even_direction(const SquarePoint<float>& uv) {
  const float y = 1 - 2 * uv.x, across = std::sqrt(std::max(1 - y * y, 0.0f));
  const float turn = 2 * std::numbers::pi_v<float> * uv.y;
  return {across * std::cos(turn), y, across * std::sin(turn)};
}

/// Returns a sample of the GGX microfacet normals that are visible from the direction `view`, for a surface
/// with the normal n. a: roughness^2. From J. Dupuy and A. Benyoub, "Sampling Visible GGX Normals with
/// Spherical Caps" (2023).
Eigen::Vector3f visible_facet(const Eigen::Vector3f& n, const Eigen::Vector3f& view, float a,
                              const SquarePoint<float>& uv);

/// Returns the direction of a ray after its reflection at a surface with the unit normal n.
inline Eigen::Vector3f reflected(const Eigen::Vector3f& direction, const Eigen::Vector3f& n) {
  return direction - 2 * direction.dot(n) * n;
}

}  // namespace offstage::render
