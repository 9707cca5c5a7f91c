#pragma once
/// Tables as comma-separated values (RFC 4180). Texts are quoted if necessary. Numbers are written with all
/// digits that are needed to read the same value again.

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "render/output_file.h"
#include "sim/core/types.h"

namespace offstage::producer {

/// Returns a text as a field of a table. A text that contains a comma, a quote or a line break is put in
/// quotes, and its own quotes are doubled.
std::string csv_field(std::string_view text);

/// Builds rows of a table.
class CsvRows {
 public:
  CsvRows& text(std::string_view value);
  /// Appends a number. After a number that is not finite, finite() returns false.
  CsvRows& number(double value);
  CsvRows& vector(const sim::Vec3& v) { return number(v.x()).number(v.y()).number(v.z()); }
  CsvRows& count(uint64_t value);
  void end_row() {
    rows_ += '\n';
    first_ = true;
  }

  const std::string& rows() const { return rows_; }
  bool finite() const { return finite_; }

 private:
  void separate();

  std::string rows_;
  bool first_ = true, finite_ = true;
};

/// A table in a file, which grows row by row. Until close() the file's name has the additional ending
/// .partial. A table that is never closed keeps this ending.
class CsvFile {
 public:
  /// Begins the file with a header line. Throws render::FileError; so do write() and close().
  CsvFile(const std::filesystem::path& path, const std::string& header);
  ~CsvFile();
  CsvFile(const CsvFile&) = delete;
  CsvFile& operator=(const CsvFile&) = delete;

  /// Appends rows. If one of their numbers is not finite, throws NotFinite and writes nothing.
  void write(const CsvRows& rows);
  void close();

  struct NotFinite : std::runtime_error {
    using std::runtime_error::runtime_error;
  };

 private:
  void flush();

  std::filesystem::path path_;
  std::optional<render::OutputFile> file_;
  std::string buffer_;
};

}  // namespace offstage::producer
