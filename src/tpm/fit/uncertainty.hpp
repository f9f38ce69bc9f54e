#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/fit/likelihood/least_squares.hpp"
#include "tpm/fit/noise_of_estimates.hpp"

namespace tpm::fit {

/// Largest rise of the deviance inside a confidence set.
struct Threshold {
  double level = 0.95;      ///< in (0, 1)
  bool scale_known = true;  ///< sigma known: chi-square; known up to a factor: F
  int data_count = 0;       ///< n, bands not counted
  int parameter_count = 0;  ///< k
  /// Readings per independent reading, n / n_eff >= 1 (Correlation::inflation): the rise and the
  /// covariance are multiplied by it, and the F has n / inflation - k degrees of freedom.
  double inflation = 1.0;
  /// Noise that is not the same for every estimate; then `inflation` is its own.
  std::optional<NoiseOfEstimates> noise = std::nullopt;
  /// The least variance of a reading that is believed where it is estimated, in units of the
  /// declared one: data that are met to the rounding of numbers have no noise to be estimated.
  double least_variance = 0.0;

  /// Degrees of freedom of an estimated variance: max(n / inflation - k, 1).
  [[nodiscard]] double residual_degrees() const;
  /// Variance of one reading in units of the declared one: 1 if known, else deviance /
  /// (inflation residual_degrees()), which is deviance / (n - k) for independent readings: a smooth
  /// curve takes up as much of correlated noise as `inflation` parameters of independent noise
  /// would. Never below `least_variance`. Throws Error(bad_input) if it must be estimated and n <=
  /// k.
  [[nodiscard]] double variance_factor(double minimum_deviance) const;
  /// True if the size of the noise is known or can be estimated.
  [[nodiscard]] bool estimable() const { return scale_known || data_count > parameter_count; }
  /// Rise of the deviance allowed for `constrained` (>= 1) parameters at once.
  [[nodiscard]] double rise(double minimum_deviance, int constrained = 1) const;
  /// The same for one parameter, with its own variance and degrees of freedom under `noise`.
  [[nodiscard]] double rise_of(std::size_t parameter, double minimum_deviance) const;
  /// Half width of a linearised interval in standard errors, which hold the inflation already.
  [[nodiscard]] double multiplier(double minimum_deviance) const;
  /// The same of one parameter.
  [[nodiscard]] double multiplier_of(std::size_t parameter, double minimum_deviance) const;
  /// Probability of a rise at least this large if the constrained values are true.
  [[nodiscard]] double p_value(double rise, double minimum_deviance, int constrained = 1) const;
};

/// Linearised uncertainty at a minimum, in theta, of the parameters that are neither fixed nor at
/// a bound.
struct Covariance {
  /// The covariance matrix in theta; empty if not of full rank.
  [[nodiscard]] Eigen::MatrixXd theta_covariance() const;

  std::vector<std::size_t> free;  ///< indices of those parameters
  Eigen::VectorXd theta_sd;       ///< standard errors in theta; empty if not of full rank
  Eigen::MatrixXd correlation;
  Eigen::VectorXd singular_values;    ///< of the Jacobian in theta, each column scaled to length 1
  Eigen::VectorXd weakest_direction;  ///< unit vector in theta that the data see least
  Eigen::VectorXd weakest_share;      ///< the same with each column scaled to length 1: no units
  bool full_rank = false;
};

[[nodiscard]] Covariance linear_covariance(const ResidualFunction& function,
                                           std::span<const FitParameter> parameters,
                                           const Minimum& minimum, const Threshold& threshold);

/// A point of a likelihood profile: one parameter fixed, the others re-optimised.
struct ProfilePoint {
  double natural;  ///< SI
  double deviance;
};

/// End of the walk along a profile on one side.
enum class ProfileEnd {
  not_walked,
  limit,     ///< the deviance rose by the threshold there
  bound,     ///< the bound came first: every value up to it fits
  exchange,  ///< before the deviance rose by the threshold, two parts of the law were equal and
             ///< changed places (ExchangeOrder): the data do not tell them apart
  rounding,  ///< failed: the interval is as narrow as the rounding of numbers
  steps,     ///< failed: neither limit nor bound was reached within the allowed number of steps
};

/// The walk found neither a limit nor that there is none.
[[nodiscard]] constexpr bool has_failed(ProfileEnd end) noexcept {
  return end == ProfileEnd::rounding || end == ProfileEnd::steps;
}

/// Another parameter that stood on a bound where a profile met its limit: with other bounds the
/// limit would lie elsewhere.
struct LimitingBound {
  std::size_t parameter = 0;
  bool upper = false;

  bool operator==(const LimitingBound&) const = default;
};

/// The profile of one parameter and the confidence interval it gives. A limit that is missing was
/// not reached within the bounds, or the walk failed: `below` and `above` tell.
struct Profile {
  std::vector<ProfilePoint> points;  ///< rising in the natural value
  std::optional<double> lower;
  std::optional<double> upper;
  ProfileEnd below = ProfileEnd::not_walked;  ///< towards smaller natural values
  ProfileEnd above = ProfileEnd::not_walked;
  std::vector<LimitingBound> limited_by;  ///< at either limit, each once
  bool connected = true;          ///< false: the values between the limits do not all belong
  std::optional<Minimum> better;  ///< a deeper minimum met on the way; the profile is then void
  std::vector<Minimum> inside;    ///< ends of the constrained fits below the threshold
  int failures = 0;               ///< constrained fits that could not be evaluated
  bool cut_short = false;  ///< a limit is where the model ends (a tissue that snaps through, say)
};

/// Walks outwards from each minimum in theta with adaptive steps until the deviance has risen by
/// the threshold above the best one (then the limit is found to 1e-7 of its distance from the
/// minimum, in theta) or the bound is reached. Where the model can no longer be evaluated the range
/// ends, too: what cannot carry the load does not fit. A walk that ends in none of these ways has
/// failed, which is not the same as a flat profile. Several minima within the threshold may give
/// separate ranges: the limits then enclose them all and `connected` is false.
/// @param minima rising deviance, the best first
[[nodiscard]] Profile profile_likelihood(const ResidualFunction& function,
                                         std::span<const FitParameter> parameters,
                                         std::span<const Minimum> minima, std::size_t index,
                                         const Covariance& covariance, const Threshold& threshold);

/// One point of that profile: the least deviance with one parameter fixed at a value. The value is
/// in the confidence set if it rises by no more than the threshold, so that one point tells whether
/// an interval contains a known true value.
/// @param starts natural values of all parameters, from which the others are searched
/// @return infinity if no search ended in a usable point
[[nodiscard]] double profile_deviance(const ResidualFunction& function,
                                      std::span<const FitParameter> parameters,
                                      std::span<const std::vector<double>> starts,
                                      std::size_t index, double value);

}  // namespace tpm::fit
