#pragma once
/// Tables as comma-separated values (RFC 4180): texts are quoted where they need it, numbers keep all their
/// digits.

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "render/output_file.h"
#include "sim/core/types.h"

namespace offstage::producer {

/// A text as a field: in quotes, with its own quotes doubled, if it holds a comma, a quote or a line break.
std::string csv_field(std::string_view text);

/// Rows in the making.
class CsvRows {
 public:
  CsvRows& text(std::string_view value);
  /// Remembers the first number that is not finite.
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

/// A table that grows row by row. It appears under its name on close(); one that ends before that is kept
/// with .partial behind its name.
class CsvFile {
 public:
  /// Throws render::FileError, as do the others.
  CsvFile(const std::filesystem::path& path, const std::string& header);
  ~CsvFile();
  CsvFile(const CsvFile&) = delete;
  CsvFile& operator=(const CsvFile&) = delete;

  /// Throws NotFinite for rows with a number that is not finite; then nothing is written.
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
