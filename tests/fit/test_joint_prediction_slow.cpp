// The same as test_joint_prediction.cpp for the whole family of laws.
#include <catch2/catch.hpp>

#include "joint_recordings.hpp"
#include "tpm/fit/select/selection.hpp"

using namespace tpm;
using namespace tpm::fit;

TEST_CASE("every law predicts its own recordings as they were fitted", "[predict][joint][slow]") {
  const auto drive =
      GENERATE(Quantity::indentation_depth, Quantity::strain, Quantity::relative_length);
  const int count = GENERATE(1, 2, 4);
  std::vector<LawSpec> laws = classical_family();
  for (const LawSpec& law : fractional_family()) laws.push_back(law);
  for (const LawSpec& law : laws) {
    const bool contact = drive == Quantity::indentation_depth;
    if (!contact && law.kernel == Kernel::hertz) continue;
    if (drive == Quantity::strain && law.tension != Tension::none) continue;
    test::check_predicted_as_fitted(law_name(law), drive, count, false);
  }
}
