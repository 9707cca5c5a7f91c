#pragma once
/// Reading of keyword arguments from Python.

#include <map>
#include <set>
#include <stdexcept>
#include <string>

#include <pybind11/pybind11.h>

#include "arrays.h"

namespace offstage::python {

using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;
using IndexArray = py::array_t<uint32_t, py::array::c_style | py::array::forcecast>;

/// Returns the value of a word in a table. If the word is unknown, throws std::invalid_argument with the name
/// of the argument and the allowed words.
template <class T>
T chosen(const std::map<std::string, T>& words, const std::string& word, const char* name) {
  const auto it = words.find(word);
  if (it != words.end()) return it->second;
  std::string known;
  for (const auto& [text, value] : words) known += (known.empty() ? "'" : ", '") + text + "'";
  throw std::invalid_argument(std::string(name) + ": '" + word + "' is none of " + known);
}

/// Reads the keywords of a call one by one. finish() rejects those that were not read.
class Keywords {
 public:
  explicit Keywords(const py::kwargs& given) : given_(given) {}
  template <class T>
  void take(const char* name, T& value) {
    taken_.insert(name);
    if (!given_.contains(name)) return;
    try {
      value = given_[name].template cast<T>();
    } catch (const py::cast_error&) {
      throw std::invalid_argument(std::string(name) + ": has the wrong type; see docs/python.md");
    }
  }
  void take(const char* name, sim::Vec3& value) {
    Triple numbers{value[0], value[1], value[2]};
    take(name, numbers);
    value = vec(numbers);
  }
  void take(const char* name, sim::Quat& value) {
    Quadruple numbers{value.w(), value.x(), value.y(), value.z()};
    take(name, numbers);
    value = quat(numbers);
  }
  template <class T>
  void choose(const char* name, const std::map<std::string, T>& words, T& value) {
    std::string word;
    take(name, word);
    if (!word.empty()) value = chosen(words, word, name);
  }
  py::object take_object(const char* name) {
    taken_.insert(name);
    return given_.contains(name) ? py::object(given_[name]) : py::none();
  }
  /// Throws TypeError if there is a keyword that was not read. `function`: name for the message.
  void finish(const char* function) const {
    for (const auto& [key, value] : given_)
      if (!taken_.contains(key.cast<std::string>()))
        throw py::type_error(std::string(function) + "() has no keyword '" + key.cast<std::string>() + "'");
  }

 private:
  const py::kwargs& given_;
  std::set<std::string> taken_;
};
}  // namespace offstage::python
