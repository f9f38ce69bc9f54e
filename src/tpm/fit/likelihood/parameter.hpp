#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/units.hpp"

namespace tpm::fit {

/// The coordinate theta in which a parameter is searched, differentiated and profiled.
enum class Scale {
  log,             ///< theta = ln p; p > 0
  linear,          ///< theta = p
  inverse_square,  ///< theta = (lower / p)^2; p > 0. Forces depend on the spacing x through 1/x^2
                   ///< when it is large, so x -> infinity is the regular point theta = 0.
};

[[nodiscard]] std::string_view scale_name(Scale scale) noexcept;

/// One estimated parameter. All values SI, lower <= start <= upper; for log and inverse_square
/// lower > 0. Bounds may be infinite only on the linear scale.
struct FitParameter {
  std::string name;
  Unit unit;  ///< for display
  Scale scale = Scale::log;
  double start = 0.0;
  double lower = 0.0;
  double upper = 0.0;

  [[nodiscard]] double theta(double natural) const;
  [[nodiscard]] double natural(double theta) const;
  /// d natural / d theta
  [[nodiscard]] double natural_slope(double theta) const;
  [[nodiscard]] double theta_lower() const;  ///< smallest theta within the bounds
  [[nodiscard]] double theta_upper() const;
  /// True if theta and the natural value run in opposite directions.
  [[nodiscard]] bool reversed() const { return scale == Scale::inverse_square; }
  /// Within 1e-9 of the searched width of either bound.
  [[nodiscard]] bool at_lower(double natural) const;
  [[nodiscard]] bool at_upper(double natural) const;
};

/// "mN" as "mN/s", the unit of a drift: its dimension is that of what changes.
[[nodiscard]] Unit per_second(const Unit& unit);

/// SI symbol of a parameter, "N/s" of a drift of a force.
[[nodiscard]] std::string si_unit(const FitParameter& parameter);

[[nodiscard]] std::vector<double> start_values(std::span<const FitParameter> parameters);

/// Throws Error(bad_input) naming the parameter if its bounds, start and scale do not agree.
void require_valid(const FitParameter& parameter, std::string_view where);

/// Estimates after a step, taken in the coordinates of the search as far as no bound is passed:
/// times stay positive, and parameters that trade off along the step still do.
/// @param free numbers of the parameters that the step moves
/// @param natural estimates, of all parameters
/// @param by step of the free ones, natural
[[nodiscard]] std::vector<double> moved_within_bounds(std::span<const FitParameter> parameters,
                                                      const std::vector<std::size_t>& free,
                                                      std::span<const double> natural,
                                                      const Eigen::VectorXd& by);

}  // namespace tpm::fit
