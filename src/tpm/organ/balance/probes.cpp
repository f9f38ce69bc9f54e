// Declared in tpm/organ/balance/quasistatic.hpp.
#include <fmt/format.h>

#include <cmath>
#include <set>

#include "tpm/base/text.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

Probes::Probes(std::vector<Probe> all) : all_(std::move(all)) {
  if (all_.empty()) throw bad_input("probe", "there is none", "a sphere or a tool to be driven");
}

void require_valid(const Probe& probe, const Constraints& constraints) {
  if (!(probe.share > 0.0 && std::isfinite(probe.share))) {
    throw bad_input("probe", fmt::format("a share of {}", shortest(probe.share)), "above 0");
  }
  if (probe.sphere >= constraints.size()) {
    throw bad_input("probe", fmt::format("sphere {}", probe.sphere + 1),
                    fmt::format("a sphere from 1 to {}", constraints.size()));
  }
  const Eigen::Vector3d free = constraints.projector(probe.sphere) * probe.direction;
  if (std::abs(free.norm() - 1.0) > 1e-9) {
    throw bad_input("probe", fmt::format("sphere {} is fixed", probe.sphere + 1),
                    "a sphere that is free to move along the direction of the probe");
  }
}

void require_valid(const Probes& probes, const Constraints& constraints) {
  std::set<std::size_t> driven;
  for (const Probe& probe : probes) {
    require_valid(probe, constraints);
    if (driven.insert(probe.sphere).second) continue;
    throw bad_input("probe", fmt::format("sphere {} is driven twice", probe.sphere + 1),
                    "each sphere once");
  }
}

}  // namespace tpm::organ
