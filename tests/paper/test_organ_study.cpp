// The study of the paper's experiments: its configuration, the star as a network against the star's
// closed form, and the committed report against what the code computes.
#include <catch2/catch.hpp>
#include <cmath>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/paper/organ_study.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::paper;
using namespace tpm::test;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using Kind = ProtocolChoice::Kind;

namespace {

namespace fs = std::filesystem;

const fs::path kConfigs = fs::path(TPM_TEST_SOURCE_DIR) / "configs";

Json shipped() {
  return read_json(kConfigs / "organ_experiments.json");
}

/// Without the organs, which take time to read.
Json star_only() {
  Json study = shipped();
  study["tissues"] = {{{"name", "star"}}, {{"name", "the same again"}}};
  return study;
}

/// The shipped study of the star's closed form and of the star as a network.
OrganStudyConfig two_stars(const TempFolder& folder) {
  write_file(folder / "star.json", R"({"organ": {"kind": "star", "spacing": "20 mm"}})");
  Json study = shipped();
  study["tissues"] = {{{"name", "closed form"}}, {{"name", "network"}, {"scene", "star.json"}}};
  return parse_organ_study(study, "study.json", folder.path());
}

TpmParameters some_liver() {
  TpmParameters p;
  p.E1_Pa = p.E2_Pa = p.Eprime_Pa = 13e3;
  p.eta1_Pa_s = 2.5e5;
  p.spacing_m = 0.025;
  return p;
}

std::string refused(const Json& study) {
  return refusal_of([&] { static_cast<void>(parse_organ_study(study, "s.json", kConfigs)); });
}

}  // namespace

TEST_CASE("the star as a network does every experiment of the paper as its closed form does") {
  const TempFolder folder;
  const OrganStudyConfig config = two_stars(folder);
  const StudyCurves set = curves_at(config, "liver", to_vector(some_liver()));
  REQUIRE(set.curves.size() == 2 * config.conditions.size());
  for (std::size_t c = 0; c < config.conditions.size(); ++c) {
    const StudyCurve& closed = set.at(c, 0);
    const StudyCurve& network = set.at(c, 1);
    CAPTURE(c, network.failure);
    REQUIRE(closed.failure.empty());
    REQUIRE(network.response.size() == closed.response.size());
    for (std::size_t i = 0; i < closed.response.size(); ++i) {
      CHECK_THAT(network.response[i], WithinAbs(closed.response[i], 3e-6 * closed.response.back()));
    }
    for (const StudyReading& r : network.readings) CHECK(std::abs(*r.against_first) < 1e-5);
    for (const StudyReading& r : closed.readings) CHECK_FALSE(r.against_first);
  }
}

TEST_CASE("readings stand where their experiment has them") {
  const TempFolder folder;
  const OrganStudyConfig config = two_stars(folder);
  const TpmParameters p = some_liver();
  for (std::size_t c = 0; c < config.conditions.size(); ++c) {
    const StudyCondition& condition = config.conditions[c];
    const StudyCurve curve = study_curve(config, c, 0, to_vector(p));
    CAPTURE(c);
    const double lambda1 = lambda1_Pa(p.Eprime_Pa, condition.depth_m, p.spacing_m);
    if (condition.kind == Kind::static_) {
      const StudyReading& deepest = curve.readings.back();
      CHECK(deepest.label == "8 mm");
      CHECK(deepest.x == condition.depth_m);
      CHECK_THAT(deepest.response,
                 WithinRel(step_relaxation_force_N(p, lambda1, deepest.x,
                                                   std::numeric_limits<double>::infinity()),
                           1e-12));
    } else if (condition.kind == Kind::ramp_hold) {
      CHECK_THAT(curve.readings[0].x, WithinRel(condition.depth_m / condition.rate_m_per_s, 1e-12));
      CHECK_THAT(curve.readings[1].x - curve.readings[0].x, WithinRel(30.0, 1e-12));
      CHECK(curve.readings[0].response ==
            *std::max_element(curve.response.begin(), curve.response.end()));
    } else {
      // At once the dashpot has not moved: (E2 + lambda1(e)) e A0/l0 is the load.
      const double e = curve.readings[0].response;
      const double instantaneous =
          (p.E2_Pa + lambda1_Pa(p.Eprime_Pa, e, p.spacing_m)) * e * p.A0_m2 / p.l0_m;
      CHECK_THAT(instantaneous, WithinRel(condition.load_N, 1e-9));
      CHECK(curve.readings[1].x == 300.0);
    }
  }
}

TEST_CASE("the example of a study is read", "[keys]") {
  CHECK_NOTHROW(parse_organ_study(example_of(organ_study_kind()), "example", {}));
}

