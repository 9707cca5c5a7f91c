#pragma once
/// The bookkeeping of a sweep: which values a scene is run with, and the table of what the runs came to.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace offstage::producer {

struct RunStats;

/// A value of the scene that varies, and what it is set to in turn.
struct Variation {
  std::string path;                 ///< as of an override, such as emitters.0.rate
  std::vector<std::string> values;  ///< JSON or plain text
};

/// Reads "path=a:b:step" (from a to b, both included if the step meets b) or "path=x,y,z"; commas inside
/// brackets and quotes belong to a value. Throws std::invalid_argument, saying what is allowed.
Variation parse_variation(const std::string& text);

inline constexpr std::size_t kMostCombinations = 256;

/// Every choice of one value each, the last varying fastest. Throws std::invalid_argument for a path given
/// twice and for more than kMostCombinations.
std::vector<std::vector<std::string>> combinations(const std::vector<Variation>& variations);

/// Names with values, in the order of the columns.
using Figures = std::vector<std::pair<std::string, std::string>>;

/// What a run came to: its stats but those of time and memory, which differ from run to run. Nested names are
/// joined with dots.
Figures figures_of(const RunStats& stats);

/// One row per run, with the columns of all of them; a figure that a run lacks is empty.
std::string to_csv(const std::vector<Figures>& rows);

}  // namespace offstage::producer
