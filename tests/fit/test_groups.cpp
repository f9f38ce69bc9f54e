// Two groups of specimens: the difference of their means, and the command that compares folders.
#include <fmt/format.h>

#include <boost/math/distributions/students_t.hpp>
#include <catch2/catch.hpp>
#include <cmath>

#include "group_studies.hpp"
#include "run_in.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/groups/group_comparison.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

std::vector<SpecimenEstimate> estimates(const std::vector<double>& values, double standard_error) {
  std::vector<SpecimenEstimate> all;
  for (const double v : values) all.push_back({"s", v, standard_error});
  return all;
}

/// A rest of 2 s, a ramp and a hold: a stiffness of 60 N/m times a factor with a branch of 45 N/m
/// that relaxes in 2 s.
/// @param bend a force that grows with the square of the depth, which linear-1 does not have,
/// N/mm^2
std::string recording(double factor, double depth_mm, std::uint64_t seed, double bend = 0.0) {
  Random random(seed);
  std::string csv = "time [s],depth [mm],force [N]\n";
  for (int i = 0; i < 440; ++i) {
    const double t = std::max(0.05 * i - 2.0, 0.0), ramp = std::min(t, 2.0);
    const double v = depth_mm / 2.0;
    const double force = bend * std::pow(v * ramp, 2) + 0.060 * v * ramp +
                         0.045 * v * 2.0 * (std::exp((ramp - t) / 2.0) - std::exp(-t / 2.0));
    csv += fmt::format("{:.2f},{:.5f},{:.7f}\n", 0.05 * i, v * ramp,
                       factor * force + 2e-4 * random.normal());
  }
  return csv;
}

void write_group(const test::TempFolder& folder, const std::string& name,
                 const std::vector<double>& factors, double depth_mm, std::uint64_t seed) {
  std::filesystem::create_directories(folder.path() / name);
  for (std::size_t i = 0; i < factors.size(); ++i) {
    write_file(folder.path() / name / fmt::format("liver{}.csv", i + 1),
               recording(factors[i], depth_mm, seed + i));
  }
}

}  // namespace

TEST_CASE("With equal standard errors below the spread, two groups are Student's two-sample test",
          "[groups]") {
  const std::vector<double> a{0.1, 0.4, -0.2, 0.3}, b{0.9, 0.5, 1.1};
  const GroupDifference d = group_difference(estimates(a, 0.02), estimates(b, 0.02));
  const double mean_a = 0.15, mean_b = 2.5 / 3.0;
  double squares = 0.0;
  for (const double v : a) squares += (v - mean_a) * (v - mean_a);
  for (const double v : b) squares += (v - mean_b) * (v - mean_b);
  const double variance = squares / 5.0;
  const double error = std::sqrt(variance * (1.0 / 4.0 + 1.0 / 3.0));
  CHECK_THAT(d.difference, WithinRel(mean_b - mean_a, 1e-12));
  CHECK_THAT(d.tau_squared, WithinRel(variance - 0.02 * 0.02, 1e-6));
  CHECK_THAT(d.standard_error, WithinRel(error, 1e-6));
  CHECK(d.degrees == 5.0);
  const boost::math::students_t t(5.0);
  CHECK_THAT(d.p_value, WithinRel(2.0 * cdf(complement(t, d.difference / error)), 1e-5));
  CHECK_THAT(d.interval.upper, WithinRel(d.difference + quantile(t, 0.975) * error, 1e-6));
}

TEST_CASE("Groups that agree within their standard errors have no spread and no narrower interval",
          "[groups]") {
  const std::vector<SpecimenEstimate> a{{"a", 1.0, 0.1}, {"b", 1.01, 0.2}, {"c", 0.99, 0.3}};
  const std::vector<SpecimenEstimate> b{{"d", 1.5, 0.1}, {"e", 1.5, 0.1}};
  const GroupDifference d = group_difference(a, b);
  CHECK(d.tau_squared == 0.0);
  const double weights_a = 100.0 + 25.0 + 1.0 / 0.09, weights_b = 200.0;
  CHECK_THAT(d.standard_error, WithinRel(std::sqrt(1.0 / weights_a + 1.0 / weights_b), 1e-12));
  CHECK_THROWS_WITH(group_difference(a, std::span(b).first(1)), Contains("at least two"));
}

TEST_CASE("Groups that do not differ are found to differ in 5 % of studies at most", "[groups]") {
  for (const auto& [first, second] : {std::pair{3, 3}, {5, 10}}) {
    const test::GroupDesign design{first, second, 0.2, 0.2 / 3.0, 3.0, 0.3};
    const test::GroupCounts counts = test::group_counts(design, 1000, 7);
    CAPTURE(first, second, counts.held);
    CHECK(counts.held >=
          926);  // of 1,000 at 95 %: what a fair interval keeps but once in a thousand
    CHECK(counts.held <= 975);
  }
}

