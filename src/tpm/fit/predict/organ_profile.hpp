#pragma once
#include <span>

#include "tpm/base/namespaces.hpp"
#include "tpm/fit/likelihood/least_squares.hpp"
#include "tpm/fit/uncertainty.hpp"

namespace tpm::fit {

/// The likelihood profile of one parameter where an evaluation takes a second, not a microsecond:
/// each side is walked in a few points, the others fitted again by damped Gauss-Newton steps until
/// a step promises less than 1e-3 of the threshold. A limit is where the square root of the rise,
/// which is nearly linear in theta, meets its threshold within 0.5 %: profile_likelihood asks for
/// 1e-4 of the distance and mean squared residual, a hundred times as many evaluations.
/// @param best a minimum; a deeper one met on the way is returned as `better`
/// @param half_width of the linearised interval, in theta, where the walk begins to look
[[nodiscard]] Profile short_profile(const ResidualFunction& function,
                                    std::span<const FitParameter> parameters, const Minimum& best,
                                    std::size_t index, double half_width, double rise);

}  // namespace tpm::fit
