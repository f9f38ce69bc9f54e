#pragma once
#include <span>
#include <string>

#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// From which limits the profile reached.
[[nodiscard]] Verdict verdict_of(const ParameterResult& parameter);

/// True if it is the order of a spring-pot and 1: a dashpot, which is a special case of the law and
/// no bound that the search was stopped by.
[[nodiscard]] bool is_dashpot(const ParameterResult& parameter);

/// The verdict with what it rests on: "identified, conditional on contact at its lower bound".
[[nodiscard]] std::string verdict_text(const ParameterResult& parameter);

/// Number that the unit of a parameter is chosen by (sized_unit()): its estimate, or the further
/// limit where the estimate is near 0 and says nothing of the size of the interval.
[[nodiscard]] double size_of(const ParameterResult& parameter);
[[nodiscard]] double size_of(double estimate, const std::optional<double>& lower,
                             const std::optional<double>& upper);

/// An estimate in a table, kEstimateDigits of it in `unit`; 0 where it is nothing beside its size.
[[nodiscard]] std::string estimate_text(double estimate, double size, const Unit& unit);

/// "215.7 uN": a value in the unit in which a short answer shows the parameter, 4 significant
/// digits.
[[nodiscard]] std::string in_sized_unit(const ParameterResult& parameter, double natural);

/// One limit of the interval in the parameter's own unit, "open" where the bound came first, or
/// "failed" where the profile did.
[[nodiscard]] std::string limit_text(const ParameterResult& parameter, bool upper);

/// The same in this unit, of the same dimension.
[[nodiscard]] std::string limit_text(const ParameterResult& parameter, bool upper,
                                     const Unit& unit);

/// One sentence for a reader, made from the numbers.
[[nodiscard]] std::string parameter_words(const ParameterResult& parameter, double level);

/// Codes of ParameterResult::not_separable: no rest tells a drift of the zero; a material function
/// does not tell its plateau; contact trades off with a loading that no probe's exponent describes;
/// readings at rest were cut off.
inline constexpr const char* kDriftOrBranch = "drift_or_slow_branch";
inline constexpr const char* kPlateauOrBranch = "plateau_or_slower_branch";
inline constexpr const char* kPlateauOrFloor = "plateau_or_floor";
inline constexpr const char* kContactOrLoading = "contact_or_loading";
inline constexpr const char* kZeroOrContact = "zero_or_contact";

/// "eta1 = 5 Pa s is excluded by these data (...)" or "undetermined ...".
[[nodiscard]] std::string hypothesis_words(const HypothesisResult& result, double level);

/// Combination that the data determine of parameters that trade off along a direction, "their
/// product E eta1", "their ratio E / eta1", "the product E eta1^2", "the ratios of E, eta1 and
/// eta2", "their sum E1
/// + E2"; empty if it is nothing that simple.
/// @param named parameters that move along the direction, two or more
/// @param steps their components in theta, parallel
[[nodiscard]] std::string known_combination(std::span<const FitParameter> named,
                                            std::span<const double> steps);

/// Combination of parameters that the data determine least; empty for fewer than two free
/// parameters. Names what is known instead where a singular value is below a tenth of the largest,
/// see known_combination.
[[nodiscard]] std::string weakest_direction_words(const FitResult& result);

}  // namespace tpm::fit
