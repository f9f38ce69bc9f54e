// Folders of recordings: one reference depth for all coefficients, and repeats of a specimen.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "expected_values.hpp"
#include "run_in.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/groups/young_moduli.hpp"
#include "tpm/fit/show/fit_report.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

LawSpec law_at(const char* name, double reference_m) {
  LawSpec spec = parse_law_name(name, "test");
  spec.reference = reference_m;
  return spec;
}

/// Ramp and hold of a specimen whose power law has exponent 2 and k_inf = 100 N/m at 4 mm.
Recording quadratic_press(double depth_m, double stiffness, std::uint64_t seed) {
  Recording r;
  for (int i = 0; i < 160; ++i) {
    r.time_s.push_back(0.06 * i);
    r.drive.push_back(std::clamp(2e-3 * (r.time_s.back() - 0.5), 0.0, depth_m + 0.5e-3));
  }
  const Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  const std::vector<double> values{100.0 * stiffness, 120.0 * stiffness, 2.0, 2.0, 0.5e-3, 0.0};
  const Eigen::VectorXd f =
      LawModel(law_at("power-1", 4e-3)).respond(history, r.time_s, values, Want::values).value;
  Random random(seed);
  for (const double force : f) r.response.push_back(force + 2e-3 * f.maxCoeff() * random.normal());
  return r;
}

std::vector<PreparedRecording> one_material() {
  std::vector<PreparedRecording> recordings;
  for (const double depth_mm : {2.0, 3.0, 4.5, 6.0, 8.0}) {
    recordings.push_back(prepare_recording(
        fmt::format("{} mm.csv", depth_mm),
        quadratic_press(1e-3 * depth_mm, 1.0, static_cast<std::uint64_t>(10 * depth_mm))));
  }
  return recordings;
}

SelectionOptions options_without_profiles() {
  SelectionOptions options;
  options.setup.profiles = false;
  return options;
}

const PooledParameter& pooled(const SpecimenStudy& study, const std::string& name) {
  for (const PooledParameter& p : study.pooled) {
    if (p.parameter.name == name) return p;
  }
  throw std::runtime_error(name);
}

std::string csv_of(const Recording& r, const std::string& specimen = {}) {
  std::string csv = "time [s],depth [mm],force [N]";
  csv += specimen.empty() ? "\n" : ",animal\n";
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    csv += fmt::format("{},{},{}", r.time_s[i], 1e3 * r.drive[i], r.response[i]);
    csv += specimen.empty() ? "\n" : fmt::format(",{}\n", specimen);
  }
  return csv;
}

}  // namespace

TEST_CASE("Recordings of one material to unequal depths show no spread", "[specimens]") {
  const auto recordings = one_material();
  const SpecimenStudy study =
      study_specimens(recordings, parse_law_name("power-1", "test"), options_without_profiles());
  // What all of them reach: 2 mm, less what a quadratic force hides below the noise.
  CHECK_THAT(study.law.reference, test::expected("recordings_to_unequal_depths.reference_depth"));
  for (const SpecimenRow& row : study.rows) {
    CHECK(row.fit.value().config.law.value().reference == study.law.reference);
  }
  // k at a depth u of the law k0 (u/4 mm)^(m - 1).
  const PooledParameter& k_inf = pooled(study, "k_inf");
  CHECK(k_inf.effects.specimens == 5);
  CHECK_THAT(std::exp(k_inf.effects.mean), WithinRel(100.0 * study.law.reference / 4e-3, 0.02));
  CHECK(k_inf.effects.q_p_value.value() > 0.01);
  CHECK(pooled(study, "k1").effects.q_p_value.value() > 0.01);
  const std::string shown = fmt::format("{} mm", 1e3 * study.law.reference);
  CHECK_THAT(to_terminal_text(study), Contains("coefficients are secants at a depth of " + shown));
  CHECK_THAT(specimen_figures(study).front().caption, Contains("secants at a depth of " + shown));
  const Json json = to_json(study);
  CHECK(json.at("depth_reference_m") == study.law.reference);
  CHECK(json.at("coefficients_depend_on_reference") == true);
  CHECK(json.at("recordings").at(0).at("fit").at("depth_reference_m") == study.law.reference);
  CHECK(json.at("pooled").at(0).contains("spread_p_value"));
  CHECK_THAT(to_terminal_text(*study.rows.front().fit), Contains("secants at a depth of " + shown));
}

