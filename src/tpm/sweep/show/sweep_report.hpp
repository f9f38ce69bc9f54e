#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/show/figure.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpm/sweep/sweep_sensitivity.hpp"
#include "tpmkit/units.hpp"

namespace tpm::sweep {

/// The unit in which people read numbers of an SI unit; empty for plain numbers.
[[nodiscard]] Unit shown_unit_of(const std::string& si_unit);
/// "peak force": the name of a quantity or a parameter as figures print it.
[[nodiscard]] std::string printed(std::string name);
/// "depth [mm]"
[[nodiscard]] std::string named_in_unit(const std::string& name, const Unit& unit);

/// "4 mm" of a value in SI units
[[nodiscard]] std::string value_words(double value, const Unit& unit, int digits);

/// " at depth = 2 mm, rate = 4 mm/s"; empty if there is no other axis.
[[nodiscard]] std::string fixed_words(const std::vector<FixedValue>& fixed, int digits);
[[nodiscard]] Json fixed_json(const std::vector<FixedValue>& fixed);

/// Contents of a file of results: axes, variables with their ranges, cells and reasons.
[[nodiscard]] std::string sweep_text(const SweepReader& sweep);
[[nodiscard]] Json sweep_json(const SweepReader& sweep);

/// First-order and total indices with their intervals, one table for each number.
[[nodiscard]] std::string sensitivity_text(const std::vector<SweepSensitivity>& all);
/// A row for each number: its spread, and the parameters that make it, by falling total index.
[[nodiscard]] ShortAnswer short_answer(const std::vector<SweepSensitivity>& all,
                                       const std::string& title);
[[nodiscard]] Json sensitivity_json(const std::vector<SweepSensitivity>& all);

/// For each number its first-order and total indices, by parameter, with their intervals.
[[nodiscard]] std::vector<Figure> sensitivity_figures(const std::vector<SweepSensitivity>& all,
                                                      const std::string& title);

/// Figures of a sweep.
struct SweepFigures {
  std::vector<std::string> variables;  ///< empty: all that are no counts
  std::optional<std::string> x, y;     ///< axes; none: the last and the one before
  FixedPlaces fixed;                   ///< places on the other axes
  /// Two numbers that are both better when smaller, such as misfit and cost.
  std::optional<std::pair<std::string, std::string>> pareto;
};

/// Maps of colours of numbers over two axes with families of lines beside them, lines over one,
/// points over samples, curves in time, and a Pareto front. Throws Error(bad_input).
[[nodiscard]] std::vector<Figure> sweep_figures(const SweepReader& sweep,
                                                const SweepFigures& wished);

/// Of pairs that are better when smaller, those that no other betters in both, by rising first.
[[nodiscard]] std::vector<std::pair<double, double>> pareto_front(
    std::vector<std::pair<double, double>> pairs);

}  // namespace tpm::sweep
