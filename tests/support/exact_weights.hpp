#pragma once

namespace tpm::test {

/// A weight of a sum of exponentials and its derivatives, computed in 100 digits and rounded.
struct ExactWeight {
  double value = 0.0, d_alpha = 0.0, d_beta = 0.0, d_x = 0.0;
};

/// The formula of CardinalWeight at x = h (m + phase), in real numbers; derivatives by central
/// differences. 0/0 for alpha = 1 at x = 0.
[[nodiscard]] ExactWeight exact_cardinal_weight(double alpha, long m, double phase, double h);

/// The same of PairWeight, for alpha > beta. 0/0 for alpha = 1 and beta = 0 at x = 0.
[[nodiscard]] ExactWeight exact_pair_weight(double alpha, double beta, long m, double phase,
                                            double h);

}  // namespace tpm::test
