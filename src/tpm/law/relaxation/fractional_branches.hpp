#pragma once
#include <vector>

namespace tpm::law {

/// A fractional relaxation function as a sum of exponentials with positive weights,
///
///     E_alpha(-(t/tau)^alpha) = constant + sum_j share_j exp(-t/time_j) + error,
///
/// whose constant and shares add up to 1: a material whose branches have these shares is passive.
struct FractionalBranches {
  struct Branch {
    double share = 0.0;  ///< > 0
    double time_s = 0.0;
  };
  std::vector<Branch> branches;  ///< the shortest time first
  double constant = 0.0;         ///< >= 0: what relaxes later than the window shows
  double error = 0.0;            ///< the largest between shortest_s and longest_s
};

struct FractionalWindow {
  double shortest_s = 0.0;  ///< > 0
  double longest_s = 0.0;   ///< > shortest_s; at most 1e12 times that
  double error = 1e-3;      ///< wanted, 1e-6 to 0.1
};

/// The sum with the fewest relaxation times, evenly spaced in their logarithm and one of them tau,
/// that keeps the wanted error: shares by non-negative least squares over the window. Just after a
/// jump, before shortest_s, the sum is less exact. Towards alpha = 1 the spectrum is a narrow peak,
/// which needs many times; at 1 it is one exponential.
/// @param alpha above 0, at most 1
/// @param most branches, 1 to 40
/// Throws Error(bad_input) for numbers out of range and where `most` branches do not suffice; the
/// message says which error they reach.
[[nodiscard]] FractionalBranches fractional_branches(double alpha, double tau_s,
                                                     const FractionalWindow& window,
                                                     std::size_t most);

}  // namespace tpm::law
