#pragma once

namespace tpm::base {

// Distributions of statistics, by Boost.Math in its long double unless said otherwise. Its headers
// take the compiler seconds: one source reads them. What is out of range throws std::domain_error.

/// x with P(X <= x) = p of the standard normal distribution; p in (0, 1).
[[nodiscard]] double normal_quantile(double p);
/// P(X <= x) of the standard normal distribution.
[[nodiscard]] double normal_cdf(double x);

/// x with P(X <= x) = p of Student's distribution; p in (0, 1), degrees > 0.
[[nodiscard]] double student_quantile(double p, double degrees);
/// P(X <= x) of Student's distribution, in double; degrees > 0.
[[nodiscard]] double student_cdf(double x, double degrees);
/// student_quantile in double: where many are needed, to about 1e-14.
[[nodiscard]] double quick_student_quantile(double p, double degrees);

/// x with P(X <= x) = p of chi squared; p in [0, 1), degrees > 0.
[[nodiscard]] double chi_squared_quantile(double p, double degrees);
/// P(X > x) of chi squared; x >= 0, degrees > 0.
[[nodiscard]] double chi_squared_tail(double x, double degrees);

/// x with P(X <= x) = p of Fisher's F; p in [0, 1), degrees > 0.
[[nodiscard]] double fisher_quantile(double p, double numerator_degrees,
                                     double denominator_degrees);
/// P(X > x) of Fisher's F; x >= 0 and finite, degrees > 0.
[[nodiscard]] double fisher_tail(double x, double numerator_degrees, double denominator_degrees);

/// P(X = k) of k successes in n trials that succeed with p each; 0 <= k <= n.
[[nodiscard]] double binomial_density(int k, int n, double p);

/// ln Gamma(x); x > 0.
[[nodiscard]] double log_gamma(double x);

}  // namespace tpm::base
