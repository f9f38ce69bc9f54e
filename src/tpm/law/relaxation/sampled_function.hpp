#pragma once
#include <Eigen/Core>
#include <functional>
#include <span>

namespace tpm::law {

/// Values of a function at rising places: a row for each place, a column for each of its parts.
using RowsAt = std::function<Eigen::MatrixXd(std::span<const double>)>;

/// A function that is smooth nearly everywhere, at many places, from few of its own values: where
/// many places lie close together, polynomials through its values at 16 Chebyshev nodes answer
/// them, if those through every other node agree with the nodes between; elsewhere the stretch is
/// halved, or the function itself answers. What a polynomial of half the degree differs by is an
/// estimate of the error that is far on the safe side (Trefethen, Approximation Theory and
/// Approximation Practice, chapter 7).
/// @param function is asked for 1 to `together` places at a time
/// @param places rising
/// @param together places that the function answers as quickly as one; at least 2
/// @param allowed difference in each part, in its unit; one number per part, >= 0
[[nodiscard]] Eigen::MatrixXd sampled(const RowsAt& function, std::span<const double> places,
                                      std::size_t together, const Eigen::RowVectorXd& allowed);

}  // namespace tpm::law
