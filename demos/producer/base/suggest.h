#pragma once
/// "Did you mean": suggestions for misspelt words.

#include <span>
#include <string>
#include <string_view>

namespace offstage::producer {

/// During its lifetime, this thread compares a limited number of words, so that the time to refuse a text
/// with very many errors is proportional to its length. After that no suggestions are made.
class SuggestionBudget {
 public:
  SuggestionBudget();
  ~SuggestionBudget();
  SuggestionBudget(const SuggestionBudget&) = delete;
  SuggestionBudget& operator=(const SuggestionBudget&) = delete;

 private:
  std::size_t before_;
};

/// Smallest number of insertions, deletions, replacements and swaps of neighbours that change one word to the
/// other.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// Returns the candidate nearest to `word` (the first of equals) if it is similar enough for a typing error,
/// else an empty text.
std::string nearest(std::string_view word, std::span<const std::string> candidates);

/// Returns "; did you mean 'x'?" if there is a similar candidate, else "; known: 'a', 'b'", or `if_none`
/// without candidates.
std::string suggestion(std::string_view word, std::span<const std::string> candidates,
                       std::string_view if_none = "");

}  // namespace offstage::producer
