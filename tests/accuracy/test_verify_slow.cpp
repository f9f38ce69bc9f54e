// tpm accuracy verify: the groups that take longer.
#include <catch2/catch.hpp>
#include <chrono>

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

TEST_CASE("verification: everything takes at most two minutes") {
  const auto start = std::chrono::steady_clock::now();
  const VerificationRun all = run_verification(verification_groups(), 0.0);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  CHECK(all.rows.size() > 100);
  CHECK(all.failed() == 0);
  CHECK(took.count() < 120.0);
}