TEST_CASE("A minimum that is not trusted is not pooled", "[specimens]") {
  const auto recordings = one_material();
  SpecimenStudy study =
      study_specimens(recordings, parse_law_name("power-1", "test"), options_without_profiles());
  const PooledParameter before = pooled(study, "k1");
  FitResult& fit = study.rows.front().fit.value();
  for (ParameterResult& p : fit.parameters) {
    if (p.parameter.name == "k1") p.unconfirmed = Remark{"one_start", "found by one start of 5"};
  }
  const std::vector<PooledParameter> again = pool_specimens(study.rows, study.level);
  for (const PooledParameter& p : again) {
    CAPTURE(p.parameter.name);
    const PooledParameter& all = pooled(study, p.parameter.name);
    const int left = p.parameter.name == "k1" ? 1 : 0;
    CHECK(p.left_out == all.left_out + left);
    CHECK(p.effects.specimens == all.effects.specimens - left);
  }
  CHECK(before.effects.specimens == 5);
  // law.json says the same, and what is predicted with it.
  const LawFile law = fitted_law(fit);
  CHECK(law.uncertainty.value().unconfirmed == std::vector<std::string>{"k1"});
}

TEST_CASE("A folder's stiffnesses under a probe are Young's moduli", "[specimens]") {
  // A cone's force is 2/pi E tan(angle)/(1 - nu^2) u^2: the stiffness at u is that times u.
  ContactGeometry cone;
  cone.cone_half_angle_rad = std::atan(1.5);
  cone.poisson_ratio = 0.4;
  const double true_Pa = 100.0 / 4e-3 / (2.0 / 3.141592653589793 * 1.5 / (1.0 - 0.16));
  SelectionOptions options = options_without_profiles();
  options.setup.exponent = probe_exponent(cone);
  const SpecimenStudy study = study_specimens(one_material(), law_at("power-1", 1.0), options);
  const YoungModuli moduli = pooled_moduli(study, cone, true);
  REQUIRE(moduli.moduli.size() == 3);
  CHECK(moduli.poisson_assumed);
  CHECK(moduli.reference_m == study.law.reference);
  const YoungModulus& in_the_end = moduli.moduli[0];
  CHECK(in_the_end.name == "E_inf");
  CHECK(in_the_end.basis == "pooled");
  // No rest of these recordings tells a drift.
  CHECK(in_the_end.verdict ==
        "typical of 5 specimens, not identified: drift or a slow branch: not separable");
  CHECK_THAT(in_the_end.estimate, WithinRel(true_Pa, 0.01));
  CHECK(in_the_end.lower.value() < true_Pa);
  CHECK(in_the_end.upper.value() > true_Pa);
  CHECK_THAT(moduli.moduli[1].estimate, WithinRel(1.2 * true_Pa, 0.01));
  const YoungModulus& sum = moduli.moduli[2];
  CHECK(sum.name == "E_instantaneous");
  CHECK(sum.of == "k_inf + k1");
  CHECK(sum.basis == "pooled");
  CHECK_THAT(sum.estimate, WithinRel(2.2 * true_Pa, 0.01));
  CHECK(sum.lower.value() < 2.2 * true_Pa);
  CHECK(sum.upper.value() > 2.2 * true_Pa);
}

/// A folder of two recordings, `pig`.
void write_folder(const test::TempFolder& folder) {
  std::filesystem::create_directory(folder.path() / "pig");
  for (const double depth_mm : {3.0, 5.0}) {
    write_file(folder.path() / "pig" / fmt::format("{}mm.csv", depth_mm),
               csv_of(quadratic_press(1e-3 * depth_mm, 1.0, static_cast<std::uint64_t>(depth_mm))));
  }
}

