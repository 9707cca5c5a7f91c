#pragma once
/// Tables as comma-separated values (RFC 4180): texts are quoted if necessary, numbers have all their digits.

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "render/output_file.h"
#include "sim/core/types.h"

namespace offstage::producer {

/// Returns a text as a field: quoted, with its own quotes doubled, if it contains a comma, a quote or a line
/// break.
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

/// A table that grows row by row. It gets its name on close(); a table that is not closed keeps the ending
/// .partial.
class CsvFile {
 public:
  /// Throws render::FileError, as the other functions do.
  CsvFile(const std::filesystem::path& path, const std::string& header);
  ~CsvFile();
  CsvFile(const CsvFile&) = delete;
  CsvFile& operator=(const CsvFile&) = delete;

  /// Throws NotFinite and writes nothing if a number of the rows is not finite.
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
