#pragma once
/// CSV tables of a simulation. Values are written with all their digits, so that they can be checked against
/// closed forms. The constructors and record() throw render::FileError. record() throws CsvFile::NotFinite
/// for a value that is not finite.

#include <filesystem>
#include <string>

#include "producer/build/simulation.h"
#include "producer/run/csv.h"

namespace offstage::producer {

/// Table of the motion of all objects. Columns: time, object, position, orientation, velocities.
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

/// Table of the state of cloths. Columns: time, cloth, number of points, strain, contacts, shortened moves,
/// and enclosed volume.
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

/// Table of the vertices of cloths. Columns: time, cloth, vertex, position, velocity.
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

/// Table of the state and loads of joints. Columns: time, joint, anchor on body a, force and torque on body
/// a, the free coordinate and its speed, distance between the anchors, and 1 for a broken joint.
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

/// Table of the contact points of bodies. Columns: time, bodies a and b, point, normal from b to a, force on
/// a, separation.
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
