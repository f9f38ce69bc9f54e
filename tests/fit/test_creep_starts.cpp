// Where the search for a law of creep begins.
#include <catch2/catch.hpp>

#include "creep_recordings.hpp"
#include "tpm/fit/select/imposed_channel.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::CreepTrial;

TEST_CASE("where the search of creep begins does not take the recovery, which costs most",
          "[creep]") {
  const CreepTrial trial{.noise = 6e-4};
  const PreparedRecording whole = prepare_recording("creep.csv", test::with_recovery(trial));
  const PreparedRecording load = prepare_recording("creep.csv", test::creep_recording_of(trial));
  REQUIRE(whole.load_imposed);
  REQUIRE(whole.to_s > load.to_s);
  SetupOptions setup;
  setup.starts = 4;
  for (const char* law : {"linear-1", "power-1"}) {
    CAPTURE(law);
    const FitConfig config =
        recording_config(parse_law_name(law, "test"), std::span(&whole, 1), setup);
    const auto starts = creep_starts(config, std::span(&whole, 1), setup);
    const auto of_load = creep_starts(config, std::span(&load, 1), setup);
    REQUIRE(!starts.empty());
    REQUIRE(starts.size() == of_load.size());
    for (std::size_t i = 0; i < starts.size(); ++i) {
      for (std::size_t k = 0; k < starts[i].size(); ++k) {
        CHECK_THAT(starts[i][k], WithinRel(of_load[i][k], 1e-6) || WithinAbs(of_load[i][k], 1e-12));
      }
    }
  }
}
