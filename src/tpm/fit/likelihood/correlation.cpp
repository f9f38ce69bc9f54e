#include "tpm/fit/likelihood/correlation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

#include "tpm/base/distributions.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr double kSignificance = 0.01;

void require_finite(std::span<const std::span<const double>> recordings) {
  for (const auto& recording : recordings) {
    for (const double r : recording) {
      if (std::isfinite(r)) continue;
      throw bad_input("residuals", "a residual is not a finite number", "finite residuals");
    }
  }
}

/// sum of r_i r_(i+k) over all recordings for every k below the longest length.
std::vector<double> lagged_products(std::span<const std::span<const double>> recordings,
                                    std::size_t longest) {
  // Padded to twice its length a recording does not wrap around onto itself.
  const std::size_t size = std::bit_ceil(2 * longest);
  Eigen::FFT<double> fft;
  std::vector<std::complex<double>> power(size);
  std::vector<std::complex<double>> spectrum;
  std::vector<double> padded(size);
  for (const auto& recording : recordings) {
    std::fill(std::copy(recording.begin(), recording.end(), padded.begin()), padded.end(), 0.0);
    fft.fwd(spectrum, padded);
    for (std::size_t i = 0; i < size; ++i) power[i] += std::norm(spectrum[i]);
  }
  fft.inv(padded, power);
  padded.resize(longest);
  return padded;
}

/// 1 + 2 sum rho_k by Geyer's initial positive sequence.
double integrated_time(const std::vector<double>& rho) {
  double sum = 0.0;
  for (std::size_t k = 0; k < rho.size(); k += 2) {
    const double pair = rho[k] + (k + 1 < rho.size() ? rho[k + 1] : 0.0);
    if (!(pair > 0.0)) break;
    sum += pair;
  }
  return 2.0 * sum - 1.0;
}

/// Number of products r_i r_(i+k).
std::size_t pairs(std::span<const std::span<const double>> recordings, std::size_t lag) {
  std::size_t count = 0;
  for (const auto& r : recordings) count += r.size() > lag ? r.size() - lag : 0;
  return count;
}

double ljung_box_p(std::span<const std::span<const double>> recordings,
                   const std::vector<double>& rho, std::size_t n, std::size_t lags) {
  double q = 0.0;
  const auto count = static_cast<double>(n);
  for (std::size_t k = 1; k <= lags; ++k) {
    // For one recording there are n - k pairs, and this is n (n + 2) rho^2 / (n - k).
    q += count * (count + 2.0) * rho[k] * rho[k] / static_cast<double>(pairs(recordings, k));
  }
  return chi_squared_tail(q, static_cast<double>(lags));
}

std::string correlation_words(const Correlation& c) {
  if (c.ljung_box_lags == 0) {
    return fmt::format("{} residuals are too few to test for correlation", c.count);
  }
  const std::string p = significant(c.ljung_box_p, 2);
  if (!c.significant) {
    return fmt::format("the {} residuals are compatible with independence (Ljung-Box p = {})",
                       c.count, p);
  }
  if (c.effective_count == static_cast<double>(c.count)) {
    return fmt::format("neighbouring residuals alternate (lag-1 correlation {}, Ljung-Box p = {})",
                       significant(c.lag1, 2), p);
  }
  return fmt::format(
      "neighbouring residuals repeat each other (lag-1 correlation {}, Ljung-Box p = {}): {} "
      "readings count as {} independent ones",
      significant(c.lag1, 2), p, c.count, significant(c.effective_count, 3));
}

}  // namespace

double Correlation::inflation() const {
  return effective_count > 0.0 ? static_cast<double>(count) / effective_count : 1.0;
}

Correlation residual_correlation(std::span<const std::span<const double>> recordings) {
  require_finite(recordings);
  Correlation c;
  std::size_t longest = 0;
  for (const auto& r : recordings) {
    c.count += r.size();
    longest = std::max(longest, r.size());
  }
  c.effective_count = static_cast<double>(c.count);
  const std::size_t most_lags = std::min<std::size_t>(20, c.count / 5);
  const std::size_t lags = longest > 1 ? std::min(most_lags, longest - 1) : 0;
  std::vector<double> rho =
      longest > 1 ? lagged_products(recordings, longest) : std::vector<double>();
  if (lags > 0 && rho[0] > 0.0) {
    const double variance = rho[0];
    for (double& r : rho) r /= variance;
    c.lag1 = rho[1];
    c.integrated_time = integrated_time(rho);
    c.ljung_box_p = ljung_box_p(recordings, rho, c.count, lags);
    c.significant = c.ljung_box_p < kSignificance;
  }
  c.ljung_box_lags = static_cast<int>(lags);
  if (c.significant) c.effective_count /= std::max(c.integrated_time, 1.0);
  c.effective_count = std::max(c.effective_count, std::min(1.0, static_cast<double>(c.count)));
  c.summary = correlation_words(c);
  return c;
}

Correlation residual_correlation(std::span<const double> recording) {
  return residual_correlation(std::span<const std::span<const double>>(&recording, 1));
}

std::size_t block_length(double integrated_time, std::size_t n) {
  const double tau = std::max(integrated_time, 1.0);
  const double length =
      std::cbrt(1.5 * static_cast<double>(n)) * std::pow(0.5 * (tau - 1.0 / tau), 2.0 / 3.0);
  const std::size_t longest = std::max<std::size_t>(n / 2, 1);
  return static_cast<std::size_t>(std::clamp(std::ceil(length), 1.0, static_cast<double>(longest)));
}

}  // namespace tpm::fit
