#pragma once
#include <complex>
#include <span>

namespace tpm::law {

/// A node of the contour over which inverse Laplace transforms are summed.
struct ContourNode {
  std::complex<double> s;
  std::complex<double> log_s;
  std::complex<double> weight;
};

/// The inverse Laplace transform of a function F that is analytic but on the negative real axis,
///
///     f(t) = 1/(2 pi i) integral F(s) exp(s t) ds = (1/t) sum_k Re[ weight_k F(s_k/t) ],   t > 0
///
/// by the midpoint rule on the parabola s = mu (1 + i u)^2, mu = pi N/12, with the step 3/N
/// (Weideman and Trefethen 2007). The error is about exp(-2 pi N/3) of |F| on the contour; with N =
/// 20 it is below rounding, which leaves 1e-13 to 1e-12 of |F(1/t)|/t. That accuracy is absolute:
/// where f is far smaller, such as exp(-t) at t = 50, it has few digits.
[[nodiscard]] std::span<const ContourNode> contour_nodes();

}  // namespace tpm::law
