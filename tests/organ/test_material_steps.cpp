// The step rules with several branches, kernels and regions, against the same branches written out
// and integrated by CVODES.
#include <catch2/catch.hpp>

#include "organ_scene.hpp"
#include "tpm/organ/balance/driven_network.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/steps/ball_by_cvode.hpp"
#include "tpm/organ/steps/method.hpp"
#include "written_out_network.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm_test;
using Catch::Matchers::WithinAbs;
using tpm::testing::OrganScene;

namespace {

constexpr double kDepth_m = 4e-3, kRamp_s = 1.0;
const std::vector<double> kRampTimes_s{0.25, 0.5, 1.0, 1.5, 2.0};

const OrganScene& liver_of_24() {
  static const OrganScene scene = [] {
    LiverRequest request;
    request.count = 24;
    return OrganScene(fill_liver(request));
  }();
  return scene;
}

Protocol ramp() {
  return {Drive::displacement, {{0.0, 0.0}, {kRamp_s, kDepth_m}, {2.0, kDepth_m}}, "ramp"};
}

BondMaterial two_branches() {
  BondMaterial m;
  m.equilibrium_Pa = 2e3;
  m.branches = {{6e3, 0.4}, {4e3, 3.0}};
  m.lateral_Pa = 12e3;
  return m;
}

/// A network and what its written-out branches answer.
class Written {
 public:
  Written(const BondMaterial& material, std::vector<double> factors = {})
      : bonds_(liver_of_24().network, field(material, factors)),
        driven_{bonds_,
                liver_of_24().network.organ.position,
                liver_of_24().constraints,
                Probes(liver_of_24().probe),
                {}} {
    std::vector<WrittenBond> written = written_bonds(liver_of_24().network, material);
    // A bond between two factors is both at half strength.
    for (std::size_t i = 0; i < written.size() && !factors.empty(); ++i) {
      const double mean = 0.5 * (factors[written[i].a] + factors[written[i].b]);
      written[i].k *= mean;
      for (WrittenBond::Branch& branch : written[i].branches) branch.g *= mean;
    }
    WrittenNetwork network(liver_of_24().network, std::move(written), liver_of_24().constraints,
                           liver_of_24().probe);
    const std::vector<double> forces = written_ramp(network, kDepth_m, kRamp_s, kRampTimes_s);
    expected_ = Eigen::VectorXd::Map(forces.data(), std::ssize(forces));
  }

  /// The largest difference in parts of the peak.
  [[nodiscard]] double error(const MethodSettings& settings) const {
    const MethodRun run = network_problem(driven_, ramp())->run(settings, kRampTimes_s);
    REQUIRE(run.end == MethodEnd::completed);
    return (run.response - expected_).cwiseAbs().maxCoeff() / expected_.maxCoeff();
  }
  [[nodiscard]] double error(StepRule rule, double step_s) const {
    MethodSettings settings;
    settings.rule = rule;
    settings.step_s = step_s;
    settings.sweeps = 200;  // XPBD has its order once the bonds agree
    return error(settings);
  }

 private:
  static MaterialField field(const BondMaterial& material, const std::vector<double>& factors) {
    MaterialField field(material);
    if (!factors.empty()) {
      field.factor = Eigen::VectorXd::Map(factors.data(), std::ssize(factors));
    }
    return field;
  }
  BondSystem bonds_;
  DrivenNetwork driven_;
  Eigen::VectorXd expected_;
};

void check_rules(const Written& written) {
  for (const StepRuleEntry& entry : kStepRules) {
    INFO(entry.text);
    if (entry.adaptive) {
      MethodSettings settings;
      settings.rule = entry.meaning;
      settings.tolerance = 1e-8;
      CHECK(written.error(settings) < 1e-6);
      continue;
    }
    const double step_s = entry.order == 4 ? 0.1 : 0.05;
    const double coarse = written.error(entry.meaning, step_s);
    const double fine = written.error(entry.meaning, 0.5 * step_s);
    CHECK_THAT(std::log2(coarse / fine), WithinAbs(entry.order, 0.25));
  }
}

}  // namespace

TEST_CASE("every step rule follows two branches with its order", "[method]") {
  check_rules(Written(two_branches()));
}

TEST_CASE("step rules take a stiffening potential, a kernel and factors of place", "[method]") {
  BondMaterial m = two_branches();
  m.potential = elongation_function("cubic", {8e-3});
  m.kernel = elongation_function("cubic", {6e-3});
  std::vector<double> factors(liver_of_24().network.organ.size(), 1.0);
  factors[*liver_of_24().network.organ.contact] = 3.0;
  check_rules(Written(m, factors));
}

TEST_CASE("a ball by CVODE takes several branches: one written as two is the same", "[method]") {
  const OrganScene& scene = liver_of_24();
  BondMaterial one = two_branches();
  one.branches = {{10e3, 0.4}};
  BondMaterial two = one;
  two.branches = {{4e3, 0.4}, {6e3, 0.4 * (1.0 + 1e-9)}};
  const BallTool ball =
      ball_on_surface(scene.network.organ, scene.probe.sphere, scene.probe.direction, 10e-3);
  std::vector<BallPlace> places;
  for (const double depth_m : {0.0, 1e-3, 3e-3, 3e-3}) {
    places.push_back(
        {0.3 * static_cast<double>(places.size()), ball.start_m + depth_m * scene.probe.direction});
  }
  const auto forces = [&](const BondMaterial& material) {
    const BondSystem bonds(scene.network, material);
    return ball_forces_by_cvode(bonds, scene.network.organ.position, scene.constraints, ball,
                                places, 1e-9);
  };
  const auto a = forces(one), b = forces(two);
  REQUIRE(a.back().norm() > 1e-2);
  CHECK(a[2].norm() > 1.01 * a.back().norm());
  for (std::size_t i = 0; i < a.size(); ++i) CHECK((a[i] - b[i]).norm() < 1e-6 * a[2].norm());
}
