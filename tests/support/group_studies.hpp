#pragma once
// Simulated studies of two groups of specimens: how often a difference is found, and how often its
// interval holds the true one. Used by tests/fit and tests/measure.
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <utility>
#include <vector>

#include "tpm/base/random.hpp"
#include "tpm/fit/groups/group_difference.hpp"

namespace tpm::test {

/// Estimates of the logarithm of a stiffness. Standard errors lie between `standard_error` divided
/// and multiplied by sqrt(unequal), evenly in their logarithm.
struct GroupDesign {
  int first = 3, second = 3;
  double spread = 0.05;  ///< tau: standard deviation between specimens
  double standard_error = 0.05;
  double unequal = 3.0;  ///< largest standard error over the smallest
  double difference = 0.0;
};

struct GroupCounts {
  int studies = 0;
  int found = 0;  ///< p below 5 %
  int held = 0;   ///< the 95 % interval holds the difference
};

inline GroupCounts group_counts(const GroupDesign& design, int studies, std::uint64_t seed) {
  base::Random random(seed);
  const auto group = [&](int count, double mean) {
    std::vector<fit::SpecimenEstimate> estimates;
    for (int i = 0; i < count; ++i) {
      const double error = design.standard_error * std::pow(design.unequal, random.uniform() - 0.5);
      const double estimate = mean + design.spread * random.normal() + error * random.normal();
      estimates.push_back({"specimen", estimate, error});
    }
    return estimates;
  };
  GroupCounts counts{studies};
  for (int i = 0; i < studies; ++i) {
    const auto first = group(design.first, 0.0);
    const auto second = group(design.second, design.difference);
    const fit::GroupDifference d = fit::group_difference(first, second);
    counts.found += d.p_value < 0.05 ? 1 : 0;
    counts.held +=
        d.interval.lower <= design.difference && design.difference <= d.interval.upper ? 1 : 0;
  }
  return counts;
}

/// Exact 95 % interval of a probability (Clopper and Pearson).
inline std::pair<double, double> exact_interval(int count, int trials) {
  using Law = boost::math::binomial;
  constexpr double kTail = 0.025;
  return {count == 0 ? 0.0 : Law::find_lower_bound_on_p(trials, count, kTail),
          count == trials ? 1.0 : Law::find_upper_bound_on_p(trials, count, kTail)};
}

}  // namespace tpm::test
