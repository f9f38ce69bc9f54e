#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/fit/likelihood/least_squares.hpp"

namespace tpm::fit {

/// A fit that can be repeated on other data. The caller knows how its data are made.
class Refittable {
 public:
  Refittable() = default;
  Refittable(const Refittable&) = delete;
  Refittable& operator=(const Refittable&) = delete;
  virtual ~Refittable() = default;

  /// Numbers of readings of the recordings (curves, specimens); the readings of a recording are
  /// consecutive and in the order of measurement.
  [[nodiscard]] virtual std::vector<std::size_t> recording_lengths() const = 0;

  /// z of each reading at the given parameters, (T(y) - T(f)) / sigma, in the order of the
  /// readings. Throws Error(numerical) if the response cannot be computed.
  [[nodiscard]] virtual std::vector<double> standardised_residuals(
      std::span<const double> natural) const = 0;

  /// The fit with the data replaced by the answers at `natural`, scattered by `z`.
  [[nodiscard]] virtual std::unique_ptr<ResidualFunction> with_residuals(
      std::span<const double> natural, std::span<const double> z) const = 0;

  /// The fit to these readings only; a reading listed twice counts twice.
  [[nodiscard]] virtual std::unique_ptr<ResidualFunction> with_readings(
      std::span<const std::size_t> readings) const = 0;
};

/// Units that are drawn with replacement.
enum class Resampling {
  residuals,   ///< single standardised residuals: independent noise
  blocks,      ///< moving blocks of neighbouring residuals (Kuensch 1989): correlated noise
  recordings,  ///< whole recordings with all their readings: also the spread between specimens
};

struct BootstrapOptions {
  Resampling resampling = Resampling::residuals;
  int replicates = 1000;  ///< >= 20
  std::uint64_t seed = 0;
  double level = 0.95;           ///< in (0, 1)
  std::size_t block_length = 0;  ///< of blocks; 0: block_length() of the residuals' correlation
};

/// Natural values, SI.
struct BootstrapInterval {
  double lower = 0.0, upper = 0.0;
};

/// One parameter's bootstrap distribution.
struct BootstrapParameter {
  std::string name;
  double estimate = 0.0;        ///< of the original fit, SI
  double standard_error = 0.0;  ///< standard deviation of the replicates, SI
  double bias = 0.0;            ///< mean of the replicates less the estimate, SI
  BootstrapInterval percentile;
  /// Bias-corrected and accelerated (Efron, J. Am. Stat. Assoc. 82 (1987) 171). Empty if all
  /// replicates lie on one side of the estimate.
  std::optional<BootstrapInterval> bca;
  double acceleration = 0.0;       ///< from a jackknife over at most 50 groups
  std::vector<double> replicates;  ///< of the refits that succeeded, in the order drawn, SI
};

struct BootstrapResult {
  BootstrapOptions options;
  std::size_t block_length = 1;  ///< used
  int failed = 0;                ///< refits without a usable end: they are in no distribution
  int not_converged = 0;         ///< usable ends of refits that ran out of iterations: they are
  int jackknife_failed = 0;      ///< of the refits for the acceleration
  std::vector<BootstrapParameter> parameters;
  std::string summary;  ///< one sentence; says if refits failed
};

/// Refits `replicates` times, each from the original minimum. Residuals are centred and widened by
/// sqrt(n / (n - k)), which a fit has taken from them (Davison & Hinkley, Bootstrap Methods (1997),
/// 6.2). Limits are interpolated between the order statistics (R + 1) p. Deterministic in the seed.
/// Throws Error(bad_input) for options out of range, n <= k, or fewer than 2 recordings to draw
/// from; Error(numerical) if fewer than half of the refits succeed.
[[nodiscard]] BootstrapResult bootstrap(const Refittable& fit,
                                        std::span<const FitParameter> parameters,
                                        const Minimum& minimum, const BootstrapOptions& options);

}  // namespace tpm::fit
