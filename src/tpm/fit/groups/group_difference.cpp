#include "tpm/fit/groups/group_difference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tpm/base/distributions.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// Mean of a group, its sum of weights, and the sum of weighted squares around it.
struct GroupMean {
  double mean = 0.0, weights = 0.0, squares = 0.0;
};

GroupMean mean_of(std::span<const SpecimenEstimate> group, double tau_squared) {
  const auto weight = [&](const SpecimenEstimate& s) {
    return 1.0 / (s.standard_error * s.standard_error + tau_squared);
  };
  GroupMean m;
  for (const SpecimenEstimate& s : group) {
    m.weights += weight(s);
    m.mean += weight(s) * s.estimate;
  }
  m.mean /= m.weights;
  for (const SpecimenEstimate& s : group) m.squares += weight(s) * std::pow(s.estimate - m.mean, 2);
  return m;
}

void require_group(std::span<const SpecimenEstimate> group, double level) {
  if (group.size() < 2) {
    throw bad_input("group",
                    fmt::format("{} specimen{}", group.size(), group.size() == 1 ? "" : "s"),
                    "at least two in each group: one says nothing about their spread");
  }
  if (!(level > 0.0 && level < 1.0)) {
    throw bad_input("group", fmt::format("a confidence level of {}", shortest(level)),
                    "a number between 0 and 1");
  }
  for (const SpecimenEstimate& s : group) {
    if (std::isfinite(s.estimate) && std::isfinite(s.standard_error) && s.standard_error > 0.0)
      continue;
    throw bad_input(fmt::format("specimen '{}'", s.name),
                    fmt::format("estimate {} with standard error {}", shortest(s.estimate),
                                shortest(s.standard_error)),
                    "a finite estimate and a positive standard error");
  }
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
  const GroupMean a = mean_of(first, d.tau_squared);
  const GroupMean b = mean_of(second, d.tau_squared);
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
