#pragma once
/// Data of a parameter sweep: the varied values of the scene, and the table of results.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace offstage::producer {

struct RunStats;

/// A varied value of the scene, with its values.
struct Variation {
  std::string path;                 ///< path of an override, such as emitters.0.rate
  std::vector<std::string> values;  ///< JSON or plain text
};

/// Parses "path=a:b:step" (from a to b, both included if a step ends at b) or "path=x,y,z"; commas inside
/// brackets and quotes belong to a value. Throws std::invalid_argument with the allowed forms.
Variation parse_variation(const std::string& text);

inline constexpr std::size_t kMostCombinations = 256;

/// Returns all combinations, the last variation changing fastest. Throws std::invalid_argument for a path
/// given twice and for more than kMostCombinations.
std::vector<std::vector<std::string>> combinations(const std::vector<Variation>& variations);

/// Names with values, in the order of the columns.
using Figures = std::vector<std::pair<std::string, std::string>>;

/// Results of a run: its stats without time and memory, which differ from run to run. Nested names are joined
/// with dots.
Figures figures_of(const RunStats& stats);

/// One row per run, with the columns of all runs; a missing value is empty.
std::string to_csv(const std::vector<Figures>& rows);

}  // namespace offstage::producer
