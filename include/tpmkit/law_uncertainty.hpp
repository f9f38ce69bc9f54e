#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/error.hpp"
#include "tpmkit/law.hpp"

namespace tpm {

/// The coordinate theta in which the uncertainty of a parameter p is stated.
enum class Coordinate {
  linear,          ///< theta = p
  log,             ///< theta = ln p, p > 0
  inverse_square,  ///< theta = 1/p^2, p > 0; an infinite spacing is the ordinary point 0
};

[[nodiscard]] std::string_view coordinate_name(Coordinate coordinate) noexcept;
[[nodiscard]] double to_coordinate(Coordinate coordinate, double natural);
[[nodiscard]] double from_coordinate(Coordinate coordinate, double theta);
/// d natural / d theta at a natural value.
[[nodiscard]] double coordinate_slope(Coordinate coordinate, double natural);

/// A rise of the drive between two samples that was not in the middle of the time between them.
struct DelayedRise {
  double begin_s = 0.0, end_s = 0.0;  ///< the samples
  double delay_s = 0.0;               ///< of its centre, at most half the time between them
};

/// A file that a law was fitted to.
struct FittedFile {
  std::string name;
  std::string sha256;                  ///< of its bytes; empty if the data came from no file
  int readings = 0;                    ///< number of fitted readings
  std::optional<double> from_s, to_s;  ///< of a recording: samples outside were not fitted
  /// Of a recording that was fitted together with others: its own contact (m, or a relative length)
  /// and offset (N or Pa). Of a single one they stand among the law's parameters.
  std::optional<double> contact = std::nullopt, offset = std::nullopt;
  /// Those of the two that were not estimated: "contact", "offset".
  std::vector<std::string> held = {};
  /// Limits of the force cell: readings at or beyond them were censored, SI.
  std::optional<double> clipped_above = std::nullopt, clipped_below = std::nullopt;
  /// Drift of the force cell's zero that was found in a recording, N/s or Pa/s, and when it is 0,
  /// s.
  std::optional<double> drift = std::nullopt, drift_origin_s = std::nullopt;

  /// Rises of the drive within the time between two samples.
  std::vector<DelayedRise> rises = {};
  /// SHA-256 of the samples' numbers (time, drive, response with 9 digits): a copy of the recording
  /// has the same, however its file is named or formatted. Empty: not stated.
  std::string samples_sha256 = {};

  /// Addition of the drift to a reading.
  [[nodiscard]] double drifted(double time_s) const {
    return drift ? *drift * (time_s - drift_origin_s.value_or(0.0)) : 0.0;
  }

  /// True if a reading stands at a limit of the force cell.
  [[nodiscard]] bool clips(double reading) const {
    return (clipped_above && reading >= *clipped_above) ||
           (clipped_below && reading <= *clipped_below);
  }

  /// True if a sample at this time was fitted.
  [[nodiscard]] bool holds(double time_s) const {
    return !(from_s && time_s < *from_s) && !(to_s && time_s > *to_s);
  }
};

/// Scatter of one reading about the law, after the fit.
struct ReadingNoise {
  /// Kind of the fit's noise model (docs/fit_files.md): absolute, combined, relative_to_datum,
  /// relative_to_model, log, per_row; "unknown" where the fit's noise is not normal.
  std::string kind = "absolute";
  double absolute = 0.0;  ///< a of sigma = a + b |model|, SI unit of the response
  double relative = 0.0;  ///< b; of `log` the standard deviation of the logarithm
  double column = 1.0;    ///< per_row: factor of the file's own standard deviations
  double lag_1 = 0.0;     ///< correlation of neighbouring residuals
};

/// Verdict whether a law describes the recordings that it was fitted to: their residuals against
/// the noise that was measured where nothing moves.
struct LawAdequacy {
  std::string verdict;                        ///< adequate, not_described or not_judged
  std::optional<double> residual_over_noise;  ///< of the worst recording; none if not judged
  std::string summary;                        ///< one sentence, with the likely cause
  std::vector<Remark> causes = {};            ///< likely ones, if the law does not describe them

  [[nodiscard]] bool is_adequate() const { return verdict == "adequate"; }
  [[nodiscard]] bool is_rejected() const { return verdict == "not_described"; }
};

/// Uncertainty of the parameters of a fitted law, sufficient to predict with a band.
struct LawUncertainty {
  std::vector<std::size_t> place;  ///< index of each uncertain parameter in law_parameters()
  std::vector<Coordinate> coordinate;
  /// Covariance of theta, in the order of `place`. It accounts for correlated readings and an
  /// estimated size of the noise. It may be singular: several parameters of the law may follow from
  /// one of the fit.
  Eigen::MatrixXd covariance;
  double level = 0.95;  ///< of the fit's intervals
  /// Degrees of freedom of Student's t for the intervals. None: the size of the noise was known,
  /// and normal quantiles apply.
  std::optional<double> degrees_of_freedom;
  /// n / n_eff, the number of readings per independent one.
  double readings_per_independent = 1.0;
  ReadingNoise noise;
  double duration_s = 0.0;  ///< longest fitted time span; 0 if unknown
  std::vector<FittedFile> data;
  std::vector<std::string> at_bound;  ///< estimated parameters that are fixed on a bound
  /// Estimated parameters that the recordings cannot tell from something else: from a drift.
  std::vector<std::string> not_separable;
  /// Estimated parameters whose minimum is not trusted (FittedParameter::unconfirmed).
  std::vector<std::string> unconfirmed;

  /// Two-sided quantile: estimate +- this times the standard error is an interval at `level`.
  [[nodiscard]] double quantile(double at_level) const;
  [[nodiscard]] double quantile() const { return quantile(level); }
};

}  // namespace tpm
