#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tpm/study/random_effects.hpp"
#include "tpm/study/selection.hpp"

namespace tpm {

/// One recording's own fit of the common law.
struct SpecimenRow {
  std::string name;
  std::optional<FitResult> fit;  ///< empty if it could not be fitted
  std::string reason;            ///< then why
  /// Which of the fit's parameters stands for each of the common law's: a fit may number its
  /// branches in any order, here they are sorted by their relaxation times.
  std::vector<std::size_t> place;

  /// The result for the common law's parameter i of a recording that was fitted.
  [[nodiscard]] const ParameterResult& parameter(std::size_t i) const {
    return fit.value().parameters[place[i]];
  }
};

/// One material parameter over the specimens.
struct PooledParameter {
  FitParameter parameter;
  RandomEffects effects;  ///< in theta
  int left_out = 0;       ///< specimens that do not determine it (at a bound or of no full rank)
};

struct SpecimenStudy {
  LawSpec law;
  std::string why;  ///< how the law was chosen
  std::vector<SpecimenRow> rows;
  std::vector<PooledParameter> pooled;
};

/// Fits one law to each recording by itself and pools the material parameters with random effects:
/// a typical specimen, its interval, and the spread between specimens.
/// @param law empty: the least law that all recordings support, that is the one with the fewest
///        parameters whose sum of BIC over the recordings is within the margin (for each recording)
///        of the least sum
[[nodiscard]] SpecimenStudy study_specimens(std::span<const PreparedRecording> recordings,
                                            const std::optional<LawSpec>& law,
                                            const SelectionOptions& options);

[[nodiscard]] Json to_json(const SpecimenStudy& study);
[[nodiscard]] std::string to_terminal_text(const SpecimenStudy& study);

}  // namespace tpm
