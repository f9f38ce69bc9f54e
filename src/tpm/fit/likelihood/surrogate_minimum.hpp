#pragma once
#include "tpm/fit/likelihood/least_squares.hpp"

namespace tpm::fit {

/// minimise_near() for a costly function, with a cheap one that changes much as it does. At each
/// point the surrogate is corrected so that its residuals and their derivatives are the function's
/// own there (and, learnt from step to step, the second ones); the corrected surrogate is
/// minimised, and the function is asked at the end. A step that does not lower the function's sum
/// of squares is tried again with a pull towards where it began (first-order model management:
/// Alexandrov, Lewis, J. Aircraft 38 (2001) 1093). Ends when the corrected surrogate sees no more
/// to gain than 1e-6 of the mean squared residual. Not usable if the start cannot be evaluated.
[[nodiscard]] Minimum minimise_by_surrogate(const ResidualFunction& function,
                                            const ResidualFunction& surrogate,
                                            std::span<const FitParameter> parameters,
                                            std::span<const double> start, const FixedMask& fixed);

}  // namespace tpm::fit
