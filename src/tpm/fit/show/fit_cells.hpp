#pragma once
#include <string>

#include "tpm/fit/fit.hpp"
#include "tpm/show/document.hpp"

namespace tpm::fit {

[[nodiscard]] Tone tone_of(const ParameterResult& p);

/// A standardised residual beyond 2 is unusual, beyond 3 wrong.
[[nodiscard]] Tone tone_of_residual(double standardised);

/// "0.32 N", or "0.07 to 0.18 N" of a band.
[[nodiscard]] std::string observed(const FitDatum& datum);

/// The model's answer, "0.3266 N".
/// @param with_sd its standard error, too, if it has one
[[nodiscard]] std::string predicted(const FittedDatum& datum, bool with_sd);

}  // namespace tpm::fit
