// A smaller part of tests/measure/validation.cpp: how often tpm validate is right, by simulation.
#include <fmt/format.h>
#include <sys/wait.h>

#include <catch2/catch.hpp>
#include <cstdlib>

#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"
#include "validation_studies.hpp"

namespace tpm::fit {
namespace {

int exit_code_in(const test::TempFolder& folder, const std::string& arguments) {
  const int status = std::system(fmt::format("cd '{}' && '" TPM_TEST_PROGRAM "' {} > said 2>&1",
                                             folder.path().string(), arguments)
                                     .c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void write_table(const std::string& file, const Recording& r) {
  std::string text = "time [s],depth [mm],force [N]\n";
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    text += fmt::format("{:.4f},{:.6f},{:.9f}\n", r.time_s[i], 1e3 * r.drive[i], r.response[i]);
  }
  write_file(file, text);
}

}  // namespace

TEST_CASE("the example of the help runs, and its page finds what changed", "[validate]") {
  const test::TempFolder folder;
  Random random(5);
  test::StudyNoise noise;
  noise.sigma_N = 5e-4;
  write_table(folder / "recording.csv", test::study_recording({}, noise, random));
  const test::StudyTest protocol = test::study_validation(100, 0.0);
  write_table(folder / "other.csv", test::study_recording(protocol, noise, random));
  REQUIRE(exit_code_in(folder, "fit recording.csv --folder fitted") == 0);
  const std::string validate = "validate fitted/law.json other.csv --require 10%";
  CHECK(exit_code_in(folder, validate + " --folder validated --credibility page.html") == 0);
  CHECK_THAT(read_file(folder / "said"), Catch::Matchers::Contains("adequate for 10%"));
  for (const char* file :
       {"validation.csv", "validation.json", "validation_error.png", "validation_motion.png"}) {
    CHECK(std::filesystem::exists(folder / (std::string("validated/") + file)));
  }
  CHECK(read_json(folder / "validated/validation.json").at("verdict") == "adequate");
  // On a narrow screen every table of the page with a SHA-256 stacks.
  const std::string credible = read_file(folder / "page.html");
  CHECK_THAT(credible, Catch::Matchers::Contains("data-title=\"standard uncertainty\"") &&
                           Catch::Matchers::Contains("data-title=\"SHA-256\"") &&
                           Catch::Matchers::Contains("overflow-wrap: anywhere"));
  // Recordings of one protocol are one line of the figure, with how many they are.
  write_table(folder / "again.csv", test::study_recording(protocol, noise, random));
  CHECK(exit_code_in(folder, "validate fitted/law.json other.csv again.csv --folder two") == 0);
  std::vector<std::string> labels;
  const Json figures = read_json(folder / "two/figures.json");
  for (const Json& series : figures["figures"][1]["panels"][0]["series"]) {
    labels.push_back(series.at("label"));
  }
  CHECK(labels == std::vector<std::string>{"calibration", "other.csv and 1 of its protocol",
                                           "other.csv and 1 of its protocol",
                                           "deepest of the calibration"});
  CHECK(exit_code_in(folder, "validate --recheck page.html") == 0);
  // Another recording under the same name.
  write_table(folder / "other.csv", test::study_recording(protocol, noise, random, 1.3));
  CHECK(exit_code_in(folder, "validate --recheck page.html") == 1);
  const std::string page = read_file(folder / "page_rechecked.html");
  CHECK_THAT(page, Catch::Matchers::Contains("Changed since this page was written") &&
                       Catch::Matchers::Contains("class=\"bad\""));
  CHECK(exit_code_in(folder, validate) == 1);
  // The law's own data validate nothing.
  CHECK(exit_code_in(folder, "validate fitted/law.json recording.csv --require 10%") == 1);
  CHECK_THAT(read_file(folder / "said"), Catch::Matchers::Contains("calibration residual"));
  CHECK(exit_code_in(folder, "validate fitted/law.json other.csv --require much") == 2);
}

TEST_CASE("a credibility page names what was tampered with, is missing or changed", "[validate]") {
  const test::TempFolder folder;
  Random random(6);
  test::StudyNoise noise;
  noise.sigma_N = 5e-4;
  write_table(folder / "recording.csv", test::study_recording({}, noise, random));
  const test::StudyTest protocol = test::study_validation(100, 0.0);
  write_table(folder / "other.csv", test::study_recording(protocol, noise, random));
  write_file(folder / "cell.json",
             R"({"instrument": {"id": "cell", "force": "0.5 % of reading"}})");
  write_file(folder / "checks.json", "{}");
  REQUIRE(exit_code_in(folder, "fit recording.csv --folder fitted") == 0);
  REQUIRE(exit_code_in(
              folder,
              "validate fitted/law.json other.csv --require 10% --placement onset --quantity peak "
              "--quantity end --instrument cell.json --evidence 'code verification=checks.json' "
              "--question 'Stiff?' --context training --risk low --credibility page.html") == 0);
  const std::string page = read_file(folder / "page.html");
  for (const char* shown : {"Stiff?", "training", "checks.json (SHA-256", "cell.json"}) {
    CHECK_THAT(page, Catch::Matchers::Contains(shown));
  }
  CHECK_THAT(page, !Catch::Matchers::Contains("relaxation ratio"));
  const auto recheck = [&](int code, const std::string& says) {
    CAPTURE(says);
    CHECK(exit_code_in(folder, "validate --recheck page.html") == code);
    const std::string said = read_file(folder / "said");
    CHECK_THAT(said, Catch::Matchers::Contains(says));
    CHECK(read_file(folder / "page.html").size() > 0);
  };
  recheck(0, "0 of its values changed");
  // A number that the page shows, its record left alone; then the record's.
  std::string edited = page;
  edited.replace(edited.find(">adequate<"), 10, ">splendid<");
  write_file(folder / "page.html", edited);
  recheck(1, "the page itself");
  edited = page;
  const auto at = edited.rfind("\"u_D\": ");
  REQUIRE(at != std::string::npos);
  edited.replace(at, 7, "\"u_D\": 1");
  write_file(folder / "page.html", edited);
  recheck(1, "/u_D: was");
  write_file(folder / "page.html", page);
  // Evidence, instrument and law are inputs, too.
  write_file(folder / "checks.json", "{ }");
  recheck(1, "/files/checks.json");
  write_file(folder / "checks.json", "{}");
  write_file(folder / "cell.json", R"({"instrument": {"id": "cell", "force": "2 % of reading"}})");
  recheck(1, "/files/cell.json");
  CHECK_THAT(read_file(folder / "said"), Catch::Matchers::Contains("/u_D: was"));
  std::filesystem::rename(folder / "cell.json", folder / "gone.json");
  recheck(3, "cell.json");
  std::filesystem::rename(folder / "gone.json", folder / "cell.json");
  write_file(folder / "cell.json",
             R"({"instrument": {"id": "cell", "force": "0.5 % of reading"}})");
  std::filesystem::rename(folder / "other.csv", folder / "gone.csv");
  recheck(3, "other.csv");
  std::filesystem::rename(folder / "gone.csv", folder / "other.csv");
  recheck(0, "0 of its values changed");
  edited = page;
  edited.replace(edited.find("\"evidence\": ["), 10, "\"evidenco\"");
  write_file(folder / "page.html", edited);
  recheck(3, "page.html");
}

TEST_CASE("|E| <= U without a model error, and [E - U, E + U] holds a known one", "[validate]") {
  constexpr int kExperiments = 200;
  constexpr double kStiffer = 1.05;
  constexpr double kSuspicious = 1e-3;
  for (const double phi : {0.0, 0.9}) {
    test::StudyNoise noise;
    noise.phi = phi;
    Random random(71);
    test::StudyCounts none, known;
    LawFile right = test::study_calibration(1, noise, random);
    right.values = {60.0, 45.0, 2.0, 0.0, 0.0};
    const test::StudyTest protocol = test::study_validation(20, 0.4);
    const test::TrueErrors delta = test::true_errors(right, protocol, kStiffer);
    for (int i = 0; i < kExperiments; ++i) {
      const LawFile law = test::study_calibration(1, noise, random);
      const auto compared = [&](double stiffer) {
        ComparisonOptions options;
        options.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
        return compare_with_recording(
            law,
            prepare_recording("validation",
                              test::study_recording(protocol, noise, random, stiffer)),
            options);
      };
      none.add(compared(1.0), 0.0, 0.0);
      known.add(compared(kStiffer), delta.peak, delta.end);
    }
    CAPTURE(phi);
    for (const test::Count& count : {none.peak, none.end, known.peak, known.end}) {
      CAPTURE(count.held);
      CHECK(test::binomial_p(count, 0.95) > kSuspicious);
    }
  }
}

TEST_CASE("|E| <= U for new specimens, alone and together", "[validate]") {
  constexpr int kExperiments = 60;
  constexpr double kSpread = 0.1;
  const test::StudyNoise noise;
  Random random(22);
  test::StudyCounts alone, without;
  test::Count mean;
  for (int i = 0; i < kExperiments; ++i) {
    alone.add(test::study_new_specimens(3, 1, kSpread, noise, random).recordings.front(), 0.0, 0.0);
    without.add(test::study_new_specimens(3, 1, kSpread, noise, random, false).recordings.front(),
                0.0, 0.0);
    const Validation v = test::study_new_specimens(3, 3, kSpread, noise, random);
    mean.add(std::abs(v.pooled.front().e.error) <= v.pooled.front().e.expanded());
  }
  // 95 % of 60 are 57 +- 1.7; with the law's covariance alone few are inside.
  for (const test::Count& c : {alone.peak, alone.end, mean}) CHECK(c.held >= 51);
  for (const test::Count& c : {without.peak, without.end}) CHECK(c.held < 40);
}

}  // namespace tpm::fit
