#pragma once
#include <span>

#include "tpm/fit/select/fit_variations.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::fit {

/// Rise of the deviance along each parameter, the others re-optimised, with the level that bounds
/// the confidence interval. No panels if the fit was not profiled.
[[nodiscard]] Figure profile_figure(const FitStudy& study);

/// Where a profile leaves the confidence interval.
struct ProfileLimit {
  double level = 0.95;
  double rise = 0.0;  ///< of the deviance
  double unit = 1.0;  ///< of the deviance's axis
};

/// Series of a panel of a profile: the profile, the limit, the best fit.
/// @param least deviance, of the best fit
[[nodiscard]] std::vector<Series> profile_series(const ParameterResult& result,
                                                 std::span<const ProfilePoint> points, double least,
                                                 const ProfileLimit& at);

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

}  // namespace tpm::fit
