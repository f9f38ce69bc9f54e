#include "tpm/organ/balance/resumed_run.hpp"

#include <fmt/format.h>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

void require_later(std::span<const double> times_s, double from_s) {
  for (const double time : times_s) {
    if (time >= from_s) continue;
    throw bad_input("times", fmt::format("{} s", shortest(time)),
                    fmt::format("times from {} s on, where the run begins", shortest(from_s)));
  }
}

void require_same_network(const QuasiStaticState& from, const BondSystem& bonds) {
  const auto spheres = static_cast<std::size_t>(from.position.cols());
  const auto rows = static_cast<std::size_t>(from.viscous.rows());
  const bool same_branches = from.viscous.cols() == bonds.most_branches();
  if (spheres == bonds.spheres() && rows == bonds.size() && same_branches) return;
  throw bad_input(
      "state",
      fmt::format("{} spheres and {} bonds of {} branches", spheres, rows, from.viscous.cols()),
      fmt::format("{}, {} and {}, as the network has", bonds.spheres(), bonds.size(),
                  bonds.most_branches()));
}

}  // namespace tpm::organ
