#include "tpm/law/relaxation/fractional_branches.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/relaxation/mittag_leffler.hpp"
#include "tpm/law/relaxation/nonnegative.hpp"
#include "tpmkit/error.hpp"

namespace tpm::law {
namespace {

constexpr double kFittedPerDecade = 40.0, kComparedPerDecade = 97.0;
constexpr int kMostPerDecade = 12;
constexpr double kBeyond = 10.0;  // times outside of the window, as factors
constexpr double kSumWeight = 1e3;
constexpr double kBranchShare = 1e-3;  // of the error: a share that is rounding

double relaxation(double alpha, double tau_s, double t_s) {
  return mittag_leffler(alpha, 1.0, std::pow(t_s / tau_s, alpha));
}

/// Evenly spaced in the logarithm, both ends among them.
std::vector<double> times_within(const FractionalWindow& window, double per_decade) {
  const double decades = std::log10(window.longest_s / window.shortest_s);
  const auto count = static_cast<std::size_t>(std::ceil(decades * per_decade)) + 2;
  std::vector<double> times;
  for (std::size_t i = 0; i < count; ++i) {
    const double at = static_cast<double>(i) / static_cast<double>(count - 1);
    times.push_back(window.shortest_s * std::pow(10.0, decades * at));
  }
  return times;
}

/// Relaxation times around tau, so many in a decade, that cover the window.
std::vector<double> candidates(double tau_s, const FractionalWindow& window, int per_decade) {
  const double low = std::log10(window.shortest_s / kBeyond / tau_s) * per_decade;
  const double high = std::log10(window.longest_s * kBeyond / tau_s) * per_decade;
  const auto first = static_cast<int>(std::ceil(std::min(low, 0.0)));
  const auto last = static_cast<int>(std::floor(std::max(high, 0.0)));
  std::vector<double> times;
  for (int k = first; k <= last; ++k) {
    if (k != 0 && (k < low || k > high)) continue;
    times.push_back(tau_s * std::pow(10.0, static_cast<double>(k) / per_decade));
  }
  return times;
}

FractionalBranches fitted(double alpha, double tau_s, const FractionalWindow& window,
                          const std::vector<double>& times) {
  const std::vector<double> at = times_within(window, kFittedPerDecade);
  const auto rows = static_cast<Eigen::Index>(at.size());
  const auto columns = static_cast<Eigen::Index>(times.size());
  Eigen::MatrixXd a(rows + 1, columns + 1);
  Eigen::VectorXd b(rows + 1);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = at[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < columns; ++j) {
      a(i, j) = std::exp(-t / times[static_cast<std::size_t>(j)]);
    }
    a(i, columns) = 1.0;
    b[i] = relaxation(alpha, tau_s, t);
  }
  a.row(rows).setConstant(kSumWeight);
  b[rows] = kSumWeight;
  Eigen::VectorXd share = nonnegative_least_squares(a, b);
  for (double& s : share) s = s > kBranchShare * window.error ? s : 0.0;
  const double sum = share.sum();
  FractionalBranches found;
  found.constant = share[columns] / sum;
  for (Eigen::Index j = 0; j < columns; ++j) {
    if (share[j] > 0.0) {
      found.branches.push_back({share[j] / sum, times[static_cast<std::size_t>(j)]});
    }
  }
  for (const double t : times_within(window, kComparedPerDecade)) {
    double value = found.constant;
    for (const auto& [weight, time] : found.branches) value += weight * std::exp(-t / time);
    found.error = std::max(found.error, std::abs(value - relaxation(alpha, tau_s, t)));
  }
  return found;
}

}  // namespace

FractionalBranches fractional_branches(double alpha, double tau_s, const FractionalWindow& window,
                                       std::size_t most) {
  const auto require = [](bool good, const char* what, double got, const char* expected) {
    if (!good)
      throw bad_input("fractional branch", fmt::format("{} {}", what, shortest(got)), expected);
  };
  require(alpha > 0.0 && alpha <= 1.0, "order", alpha, "above 0, at most 1");
  require(tau_s > 0.0 && std::isfinite(tau_s), "tau in s", tau_s, "above 0");
  require(window.shortest_s > 0.0, "shortest time in s", window.shortest_s, "above 0");
  require(window.longest_s > window.shortest_s && window.longest_s <= 1e12 * window.shortest_s,
          "longest time in s", window.longest_s, "above the shortest, at most 1e12 times it");
  require(window.error >= 1e-6 && window.error <= 0.1, "error", window.error, "1e-6 to 0.1");
  double best = std::numeric_limits<double>::infinity();
  for (int per_decade = 1; per_decade <= kMostPerDecade; ++per_decade) {
    FractionalBranches found = fitted(alpha, tau_s, window, candidates(tau_s, window, per_decade));
    if (found.branches.size() > most) continue;
    if (found.error <= window.error) return found;
    best = std::min(best, found.error);
  }
  throw bad_input("fractional branch",
                  fmt::format("an error of {} takes more than {} exponentials, which reach {}",
                              shortest(window.error), most, significant(best, 2)),
                  "a larger error or a shorter window");
}

}  // namespace tpm::law
