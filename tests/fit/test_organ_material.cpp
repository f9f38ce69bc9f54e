// A law put on an organ: the star answers as its bond does, the fit finds a material that is there,
// the covariance against refits, and what is refused.
#include <catch2/catch.hpp>
#include <cmath>

#include "expected_values.hpp"
#include "liver_of_60.hpp"
#include "refusal.hpp"
#include "tpm/fit/predict/organ_material.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;

/// Two branches with an offset and contact that no organ feels.
LawFile two_branches(double k_inf) {
  LawFile law;
  law.spec = parse_law_name("linear-2", "test");
  law.spec.reference = 4e-3;
  law.values = {k_inf, 50.0, 30.0, 0.5, 5.0, 3e-4, 0.02};
  law.provenance = Provenance::derived;
  LawUncertainty u;
  u.place = {0, 1};
  u.coordinate = {Coordinate::linear, Coordinate::linear};
  u.covariance = Eigen::Vector2d(4.0, 9.0).asDiagonal();
  law.uncertainty = u;
  return law;
}

OrganMaterial on_liver(const LawFile& law, const OrganMaterialOptions& options = {}) {
  return put_on_organ(law, {testing::ramp_to_2_mm()}, testing::liver_of_60(), "test", {}, options);
}

}  // namespace

TEST_CASE("at small depths correspondence alone makes an organ answer as the law") {
  std::vector<double> times;
  for (int i = 0; i <= 24; ++i) times.push_back(0.25 * i);
  const MaterialMotion shallow = motion_of_protocol(ramp_and_hold(2e-6, 2e-6, 5.0), times);
  const OrganMaterial m =
      put_on_organ(two_branches(100.0), {shallow}, testing::liver_of_60(), "test", {}, {});
  // What is left grows with the depth over the spacing.
  CHECK(m.start.largest < test::allowed_error("organ_material.correspondence"));
  CHECK(m.organ.largest <= m.start.largest);
}

TEST_CASE("the written scene answers in a run as the fit says") {
  const OrganMaterial m = on_liver(two_branches(100.0));
  CHECK(m.organ.rms < m.start.rms);
  CHECK(m.remarks.empty());
  Json scene = m.scene;
  scene["protocol"] = {
      {"kind", "ramp_hold"}, {"depth", "2 mm"}, {"rate", "2 mm/s"}, {"hold", "5 s"}};
  const Trajectory run =
      run_scene(parse_experiment(scene, "test", {}), m.courses.front().time_s, false);
  for (std::size_t i = 0; i < m.courses.front().time_s.size(); ++i) {
    CHECK(run.response[static_cast<Eigen::Index>(i)] ==
          Approx(m.courses.front().organ_N[i]).margin(1e-5 * m.peak_N));
  }
}

TEST_CASE("intervals are what fits to changed laws scatter by") {
  const OrganMaterial m = on_liver(two_branches(100.0));
  REQUIRE(m.covariance.rows() == 3);
  constexpr double kStep = 0.5;  // N/m; the standard deviation of k_inf is 2
  const OrganMaterial more = on_liver(two_branches(100.0 + kStep));
  LawFile only_k_inf = two_branches(100.0);
  only_k_inf.uncertainty->covariance(1, 1) = 0.0;
  const OrganMaterial one = on_liver(only_k_inf);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double slope = std::log(more.parameters[i].value / m.parameters[i].value) / kStep;
    CAPTURE(m.parameters[i].parameter.name);
    CHECK(std::sqrt(one.covariance(k, k)) ==
          Approx(2.0 * std::abs(slope)).epsilon(0.05).margin(2e-4));
    CHECK(*m.parameters[i].lower < m.parameters[i].value);
    CHECK(*m.parameters[i].upper > m.parameters[i].value);
  }
}

TEST_CASE("laws, motions and scenes that no organ can take are refused") {
  LawFile fractional = two_branches(100.0);
  fractional.spec = parse_law_name("linear-fzener", "test");
  CHECK_THAT(test::refusal_of([&] { (void)on_liver(fractional); }),
             Contains("cannot be put on an organ"));
  Json patch = testing::liver_of_60();
  patch["contacts"] = Json::parse(R"([{"kind": "patch", "radius": "30 mm"}])");
  CHECK_THAT(test::refusal_of([&] {
               (void)put_on_organ(two_branches(100.0), {testing::ramp_to_2_mm()}, patch, "test", {},
                                  {});
             }),
             Contains("is not one sphere"));
  CHECK_THAT(test::refusal_of([&] {
               (void)motion_of_protocol(creep(1.0, 5.0), {0.0, 1.0});
             }),
             Contains("does not press"));
}

}  // namespace tpm::fit
