#include "tpm/fit/validate/area_metric.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tpm/base/distributions.hpp"
#include "tpm/base/random.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

double density(double z) {
  return std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
}

/// Phi of the standard normal distribution without cancellation in either tail.
double phi(double z) {
  return 0.5 * std::erfc(-z / std::numbers::sqrt2);
}

/// Integral of Phi from -infinity to z.
double below(double z) {
  return z * phi(z) + density(z);
}

/// Integral of |Phi - level| from a to b.
double between(double a, double b, double level) {
  const auto integral = [level](double from, double to) {
    return below(to) - below(from) - level * (to - from);
  };
  const double low = phi(a), high = phi(b);
  if (high <= level) return -integral(a, b);
  if (low >= level) return integral(a, b);
  const double crossing = normal_quantile(level);
  return -integral(a, crossing) + integral(crossing, b);
}

/// Of sorted values against N(0, 1).
double standard_area_of(std::span<const double> sorted) {
  const auto n = static_cast<double>(sorted.size());
  double area = below(sorted.front()) + below(-sorted.back());
  for (std::size_t i = 0; i + 1 < sorted.size(); ++i) {
    area += between(sorted[i], sorted[i + 1], static_cast<double>(i + 1) / n);
  }
  return area;
}

std::vector<double> sorted_values(std::span<const double> values) {
  if (values.empty()) throw bad_input("area metric", "no values", "one or more");
  std::vector<double> sorted(values.begin(), values.end());
  for (const double value : sorted) {
    if (!std::isfinite(value)) throw bad_input("area metric", "a value that is not finite");
  }
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

double quantile_of(std::vector<double>& values, double share) {
  const auto place =
      static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

void set_interval(AreaMetric& metric, std::span<const double> z, Random& random) {
  constexpr std::size_t kFewest = 5;
  constexpr int kResamples = 1000;
  if (z.size() < kFewest) return;
  std::vector<double> areas;
  std::vector<double> resample(z.size());
  for (int k = 0; k < kResamples; ++k) {
    for (double& each : resample) each = z[random.below(z.size())];
    std::sort(resample.begin(), resample.end());
    areas.push_back(standard_area_of(resample));
  }
  metric.lower = quantile_of(areas, 0.025);
  metric.upper = quantile_of(areas, 0.975);
}

}  // namespace

double area_metric(std::span<const double> values, double mean, double sd) {
  std::vector<double> sorted = sorted_values(values);
  if (!std::isfinite(mean) || !std::isfinite(sd) || sd < 0.0) {
    throw bad_input("area metric", "a distribution that is not finite", "a mean and an sd >= 0");
  }
  if (sd == 0.0) {
    double sum = 0.0;
    for (const double value : sorted) sum += std::abs(value - mean);
    return sum / static_cast<double>(sorted.size());
  }
  for (double& value : sorted) value = (value - mean) / sd;
  return sd * standard_area_of(sorted);
}

double area_metric(std::span<const double> values, std::span<const double> others) {
  const std::vector<double> a = sorted_values(values), b = sorted_values(others);
  double area = 0.0, last = std::min(a.front(), b.front());
  std::size_t i = 0, j = 0;
  while (i < a.size() || j < b.size()) {
    const bool first = j == b.size() || (i < a.size() && a[i] <= b[j]);
    const double here = first ? a[i] : b[j];
    const double height = static_cast<double>(i) / static_cast<double>(a.size()) -
                          static_cast<double>(j) / static_cast<double>(b.size());
    area += std::abs(height) * (here - last);
    last = here;
    ++(first ? i : j);
  }
  return area;
}

AreaMetric standard_area(std::span<const double> z, const Eigen::MatrixXd& shared,
                         std::span<const double> own, std::uint64_t seed) {
  AreaMetric metric;
  metric.area = area_metric(z, 0.0, 1.0);
  constexpr int kDraws = 4000;
  Random random(seed);
  std::vector<double> areas;
  std::vector<double> drawn(z.size());
  Eigen::VectorXd zeta(shared.cols());
  int beyond = 0;
  for (int k = 0; k < kDraws; ++k) {
    for (double& each : zeta) each = random.normal();
    for (std::size_t j = 0; j < z.size(); ++j) {
      const auto row = shared.row(static_cast<Eigen::Index>(j));
      const double u = std::sqrt(row.squaredNorm() + own[j] * own[j]);
      drawn[j] = u > 0.0 ? (row.dot(zeta) + own[j] * random.normal()) / u : 0.0;
    }
    std::sort(drawn.begin(), drawn.end());
    areas.push_back(standard_area_of(drawn));
    beyond += areas.back() >= metric.area;
    metric.null_mean += areas.back() / kDraws;
  }
  metric.p_value = static_cast<double>(beyond) / kDraws;
  metric.null_95 = quantile_of(areas, 0.95);
  set_interval(metric, z, random);
  return metric;
}

}  // namespace tpm::fit