TEST_CASE("Beside an answer in JSON stands its table as CSV", "[specimens]") {
  const test::TempFolder folder;
  write_folder(folder);
  write_file(folder.path() / "law.json", R"({"law": "linear", "drive": "indentation_depth",
    "response": "contact_force", "reference_m": 0.001, "provenance": "assumed",
    "parameters": {"k_inf_N_per_m": 20.0}})");
  struct Case {
    const char* command;
    const char* first;  ///< line of the CSV
  };
  for (const Case& c : std::vector<Case>{
           {"fit pig/3mm.csv --laws power-1 --no-held-out --no-profiles --no-draw",
            "name,SI_unit,scale,"},
           {"fit pig/3mm.csv --laws power-1 --no-draw", "name,SI_unit,scale,"},
           {"fit pig --laws power-1 --no-draw", "name,unit,typical_SI,"},
           {"design " TPM_TEST_SOURCE_DIR "/configs/coverage_absolute.json --repetitions 3",
            "seed,confidence_level,data_sets,"},
           {"design --laws linear-1 --repetitions 1", "law,noise_over_peak,seed,"},
           {"predict law.json --frequencies '1 Hz : 100 Hz : 3'",
            "frequency_Hz,storage_N_per_m,"}}) {
    INFO(c.command);
    const test::ProgramRun json =
        test::run_in(folder, std::string(c.command) + " --format json -o answer.json");
    INFO(json.said);
    REQUIRE((json.code == 0 || json.code == 1));
    const Json answer = parse_json(read_file(folder.path() / "answer.json"), "answer");
    CHECK_FALSE(answer.empty());
    const std::string csv = read_file(folder.path() / "answer.csv");
    CHECK(csv.starts_with(c.first));
    CHECK(std::count(csv.begin(), csv.end(), '\n') > 1);
    std::filesystem::remove(folder.path() / "answer.csv");
    // Text has no table beside it.
    CHECK(test::run_in(folder, std::string(c.command) + " -o answer.txt").code == json.code);
    CHECK_FALSE(std::filesystem::exists(folder.path() / "answer.csv"));
  }
  const test::ProgramRun over =
      test::run_in(folder, "fit pig/3mm.csv --no-draw --format json -o pig/3mm.json");
  CHECK(over.code == 2);
  CHECK_THAT(over.said, Contains("pig/3mm.csv: this command reads it and would write over it"));
}

TEST_CASE("The choice of a law is told by options of fit", "[specimens]") {
  const test::TempFolder folder;
  write_folder(folder);
  const auto answer = [&](const std::string& options) {
    const test::ProgramRun run =
        test::run_in(folder, "fit pig/3mm.csv --no-draw --format json " + options);
    INFO(run.said);
    REQUIRE(run.code == 0);
    return parse_json(run.said, "answer");
  };
  const Json of_two = answer("--laws linear,power-1 --margin 7.5 --no-profiles");
  CHECK(of_two.at("laws").size() == 2);
  CHECK(of_two.at("recommended") == "power-1");
  CHECK(of_two.at("margin_bic") == 7.5);
  CHECK_FALSE(of_two.at("laws").at(0).at("held_out").empty());
  CHECK(answer("--laws power-1 --no-held-out").at("laws").at(0).at("held_out").empty());
  const Json fractional = answer("--family fractional --no-held-out --no-profiles");
  for (const Json& law : fractional.at("laws")) {
    CHECK_FALSE(parse_law_name(law.at("law").get<std::string>(), "answer").fractional ==
                Fractional::none);
  }
  const test::ProgramRun twice =
      test::run_in(folder, "fit pig/3mm.csv --laws linear-1,power-1 --times '1 s'");
  CHECK(twice.code == 2);
  CHECK_THAT(twice.said, Contains("--times: with 2 laws"));
  for (const char* option : {"--laws power-1", "--family all", "--margin 3", "--no-profiles"}) {
    const test::ProgramRun run = test::run_in(
        folder, std::string("fit " TPM_TEST_SOURCE_DIR "/configs/liver_relaxation.json ") + option);
    CHECK(run.code == 2);
    CHECK_THAT(run.said, Contains("with a configuration"));
  }
}

TEST_CASE("Under a sphere the law of a folder is chosen among those of Hertz' kernel",
          "[specimens]") {
  const test::TempFolder folder;
  write_folder(folder);
  const test::ProgramRun run =
      test::run_in(folder, "fit pig --radius '2 mm' --no-draw --format json");
  INFO(run.said);
  REQUIRE(run.code == 0);
  const Json study = parse_json(run.said, "answer");
  CHECK_THAT(study.at("why").get<std::string>(), !Contains("was asked for"));
  CHECK(parse_law_name(study.at("law").get<std::string>(), "answer").kernel == Kernel::hertz);
  CHECK(parse_law_name(study.at("law").get<std::string>(), "answer").branches > 0);
}

