#pragma once
/// "Did you mean": the nearest of the words that would have been right.

#include <span>
#include <string>
#include <string_view>

namespace offstage::producer {

/// While one lives, this thread compares a limited number of words, so that a text with very many faults is
/// refused in a time that grows with its length; then nothing is suggested any more.
class SuggestionBudget {
 public:
  SuggestionBudget();
  ~SuggestionBudget();
  SuggestionBudget(const SuggestionBudget&) = delete;
  SuggestionBudget& operator=(const SuggestionBudget&) = delete;

 private:
  std::size_t before_;
};

/// Fewest insertions, deletions, replacements and swaps of neighbours that turn one word into the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The candidate nearest to `word` (the first of equals) if it is near enough to be a slip, else empty.
std::string nearest(std::string_view word, std::span<const std::string> candidates);

/// "; did you mean 'x'?" if there is a near candidate, else "; known: 'a', 'b'", or `if_none` without any
/// candidate.
std::string suggestion(std::string_view word, std::span<const std::string> candidates,
                       std::string_view if_none = "");

}  // namespace offstage::producer
