#pragma once
/// Conversion between numpy arrays and the types of the libraries.

#include <array>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "sim/core/types.h"

namespace offstage::python {

namespace py = pybind11;

/// Three numbers from any sequence or array.
using Triple = std::array<double, 3>;
/// A quaternion [w, x, y, z] from any sequence or array.
using Quadruple = std::array<double, 4>;

inline sim::Vec3 vec(const Triple& v) {
  return {v[0], v[1], v[2]};
}
inline sim::Quat quat(const Quadruple& q) {
  const sim::Quat out(q[0], q[1], q[2], q[3]);
  if (!(out.norm() > 1e-9)) throw std::invalid_argument("orientation: must not be zero; it is [w, x, y, z]");
  return out.normalized();
}
inline py::array_t<double> array(const sim::Vec3& v) {
  return py::array_t<double>(3, v.data());
}
inline py::array_t<double> array(const sim::Quat& q) {
  const double wxyz[] = {q.w(), q.x(), q.y(), q.z()};
  return py::array_t<double>(4, wxyz);
}

/// Returns a new (n, 3) array with one vector in each row.
template <class Scalar, class List>
py::array_t<Scalar> rows(const List& vectors) {
  py::array_t<Scalar> out({static_cast<py::ssize_t>(vectors.size()), py::ssize_t{3}});
  auto view = out.template mutable_unchecked<2>();
  for (std::size_t i = 0; i < vectors.size(); ++i)
    for (int k = 0; k < 3; ++k) view(static_cast<py::ssize_t>(i), k) = vectors[i][k];
  return out;
}

/// Returns a new array with a copy of the numbers.
template <class T>
py::array_t<T> numbers(std::span<const T> values) {
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

/// Converts an (n, 3) array from Python to vectors. Throws an exception that contains `name` if the shape is
/// different.
inline std::vector<sim::Vec3> vectors(const py::array_t<double, py::array::c_style | py::array::forcecast>& a,
                                      const char* name) {
  if (a.ndim() != 2 || a.shape(1) != 3)
    throw std::invalid_argument(std::string(name) + ": must have the shape (n, 3)");
  std::vector<sim::Vec3> out(static_cast<std::size_t>(a.shape(0)));
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = Eigen::Map<const sim::Vec3>(a.data() + 3 * i);
  return out;
}

/// Returns a read-only array that refers to `data` without a copy. `owner` keeps the memory alive.
template <class T>
py::array view(std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides, const T* data,
               py::handle owner) {
  py::array_t<T> out(std::move(shape), std::move(strides), data, owner);
  out.attr("setflags")(py::arg("write") = false);
  return out;
}

/// Returns an array that takes ownership of a vector, without a copy.
template <class T, class Element>
py::array_t<T> taken(std::vector<Element>&& values, std::vector<py::ssize_t> shape) {
  auto* kept = new std::vector<Element>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<Element>*>(p); });
  return py::array_t<T>(std::move(shape), reinterpret_cast<const T*>(kept->data()), owner);
}

}  // namespace offstage::python
