// Derivatives of an organ by the parameters of its material.
#include <catch2/catch.hpp>
#include <memory>
#include <vector>

#include "organ_scene.hpp"
#include "tpm/organ/scene/material_directions.hpp"
#include "tpm/organ/scene/organ_model.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "written_out_scene.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm_test;
using tpm::testing::OrganScene;

TEST_CASE("an organ is differentiated by every parameter of its material's table") {
  const auto tissue = std::make_shared<const Tissue>(parse_tissue(Json::parse(R"({
    "organ": {"kind": "liver", "count": 30},
    "material": {"Einf": "5 kPa", "Eprime": "9 kPa",
      "branches": [{"g": "4 kPa", "tau": "0.3 s"}, {"g": "3 kPa", "tau": "5 s"}],
      "potential": {"shape": "cubic", "stiffening": "4 mm"},
      "kernel": {"shape": "sinh", "stiffening": "3 mm"},
      "regions": [{"kind": "ball", "below_contact": "0 mm", "radius": "30 mm", "factor": 2},
                  {"kind": "layer", "layer": 2, "material": {"Einf": "3 kPa",
                   "potential": {"shape": "cubic", "stiffening": "6 mm"}}}]}})"),
                                                                  "s.json", {}));
  const OrganModel organ(tissue);
  CHECK_FALSE(organ.has_element());
  CHECK(organ.surrogate() == nullptr);
  const std::vector<double> p = organ.own_values();
  REQUIRE(organ.parameters().size() == 10);
  CHECK(organ.parameters()[4].name == "g1");
  CHECK(organ.range(5).first == 0.0);
  const std::vector<double> times{0.5, 1.5, 4.0};
  for (const Drive drive : {Drive::displacement, Drive::force}) {
    const double unit = drive == Drive::displacement ? 1e-3 : 0.03;
    const Protocol protocol(drive, {{0.0, 0.0}, {1.0, 5 * unit}, {4.0, 5 * unit}}, "ramp");
    const Response found = organ.respond(protocol, times, p, Want::values_and_sensitivity);
    for (std::size_t i = 0; i < p.size(); ++i) {
      CAPTURE(organ.parameters()[i].name, drive == Drive::force);
      const double h = 2e-3 * p[i];
      std::vector<double> more = p, less = p;
      more[i] += h;
      less[i] -= h;
      const Eigen::VectorXd change = organ.respond(protocol, times, more, Want::values).value -
                                     organ.respond(protocol, times, less, Want::values).value;
      const Eigen::VectorXd expected = change / (2.0 * h) * p[i];
      const Eigen::VectorXd got = found.sensitivity.col(static_cast<Eigen::Index>(i)) * p[i];
      const double scale = found.value.cwiseAbs().maxCoeff();
      CHECK((got - expected).cwiseAbs().maxCoeff() < 1e-3 * scale);
      CHECK(got.cwiseAbs().maxCoeff() > 1e-4 * scale);
    }
  }
  std::vector<double> none = p;
  none[4] = 0.0;
  const Protocol protocol(Drive::displacement, {{0.0, 0.0}, {1.0, 1e-3}}, "ramp");
  CHECK_NOTHROW(organ.respond(protocol, std::vector<double>{1.0}, none, Want::values));
  CHECK_THROWS_WITH(
      organ.respond(protocol, std::vector<double>{1.0}, none, Want::values_and_sensitivity),
      Catch::Contains("g1 = 0"));
}

TEST_CASE("a derivative across two materials that are one by chance is refused") {
  const OrganScene& scene = small_scene();
  const auto with = [&](double stiffening_m) {
    MaterialField field(material_of({0.3}, 0.5));
    field.materials.push_back(field.materials.front());
    field.materials[0].potential = elongation_function("cubic", {stiffening_m});
    field.materials[1].potential = elongation_function("cubic", {4e-3});
    field.of_sphere.assign(scene.network.organ.size(), 0);
    field.of_sphere[3] = 1;
    return BondSystem(scene.network, field);
  };
  CHECK_THROWS_WITH(direction_between(with(3.9e-3), with(4e-3), with(4.1e-3), 2e-4),
                    Catch::Contains("laws change their form"));
  CHECK_NOTHROW(direction_between(with(4.9e-3), with(5e-3), with(5.1e-3), 2e-4));
}