TEST_CASE("A folder under a probe answers in pascals", "[specimens]") {
  const test::TempFolder folder;
  write_folder(folder);
  const test::ProgramRun text = test::run_in(
      folder, "fit pig --laws power-1 --cone-angle '45 deg' --poisson 0.4 --folder out");
  INFO(text.said);
  REQUIRE(text.code == 0);
  CHECK_THAT(text.said, Contains("Young's moduli under") && Contains("typical of 2 specimens"));
  const Json moduli = read_json(folder.path() / "out" / "young_moduli.json");
  CHECK(moduli.at("moduli").size() == 3);  // of k_inf and k1, and of both together
  CHECK(moduli.at("moduli").at(0).at("interval_from") == "pooled");
  CHECK(moduli.at("poisson_ratio_provenance") == "given");
  CHECK(read_file(folder.path() / "out" / "young_moduli.csv")
            .starts_with("name,of,unit,estimate_SI,"));
}

TEST_CASE("A reference depth can be chosen, and the coefficients are those at it", "[specimens]") {
  const auto recordings = one_material();
  SelectionOptions options = options_without_profiles();
  options.setup.reference = 4e-3;
  const SpecimenStudy study =
      study_specimens(recordings, parse_law_name("power-1", "test"), options);
  CHECK_THAT(std::exp(pooled(study, "k_inf").effects.mean), WithinRel(100.0, 0.02));
  CHECK_THAT(std::exp(pooled(study, "k1").effects.mean), WithinRel(120.0, 0.02));
  CHECK(pooled(study, "k_inf").effects.q_p_value.value() > 0.01);
}

TEST_CASE("Coefficients of different reference depths are never pooled", "[specimens]") {
  const auto recordings = one_material();
  std::vector<SpecimenRow> rows;
  SetupOptions setup;
  setup.profiles = false;
  for (std::size_t i = 0; i < 2; ++i) {
    const std::span<const PreparedRecording> one(&recordings[i], 1);
    SpecimenRow row;
    row.name = recordings[i].name;
    row.fit =
        run_fit(recording_config(parse_law_name("power-1", "test"), one, setup), data_sets(one));
    for (std::size_t p = 0; p < row.fit->parameters.size(); ++p) row.place.push_back(p);
    rows.push_back(std::move(row));
  }
  CHECK_THROWS_WITH(pool_specimens(rows, 0.95),
                    Contains("recording '3 mm.csv': its coefficients are secants at a depth of") &&
                        Contains("expected those of '2 mm.csv'"));
}

TEST_CASE("What was fitted to shallow recordings predicts a deep one", "[specimens]") {
  std::vector<PreparedRecording> recordings;
  for (const double depth_mm : {3.0, 4.0, 6.0}) {
    recordings.push_back(prepare_recording(fmt::format("{}.csv", depth_mm),
                                           quadratic_press(1e-3 * depth_mm, 1.0, 7)));
  }
  SelectionOptions options = options_without_profiles();
  options.laws = {parse_law_name("power-1", "test")};
  options.only_listed = true;
  const Selection s = select_law(recordings, options);
  REQUIRE(s.candidates.front().held_out.size() == 3);
  for (const HeldOut& h : s.candidates.front().held_out) {
    INFO(h.what);
    CHECK(h.rms_over_peak < 0.006);
  }
}

TEST_CASE("The law of a folder is one that most of its recordings identify", "[specimens]") {
  const auto recordings = one_material();
  const SpecimenStudy study = study_specimens(recordings, std::nullopt, options_without_profiles());
  CHECK(law_name(study.law) == "power-1");
  CHECK_THAT(study.why, Contains("among the laws that most of them identify; its parameters are "
                                 "identified in 5 of them"));
}

TEST_CASE("Repeats of a specimen are one specimen", "[specimens]") {
  // Two specimens with three repeats each, without spread between specimens: y = 0 +- 0.1 though
  // each fit claims 0.01.
  const std::vector<double> y{0.1, -0.1, 0.0, -0.1, 0.1, 0.0};
  std::vector<SpecimenEstimate> estimates;
  for (std::size_t i = 0; i < y.size(); ++i) {
    estimates.push_back({fmt::format("r{}", i), y[i], 0.01, i < 3 ? "a" : "b"});
  }
  const RandomEffects r = random_effects_of_repeats(estimates);
  CHECK(r.specimens == 2);
  CHECK(r.repeat_degrees == 4);
  // Within each specimen the variance of the repeats is 0.01: rho^2 = 0.01 - 0.0001.
  CHECK_THAT(r.repeat_variance.value(), WithinRel(0.0099, 1e-9));
  CHECK_THAT(r.mean, WithinAbs(0.0, 1e-12));
  CHECK_THAT(r.q_p_value.value(), WithinAbs(1.0, 1e-9));
  CHECK(r.tau_at_zero);
  CHECK(r.standard_error > 0.04);  // 0.1 / sqrt(6), not 0.01 / sqrt(6)
  for (SpecimenEstimate& e : estimates) e.specimen.clear();
  const RandomEffects apart = random_effects_of_repeats(estimates);
  CHECK(apart.specimens == 6);
  CHECK(apart.q_p_value.value() < 1e-9);  // taken one by one they would be six unlike specimens
}

