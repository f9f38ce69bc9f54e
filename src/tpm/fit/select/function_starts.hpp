#pragma once
#include <vector>

#include "tpm/fit/likelihood/config.hpp"
#include "tpmkit/curve.hpp"

namespace tpm::fit {

/// Where the search for the parameters of a law begins, found from a measured G(t) or J(t).
///
/// Of a law with branches one start is its discrete spectrum: non-negative weights on a grid of
/// times, of which neighbours are joined until there are as many as branches. J(t) is linear in no
/// parameter of a law, so that starts anywhere would have to be followed by the dozen: of a Latin
/// hypercube the points are returned that come nearest to some of the readings once all their
/// stiffnesses are scaled together.
/// @param config its law, parameters and their bounds, seed and number of starts
/// @param function with quantity relaxation_modulus or creep_compliance
/// @return each in the order of config.parameters and within their bounds; may be empty
[[nodiscard]] std::vector<std::vector<double>> function_starts(const FitConfig& config,
                                                               const Recording& function);

}  // namespace tpm::fit
