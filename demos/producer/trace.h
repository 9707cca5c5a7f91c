#pragma once
/// CSV of where everything went: time, object, position, orientation, velocities. Values are written with all
/// their digits, so that a trace can be checked against closed forms.

#include <cstdio>
#include <filesystem>
#include <string>

#include "producer/simulation.h"

namespace offstage::producer {

class Trace {
 public:
  /// Throws render::FileError. The file appears under its name on close(); a trace that ends before that is
  /// kept with .partial behind its name.
  Trace(const std::filesystem::path& path, const Simulation& simulation);
  ~Trace();
  Trace(const Trace&) = delete;
  Trace& operator=(const Trace&) = delete;

  /// One row per moving body and per placed particle ("group/id").
  void record(double time);
  void close();

 private:
  void write(const std::string& text);
  void fail();

  std::filesystem::path path_, temporary_;
  const Simulation& simulation_;
  std::FILE* file_ = nullptr;
};

}  // namespace offstage::producer
