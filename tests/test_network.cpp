// The quasi-static network against the closed forms of the star, energy balance, orders.
#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/core/error.hpp"
#include "tpm/core/random.hpp"
#include "tpm/model/model.hpp"
#include "tpm/network/quasistatic.hpp"
#include "tpm/network/rigidity.hpp"

using namespace tpm;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// B between A and C at the spacing, its partner D below; only B may move.
Organ star_organ(double spacing) {
  Organ organ;
  organ.name = "star";
  organ.position.resize(3, 4);
  organ.position << 0, -spacing, spacing, 0,  //
      0, 0, 0, 0,                             //
      0, 0, 0, 0.02;
  organ.normal = Eigen::Vector3d(0, 0, -1).replicate(1, 4);
  organ.layer = {0, 0, 0, 1};
  organ.radius = 0.01;
  organ.spacing = spacing;
  organ.contact = 0;
  return organ;
}

struct Star {
  explicit Star(const TpmParameters& p)
      : network(join(star_organ(p.spacing_m), pairs(), {}, "star")), bonds(network, p), freedom(4) {
    freedom.guide(0, Eigen::Vector3d::UnitZ());
    for (const std::size_t i : {1, 2, 3}) freedom.hold(i);
  }
  static const std::vector<NeighbourPair>& pairs() {
    static const std::vector<NeighbourPair> list{{0, 1}, {0, 2}, {0, 3}};
    return list;
  }
  [[nodiscard]] QuasiStaticRun run(const Protocol& protocol, std::span<const double> times,
                                   QuasiStaticOptions options) const {
    return QuasiStatic(bonds, network.organ.position, freedom, {0, Eigen::Vector3d::UnitZ()},
                       options)
        .run(protocol, times);
  }
  Network network;
  BondSystem bonds;
  Freedom freedom;
};

std::vector<double> even_times(double end, int n) {
  std::vector<double> times;
  for (int i = 0; i <= n; ++i) times.push_back(end * i / n);
  return times;
}

}  // namespace

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
  Freedom freedom(4);
  for (const std::size_t i : {1, 2, 3}) freedom.hold(i);
  const ZeroEnergyModes modes = zero_energy_modes(bonds, network.organ.position, freedom);
  CHECK(modes.count == 1);
  CHECK(modes.spheres == std::vector<std::size_t>{0});
  CHECK_THROWS_WITH(require_rigid(bonds, network.organ.position, freedom, "star.json"),
                    Catch::StartsWith("star.json: 1 zero-energy mode; loose: sphere 1; expected"));
  freedom.guide(0, Eigen::Vector3d::UnitZ());
  CHECK(zero_energy_modes(bonds, network.organ.position, freedom).is_rigid());
}
