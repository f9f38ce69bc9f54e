#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tpm/fit/likelihood/exchange_order.hpp"
#include "tpm/fit/likelihood/parameter.hpp"
#include "tpmkit/model.hpp"

namespace tpm::fit {

/// Weighted residuals of everything that is fitted, with exact derivatives. Their sum of squares
/// less offset() is the deviance: -2 ln L up to a constant that no parameter moves.
class ResidualFunction {
 public:
  ResidualFunction() = default;
  ResidualFunction(const ResidualFunction&) = delete;
  ResidualFunction& operator=(const ResidualFunction&) = delete;
  virtual ~ResidualFunction() = default;

  [[nodiscard]] virtual Eigen::Index residual_count() const = 0;

  /// @param natural parameter values, SI
  /// @param residual size residual_count()
  /// @param jacobian d residual / d natural, residual_count() x parameter count, or null
  /// @return false if the response could not be computed there; the search then turns away. A
  ///         failure never becomes a zero residual.
  [[nodiscard]] virtual bool evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                                      RowMatrix* jacobian) const = 0;

  /// The matrix whose J^T J is the expected Fisher information, d / d natural. The residuals' own
  /// Jacobian is right for normal noise of known or common scale; a function with other noise
  /// (location_information, noise_information) overrides this.
  /// @return false as for evaluate
  [[nodiscard]] virtual bool information_root(std::span<const double> natural,
                                              RowMatrix& root) const {
    Eigen::VectorXd residual;
    return evaluate(natural, residual, &root);
  }

  /// True if the residuals are linear in a parameter while the others are fixed: a search can solve
  /// for it.
  [[nodiscard]] virtual bool linear_in(std::size_t /*parameter*/) const { return false; }

  /// A cheap function of the same parameters whose residuals change much as these do, where these
  /// are costly: searches then take it along. None if these are cheap.
  [[nodiscard]] virtual const ResidualFunction* surrogate() const { return nullptr; }

  /// Constant part of the sum of squares that is not deviance.
  [[nodiscard]] virtual double offset() const { return 0.0; }

  /// The order of parameters that can change places without changing the residuals.
  [[nodiscard]] virtual const ExchangeOrder& exchange_order() const;
};

/// The end of one descent.
struct Minimum {
  std::vector<double> natural;  ///< SI
  double deviance = 0.0;
  bool usable = false;     ///< the search ended in a finite point it could evaluate
  bool converged = false;  ///< by one of the tolerances, not by running out of iterations
  int iterations = 0;
  std::string message;  ///< the optimiser's own words
};

/// Marks of the parameters that keep their value.
using FixedMask = std::vector<bool>;

/// Length of the first step: nearly a full Gauss-Newton step, or a short one. Which valley a
/// far start falls into can depend on it (NIST BoxBOD, first start; MGH17, first start).
enum class FirstStep { bold, cautious };

/// Trust-region descent (Ceres, Levenberg-Marquardt with box bounds) in theta.
/// @param start natural values within the bounds (a start outside is moved to the bound)
/// @param fixed empty, or one flag per parameter
/// A function with a surrogate is searched with its help instead (surrogate_minimum.hpp).
[[nodiscard]] Minimum minimise(const ResidualFunction& function,
                               std::span<const FitParameter> parameters,
                               std::span<const double> start, const FixedMask& fixed = {},
                               FirstStep first_step = FirstStep::bold);

/// The same from a start that is already close (a neighbouring point of a profile, a start whose
/// linear parameters were solved for): projected Levenberg-Marquardt with an active set of bounds,
/// a few evaluations where the general search needs dozens. Ends when a step changes the residuals
/// by less than 1e-4 standard deviations in all, or after 200 steps (then not `converged`).
/// A function with a surrogate is searched with its help instead.
[[nodiscard]] Minimum minimise_near(const ResidualFunction& function,
                                    std::span<const FitParameter> parameters,
                                    std::span<const double> start, const FixedMask& fixed = {});

/// Natural values in the coordinates that they are searched in.
[[nodiscard]] Eigen::VectorXd theta_of(std::span<const FitParameter> parameters,
                                       std::span<const double> natural);

/// d natural / d theta
[[nodiscard]] Eigen::VectorXd natural_slopes(std::span<const FitParameter> parameters,
                                             const Eigen::VectorXd& theta);

/// Residuals and their derivatives by theta at a point.
struct KnownPoint {
  std::vector<double> natural;
  Eigen::VectorXd theta, residual;
  RowMatrix jacobian;

  [[nodiscard]] double cost() const { return residual.squaredNorm(); }
  /// Sets all that follows from the natural values; false if it is not finite.
  [[nodiscard]] bool evaluate(const ResidualFunction& function,
                              std::span<const FitParameter> parameters);
};

/// Deviance at a point; NaN if it cannot be evaluated.
[[nodiscard]] double deviance_at(const ResidualFunction& function, std::span<const double> natural);

/// Seeded starts: the first is the nominal one, the others a Latin hypercube over the bounds,
/// uniform in ln p on the log and inverse_square scales. Every seed, also 0, gives its own starts,
/// the same on every machine.
[[nodiscard]] std::vector<std::vector<double>> latin_hypercube_starts(
    std::span<const FitParameter> parameters, std::size_t count, std::uint64_t seed);

}  // namespace tpm::fit