TEST_CASE("a study says which part of its configuration is wrong") {
  Json study = star_only();
  study["fits"]["all"].push_back("nothing");
  CHECK(refused(study) == "s.json: key /fits/all: no data 'nothing'; expected a name under /data");
  study = star_only();
  study["materials"][0]["fit"] = "some";
  CHECK(refused(study) ==
        "s.json: key /materials/0/fit: no fit 'some'; expected a name under /fits");
  study = star_only();
  study["materials"][0]["fixed"] = {{"A0", "12 mm^2"}};
  CHECK_THAT(refused(study), Contains("/materials/0/fixed/A0: is not estimated"));
  study["materials"][0]["fixed"] = {{"spacing", "1 mm"}};
  CHECK_THAT(refused(study),
             Contains("/materials/0/fixed/spacing: outside the parameter's bounds"));
  study["materials"][0]["fixed"] = {{"spacing", "20 mm"}, {"E", "9 kPa"}, {"eta1", "5 Pa s"}};
  CHECK_THAT(refused(study), Contains("/materials/0/fixed: all parameters are fixed"));
  study = star_only();
  study["materials"][1]["name"] = study["materials"][0]["name"];
  CHECK_THAT(refused(study), Contains("/materials/1/name: another material has it"));
  study = star_only();
  study["conditions"]["static"]["readings"][1] = "9 mm";
  CHECK_THAT(refused(study), Contains("/conditions/static/readings: deeper than 'depth'"));
  study = star_only();
  study["conditions"]["creep"]["loads"][1] = "0 N";
  CHECK_THAT(refused(study), Contains("/conditions/creep/loads/1: 0 N; expected above 0 N"));
  study = star_only();
  study["tissues"][1]["name"] = "star";
  CHECK_THAT(refused(study), Contains("s.json: key /tissues: two tissues 'star'"));
  study = star_only();
  study["parameters"]["E"].erase("lower");
  CHECK_THAT(refused(study), Contains("s.json, fit 'relaxation' of 'star': key /parameters/E"));
  study = star_only();
  study["data"]["static"]["protocol"] = {{"kind", "measured"}};
  CHECK_THAT(refused(study), Contains("protocol 'measured'; expected ramp_hold, static or creep"));
  study = star_only();
  study["tissues"][1]["scene"] = "nowhere.json";
  CHECK_THAT(refused(study), Contains("nowhere.json: no such file"));
  study = star_only();
  study["conditions"]["swim"] = 1;
  CHECK_THAT(refused(study), Contains("s.json: key /conditions"));
}

TEST_CASE("bands alone: what they cannot tell is said, and that the estimates are no best point") {
  const OrganStudyConfig config = parse_organ_study(star_only(), "s.json", kConfigs);
  const auto fit = std::find_if(config.fits.begin(), config.fits.end(),
                                [](const StudyFit& f) { return f.name == "static"; });
  REQUIRE(fit->experiment() == Kind::static_);
  const FitResult result = run_fit(fit->configs.front());
  CHECK(result.chi_square == 0.0);
  const ParameterResult& eta1 = result.parameters[1];
  REQUIRE(eta1.parameter.name == "eta1");
  CHECK(eta1.verdict == Verdict::flat);
  CHECK_THAT(eta1.summary, Contains("is undetermined by these data"));
  CHECK(result.parameters[0].verdict == Verdict::identified);
  REQUIRE_FALSE(result.remarks.empty());
  CHECK(result.remarks.back().code == "estimates_not_unique");
  CHECK_THAT(to_terminal_text(result), Contains("4 bands, no degrees of freedom"));
}

namespace {

const fs::path kReport = fs::path(TPM_TEST_SOURCE_DIR) / "reports" / "organ";

TpmParameters parameters_in(const Json& j) {
  TpmParameters p;
  p.E1_Pa = j.at("E1_Pa");
  p.E2_Pa = j.at("E2_Pa");
  p.Eprime_Pa = j.at("Eprime_Pa");
  p.eta1_Pa_s = j.at("eta1_Pa_s");
  p.spacing_m = j.at("spacing_m");
  p.A0_m2 = j.at("A0_m2");
  p.l0_m = j.at("l0_m");
  return p;
}

}  // namespace

TEST_CASE("the committed readings are what the tissues answer at the committed materials",
          "[heavy]") {
  const Json report = read_json(kReport / "experiments.json");
  Json study = shipped();
  study["fits"] = {{"all", study["fits"]["all"]}};  // each fit reads the organs anew
  const OrganStudyConfig config = parse_organ_study(study, "s.json", kConfigs);
  // Every tissue, two ramps.
  std::size_t checked = 0;
  for (std::size_t m = 0; m < config.materials.size(); ++m) {
    const TpmParameters p = parameters_in(report.at("materials").at(m).at("parameters"));
    const Json& answers = report.at("curves").at(m).at("answers");
    for (const std::size_t c : {std::size_t{3}, std::size_t{12}}) {
      REQUIRE(config.conditions[c].kind == Kind::ramp_hold);
      for (std::size_t t = 0; t < config.tissues.size(); ++t) {
        const Json& stored = answers.at(c * config.tissues.size() + t);
        CAPTURE(m, c, t);
        REQUIRE(stored.at("tissue") == config.tissues[t].name);
        const StudyCurve curve = study_curve(config, c, t, to_vector(p));
        REQUIRE(stored.at("readings").size() == curve.readings.size());
        for (std::size_t i = 0; i < curve.readings.size(); ++i) {
          CHECK_THAT(curve.readings[i].response,
                     WithinRel(stored.at("readings").at(i).at("force_N").get<double>(), 2e-4));
          ++checked;
        }
      }
    }
  }
  CHECK(checked == 24);
}
