#pragma once
/// "Did you mean": suggestions for misspelt words.

#include <span>
#include <string>
#include <string_view>

namespace offstage::producer {

/// Limits the number of words that this thread compares during the object's lifetime. Beyond the limit no
/// suggestions are made. A text with very many errors is thus refused in a time proportional to its length.
class SuggestionBudget {
 public:
  SuggestionBudget();
  ~SuggestionBudget();
  SuggestionBudget(const SuggestionBudget&) = delete;
  SuggestionBudget& operator=(const SuggestionBudget&) = delete;

 private:
  std::size_t before_;
};

/// Returns the least number of edits that change one word to the other: insertions, deletions, replacements
/// and swaps of neighbouring characters.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// Returns the candidate nearest to `word`, if it is similar enough for a typing error; otherwise an empty
/// text. Of equally near candidates, the first one is returned.
std::string nearest(std::string_view word, std::span<const std::string> candidates);

/// Returns "; did you mean 'x'?" if there is a similar candidate, else "; known: 'a', 'b'", or `if_none`
/// without candidates.
std::string suggestion(std::string_view word, std::span<const std::string> candidates,
                       std::string_view if_none = "");

}  // namespace offstage::producer
