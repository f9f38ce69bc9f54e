// The quasi-static network against the closed forms of the star, energy balance, orders.
#include <catch2/catch.hpp>
#include <cmath>

#include "star_network.hpp"
#include "tpm/organ/bonds/local_support.hpp"
#include "tpm/organ/bonds/rigidity.hpp"
#include "tpmkit/model.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm_test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

TEST_CASE("the guided star follows the closed form of ramp and hold") {
  for (const double eta1 : {5.0, 1e3, 2.4e5, 1e7}) {
    TpmParameters p;
    p.eta1_Pa_s = eta1;
    const Star star(p);
    const Protocol protocol = ramp_and_hold(8e-3, 4e-3, 29.0);
    const auto times = even_times(31.0, 62);
    const Eigen::VectorXd exact =
        make_model("closed_form")->respond(protocol, times, to_vector(p), Want::values).value;
    const QuasiStaticRun run = star.run(protocol, times, {1e-11});
    CAPTURE(eta1, run.work.steps, run.work.rejected, run.work.iterations);
    CHECK((run.response - exact).cwiseAbs().maxCoeff() / exact.maxCoeff() < 1e-10);
  }
}

TEST_CASE("the guided star follows the closed form of creep with the true tension") {
  TpmParameters p;
  p.eta1_Pa_s = 2.4e5;
  const Star star(p);
  const Protocol protocol = creep(0.98, std::numeric_limits<double>::infinity());
  std::vector<double> times = even_times(100.0, 20);
  times.push_back(std::numeric_limits<double>::infinity());
  const Eigen::VectorXd exact =
      make_model("closed_form")->respond(protocol, times, to_vector(p), Want::values).value;
  const QuasiStaticRun run = star.run(protocol, times, {1e-11});
  CAPTURE(run.work.steps, run.work.rejected, run.work.iterations);
  CHECK((run.response - exact).cwiseAbs().maxCoeff() / exact.maxCoeff() < 1e-10);
}

TEST_CASE("the unguided star is a mechanism out of its plane, and says which sphere is loose") {
  const TpmParameters p;
  const Network network = join(star_organ(p.spacing_m), Star::pairs(), {}, "star");
  const BondSystem bonds(network, p);
  Constraints constraints(4);
  for (const std::size_t i : {1, 2, 3}) constraints.fix(i);
  const ZeroEnergyModes modes = zero_energy_modes(bonds, network.organ.position, constraints);
  CHECK(modes.count == 1);
  CHECK(modes.spheres == std::vector<std::size_t>{0});
  CHECK_THROWS_WITH(
      require_rigid(bonds, network.organ.position, constraints, "star.json"),
      Catch::StartsWith(
          "star.json: 1 zero-energy mode; loose: sphere 1 at (0, 0, 0) mm; expected"));
  constraints.slide(0, Eigen::Vector3d::UnitZ());
  CHECK(zero_energy_modes(bonds, network.organ.position, constraints).is_rigid());
}

TEST_CASE("one loose sphere is named in the singular") {
  const TpmParameters p;
  Network network = join(star_organ(p.spacing_m), Star::pairs(), {}, "star");
  Constraints constraints(4);
  for (const std::size_t i : {1, 2, 3}) {
    const auto column = static_cast<Eigen::Index>(i);
    if (network.organ.position(2, column) == 0.0) {
      constraints.fix(i);
      continue;
    }
    // The partner follows the contact; what it does along its own normal is no question.
    constraints.slide(i, Eigen::Vector3d::UnitZ());
    network.organ.normal.col(column) = Eigen::Vector3d::UnitX();
  }
  constraints.slide(0, Eigen::Vector3d::UnitZ());
  const BondSystem bonds(network, p);
  CHECK_THROWS_WITH(require_supported(bonds, network.organ, constraints, "star.json"),
                    Catch::StartsWith("star.json: nearly a mechanism: 1 sphere is loose: sphere 1 "
                                      "at (0, 0, 0) mm, held by its neighbours with less than 0.05 "
                                      "of its bonds' stiffness (least "));
}
