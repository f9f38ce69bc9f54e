#include "tpm/fit/groups/group_difference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tpm/base/distributions.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

void require_group(std::span<const SpecimenEstimate> group, double level) {
  require_estimates(group, level);
  if (group.size() > 1) return;
  throw bad_input("group", "one specimen",
                  "at least two in each group: one says nothing about their spread");
}

}  // namespace

GroupDifference group_difference(std::span<const SpecimenEstimate> first,
                                 std::span<const SpecimenEstimate> second, double level) {
  require_group(first, level);
  require_group(second, level);
  const std::array groups{std::vector(first.begin(), first.end()),
                          std::vector(second.begin(), second.end())};
  GroupDifference d;
  d.first = first.size();
  d.second = second.size();
  d.degrees = static_cast<double>(d.first + d.second - 2);
  d.tau_squared = restricted_tau_squared(groups);
  const WeightedMean a = weighted_mean(first, d.tau_squared);
  const WeightedMean b = weighted_mean(second, d.tau_squared);
  d.difference = b.mean - a.mean;
  const double scale = std::max(1.0, (a.squares + b.squares) / d.degrees);
  d.standard_error = std::sqrt(scale * (1.0 / a.weights + 1.0 / b.weights));
  const double half = student_quantile(0.5 * (1.0 + level), d.degrees) * d.standard_error;
  d.interval = {d.difference - half, d.difference + half};
  const double t = d.difference / d.standard_error;
  d.p_value = fisher_tail(t * t, 1.0, d.degrees);
  return d;
}

}  // namespace tpm::fit
