#pragma once
/// Private: SIMD vectors of eight numbers (vector extensions of GCC and Clang), and functions that give the
/// same results for one number and for eight.

#include <cmath>
#include <cstdint>

namespace offstage::render {

inline constexpr int kLanes = 8;
typedef float Lanes __attribute__((vector_size(4 * kLanes)));
typedef int32_t IntLanes __attribute__((vector_size(4 * kLanes)));
typedef uint32_t UintLanes __attribute__((vector_size(4 * kLanes)));

inline Lanes square_root(Lanes x) {
  return __builtin_ia32_sqrtps256(x);
}
inline float square_root(float x) {
  return std::sqrt(x);
}
template <class T>
T larger(T a, T b) {
  return a > b ? a : b;
}
template <class T>
T smaller(T a, T b) {
  return a < b ? a : b;
}
template <class T>
T absolute(T x) {
  return x < 0.0f ? -x : x;
}
template <class T>
T clamped_to(T x, float low, float high) {
  return smaller(larger(x, T{} + low), T{} + high);
}
inline bool any(IntLanes mask) {
  int32_t all = 0;
  for (int i = 0; i < kLanes; ++i) all |= mask[i];
  return all != 0;
}

/// A point or direction, or eight of them.
template <class T>
struct Three {
  T x, y, z;
};
using LaneVectors = Three<Lanes>;

template <class T>
Three<T> operator+(const Three<T>& a, const Three<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
Three<T> operator-(const Three<T>& a, const Three<T>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T, class S>
Three<T> operator*(const Three<T>& a, S s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class T>
T dot(const Three<T>& a, const Three<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
Three<T> normalized(const Three<T>& a) {
  return a * (1.0f / square_root(dot(a, a)));
}

}  // namespace offstage::render
