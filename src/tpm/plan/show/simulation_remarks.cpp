#include "tpm/plan/show/simulation_remarks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "tpm/base/text.hpp"

namespace tpm::plan {
namespace {

constexpr std::size_t kMostNamed = 12;

/// "71, 72 and 3 others"
std::string named(const std::vector<std::size_t>& spheres) {
  std::string text;
  for (std::size_t i = 0; i < std::min(spheres.size(), kMostNamed); ++i) {
    text += fmt::format("{}{}", i == 0 ? "" : ", ", spheres[i] + 1);
  }
  if (spheres.size() > kMostNamed)
    text += fmt::format(" and {} others", spheres.size() - kMostNamed);
  return text;
}

}  // namespace

std::vector<Remark> breach_remarks(const Validity& validity) {
  std::vector<Remark> remarks;
  for (std::size_t k = 0; k < kValidityLimits; ++k) {
    const auto limit = static_cast<ValidityLimit>(k);
    const ValidityBreach& breach = validity.of(limit);
    if (!breach.first_time_s) continue;
    remarks.push_back({std::string(key_of(limit)),
                       fmt::format("{}: from {} s on; sphere{} {}", words_of(limit),
                                   significant(*breach.first_time_s, 4),
                                   breach.spheres.size() == 1 ? "" : "s", named(breach.spheres))});
  }
  return remarks;
}

std::vector<Remark> contact_remarks(const SimulationRun& run) {
  if (!run.contact_check || !run.contact_check->depends_on_stiffness()) return {};
  return {{"depends_on_contact_stiffness",
           fmt::format("numbers of this run depend on the stiffness of its contacts, by {} % of "
                       "the largest; stiffen them",
                       significant(100.0 * run.contact_check->difference, 3))}};
}

std::vector<Remark> simulation_remarks(const SimulationRun& run) {
  std::vector<Remark> remarks = contact_remarks(run);
  std::ranges::move(breach_remarks(run.record.validity), std::back_inserter(remarks));
  return remarks;
}

}  // namespace tpm::plan
