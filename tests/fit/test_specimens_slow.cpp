// Folders of recordings: how often the test of spread between specimens rejects what is not there.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <map>

#include "tpm/base/random.hpp"
#include "tpm/fit/design/coverage.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;

namespace {

constexpr double kLevel = 0.95;
constexpr double kTest = 1e-3;  // level of the exact binomial tests

LawSpec quadratic_law() {
  LawSpec spec = parse_law_name("power-1", "test");
  spec.reference = 4e-3;
  return spec;
}

/// Rest 0.5 mm above the specimen, ramp at 2 mm/s, hold until 9 s after the rest.
Recording clean_recording(double depth_m, double rest_s) {
  constexpr double kAbove_m = 0.5e-3, kAfter_s = 9.0, kPeriod_s = 0.06;
  Recording r;
  for (int i = 0; kPeriod_s * i < rest_s + kAfter_s; ++i) {
    r.time_s.push_back(kPeriod_s * i);
    r.drive.push_back(std::clamp(2e-3 * (r.time_s.back() - rest_s), 0.0, depth_m + kAbove_m));
  }
  const std::vector<double> values{100.0, 120.0, 2.0, 2.0, kAbove_m, 0.0};
  const Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  const Eigen::VectorXd f =
      LawModel(quadratic_law()).respond(history, r.time_s, values, Want::values).value;
  r.response.assign(f.begin(), f.end());
  return r;
}

Recording with_noise(Recording r, Random& random) {
  const double peak = *std::max_element(r.response.begin(), r.response.end());
  for (double& force : r.response) force += 2e-3 * peak * random.normal();
  return r;
}

}  // namespace

namespace {

/// Of folders of one material, by parameter: how often the test of spread rejects, and of how many.
std::map<std::string, std::pair<int, int>> spread_rejections(double rest_s, int folders) {
  std::vector<Recording> clean;
  for (const double depth_mm : {2.0, 3.0, 4.5, 6.0, 8.0}) {
    clean.push_back(clean_recording(1e-3 * depth_mm, rest_s));
  }
  SelectionOptions options;
  options.setup.profiles = false;
  Random random(20261123);
  std::map<std::string, std::pair<int, int>> counts;
  for (int folder = 0; folder < folders; ++folder) {
    std::vector<PreparedRecording> recordings;
    for (const Recording& r : clean) {
      recordings.push_back(
          prepare_recording(fmt::format("{}.csv", recordings.size()), with_noise(r, random)));
    }
    const SpecimenStudy study = study_specimens(recordings, quadratic_law(), options);
    for (const PooledParameter& p : study.pooled) {
      if (p.effects.specimens != clean.size()) continue;
      auto& [rejected, tested] = counts[p.parameter.name];
      ++tested;
      rejected += *p.effects.q_p_value < 1.0 - kLevel ? 1 : 0;
    }
  }
  return counts;
}

}  // namespace

TEST_CASE("folders of unequal depths: the test of spread rejects as often as it says") {
  constexpr int kFolders = 160;
  constexpr double kTellsDrift_s = 6.0;
  const auto counts = spread_rejections(kTellsDrift_s, kFolders);
  REQUIRE(counts.size() == 4);
  for (const auto& [name, count] : counts) {
    const auto [rejected, tested] = count;
    const double p = binomial_test(rejected, tested, 1.0 - kLevel);
    INFO(name << ": " << rejected << " of " << tested << " rejected, exact binomial p = " << p);
    CHECK(tested > kFolders * 9 / 10);
    CHECK(p > kTest);
  }
}

TEST_CASE("what a drift may be is no spread of specimens") {
  constexpr int kFolders = 60;
  constexpr double kTellsNoDrift_s = 0.5;
  const auto counts = spread_rejections(kTellsNoDrift_s, kFolders);
  REQUIRE(counts.size() == 4);
  for (const auto& [name, count] : counts) {
    const auto [rejected, tested] = count;
    INFO(name << ": " << rejected << " of " << tested << " rejected");
    CHECK(tested > kFolders * 9 / 10);
    CHECK((rejected < (1.0 - kLevel) * tested ||
           binomial_test(rejected, tested, 1.0 - kLevel) > kTest));
  }
}

TEST_CASE("repeats: the test of spread rejects as often as it says, however much repeats differ") {
  constexpr int kStudies = 500;
  Random random(7);
  for (const double rho : {0.0, 1.0, 5.0}) {
    int rejected = 0;
    int found = 0;
    for (int study = 0; study < kStudies; ++study) {
      std::vector<SpecimenEstimate> same, unlike;
      for (int specimen = 0; specimen < 5; ++specimen) {
        const double own = 5.0 * (1.0 + rho) * random.normal();
        for (int repeat = 0; repeat < 3; ++repeat) {
          const double y = random.normal() + rho * random.normal();
          const std::string group = fmt::format("s{}", specimen);
          same.push_back({fmt::format("{}{}", group, repeat), y, 1.0, group});
          unlike.push_back({fmt::format("{}{}", group, repeat), y + own, 1.0, group});
        }
      }
      rejected += *random_effects_of_repeats(same).q_p_value < 1.0 - kLevel ? 1 : 0;
      found += *random_effects_of_repeats(unlike).q_p_value < 1.0 - kLevel ? 1 : 0;
    }
    INFO("rho " << rho << ": " << rejected << " of " << kStudies << " rejected");
    CHECK(binomial_test(rejected, kStudies, 1.0 - kLevel) > kTest);
    CHECK(found > kStudies * 9 / 10);
  }
}
