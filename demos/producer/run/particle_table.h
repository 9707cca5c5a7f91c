#pragma once
/// Writes a table of all particles in all frames of a film: particles of groups and emitters, and child
/// particles. Rows are written immediately, so only the disk limits the size of the table.
///
/// Columns: frame, time [s], system, id, age [s], position [m], velocity [m/s], radius as drawn [m], colour
/// and opacity as drawn. A file with the ending .bin is binary: one line of JSON with the names of the
/// systems and the columns with their types as in NumPy, then the rows as packed little-endian records, in
/// which `system` is the index of the name. Every other file is CSV.

#include <filesystem>
#include <optional>
#include <string>

#include "producer/build/simulation.h"
#include "producer/run/csv.h"
#include "render/output_file.h"

namespace offstage::producer {

class ParticleTable {
 public:
  /// Throws render::FileError, as the other functions do.
  ParticleTable(const std::filesystem::path& path, const Simulation& simulation);
  ~ParticleTable();
  ParticleTable(const ParticleTable&) = delete;
  ParticleTable& operator=(const ParticleTable&) = delete;

  /// Appends one row for each particle.
  void record(int frame, double time);
  /// Completes the file; one that is not completed keeps the ending .partial.
  void close();

 private:
  void put_row(int frame, double time, std::size_t system, const std::string& name,
               const sim::ParticleArrays& particles, const PointSet& drawn, std::size_t i);
  void flush();

  const Simulation& simulation_;
  std::filesystem::path path_;
  std::optional<CsvFile> csv_;
  CsvRows rows_;
  std::size_t row_count_ = 0;  // in rows_
  std::optional<render::OutputFile> binary_;
  std::vector<uint8_t> bytes_;
};

}  // namespace offstage::producer
