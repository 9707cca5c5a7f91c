#include "producer/run/sweep.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/run/csv.h"
#include "producer/run/production.h"

namespace offstage::producer {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void refuse_sweep(const std::string& text, const std::string& what) {
  throw std::invalid_argument("--vary " + text + ": " + what);
}

/// Splits a text at those separators that are not inside brackets or quotes.
std::vector<std::string> split_outside(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  int depth = 0;
  bool quoted = false, escaped = false;
  for (const char c : text) {
    if (!quoted && depth == 0 && c == separator) {
      parts.emplace_back();
      continue;
    }
    parts.back() += c;
    if (c == '"' && !escaped) quoted = !quoted;
    escaped = quoted && c == '\\' && !escaped;
    if (!quoted && (c == '[' || c == '{')) ++depth;
    if (!quoted && (c == ']' || c == '}')) --depth;
  }
  return parts;
}

std::optional<double> to_number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

/// Returns the values of "a:b:step"; nothing if `values` contains no colon. Throws for an invalid range.
std::optional<std::vector<std::string>> range(const std::string& text, const std::string& values) {
  const std::vector<std::string> parts = split_outside(values, ':');
  if (parts.size() < 2) return {};
  std::array<double, 3> numbers{};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::optional<double> number = i < numbers.size() ? to_number(parts[i]) : std::nullopt;
    if (!number || parts.size() != numbers.size())
      refuse_sweep(text, "a range is a:b:step with three numbers, such as 100:400:50");
    numbers[i] = *number;
  }
  const auto [first, last, step] = numbers;
  if (step == 0 || (last - first) * step < 0)
    refuse_sweep(text, "the step is 0 or has the wrong sign, so it never reaches the last value");
  constexpr double kSlack = 1e-9;  // tolerance as a fraction of a step, so that 0:1:0.1 has 11 values
  const double steps = std::floor((last - first) / step + kSlack);
  if (!(steps < static_cast<double>(kMostCombinations)))
    refuse_sweep(text, fmt::format("has {:.0f} values; the limit is {} runs", steps + 1, kMostCombinations));
  std::vector<std::string> all;
  constexpr double kZero = 1e-12;  // tolerance as a fraction of a step, so that -1:1:0.1 contains exactly 0
  for (int i = 0; i <= static_cast<int>(steps); ++i) {
    const double value = first + i * step;
    all.push_back(fmt::format("{:.12g}", std::abs(value) < kZero * std::abs(step) ? 0.0 : value));
  }
  return all;
}

void flatten(const Json& json, const std::string& name, Figures& figures) {
  if (json.is_object()) {
    for (const auto& [key, value] : json.items())
      flatten(value, name.empty() ? key : name + "." + key, figures);
    return;
  }
  std::string text;
  if (json.is_array()) {
    for (const Json& item : json)
      text += (text.empty() ? "" : " ") + (item.is_string() ? item.get<std::string>() : item.dump());
  } else {
    text = json.is_string() ? json.get<std::string>() : json.dump();
  }
  figures.emplace_back(name, std::move(text));
}

}  // namespace

Variation parse_variation(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos)
    refuse_sweep(text, "must be path=a:b:step or path=x,y,z, such as emitters.0.rate=100:400:50");
  const std::string values = text.substr(equals + 1);
  Variation variation{text.substr(0, equals), {}};
  if (const auto numbers = range(text, values))
    variation.values = *numbers;
  else
    variation.values = split_outside(values, ',');
  if (std::ranges::find(variation.values, "") != variation.values.end())
    refuse_sweep(text, "has an empty value");
  return variation;
}

std::vector<std::vector<std::string>> combinations(const std::vector<Variation>& variations) {
  std::vector<std::vector<std::string>> all(1);
  for (std::size_t i = 0; i < variations.size(); ++i) {
    const auto same = [&](const Variation& other) { return other.path == variations[i].path; };
    if (std::count_if(variations.begin(), variations.end(), same) > 1)
      throw std::invalid_argument("--vary: " + variations[i].path + " is given twice");
    std::vector<std::vector<std::string>> longer;
    for (const auto& chosen : all)
      for (const std::string& value : variations[i].values) {
        longer.push_back(chosen);
        longer.back().push_back(value);
      }
    all = std::move(longer);
    if (all.size() > kMostCombinations)
      throw std::invalid_argument(fmt::format("--vary: {} combinations or more; the limit is {} runs",
                                              all.size(), kMostCombinations));
  }
  return all;
}

Figures figures_of(const RunStats& stats) {
  Json json = Json::parse(to_json(stats));
  for (const char* key : {"frames", "frames_kept", "wall_s", "startup_s", "sim_ms", "render_ms", "encode_ms",
                          "peak_rss_mb", "blank_frames", "interrupted_by"})
    json.erase(key);
  Figures figures;
  flatten(json, "", figures);
  return figures;
}

std::string to_csv(const std::vector<Figures>& rows) {
  std::vector<std::string> columns;
  for (const Figures& row : rows)
    for (const auto& [name, value] : row)
      if (std::ranges::find(columns, name) == columns.end()) columns.push_back(name);
  std::string csv;
  for (std::size_t i = 0; i < columns.size(); ++i) csv += (i > 0 ? "," : "") + csv_field(columns[i]);
  csv += '\n';
  for (const Figures& row : rows) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const auto figure = std::ranges::find(row, columns[i], &Figures::value_type::first);
      csv += (i > 0 ? "," : "") + (figure == row.end() ? "" : csv_field(figure->second));
    }
    csv += '\n';
  }
  return csv;
}

}  // namespace offstage::producer
