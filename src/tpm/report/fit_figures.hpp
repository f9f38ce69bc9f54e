#pragma once
#include "tpm/report/figure.hpp"
#include "tpm/study/fit_variations.hpp"

namespace tpm::report {

/// Rise of the deviance along each parameter, the others re-optimised, with the level that bounds
/// the confidence interval. No panels if the fit was not profiled.
[[nodiscard]] Figure profile_figure(const FitStudy& study);

/// Estimate and interval of one parameter against the assumed ramp rate, one panel per noise
/// convention.
/// @param stated the value that the paper states, SI
[[nodiscard]] Figure sensitivity_figure(const FitStudy& study, const std::string& parameter,
                                        double stated);

/// "relative to datum"
[[nodiscard]] std::string noise_words(NoiseKind noise);

/// "E = 13.17 kPa, eta1 = 2.573e+05 Pa s, spacing = 1000 mm"
[[nodiscard]] std::string estimate_words(const FitResult& fit);

/// The parameter's result; throws Error(bad_input) if the fit does not estimate it.
[[nodiscard]] const ParameterResult& parameter_of(const FitResult& fit, const std::string& name);

}  // namespace tpm::report
