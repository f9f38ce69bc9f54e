#pragma once
#include <span>
#include <vector>

#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpm/fit/likelihood/least_squares.hpp"

namespace tpm::fit {

/// Where starts come from, which decides how they are followed.
enum class StartKind {
  anywhere,  ///< spread over the bounds: the general search, with a bold and a cautious first step
  solved,    ///< found from the data: the search from nearby
};

/// Minimum of x' G x / 2 - g' x with lower <= x <= upper by an active set of bounds; x is as near
/// to 0 as they let it where G does not tell. For a handful of columns.
[[nodiscard]] Eigen::VectorXd bounded_minimum(const Eigen::MatrixXd& gram,
                                              const Eigen::VectorXd& right,
                                              const Eigen::VectorXd& lower,
                                              const Eigen::VectorXd& upper);

/// Starts with the parameters in which the residuals are linear solved for: `count` points of a
/// Latin hypercube over the others, of which the `keep` of least deviance are returned after the
/// nominal start. Points that cannot be evaluated are left out.
/// @param linear one flag for each parameter
[[nodiscard]] std::vector<std::vector<double>> projected_starts(
    const ResidualFunction& function, std::span<const FitParameter> parameters,
    const std::vector<bool>& linear, std::size_t count, std::size_t keep, std::uint64_t seed);

/// Kind of starts that fit_starts() gives: projected or given.
[[nodiscard]] StartKind start_kind(const ExperimentResiduals& function);

/// The starts of a configuration: a Latin hypercube of all parameters, or, where the model is
/// linear in some and the noise does not depend on it, projected starts; FitConfig::given_starts
/// come before the latter and instead of the former, unless points of the hypercube come nearer to
/// the data than all of them: these are then followed as well.
[[nodiscard]] std::vector<std::vector<double>> fit_starts(const ExperimentResiduals& function,
                                                          std::span<const FitParameter> parameters);

/// More starts, where fit_starts() gives projected ones: those of another seed that come nearest to
/// the data. Empty else.
[[nodiscard]] std::vector<std::vector<double>> further_starts(
    const ExperimentResiduals& function, std::span<const FitParameter> parameters);

}  // namespace tpm::fit