TEST_CASE("A folder's repeats are grouped by name, column or key", "[specimens]") {
  const test::TempFolder folder;
  std::filesystem::create_directory(folder.path() / "by_name");
  std::filesystem::create_directory(folder.path() / "by_key");
  int i = 0;
  for (const double stiffness : {1.0, 1.3}) {
    for (const double depth_mm : {3.0, 5.0}) {
      const Recording r =
          quadratic_press(1e-3 * depth_mm, stiffness, static_cast<std::uint64_t>(++i));
      const std::string animal = stiffness > 1.1 ? "pig2" : "pig1";
      const std::string name = fmt::format("{}_{}mm", animal, depth_mm);
      write_file(folder.path() / "by_name" / (name + ".csv"), csv_of(r, animal));
      write_file(folder.path() / "by_key" / (name + ".csv"), csv_of(r));
      write_file(folder.path() / "by_key" / (name + ".json"), fmt::format(R"({{"id": "{0}",
        "title": "{0}", "kind": "recording", "observable": "contact_force",
        "provenance": "measured", "citation": "synthetic", "specimen": "{1}", "columns": {{
        "time [s]": {{"quantity": "time", "unit": "s"}},
        "depth [mm]": {{"quantity": "indentation_depth", "unit": "mm"}},
        "force [N]": {{"quantity": "contact_force", "unit": "N"}}}}}})",
                                                                          name, animal));
    }
  }
  const std::string fit = "--laws power-1 --no-draw --format json --group-by ";
  for (const std::string& arguments :
       std::vector<std::string>{"by_name " + fit + "'(pig[0-9])_'", "by_name " + fit + "animal",
                                "by_key " + fit + "specimen"}) {
    INFO(arguments);
    const test::ProgramRun run = test::run_in(folder, "fit " + arguments);
    INFO(run.said);
    REQUIRE(run.code == 0);
    const Json json = parse_json(run.said, "said");
    CHECK(json.at("recordings").at(0).at("specimen") == "pig1");
    CHECK(json.at("recordings").at(3).at("specimen") == "pig2");
    CHECK(json.at("pooled").at(0).at("specimens") == 2);
    CHECK(json.at("pooled").at(0).at("repeat_degrees_of_freedom") == 2);
    CHECK(json.at("pooled").at(0).at("spread_p_value") < 0.05);  // they differ by 30 %
  }
  const test::ProgramRun text =
      test::run_in(folder,
                   "fit by_name --laws power-1 --no-draw --group-by animal "
                   "--reference '3.5 mm' --verbose");
  CHECK_THAT(text.said, Contains("[pig2]") && Contains("secants at a depth of 3.5 mm"));
  const test::ProgramRun unmatched =
      test::run_in(folder, "fit by_name --no-draw --group-by '(cow)'");
  CHECK(unmatched.code == 2);
  CHECK_THAT(unmatched.said, Contains("tpm: --group-by: 'pig1_3mm.csv' is not matched by '(cow)'"));
  CHECK(test::run_in(folder, "fit by_name --group-by '(a)(b)'").code == 2);
  CHECK(test::run_in(folder, "fit by_name --group-by '(['").code == 2);
  CHECK(test::run_in(folder, "fit by_name --group-by colour").code == 3);
  CHECK(test::run_in(folder, "fit by_key --group-by colour").code == 3);
  CHECK(test::run_in(folder, "fit by_name --group-by force").code == 3);
  CHECK(test::run_in(folder, "fit by_name --reference '0 mm'").code == 2);
  CHECK(test::run_in(folder, "fit by_name/pig1_3mm.csv --group-by animal").code == 2);
  // A folder that would not be written is no silent wish.
  CHECK(test::run_in(folder, "fit by_name/pig1_3mm.csv --no-draw --folder f").code == 2);
}
