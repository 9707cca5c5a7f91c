#pragma once
/// Data of a parameter sweep: the varied values of the scene, and the table of results.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace offstage::producer {

struct RunStats;

/// A key of the scene that is varied, with the values that it takes.
struct Variation {
  std::string path;                 ///< path of an override, such as emitters.0.rate
  std::vector<std::string> values;  ///< values as JSON or plain text
};

/// Parses a variation. "path=a:b:step" means the values a, a + step and so on, up to b at most. "path=x,y,z"
/// is a list of values; commas inside brackets and quotes belong to a value. For any other text, throws
/// std::invalid_argument with the allowed forms.
Variation parse_variation(const std::string& text);

inline constexpr std::size_t kMostCombinations = 256;

/// Returns all combinations of the values. Each has one value per variation; the last variation changes
/// fastest. Throws std::invalid_argument for a path given twice and for more than kMostCombinations
/// combinations.
std::vector<std::vector<std::string>> combinations(const std::vector<Variation>& variations);

/// Names and values of results, in the order of the columns of a table.
using Figures = std::vector<std::pair<std::string, std::string>>;

/// Returns the results of a run: its stats without durations and memory, which differ from run to run. The
/// names of nested values are joined by dots.
Figures figures_of(const RunStats& stats);

/// Returns a CSV table with one row for each run. It has the columns of all runs; a missing value is empty.
std::string to_csv(const std::vector<Figures>& rows);

}  // namespace offstage::producer
