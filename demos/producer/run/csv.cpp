#include "producer/run/csv.h"

#include <cmath>
#include <exception>
#include <iterator>

#include <fmt/format.h>

#include "render/error.h"

namespace offstage::producer {
namespace {

constexpr std::size_t kBufferBytes = 1 << 16;

std::span<const uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

}  // namespace

std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
  return field + '"';
}

void CsvRows::separate() {
  if (!std::exchange(first_, false)) rows_ += ',';
}

CsvRows& CsvRows::text(std::string_view value) {
  separate();
  rows_ += csv_field(value);
  return *this;
}

CsvRows& CsvRows::number(double value) {
  separate();
  finite_ &= std::isfinite(value);
  fmt::format_to(std::back_inserter(rows_), "{}", value);
  return *this;
}

CsvRows& CsvRows::count(uint64_t value) {
  separate();
  fmt::format_to(std::back_inserter(rows_), "{}", value);
  return *this;
}

CsvFile::CsvFile(const std::filesystem::path& path, const std::string& header) : path_(path) {
  render::remove_leftovers(path.parent_path());
  file_.emplace(path);
  buffer_ = header + "\n";
}

CsvFile::~CsvFile() {
  if (!file_) return;
  try {  // keeps the rows collected so far; if the disk or the memory is full, they are lost
    flush();
    file_->commit_as(path_.string() + ".partial");
  } catch (const std::exception&) {
  }
}

void CsvFile::write(const CsvRows& rows) {
  if (!rows.finite()) throw NotFinite(path_.string() + ": a number to be written is not finite");
  buffer_ += rows.rows();
  if (buffer_.size() >= kBufferBytes) flush();
}

void CsvFile::flush() {
  file_->write(bytes_of(std::exchange(buffer_, {})));
}

void CsvFile::close() {
  flush();
  file_->commit();
  file_.reset();
}

}  // namespace offstage::producer
