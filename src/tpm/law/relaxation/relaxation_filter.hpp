#pragma once
#include <functional>
#include <span>

#include "tpmkit/protocol.hpp"

namespace tpm::law {

/// Weights of the exact update of  dw/dt = (u - w) / tau  over an interval h in which u is linear:
///
///     w_new = r w + w0 u_old + w1 u_new,   z = h / tau,  r = exp(-z)
///     w1 = 1 - (1 - r) / z,  w0 = (1 - r) / z - r
///
/// Correct to rounding for every z >= 0, also as z -> 0 and z -> infinity, where the formulas as
/// written lose all digits. Stable for every tau. The d_ values are derivatives with respect to
/// ln(tau).
struct RelaxationWeights {
  double r, w0, w1;
  double d_r, d_w0, d_w1;
};

[[nodiscard]] RelaxationWeights relaxation_weights(double z);

/// The state of one relaxing branch: w follows u with the time constant tau.
struct RelaxationState {
  double w = 0.0;
  double d_w = 0.0;  ///< dw / d ln(tau)

  [[nodiscard]] RelaxationState after(const RelaxationWeights& k, double u_old,
                                      double u_new) const {
    return {k.r * w + k.w0 * u_old + k.w1 * u_new,
            k.r * d_w + k.d_r * w + k.d_w0 * u_old + k.d_w1 * u_new};
  }
};

/// Runs the branch through the whole history and reports u and w at each asked time, in O(knots +
/// times). At a jump the value just after it is reported.
/// @param order indices of `times_s` in rising order of time
/// @param report called once per asked time with its index in `times_s`
void run_relaxation(
    const Protocol& protocol, double tau_s, std::span<const double> times_s,
    std::span<const std::size_t> order,
    const std::function<void(std::size_t, double u, const RelaxationState&)>& report);

}  // namespace tpm::law
