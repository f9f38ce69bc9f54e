// A shape of materials added in one file (shapes/dummy.cpp) is in the list and at every user's
// hand; one that does not keep its word is found. This program is linked with lists of its own.
#include <catch2/catch.hpp>

#include "dummy_program.hpp"
#include "shape_suite.hpp"
#include "temp_folder.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/organ/scene/organ_model.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinRel;
using test::answer_of;
using test::TempFolder;

namespace {

const std::string kMaterial = R"("material": {"Einf": "5 kPa", "Eprime": "9 kPa",
  "branches": [{"g": "4 kPa", "tau": "0.5 s"}],
  "potential": {"shape": "dummy", "collagen": 0.4, "uncrimped": "2 mm"}})";

std::string scene_by(const std::string& formulation, const std::string& material = kMaterial) {
  return R"({"organ": {"kind": "liver", "count": 40}, )" + material + R"(,
  "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s", "hold": "1 s"},
  "formulation": {"kind": ")" +
         formulation + R"("}})";
}

}  // namespace

TEST_CASE("a shape in one file is in the list with its parameters") {
  const Json shapes = answer_of("simulate --list-materials").at("shapes");
  REQUIRE(test::names(shapes, "dummy"));
  for (const char* name : {"linear", "cubic", "sinh"}) CHECK(test::names(shapes, name));
  for (const Json& shape : shapes) {
    if (shape.at("name") != "dummy") continue;
    CHECK(shape.at("servo") == false);
    REQUIRE(test::names(shape.at("parameters"), "collagen"));
    CHECK(shape.at("parameters").at(1).at("unit") == "m");
    CHECK(shape.at("parameters").at(1).at("range") == "above 0");
  }
  CHECK_THAT(test::dummy_program("simulate --list-materials").text,
             Catch::Contains("uncrimped: elongation s at which collagen pulls, m, above 0"));
}

TEST_CASE("a shape in one file runs in scenes, and is refused in one line") {
  const TempFolder folder;
  const auto run = [&](const std::string& scene) {
    write_file(folder / "s.json", scene);
    return test::dummy_program("simulate " + (folder / "s.json") + " -o " + (folder / "s.h5") +
                               " --format json");
  };
  const auto force = [&](const std::string& scene) {
    const test::DummyAnswer answer = run(scene);
    CAPTURE(answer.text);
    REQUIRE(answer.code == 0);
    const std::size_t json = answer.text.find('{');
    return parse_json(answer.text.substr(json), "answer").at("last").at("response").get<double>();
  };
  const double shaped = force(scene_by("backward_euler"));
  const std::string linear = kMaterial.substr(0, kMaterial.find(R"(,
  "potential")")) + "}";
  CHECK(shaped > 1.01 * force(scene_by("backward_euler", linear)));

  const test::DummyAnswer refused = run(scene_by("servo_network"));
  CHECK(refused.code == 3);
  CHECK_THAT(refused.text, Catch::Contains("no formulation that takes a potential of any shape; "
                                           "expected one of linear, element, curves, condensed"));
  CHECK(std::count(refused.text.begin(), refused.text.end(), '\n') == 1);
  std::string missing = scene_by("static");
  missing.replace(missing.find(R"(, "uncrimped": "2 mm")"), 21, "");
  CHECK_THAT(run(missing).text,
             Catch::Contains("/material/potential/uncrimped: is missing; expected elongation s at "
                             "which collagen pulls: a text of a number and a unit of length"));
}

TEST_CASE("a sweep sets the parameters of a shape in one file by their names") {
  const TempFolder folder;
  write_file(folder / "sweep.json",
             R"({"title": "t", "model": "organ", "scene": )" + scene_by("quasi_static") + R"(,
    "axes": [{"parameter": "material.collagen", "values": [0, 0.5]},
             {"parameter": "material.uncrimped", "values": ["1 mm", "2 mm"]}],
    "outputs": ["end_force"]})");
  const Json sweep = answer_of("sweep " + (folder / "sweep.json") + " -o " + (folder / "sweep"));
  INFO(sweep.dump());
  CHECK(sweep.at("done") == 4);
}

