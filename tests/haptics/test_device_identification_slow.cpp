// How often the intervals of a device's friction hold, over devices.
#include <algorithm>
#include <catch2/catch.hpp>

#include "identified_handle.hpp"

namespace tpm::haptics {

using test::Handle;
using test::moved;

TEST_CASE(
    "Of devices at most 5 % have less viscous friction than the limit, or Coulomb's outside its "
    "interval") {
  int above = 0, outside = 0, tries = 0;
  double far = 0.0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Handle h;
    h.viscous_N_s_per_m = seed % 3 == 0 ? 0.1 : seed % 3 == 1 ? 0.5 : 1.0;
    h.coulomb_N = seed % 2 == 0 ? 0.03 : 0.0;
    h.force_late_s = 1e-3 * static_cast<double>(seed % 5);
    h.jitter_s = seed % 4 == 0 ? 0.5e-3 : 0.0;
    const DeviceIdentification found = identify_device(moved(h, seed), h.period_s);
    REQUIRE(found.viscous_lower_95_N_s_per_m);
    ++tries;
    if (*found.coulomb_low_N > h.coulomb_N || *found.coulomb_high_N < h.coulomb_N) ++outside;
    if (*found.viscous_lower_95_N_s_per_m > h.viscous_N_s_per_m) {
      ++above;
      far = std::max(far, *found.viscous_lower_95_N_s_per_m - h.viscous_N_s_per_m);
    }
  }
  CAPTURE(above, outside, tries, far);
  CHECK(above <= 3);
  CHECK(outside <= 3);
}
}  // namespace tpm::haptics
