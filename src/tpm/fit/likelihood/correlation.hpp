#pragma once
#include <span>
#include <string>
#include <vector>

namespace tpm::fit {

/// Correlation of neighbouring residuals. A dense recording holds fewer independent
/// readings than samples; intervals that ignore this are too short.
struct Correlation {
  double lag1 = 0.0;             ///< autocorrelation of neighbours, -1 .. 1
  double integrated_time = 1.0;  ///< 1 + 2 sum rho_k, in samples; below 1 if residuals alternate
  double effective_count = 0.0;  ///< n_eff, 1 .. n; exactly n unless `significant`
  bool significant = false;      ///< Ljung-Box rejects independence at 1 %
  double ljung_box_p = 1.0;
  int ljung_box_lags = 0;  ///< 0: too few readings to test
  std::size_t count = 0;   ///< n
  std::string summary;     ///< one sentence

  /// n / n_eff >= 1, for Threshold::inflation.
  [[nodiscard]] double inflation() const;
};

/// Autocorrelation of standardised residuals, which have expectation 0 (no mean is subtracted: a
/// common offset of all residuals is correlation, too).
///
/// n_eff = n / (1 + 2 sum rho_k), the sum by Geyer's initial positive sequence (Geyer, Statistical
/// Science 7 (1992) 473: pairs rho_2m + rho_2m+1 as long as they are positive), rho_k with the
/// divisor n. The Ljung-Box test (Biometrika 65 (1978) 297) uses min(20, n / 5) lags; if it does
/// not reject, n_eff = n, so that independent noise keeps its exact thresholds. n_eff never exceeds
/// n. All lags come from one fast Fourier transform: n log n operations.
///
/// @param recordings each in the order of measurement, evenly spaced; products are pooled over
///        recordings and never reach from one into the next. Empty ones are allowed.
/// Throws Error(bad_input) for residuals that are not finite.
[[nodiscard]] Correlation residual_correlation(std::span<const std::span<const double>> recordings);
[[nodiscard]] Correlation residual_correlation(std::span<const double> recording);

/// Length of the blocks of a moving-block bootstrap of n readings in all: optimal for the variance
/// of a mean (Politis & White, Econometric Reviews 23 (2004) 53) under an autoregression of first
/// order with this integrated time: (1.5 n)^(1/3) ((tau - 1/tau) / 2)^(2/3), within 1 .. n / 2.
[[nodiscard]] std::size_t block_length(double integrated_time, std::size_t n);

}  // namespace tpm::fit