TEST_CASE("a fit finds the parameters of a shape in one file by their names") {
  const TempFolder folder;
  const std::string scene = R"({"organ": {"kind": "liver", "count": 40}, )" + kMaterial + "}";
  write_file(folder / "scene.json", scene);
  const OrganModel organ(
      std::make_shared<const Tissue>(parse_tissue(parse_json(scene, "scene"), "scene", {})));
  std::vector<double> true_values = organ.own_values();
  constexpr double kCollagen = 0.7, kUncrimped_m = 1.5e-3;
  for (std::size_t i = 0; i < true_values.size(); ++i) {
    if (organ.parameters()[i].name == "collagen") true_values[i] = kCollagen;
    if (organ.parameters()[i].name == "uncrimped") true_values[i] = kUncrimped_m;
  }
  std::string csv = "depth_mm,time_s,force_N,provenance\n";
  const std::vector<double> times{0.0, 0.3, 3.0};
  for (const double depth_mm : {1.0, 2.5, 4.0, 6.0}) {
    const Eigen::VectorXd force =
        organ.respond(step_and_hold(1e-3 * depth_mm, 3.0), times, true_values, Want::values).value;
    for (std::size_t i = 0; i < times.size(); ++i) {
      csv += shortest(depth_mm) + "," + shortest(times[i]) + "," +
             shortest(force[static_cast<Eigen::Index>(i)]) + ",derived\n";
    }
  }
  write_file(folder / "made.csv", csv);
  write_file(folder / "made.json", R"({"id": "made", "title": "made", "kind": "points",
    "observable": "contact_force", "time_origin": "end_of_ramp",
    "columns": {"depth_mm": {"quantity": "indentation_depth", "unit": "mm"},
                "time_s": {"quantity": "time", "unit": "s"},
                "force_N": {"quantity": "contact_force", "unit": "N"}}})");
  write_file(folder / "fit.json", R"({"title": "t", "model": "organ", "scene": "scene.json",
    "parameters": {"collagen": {"start": "0.4", "lower": "0.1", "upper": "3"},
                   "uncrimped": {"start": "2 mm", "lower": "1 mm", "upper": "6 mm"}},
    "data": [{"dataset": "made.csv", "protocol": {"kind": "step_hold"},
              "noise": {"kind": "absolute", "absolute": "0.1 mN"}}],
    "starts": {"count": 1}, "profile": {"enabled": false}})");
  const test::DummyAnswer fit =
      test::dummy_program("fit " + (folder / "fit.json") + " --format json 2>/dev/null");
  INFO(fit.text);
  const Json found = parse_json(fit.text, "fit").at("parameters");
  for (const Json& p : found) {
    const double value = p.at("estimate_SI").get<double>();
    if (p.at("name") == "collagen") CHECK_THAT(value, WithinRel(kCollagen, 1e-2));
    if (p.at("name") == "uncrimped") CHECK_THAT(value, WithinRel(kUncrimped_m, 1e-2));
  }
  CHECK(found.size() == 2);

  // The scene that it leaves has the shape with the fitted values, and runs.
  const std::string left = folder / "left";
  REQUIRE(test::dummy_program("fit " + (folder / "fit.json") + " --folder " + left).code == 0);
  const Json material = read_json(left + "/scene.json").at("material");
  CHECK(material.at("potential").at("shape") == "dummy");
  CHECK_THAT(material.at("potential").at("collagen").get<double>(), WithinRel(kCollagen, 1e-2));
  CHECK_FALSE(material.contains("collagen"));
  CHECK(test::dummy_program("simulate " + left + "/scene.json -o " + (folder / "s.h5")).code == 0);
}

TEST_CASE("the suite passes the dummy and finds what does not keep its word") {
  const ElongationShape& dummy = elongation_shape("dummy", "test");
  CHECK(test::broken_promises(dummy) == std::vector<std::string>{});
  CHECK(test::broken_in_scenes(dummy) == std::vector<std::string>{});
  const std::vector<std::string> found = test::broken_promises(elongation_shape("broken", "test"));
  for (const char* check : {"rest: ", "symmetry: ", "rise: ", "slope: ", "energy: ", "derivative: ",
                            "inverse: ", "servo: ", "Legendre: ", "passivity: "}) {
    CAPTURE(check, found);
    CHECK(std::any_of(found.begin(), found.end(),
                      [&](const std::string& line) { return line.starts_with(check); }));
  }
}
