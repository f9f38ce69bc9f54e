// The hazards of --device inverse3 and of tpm hil serve: what ends them, and the largest force. How
// soon is measured (measure_inverse_hazards, reports/inverse/report.md).
#include <catch2/catch.hpp>

#include "inverse_hazards.hpp"

namespace tpm::haptics {

TEST_CASE("Each hazard of the Inverse service ends with its cause and without a larger force") {
  constexpr double kWatchdog_s = 1.0, kScheduling_s = 1e3;  // the machine may stall
  const auto rows = test::inverse_hazard_rows(kWatchdog_s, kScheduling_s);
  CHECK(rows.size() == 19);
  INFO(test::inverse_hazard_table(rows));
  for (const auto& row : rows) {
    CAPTURE(row.hazard);
    CHECK(row.as_expected());
    // A watchdog that waits does wait.
    if (row.hazard == "the loop hangs") CHECK(row.after_s >= 0.9 * kWatchdog_s);
  }
}

}  // namespace tpm::haptics
