// tpm accuracy verify: the groups that take longer.
#include <catch2/catch.hpp>
#include <ctime>

#include "tpm/accuracy/verify/verification.hpp"

using namespace tpm;
using namespace tpm::accuracy;

TEST_CASE("verification: orders and reductions hold, and fail with a wrong coefficient") {
  for (const std::string group : {"orders", "reduction"}) {
    const std::vector<std::string> names{group};
    for (const double flaw : {0.0, 0.01}) {
      for (const VerificationRow& row : run_verification(chosen_groups(names), flaw).rows) {
        CAPTURE(row.what, row.quantity, row.measured, row.expected, row.tolerance, row.failure,
                flaw);
        CHECK(row.holds() == (flaw == 0.0));
      }
    }
  }
}

TEST_CASE("verification: everything takes at most two minutes of one processor") {
  const std::clock_t start = std::clock();
  const VerificationRun all = run_verification(verification_groups(), 0.0);
  const double processor_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  CHECK(all.rows.size() > 100);
  CHECK(all.failed() == 0);
  CHECK(processor_s < 120.0);
}
