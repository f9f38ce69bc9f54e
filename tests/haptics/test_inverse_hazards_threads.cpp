// The hazards of --device inverse3 and of tpm hil serve, each within its bounds (docs/safety.md).
#include <catch2/catch.hpp>

#include "inverse_hazards.hpp"

namespace tpm::haptics {

TEST_CASE("No hazard of the Inverse service leaves its bounds") {
  const auto rows = test::inverse_hazard_rows();
  CHECK(rows.size() == 19);
  INFO(test::inverse_hazard_table(rows));
  for (const auto& row : rows) {
    CAPTURE(row.hazard);
    CHECK(row.within());
  }
}

}  // namespace tpm::haptics
