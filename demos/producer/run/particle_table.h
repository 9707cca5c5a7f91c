#pragma once
/// Writes a table of all particles in all frames of a film: particles of groups and emitters, and child
/// particles. Rows are written immediately, so only the disk limits the size of the table.
///
/// Columns: frame, time [s], system, id, age [s], position [m], velocity [m/s], radius as drawn [m], colour
/// and opacity as drawn. A file with the ending .bin is binary. It begins with one line of JSON, which has
/// the names of the systems and, as in NumPy, the columns with their types. The rows follow as packed
/// little-endian records, in which `system` is an index into the names. Every other file is CSV.

#include <filesystem>
#include <optional>
#include <string>

#include "producer/build/simulation.h"
#include "producer/run/csv.h"
#include "render/output_file.h"

namespace offstage::producer {

class ParticleTable {
 public:
  /// Begins the file. Throws render::FileError; so do record() and close().
  ParticleTable(const std::filesystem::path& path, const Simulation& simulation);
  ~ParticleTable();
  ParticleTable(const ParticleTable&) = delete;
  ParticleTable& operator=(const ParticleTable&) = delete;

  /// Appends one row for each particle. `time`: time of the frame [s].
  void record(int frame, double time);
  /// Completes the file. A file that is not completed keeps the additional ending .partial.
  void close();

 private:
  void put_row(int frame, double time, std::size_t system, const std::string& name,
               const sim::ParticleArrays& particles, const PointSet& drawn, std::size_t i);
  void flush();

  const Simulation& simulation_;
  std::filesystem::path path_;
  std::optional<CsvFile> csv_;
  CsvRows rows_;
  std::size_t row_count_ = 0;  // number of rows in rows_
  std::optional<render::OutputFile> binary_;
  std::vector<uint8_t> bytes_;
};

}  // namespace offstage::producer
