// Derivatives of quasi-static runs: against the closed form of the star, and central differences.
#include <catch2/catch.hpp>
#include <cmath>

#include "organ_scene.hpp"
#include "star_network.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/scene/material_directions.hpp"
#include "tpmkit/model.hpp"

using namespace tpm;
using namespace tpm::organ;
using tpm::testing::OrganScene;
using tpm_test::even_times;
using tpm_test::Star;

namespace {

/// d / d ln of E1, E2, E', eta1 and of all that is imposed.
std::vector<TangentDirection> all_directions(const Network& network,
                                             const TpmParameters& material) {
  std::vector<TangentDirection> directions;
  const TpmVector values = to_vector(material);
  for (TangentDirection& d : material_directions(network, material.E1_Pa, material.E2_Pa,
                                                 material.modulus_to_stiffness_m())) {
    const double value = values[directions.size()];
    directions.push_back({value * d.stiffness, value * d.relaxing, value * d.log_relaxation_time});
  }
  const Eigen::VectorXd zero =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(network.bonds.size()));
  directions.push_back({zero, zero, 1.0, 0.0});
  directions.push_back({zero, zero, 0.0, 1.0});
  return directions;
}

TpmParameters unequal(double relaxation_time_s) {
  TpmParameters p;
  p.E1_Pa = 9e3;
  p.E2_Pa = 14e3;
  p.Eprime_Pa = 11e3;
  return p.with_relaxation_time(relaxation_time_s);
}

void check_star(const Protocol& protocol, const std::vector<double>& times) {
  for (const double tau : {1e-3, 0.5, 20.0}) {
    const TpmParameters p = unequal(tau);
    const Star star(p);
    const QuasiStaticRun run = star.run(
        protocol, times, {.tolerance = 1e-10, .directions = all_directions(star.network, p)});
    const Response exact =
        make_model("closed_form")
            ->respond(protocol, times, to_vector(p), Want::values_and_sensitivity);
    const double scale = exact.value.cwiseAbs().maxCoeff();
    CAPTURE(tau);
    CHECK((run.response - exact.value).cwiseAbs().maxCoeff() < 1e-9 * scale);
    const TpmVector values = to_vector(p);
    for (const int i : {kE1, kE2, kEprime, kEta1}) {
      CAPTURE(i);
      const Eigen::VectorXd expected =
          exact.sensitivity.col(i) * values[static_cast<std::size_t>(i)];
      CHECK((run.derivative.col(i) - expected).cwiseAbs().maxCoeff() < 1e-8 * scale);
    }
  }
}

}  // namespace

TEST_CASE("the star's derivatives are those of the closed form, driven by depth") {
  check_star(ramp_and_hold(8e-3, 4e-3, 10.0), even_times(12.0, 24));
  std::vector<double> times = even_times(10.0, 10);
  times.push_back(std::numeric_limits<double>::infinity());
  check_star(step_and_hold(6e-3, std::numeric_limits<double>::infinity()), times);
}

TEST_CASE("the star's derivatives are those of the closed form, driven by load") {
  std::vector<double> times = even_times(30.0, 15);
  times.push_back(std::numeric_limits<double>::infinity());
  check_star(creep(0.5, std::numeric_limits<double>::infinity()), times);
}

TEST_CASE("an organ's derivatives are the limits of its differences", "[heavy]") {
  LiverRequest request;
  request.count = 60;
  const OrganScene scene(fill_liver(request));
  const TpmParameters p = unequal(0.8);
  const double inf = std::numeric_limits<double>::infinity();
  const std::vector<double> times{0.4, 1.7, 2.6, 5.0, inf};
  for (const Protocol& protocol :
       {Protocol(Drive::displacement, {{0.0, 0.0}, {0.0, 1e-3}, {2.0, 6e-3}, {3.0, 4e-3}}, "d",
                 true),
        Protocol(Drive::force, {{0.0, 0.0}, {0.0, 0.02}, {2.0, 0.15}, {3.0, 0.1}}, "f", true)}) {
    const QuasiStaticRun run = scene.run(
        p, protocol, times, {.tolerance = 1e-10, .directions = all_directions(scene.network, p)});
    const double scale = run.response.cwiseAbs().maxCoeff();
    constexpr double kChange = 1e-4;
    const auto value = [&](int direction, double sign) {
      TpmVector values = to_vector(p);
      const double factor = std::exp(sign * kChange);
      if (direction < 4) values[static_cast<std::size_t>(direction)] *= factor;
      const Protocol imposed = protocol.scaled(direction < 4 ? 1.0 : factor);
      return scene.run(from_vector(values), imposed, times, {.tolerance = 1e-11}).response;
    };
    for (int i = 0; i < 5; ++i) {
      const Eigen::VectorXd expected = (value(i, 1.0) - value(i, -1.0)) / (2.0 * kChange);
      CAPTURE(i, protocol.name());
      CHECK((run.derivative.col(i) - expected).cwiseAbs().maxCoeff() < 1e-6 * scale);
    }
  }
}
