#pragma once
#include <optional>
#include <span>

#include "tpm/law/contact_history.hpp"

namespace tpm::law {

/// The depth under a load that is imposed suddenly and then constant, where elastic tension helps
/// to carry it, which leaves no closed form:
///
///     A V(u) + k_tension T(u) = L + sum k_j w_j,   dw_j/dt = (V - w_j)/tau_j,   A = k_inf + sum
///     k_j
///
/// beside a dashpot, if the law has one. Within a step of an adaptive collocation V is a polynomial
/// through its values at Radau nodes, over which the w_j are exact (ExponentialCollocation). A step
/// is as long as the balance between the nodes allows, to 3e-9 of V at the law's reference, however
/// densely it is asked; the asked times are interpolated. The many rates of a spring-pot lie on a
/// lattice, and so do the steps: the weights of their products are computed once for all laws.
///
/// @param load zero error included
/// @param times_s since the load was imposed
/// @param attempts counts the steps that were tried, if given
/// Nothing where the load does not press, for infinite times, and for laws without tension.
[[nodiscard]] std::optional<Response> creep_with_tension(const LawAtParameters& law, double load,
                                                         std::span<const double> times_s, Want want,
                                                         int* attempts = nullptr);

}  // namespace tpm::law
