// Where the search for a law of creep begins.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>

#include "creep_recordings.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/select/imposed_channel.hpp"
#include "tpmkit/law.hpp"

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

namespace {

/// Kelvin-Voigt of 10 kPa and 5 s under 1 kPa from 2 s to 62 s, and its recovery; 1 % noise.
Recording kelvin_voigt_of(std::uint64_t seed, double from_s = 0.0) {
  constexpr double kModulus_Pa = 10e3, kTime_s = 5.0, kStress_Pa = 1e3, kOn_s = 2.0, kOff_s = 62.0;
  const auto crept = [](double since) {
    return since > 0.0 ? 1.0 - std::exp(-since / kTime_s) : 0.0;
  };
  Recording r;
  r.header.id = "kelvin_voigt";
  r.drive_quantity = Quantity::strain;
  r.response_quantity = Quantity::stress;
  base::Random random(seed);
  for (int i = 0; i < 244; ++i) {
    const double t = 0.5 * i, largest = kStress_Pa / kModulus_Pa;
    const double noise = 0.01 * largest * random.normal();
    if (t < from_s) continue;
    r.time_s.push_back(t);
    r.drive.push_back(largest * (crept(t - kOn_s) - crept(t - kOff_s)) + noise);
    r.response.push_back(t >= kOn_s && t < kOff_s ? kStress_Pa : 0.0);
  }
  return r;
}

double fitted_k_inf(const FitConfig& config, const PreparedRecording& recording) {
  const FitResult fit = run_fit(config, data_sets(std::span(&recording, 1)));
  for (const ParameterResult& p : fit.parameters) {
    if (p.parameter.name == "k_inf") return p.estimate;
  }
  return 0.0;
}

}  // namespace

TEST_CASE("a solid that comes to rest under a held stress is fitted as creep", "[creep]") {
  for (const std::uint64_t seed : {1, 2, 3}) {
    CAPTURE(seed);
    const PreparedRecording recording = prepare_recording("kv.csv", kelvin_voigt_of(seed));
    REQUIRE(recording.load_imposed);
    SetupOptions setup;
    setup.profiles = false;
    const FitConfig config =
        recording_config(parse_law_name("linear-1", "test"), std::span(&recording, 1), setup);
    CHECK_THAT(fitted_k_inf(config, recording), WithinRel(10e3, 0.02));
  }
}

TEST_CASE("a search that is sent astray by its given start begins elsewhere, too", "[creep]") {
  const PreparedRecording recording = prepare_recording("kv.csv", kelvin_voigt_of(1));
  SetupOptions setup;
  setup.profiles = false;
  FitConfig config =
      recording_config(parse_law_name("linear-1", "test"), std::span(&recording, 1), setup);
  std::vector<double> astray;
  for (const EstimatedParameter& p : config.parameters) astray.push_back(p.fit.upper);
  config.given_starts = {astray};
  CHECK_THAT(fitted_k_inf(config, recording), WithinRel(10e3, 0.02));
}

TEST_CASE("creep that is recorded from after its load on is refused as such", "[creep]") {
  using Catch::Contains;
  CHECK_THROWS_WITH(prepare_recording("kv.csv", kelvin_voigt_of(1, 2.0)),
                    Contains("creep without the samples before its load") &&
                        Contains("one row without a stress"));
}