TEST_CASE("tpm fit A B --compare: the ratio of what differs, 1 for what does not", "[groups]") {
  const test::TempFolder folder;
  write_group(folder, "healthy", {0.9, 1.0, 1.1, 1.05}, 4.0, 1);
  write_group(folder, "fibrotic", {1.8, 2.0, 2.2, 2.1}, 4.0, 11);
  const test::ProgramRun run =
      test::run_in(folder,
                   "fit healthy fibrotic --compare --laws linear-1 --no-draw --punch-radius '2 mm' "
                   "--format json -o c.json");
  INFO(run.said);
  REQUIRE(run.code == 0);
  const Json j = read_json(folder / "c.json");
  for (const Json& p : j["parameters"]) {
    CAPTURE(p.dump());
    const bool time = p["name"] == "tau1";
    CHECK_THAT(p["ratio"].get<double>(), WithinRel(time ? 1.0 : 2.0, time ? 0.01 : 0.02));
    CHECK(p["ratio_interval"][0].get<double>() < (time ? 1.0 : 2.0));
    CHECK(p["ratio_interval"][1].get<double>() > (time ? 1.0 : 2.0));
    CHECK((p["p_value_holm"].get<double>() < 0.01) == !time);
  }
  REQUIRE(j["young_moduli"].size() == 3);  // E_inf, E1 and their sum
  CHECK(j["young_moduli"][2]["name"] == "E_instantaneous");
  CHECK_THAT(j["young_moduli"][2]["ratio"].get<double>(), WithinRel(2.0, 0.02));
  CHECK_THAT(j["conclusion"].get<std::string>(),
             Contains("fibrotic against healthy: a difference in k_inf, k1"));
  const test::ProgramRun text =
      test::run_in(folder, "fit healthy fibrotic --compare --laws linear-1 --folder out");
  INFO(text.said);
  CHECK(text.code == 0);
  CHECK_THAT(text.said, Contains("a difference in k_inf, k1 (Holm, 95 %); none is shown in tau1"));
  CHECK(std::ranges::count(text.said, '\n') <= 25);
  CHECK_THAT(text.said, !Contains("Hartung-Knapp") && Contains("next: tpm view out/figures.json"));
  const test::ProgramRun all =
      test::run_in(folder, "fit healthy fibrotic --compare --laws linear-1 --folder out --verbose");
  CHECK_THAT(all.said, Contains("modified Hartung-Knapp") && !Contains("more: --verbose"));
  CHECK(std::filesystem::exists(folder.path() / "out" / "comparison.svg"));
  CHECK_THAT(read_file(folder.path() / "out" / "specimens.csv"), Contains("fibrotic/liver4.csv"));
}

TEST_CASE("Groups that differ by their depths are refused, copies are no second specimen",
          "[groups]") {
  const test::TempFolder folder;
  write_group(folder, "a", {0.9, 1.0, 1.1}, 4.0, 1);
  write_group(folder, "b", {0.9, 1.0, 1.1}, 6.0, 11);
  const test::ProgramRun depths =
      test::run_in(folder, "fit a b --compare --laws linear-1 --no-draw");
  CHECK(depths.code == 3);
  CHECK_THAT(depths.said, Contains("depth and group are confounded"));
  std::filesystem::copy_file(folder.path() / "a" / "liver1.csv",
                             folder.path() / "a" / "liver9.csv");
  for (const char* command :
       {"fit a --laws linear-1 --no-draw", "fit a b --compare --laws linear-1 --no-draw"}) {
    const test::ProgramRun twice = test::run_in(folder, command);
    CAPTURE(command, twice.said);
    CHECK(twice.code == 3);
  }
  CHECK_THAT(test::run_in(folder, "fit a --laws linear-1 --no-draw").said,
             Contains("has the readings of 'a/liver1.csv'"));
  CHECK_THAT(test::run_in(folder, "fit a b").said, Contains("--compare"));
  CHECK_THAT(test::run_in(folder, "fit a --compare").said, Contains("two folders of recordings"));
  CHECK_THAT(test::run_in(folder, "fit a gone --compare").said,
             Contains("'gone' is no folder; expected two folders of recordings"));
  std::filesystem::create_directories(folder.path() / "fitted");
  write_file(folder.path() / "fitted" / "selection.json", "{}");
  CHECK_THAT(test::run_in(folder, "fit fitted").said,
             Contains("this folder was written by tpm fit") &&
                 Contains("tpm fit fitted/config.json fits again"));
}

TEST_CASE(
    "A difference between groups that the law does not describe is stated with that condition",
    "[groups]") {
  const test::TempFolder folder;
  write_group(folder, "a", {0.9, 1.0, 1.1}, 4.0, 1);
  write_group(folder, "b", {1.8, 2.0, 2.2}, 4.0, 11);
  write_file(folder.path() / "b" / "bent.csv", recording(2.1, 4.0, 21, 2e-3));
  const test::ProgramRun run = test::run_in(
      folder,
      "fit a b --compare --laws linear-1 --no-draw --punch-radius '2 mm' --format json -o c.json");
  INFO(run.said);
  REQUIRE(run.code == 0);
  const Json j = read_json(folder / "c.json");
  CHECK_THAT(j["conclusion"].get<std::string>(), Contains("if the law described every recording"));
  for (const char* list : {"parameters", "young_moduli"}) {
    for (const Json& q : j[list]) {
      CAPTURE(q.dump());
      CHECK(q.at("only_if_described") == true);
    }
  }
  CHECK_THAT(test::run_in(folder, "fit a b --compare --laws linear-1 --no-draw").said,
             Contains("only if the law described the data"));
}
