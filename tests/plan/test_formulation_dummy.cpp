// A formulation added in one file (formulations/dummy.cpp) is in every list and at every user's
// hand; one that does not keep its word is found. This program is linked with a list of its own.
#include <catch2/catch.hpp>

#include "dummy_program.hpp"
#include "formulation_suite.hpp"
#include "temp_folder.hpp"
#include "tpm/accuracy/organ_problems.hpp"
#include "tpm/files/file.hpp"

using namespace tpm;
using namespace tpm::accuracy;
using test::answer_of;
using test::names;
using test::TempFolder;

namespace {

const std::string kScene = R"({"organ": {"kind": "liver", "count": 40},
  "protocol": {"kind": "ramp_hold", "depth": "1 mm", "rate": "4 mm/s", "hold": "1 s"},
  "formulation": {"kind": "KIND"}})";

std::string scene_of(const std::string& kind) {
  std::string text = kScene;
  return text.replace(text.find("KIND"), 4, kind);
}

}  // namespace

TEST_CASE("a formulation in one file is in the lists") {
  CHECK(names(answer_of("accuracy benchmark --list").at("formulations"), "dummy"));
  CHECK(names(answer_of("simulate --list-formulations").at("formulations"), "dummy"));
}

TEST_CASE("a formulation in one file is a method of benchmark problems") {
  for (const bool loaded : {false, true}) {
    const BenchmarkProblem problem = loaded ? organ_creep_problem() : organ_hold_problem();
    int found = 0;
    for (const BenchmarkSetting& setting : problem.settings) {
      if (setting.method != "dummy") continue;
      ++found;
      const BenchmarkRun run = setting.run(false);
      REQUIRE(run.outcome.end == MethodEnd::completed);
      CHECK(run.outcome.response.maxCoeff() > 0.0);
    }
    CHECK(found == 1);
  }
}

TEST_CASE("a formulation in one file runs a scene and a sweep") {
  const TempFolder folder;
  write_file(folder / "s.json", scene_of("dummy"));
  const std::string path = folder / "s.json";
  const Json run = answer_of("simulate " + path + " -o " + (folder / "s.h5"));
  CHECK(run.at("formulation") == "dummy");
  const double force_N = run.at("last").at("response").get<double>();
  CHECK(force_N > 0.0);

  write_file(folder / "sweep.json",
             R"({"title": "t", "model": "organ", "scene": )" + scene_of("dummy") + R"(,
    "axes": [{"parameter": "/protocol/depth", "values": ["1 mm", "2 mm"]}],
    "outputs": ["end_force"]})");
  const Json sweep = answer_of("sweep " + (folder / "sweep.json") + " -o " + (folder / "sweep"));
  INFO(sweep.dump());
  CHECK(sweep.at("done") == 2);
}

TEST_CASE("a formulation in one file is a candidate of plans") {
  const TempFolder folder;
  write_file(folder / "s.json", scene_of("quasi_static"));
  const Json plan = answer_of("plan " + (folder / "s.json") + " --tolerance 1%");
  for (const Json& candidate : plan.at("frontier")) {
    if (candidate.at("name") != "dummy") continue;
    CHECK(candidate.at("claimed_error").get<double>() > 0.0);
    CHECK(candidate.at("verified_error").get<double>() <=
          candidate.at("claimed_error").get<double>());
    return;
  }
  FAIL("no candidate: " << plan.at("frontier").dump());
}

TEST_CASE("the suite passes the dummy and finds what does not keep its word") {
  CHECK(test::listed(test::broken_words(*find_formulation("dummy"))) == "");
  const std::string found = test::listed(test::broken_words(*find_formulation("broken")));
  for (const char* check : {"closed form: ", "rest: ", "determinism: ", "energy: "}) {
    CAPTURE(check, found);
    CHECK(found.find(check) != std::string::npos);
  }
}
