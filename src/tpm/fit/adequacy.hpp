#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/fit/likelihood/quantum.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {

/// Verdict whether a law describes a recording.
enum class Described {
  adequate,       ///< the residuals are no larger than the noise
  not_described,  ///< they are, at the level of the test
  not_judged,     ///< the rest is too short to tell the noise, or no rest
};

/// "adequate", "not_described", "not_judged": as files say it.
[[nodiscard]] std::string_view described_name(Described described) noexcept;

/// "2.4", "93" or "1204": how many times the noise something is.
[[nodiscard]] std::string times_text(double times);

/// Input of an adequacy test. Responses in one unit, times in s, both in the order of time.
struct AdequacyData {
  std::span<const double> rest_time_s;  ///< samples in which nothing moves and nothing touches
  std::span<const double> rest;         ///< their readings, as many
  std::span<const double> time_s;       ///< of the fitted samples
  std::span<const double> reading;      ///< fitted readings
  std::span<const double> residual;     ///< reading less prediction, or the negative
  int parameters = 0;                   ///< fitted, 0 or more
  /// Variance that the noise of the imposed channel adds to the residual and not to the rest.
  double carried_variance = 0.0;
  double ramp_to_s = 0.0;     ///< where the drive first reaches its largest value, among the fitted
  std::string repeated = {};  ///< words on readings that a logger repeats; empty: none
};

/// Straight trend of the readings at rest.
struct RestTrend {
  double per_s = 0.0;
  double standard_error = 0.0;  ///< counts the correlation of the readings
};

/// Readings in a row that are all equal.
struct EqualRun {
  std::size_t first = 0, length = 0;
  double value = 0.0;
  bool largest = true;  ///< at the largest reading, else at the smallest
};

/// Result of a test of the residual against the noise at rest.
struct Adequacy {
  Described described = Described::not_judged;
  double residual_over_noise = 0.0;  ///< ratio of standard deviations; 0 if not judged
  double noise_sd = 0.0;             ///< at rest, with the rounding of the readings, or under load
  bool noise_under_load = false;  ///< neighbouring readings under load scatter by more than at rest
  double rest_degrees = 0.0;      ///< degrees of freedom of its square
  double p_value = 1.0;           ///< of a ratio at least this large if the law is right
  bool restless = false;          ///< not judged, because what should rest scatters too much
  std::vector<Remark> causes;     ///< likely ones, if not described
};

/// The longest run of equal readings at the largest or smallest value that is longer than rounding
/// makes: at least 4, and more than 3 times the longest run at other values near it (where readings
/// at rest stay on one level, also 3 times the longest run there).
[[nodiscard]] std::optional<EqualRun> clipped_run(std::span<const double> readings,
                                                  std::span<const double> rest);

/// None below 8 samples or for readings that are all equal.
[[nodiscard]] std::optional<RestTrend> rest_trend(std::span<const double> time_s,
                                                  std::span<const double> rest);

/// Bend of the readings at rest: the zero of a force cell that warms up does not drift along a
/// line.
struct RestBend {
  double noises = 0.0;   ///< range of the bend over the rest, in standard deviations of the noise
  double p_value = 1.0;  ///< of a bend at least this large in autoregressive noise about a line
};

/// A parabola beside the line, by Student's t with the degrees of freedom and the standard error
/// that the upper confidence bound of the residuals' lag-1 correlation leaves. None below 20
/// samples.
[[nodiscard]] std::optional<RestBend> rest_bend(std::span<const double> time_s,
                                                std::span<const double> rest);

/// Tests whether residuals have a larger variance than readings at rest. With autoregressive noise
/// of first order and lag-1 correlation rho,
///
///     F = (sum of squared residuals / (N - parameters)) / s^2
///
/// is compared with the F distribution. s^2 is the variance of the rest about a straight line (a
/// drift is no noise), corrected for what the line takes, plus q^2/12 of readings that are rounded
/// to steps q. The degrees of freedom of both are those of the chi-square with the same first two
/// moments (Satterthwaite), 2 E^2 / Var, at the upper confidence bound of rho: the smaller one of
/// what the rest and the residuals tell, since under the hypothesis both are the same noise.
///
/// Noise may grow under load (a probe that shakes, noise in parts of a reading). Where the
/// residuals scatter about their neighbours by more than the rest, s^2 is that scatter instead: of
/// blocks of 32 samples the median of second differences, which a course that is smooth or jumps
/// now and then leaves out.
///
/// Where readings at rest scatter by more than twice the residuals, and by more than chance, they
/// are no noise (a force cell that settles, a probe that swings in the air): any law would lie
/// within them, and nothing is judged.
///
/// @param level probability of calling a law that is right not described, in (0, 1)
/// Throws Error(bad_input) for readings that are not finite or spans of unequal lengths.
[[nodiscard]] Adequacy judge_adequacy(const AdequacyData& data, double level = 0.01);

}  // namespace tpm::fit
