#pragma once
/// CSV tables of a simulation. Values are written with all their digits, so that they can be checked against
/// closed forms. A value that is not finite throws CsvFile::NotFinite.

#include <filesystem>
#include <string>

#include "producer/build/simulation.h"
#include "producer/run/csv.h"

namespace offstage::producer {

/// Motion of all objects: time, object, position, orientation, velocities.
class Trace {
 public:
  Trace(const std::filesystem::path& path, const Simulation& simulation);

  /// Appends one row for each moving body that exists at the time, each cloth (its centre of mass and mean
  /// velocity) and each placed particle ("group/id").
  void record(double time);
  void close() { file_.close(); }

 private:
  CsvFile file_;
  const Simulation& simulation_;
};

/// State of cloths: time, cloth, points, strain, contacts, shortened moves and the volume inside.
class ClothTrace {
 public:
  ClothTrace(const std::filesystem::path& path, const Simulation& simulation);

  /// Appends one row for each cloth.
  void record(double time);
  void close() { file_.close(); }

 private:
  CsvFile file_;
  const Simulation& simulation_;
};

/// Vertices of cloths: time, cloth, vertex, position, velocity.
class ClothPointTrace {
 public:
  ClothPointTrace(const std::filesystem::path& path, const Simulation& simulation);

  /// Appends one row for each vertex of each cloth.
  void record(double time);
  void close() { file_.close(); }

 private:
  CsvFile file_;
  const Simulation& simulation_;
};

/// State and loads of joints: time, joint, anchor on a, force and torque on a, the free coordinate and its
/// speed, distance of the anchors, 1 if it is broken.
class JointTrace {
 public:
  JointTrace(const std::filesystem::path& path, const Simulation& simulation);

  /// Appends one row for each joint.
  void record(double time);
  void close() { file_.close(); }

 private:
  CsvFile file_;
  const Simulation& simulation_;
};

/// Contact points of bodies: time, the two bodies, point, normal from b to a, force on a, separation.
class ContactTrace {
 public:
  ContactTrace(const std::filesystem::path& path, const Simulation& simulation);

  /// Appends one row for each contact point.
  void record(double time);
  void close() { file_.close(); }

 private:
  CsvFile file_;
  const Simulation& simulation_;
};

}  // namespace offstage::producer
