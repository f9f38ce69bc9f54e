// Creep under a kept load at many times, which is interpolated, against the same at few, which is
// not.
#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/law/kept_load_table.hpp"
#include "tpm/law/relaxation.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::law;

namespace {

constexpr double kLoad_N = 0.03;  // N

std::vector<double> values_of(const LawModel& law) {
  std::vector<double> values;
  for (const LawParameter& p : law.law_parameters()) {
    values.push_back(p.name == "exponent"  ? 1.6
                     : p.name == "alpha"   ? 0.55
                     : p.name == "beta"    ? 0.15
                     : p.name == "tau1"    ? 0.7
                     : p.name == "tau2"    ? 40.0
                     : p.name == "k_inf"   ? 15.0
                     : p.name == "contact" ? 1e-4
                     : p.name == "offset"  ? 2e-3
                                           : 40.0);
  }
  return values;
}

const Protocol& kept() {
  static const Protocol protocol(Drive::force, {{0.0, kLoad_N}}, "kept", true);
  return protocol;
}

constexpr const char* kKeptLoadLaws[] = {
    "linear-1",         "linear-2",       "linear-2-fluid",
    "power-2",          "hertz-1",        "linear-fspringpot",
    "linear-fmaxwell",  "linear-fzener",  "linear-fkelvin_voigt2",
    "linear-fmaxwell2", "linear-fzener2", "power-fspringpot",
    "linear-1-elastic"};

}  // namespace

TEST_CASE("Creep at many times is that at few", "[law]") {
  std::vector<double> times{0.0};
  constexpr int kCount = 3000;
  for (int i = 0; i < kCount; ++i) times.push_back(1e-4 * std::pow(1e8, i / (kCount - 1.0)));
  REQUIRE(KeptLoadTable::covering(kept(), times));
  for (const char* name : kKeptLoadLaws) {
    INFO(name);
    const LawModel law(parse_law_name(name, "test"));
    const std::vector<double> values = values_of(law);
    const Response many = law.respond(kept(), times, values, Want::values_and_sensitivity);
    constexpr std::size_t kFew = 25;
    double value_error = 0.0, slope_error = 0.0;
    const Eigen::RowVectorXd largest = many.sensitivity.cwiseAbs().colwise().maxCoeff();
    for (std::size_t first = 0; first < times.size(); first += 10 * kFew) {
      const std::span<const double> part =
          std::span(times).subspan(first, std::min(kFew, times.size() - first));
      REQUIRE_FALSE(KeptLoadTable::covering(kept(), part));
      const Response few = law.respond(kept(), part, values, Want::values_and_sensitivity);
      for (Eigen::Index i = 0; i < few.value.size(); ++i) {
        const Eigen::Index row = static_cast<Eigen::Index>(first) + i;
        value_error = std::max(value_error,
                               std::abs(many.value[row] - few.value[i]) / std::abs(few.value[i]));
        for (Eigen::Index j = 0; j < largest.size(); ++j) {
          if (!(largest[j] > 0.0)) continue;
          slope_error = std::max(
              slope_error, std::abs(many.sensitivity(row, j) - few.sensitivity(i, j)) / largest[j]);
        }
      }
    }
    // With elastic tension creep is solved to a tolerance, at few times as at many.
    const double own = law.spec().tension == Tension::elastic ? 100.0 : 1.0;
    CHECK(value_error < 1e-10 * own);
    CHECK(slope_error < 1e-9 * own);
  }
}

TEST_CASE("A kept depth and a moved load are not tabulated", "[law]") {
  std::vector<double> times;
  for (int i = 1; i <= 5000; ++i) times.push_back(0.01 * i);
  CHECK(KeptLoadTable::covering(kept(), times));
  const Protocol depth(Drive::displacement, {{0.0, 1e-3}}, "depth", true);
  CHECK_FALSE(KeptLoadTable::covering(depth, times));
  const Protocol ramp(Drive::force, {{0.0, 0.0}, {1.0, kLoad_N}}, "ramp", true);
  CHECK_FALSE(KeptLoadTable::covering(ramp, times));
  times.push_back(-1.0);
  CHECK_FALSE(KeptLoadTable::covering(kept(), times));
}

TEST_CASE("A spring-pot yields nothing at once, a spring in its series all that it has", "[law]") {
  const std::vector<double> at_once{0.0};
  const auto drive_at_once = [&](const char* name) {
    const LawModel law(parse_law_name(name, "test"));
    std::vector<double> values = values_of(law);
    values[law.index("offset")] = values[law.index("contact")] = 0.0;
    return law.respond(kept(), at_once, values, Want::values_and_sensitivity).value[0];
  };
  CHECK(drive_at_once("linear-fspringpot") == 0.0);
  CHECK(drive_at_once("linear-fkelvin_voigt") == 0.0);
  CHECK(drive_at_once("linear-fmaxwell2") == 0.0);
  CHECK(drive_at_once("power-fspringpot") == 0.0);
  CHECK(drive_at_once("linear-fmaxwell") == Approx(kLoad_N / 40.0).epsilon(1e-15));
  CHECK(drive_at_once("linear-fzener") == Approx(kLoad_N / 55.0).epsilon(1e-15));
}
