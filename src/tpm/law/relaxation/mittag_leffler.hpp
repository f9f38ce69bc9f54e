#pragma once

namespace tpm::law {

/// The Mittag-Leffler function of a relaxing argument,
///
///     E_{alpha,beta}(-z) = sum over n >= 0 of (-z)^n / Gamma(alpha n + beta)
///
/// by its power series up to z = 0.1 and above it by the spectral integral with the trapezoidal
/// rule, where every term is positive, so that the *relative* accuracy holds however small the
/// value is: better than 1e-13 against a table in 25 digits (tests/law/test_fractional.cpp). For
/// alpha = 1 it is exp(-z) and (1 - exp(-z))/z exactly.
///
///     E_alpha(-(t/tau)^alpha)             relaxation after a step, beta = 1
///     t E_{alpha,2}(-(t/tau)^alpha)       its integral from 0 to t: response to a ramp
///     E_{alpha,alpha}, E_{alpha,1+alpha}  its slope, and (1 - E_alpha(-z))/z
///
/// @param alpha 0 < alpha <= 1
/// @param beta  exactly one of 1, 2, alpha, 1 + alpha
/// @param z     >= 0; infinity gives 0
/// Throws Error(bad_input) for anything else.
[[nodiscard]] double mittag_leffler(double alpha, double beta, double z);

/// E_{a,b}(-z) with its derivatives.
struct MittagLeffler {
  double value = 0.0;
  double d_a = 0.0;
  double d_b = 0.0;
  double d_z = 0.0;
};

/// The function of two free orders, as the inverse Laplace transform of s^(a-b)/(s^a + z) at t = 1
/// (laplace_contour.hpp). Up to a = 1 that is analytic but on the negative real axis, so nothing
/// switches at any order. The error is below 1e-12/(1 + z), that of d_z below 1e-12/(1 + z)^2:
/// absolute where the value is smaller, as exp(-z) is.
///
/// @param a 0 <= a <= 1
/// @param b 0 <= b <= 3
/// @param z >= 0; infinity gives 0
/// Throws Error(bad_input) for anything else.
[[nodiscard]] MittagLeffler mittag_leffler_with_slopes(double a, double b, double z);

}  // namespace tpm::law
