#pragma once
/// Figures: the numbers of a statistics report. A struct lists its figures once, each with a name and the
/// rule by which several steps are combined. Addition and output are generated from this list:
///
///   struct Work {
///     uint64_t solves = 0;  ///< number of problems
///     Real residual = 0;    ///< greatest [m/s]
///     static constexpr auto figures() {
///       return std::tuple(Figure("solves", &Work::solves),
///                         Figure("residual", &Work::residual, OverSteps::greatest));
///     }
///   };
///
/// A figure may be such a struct itself. If its name is empty, its figures are listed directly among the
/// figures of the outer struct.

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

namespace offstage::sim {

/// The rule by which a figure of several steps follows from the figures of the single steps.
enum class OverSteps : uint8_t { sum, greatest, last };

template <class Part, class Value>
struct Figure {
  constexpr Figure(std::string_view its_name, Value Part::*its_member, OverSteps its_rule = OverSteps::sum)
      : name(its_name), member(its_member), rule(its_rule) {}
  std::string_view name;
  Value Part::*member;
  OverSteps rule;
};

template <class T>
concept HasFigures = requires {
  T::figures();
};

/// Calls visit(name, value) for each figure of a part, in the order of its list.
template <HasFigures Part, class Visit>
void for_each_figure(const Part& part, Visit&& visit) {
  std::apply([&](const auto&... figure) { (visit(figure.name, part.*figure.member), ...); }, Part::figures());
}

/// Whether the list of a struct has all of its members, judged by the sum of their sizes. Padding is less
/// than the alignment.
template <HasFigures Part>
constexpr bool lists_all_members() {
  constexpr std::size_t kListed = std::apply(
      [](const auto&... figure) { return (sizeof(std::declval<Part&>().*figure.member) + ... + 0); },
      Part::figures());
  return sizeof(Part) - kListed < alignof(Part);
}

/// Adds the figures of a later step, or of another part of the same step, to `sum`.
template <HasFigures Part>
void add_figures(Part& sum, const Part& more) {
  static_assert(lists_all_members<Part>(), "a member is missing in the list of figures");
  const auto add = [&](const auto& figure) {
    auto& total = sum.*figure.member;
    const auto& value = more.*figure.member;
    if constexpr (HasFigures<std::remove_cvref_t<decltype(value)>>)
      add_figures(total, value);
    else if (figure.rule == OverSteps::sum)
      total += value;
    else
      total = figure.rule == OverSteps::greatest ? std::max(total, value) : value;
  };
  std::apply([&](const auto&... figure) { (add(figure), ...); }, Part::figures());
}

}  // namespace offstage::sim
