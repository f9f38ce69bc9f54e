#pragma once
#include <array>
#include <complex>
#include <cstddef>

namespace tpm::law {

/// A function of one complex number with its derivative.
struct Analytic {
  std::complex<double> value;
  std::complex<double> slope;
};

/// (exp(z) - 1)/z, without cancellation near 0.
[[nodiscard]] inline Analytic mean_exponential(std::complex<double> z) {
  if (std::norm(z) > 0.25) {
    const std::complex<double> growth = std::exp(z);
    const std::complex<double> mean = (growth - 1.0) / z;
    return {mean, (growth - mean) / z};
  }
  Analytic sum{1.0, 0.0};
  for (int n = 16; n >= 2; --n) {  // 1 + z/2 (1 + z/3 (1 + ...))
    sum.slope = (sum.value + z * sum.slope) / static_cast<double>(n);
    sum.value = 1.0 + z * sum.value / static_cast<double>(n);
  }
  return sum;
}

/// v/sinh(v) for |v| < 0.15.
[[nodiscard]] inline Analytic inverse_sinhc(std::complex<double> v) {
  constexpr std::array<double, 6> kSeries{
      1.0, -1.0 / 6.0, 7.0 / 360.0, -31.0 / 15120.0, 127.0 / 604800.0, -73.0 / 3421440.0};
  const std::complex<double> square = v * v;
  Analytic sum{0.0, 0.0};
  for (std::size_t n = kSeries.size(); n-- > 0;) {
    sum.slope = sum.slope * square + sum.value;
    sum.value = sum.value * square + kSeries[n];
  }
  return {sum.value, 2.0 * v * sum.slope};
}

}  // namespace tpm::law
