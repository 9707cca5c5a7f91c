#include "producer/base/suggest.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace offstage::producer {

namespace {

constexpr std::size_t kMostComparisons = 100'000;
thread_local std::size_t comparisons_left = SIZE_MAX;

/// Returns the only candidate of which `word` is the first or last part, as "tube" of "tube_radius"; empty if
/// there is none, or more than one.
std::string only_extension(std::string_view word, std::span<const std::string> candidates) {
  const std::string first = std::string(word) + '_', last = '_' + std::string(word);
  const auto extends = [&](const std::string& name) {
    return name.starts_with(first) || name.ends_with(last);
  };
  const auto found = std::ranges::find_if(candidates, extends);
  if (found == candidates.end() || std::any_of(found + 1, candidates.end(), extends)) return {};
  return *found;
}

}  // namespace

SuggestionBudget::SuggestionBudget() : before_(std::exchange(comparisons_left, kMostComparisons)) {}
SuggestionBudget::~SuggestionBudget() {
  comparisons_left = before_;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  // Optimal string alignment: each row of the table follows from the two rows before it.
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before.swap(last);
    last.swap(row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

std::string nearest(std::string_view word, std::span<const std::string> candidates) {
  constexpr std::size_t kLongestWord = 100;
  if (word.size() > kLongestWord) return {};
  std::size_t best = std::max<std::size_t>(1, word.size() / 3) + 1;
  std::string found;
  for (const std::string& candidate : candidates) {
    if (comparisons_left == 0) return {};
    --comparisons_left;
    if (candidate.size() > word.size() + best || word.size() > candidate.size() + best) continue;
    const std::size_t distance = edit_distance(word, candidate);
    if (distance >= best) continue;
    best = distance;
    found = candidate;
  }
  return found;
}

std::string suggestion(std::string_view word, std::span<const std::string> candidates,
                       std::string_view if_none) {
  if (candidates.empty()) return std::string(if_none);
  std::string near = nearest(word, candidates);
  if (near.empty()) near = only_extension(word, candidates);
  if (!near.empty()) return "; did you mean '" + near + "'?";
  constexpr std::size_t kMost = 50;
  std::string text = "; known: ";
  for (std::size_t i = 0; i < std::min(candidates.size(), kMost); ++i)
    text += (i > 0 ? ", '" : "'") + candidates[i] + "'";
  return candidates.size() > kMost ? text + " ..." : text;
}

}  // namespace offstage::producer
