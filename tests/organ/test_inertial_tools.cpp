// Tools among spheres with mass: impacts, closed forms of a sphere on a spring, the energy, and
// what forces tend to as contacts are made stiffer.
#include <catch2/catch.hpp>
#include <cmath>
#include <optional>
#include <vector>

#include "columns.hpp"
#include "expected_values.hpp"
#include "star_network.hpp"
#include "tpm/organ/balance/driven_network.hpp"
#include "tpm/organ/balance/inertial.hpp"
#include "tpm/organ/balance/tool_impact.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using tpm_test::even_times;

namespace {

constexpr double kSphere_kg = 0.004;

/// Spheres that move along z on one bond each, the lower end held, the top of each lower by a step
/// than that before it, under a wide punch that pushes along +z.
struct Springs {
  Springs(int count, double step_m, double times_stiffer, double tool_kg, double relaxation_time_s)
      : network(test::columns(count, step_m)),
        bonds(network, TpmParameters{}.with_relaxation_time(relaxation_time_s)),
        constraints(network.organ.size()) {
    for (std::size_t i = 0; i < network.organ.size(); i += 2) {
      constraints.slide(i, Eigen::Vector3d::UnitZ());
      constraints.fix(i + 1);
    }
    const Tool tool =
        touching_tool({ToolKind::punch, 1.0}, network.organ, 0, Eigen::Vector3d::UnitZ());
    driven.emplace(driven_network(bonds, network.organ, constraints, {},
                                  {{tool, 1.0, times_stiffer * bond_N_per_m()}}));
    mass_kg = Eigen::VectorXd::Constant(driven->rest.cols(), kSphere_kg);
    mass_kg.tail(1).setConstant(tool_kg);
  }
  [[nodiscard]] double bond_N_per_m() const { return bonds.stiffness()[0]; }
  [[nodiscard]] Inertial inertial(InertialOptions options = {}) const {
    return {driven->bonds, driven->rest, driven->constraints, driven->probes, mass_kg, options};
  }

  Network network;
  BondSystem bonds;
  Constraints constraints;
  std::optional<DrivenNetwork> driven;
  Eigen::VectorXd mass_kg;
};

constexpr double kNever_s = 1e9;  // a relaxation time: the bonds are springs

InertialOptions tight(double damping_ratio = 0.1) {
  InertialOptions options;
  options.tolerance = 1e-8;
  options.damping_ratio = damping_ratio;
  options.energy = true;
  return options;
}

Protocol in_and_out(double depth_m, double speed_m_s, double out_m) {
  const double in_s = depth_m / speed_m_s;
  return {Drive::displacement,
          {{0.0, 0.0},
           {in_s, depth_m},
           {2.0 * in_s, depth_m},
           {2.0 * in_s + (depth_m + out_m) / speed_m_s, -out_m},
           {6.0 * in_s + (depth_m + out_m) / speed_m_s, -out_m}}};
}

}  // namespace

TEST_CASE("an inelastic impact leaves a common speed, or that of a tool that is imposed") {
  const Eigen::VectorXd mass = Eigen::Vector2d(2.0, 3.0);
  const TouchingPair pair{0, 1, -Eigen::Vector3d::UnitZ()};  // the tool lies above, moving down +z
  Constraints constraints(2);
  Eigen::Matrix3Xd velocity = Eigen::Matrix3Xd::Zero(3, 2);
  velocity.col(1) = Eigen::Vector3d(0.5, 0.0, 4.0);
  const Eigen::VectorXd impulse = inelastic_impact({&pair, 1}, constraints, mass, velocity);
  CHECK_THAT(velocity(2, 0), WithinRel(2.4, 1e-12));  // 3 * 4/(2 + 3)
  CHECK_THAT(velocity(2, 1), WithinRel(2.4, 1e-12));
  CHECK(velocity(0, 1) == 0.5);  // no friction
  CHECK_THAT(impulse[0], WithinRel(4.8, 1e-12));
  constraints.fix(1);
  velocity.setZero();
  velocity(2, 1) = 4.0;
  CHECK_THAT(inelastic_impact({&pair, 1}, constraints, mass, velocity)[0], WithinRel(8.0, 1e-12));
  CHECK_THAT(velocity(2, 0), WithinRel(4.0, 1e-12));
  CHECK(velocity(2, 1) == 4.0);
  velocity(2, 0) = 5.0;  // it goes off by itself
  CHECK(inelastic_impact({&pair, 1}, constraints, mass, velocity)[0] == 0.0);
}

TEST_CASE("an impact on several spheres keeps momentum, pulls none, and takes energy") {
  // Spheres around a light ball, one of them already leaving.
  const Eigen::VectorXd mass = (Eigen::VectorXd(5) << 1.0, 2.0, 4.0, 8.0, 0.1).finished();
  const Constraints constraints(5);
  std::vector<TouchingPair> pairs;
  for (int i = 0; i < 4; ++i) {
    pairs.push_back({i, 4, -Eigen::Vector3d(std::cos(i), std::sin(i), 1.0 + i).normalized()});
  }
  Eigen::Matrix3Xd velocity = Eigen::Matrix3Xd::Zero(3, 5);
  velocity.col(4) = Eigen::Vector3d(0.1, -0.2, 3.0);
  velocity.col(3) = Eigen::Vector3d(0.0, 0.0, 9.0);
  const Eigen::Matrix3Xd before = velocity;
  const Eigen::VectorXd impulse = inelastic_impact(pairs, constraints, mass, velocity);
  CHECK((velocity * mass - before * mass).norm() < 1e-12 * (before * mass).norm());
  const auto kinetic = [&](const Eigen::Matrix3Xd& v) {
    return 0.5 * v.colwise().squaredNorm().dot(mass.transpose());
  };
  CHECK(kinetic(velocity) < kinetic(before));
  CHECK(impulse[3] == 0.0);
  CHECK(impulse.maxCoeff() > 0.01);
  for (int i = 0; i < 4; ++i) {
    const double rate =
        pairs[static_cast<std::size_t>(i)].normal.dot(velocity.col(4) - velocity.col(i));
    CHECK(impulse[i] >= 0.0);
    CHECK(rate > -1e-12);
    CHECK(std::abs(impulse[i] * rate) < 1e-10);
  }
}

TEST_CASE("an impact far below the speed of the whole ends where rounding does") {
  const Eigen::VectorXd mass = (Eigen::VectorXd(4) << 1.0, 2.0, 4.0, 0.1).finished();
  const Constraints constraints(4);
  std::vector<TouchingPair> pairs;
  for (int i = 0; i < 3; ++i) {
    pairs.push_back({i, 3, -Eigen::Vector3d(std::cos(i), std::sin(i), 1.0 + i).normalized()});
  }
  const Eigen::Vector3d common(3.0, -7.0, 11.0), approach(1e-9, -2e-9, 3e-8);
  Eigen::Matrix3Xd velocity = common.replicate(1, 4);
  velocity.col(3) += approach;
  const Eigen::VectorXd impulse = inelastic_impact(pairs, constraints, mass, velocity);
  Eigen::Matrix3Xd alone = Eigen::Matrix3Xd::Zero(3, 4);
  alone.col(3) = approach;
  const Eigen::VectorXd expected = inelastic_impact(pairs, constraints, mass, alone);
  CHECK((impulse - expected).norm() < 1e-5 * expected.norm());
}

TEST_CASE("a tool that moves evenly pushes with the spring's force, and its mass is the probe's") {
  const double speed = 0.2, depth = 4e-3;
  for (const double tool_kg : {0.01, 10.0}) {
    const Springs springs(1, 0.0, 1e5, tool_kg, kNever_s);
    const Inertial inertial = springs.inertial(tight());
    const std::vector<double> times{0.005, 0.01, 0.015};
    const InertialRun run =
        inertial.run({Drive::displacement, {{0.0, 0.0}, {depth / speed, depth}}}, times);
    const double k = springs.bond_N_per_m();
    const double drag = 0.2 * inertial.lowest().angular_frequency() * kSphere_kg * speed;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double expected = k * speed * times[static_cast<std::size_t>(i)] + drag;
      CAPTURE(tool_kg, i);
      CHECK_THAT(run.response[i], WithinRel(expected, 3e-5));
    }
    REQUIRE(run.impacts.size() == 1);
    CHECK(run.impacts[0].time_s == 0.0);
    CHECK_THAT(run.impacts[0].impulse_N_s, WithinRel((tool_kg + kSphere_kg) * speed, 1e-12));
    CHECK_THAT(run.impacts[0].impulse_on_tissue_N_s, WithinRel(kSphere_kg * speed, 1e-12));
  }
}

TEST_CASE("a tool in air is pushed by nothing, and does not change how the tissue is damped") {
  const auto lowest_Hz = [](double tool_kg, double times_stiffer) {
    return Springs(2, 1e-3, times_stiffer, tool_kg, 0.1).inertial().lowest().frequency_Hz;
  };
  const double alone = lowest_Hz(1e-3, 1e3);
  CHECK(lowest_Hz(10.0, 1e3) == alone);
  CHECK(lowest_Hz(1e-3, 1e5) == alone);
  const Springs springs(2, 1e-3, 1e4, 0.5, 0.1);
  const double end = 2.0 * 0.02 + (4e-3 + 0.02) / 0.2;
  const auto times = even_times(end, 40);
  const InertialRun run = springs.inertial(tight()).run(in_and_out(4e-3, 0.2, 0.02), times);
  int in_air = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (times[i] < 0.065) continue;
    ++in_air;
    CHECK(run.response[static_cast<Eigen::Index>(i)] == 0.0);
  }
  CHECK(in_air > 10);
  CHECK(run.response.maxCoeff() > 0.01);
}

TEST_CASE("under a load the force on the tissue is the load less what accelerates the tool") {
  const double tool_kg = 0.02, load = 0.05;
  const Springs springs(1, 0.0, 1e5, tool_kg, kNever_s);
  const double k = springs.bond_N_per_m(), total = tool_kg + kSphere_kg;
  const double omega = std::sqrt(k / total);
  const auto times = even_times(0.2, 20);
  std::vector<double> push;
  const auto see = [&](const QuasiStaticState&, const Eigen::VectorXd& pushes) {
    push.push_back(pushes.sum());
  };
  (void)springs.inertial(tight(0.0)).run(creep(load, 0.2), times, see);
  REQUIRE(push.size() == times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    CAPTURE(times[i]);
    const double expected = load * (1.0 - tool_kg / total * std::cos(omega * times[i]));
    if (times[i] > 0.0) CHECK_THAT(push[i], WithinAbs(expected, 2e-3 * load));
  }
}

TEST_CASE("with tools, too, the work of the probe is stored, moves or becomes heat") {
  const Springs springs(3, 1e-3, 1e4, 0.01, 0.1);
  const Protocol loads(Drive::force,
                       {{0.0, 0.0}, {0.02, 0.2}, {0.1, 0.2}, {0.1, 0.05}, {0.3, 0.05}});
  for (const Protocol& protocol : {in_and_out(4e-3, 0.2, 5e-3), loads}) {
    double last = 1.0;
    for (const double tolerance : {1e-6, 1e-8}) {
      InertialOptions options = tight();
      options.tolerance = tolerance;
      const InertialRun run = springs.inertial(options).run(protocol, {});
      const InertialEnergy energy = run.energy.value();
      CAPTURE(protocol.drive() == Drive::force, tolerance, energy.work, energy.contact_heat);
      // The second and third sphere are met at speed.
      CHECK(run.impacts.size() >= 2);
      CHECK(energy.contact_heat > 0.0);
      const double missing = std::abs(energy.missing()) / energy.work;
      CHECK(missing < 2e-3);
      CHECK(missing < last);
      last = missing;
    }
  }
}

TEST_CASE("a sphere met at speed takes it over: half m v squared becomes heat") {
  const double speed = 0.2;
  const Springs springs(2, 1e-3, 1e5, 0.01, kNever_s);
  const InertialRun run =
      springs.inertial(tight()).run({Drive::displacement, {{0.0, 0.0}, {0.01, 0.01 * speed}}}, {});
  REQUIRE(run.impacts.size() == 2);
  CHECK_THAT(run.impacts[1].time_s, WithinRel(1e-3 / speed, 1e-9));
  CHECK_THAT(run.impacts[1].impulse_on_tissue_N_s, WithinRel(kSphere_kg * speed, 1e-4));
  CHECK_THAT(run.energy->contact_heat, WithinRel(0.5 * kSphere_kg * speed * speed, 1e-2));
}

TEST_CASE("as contacts are made stiffer, the largest force settles with one over the stiffness") {
  const auto largest = [](double times_stiffer) {
    const Springs springs(3, 1e-3, times_stiffer, 0.01, 0.1);
    return springs.inertial(tight())
        .run({Drive::displacement, {{0.0, 0.0}, {0.02, 4e-3}, {0.1, 4e-3}}}, even_times(0.1, 200))
        .response.maxCoeff();
  };
  const double limit = largest(1e6);
  double last = 1.0;
  for (const double times_stiffer : {1e2, 1e3, 1e4}) {
    const double error = std::abs(largest(times_stiffer) / limit - 1.0);
    CAPTURE(times_stiffer, error);
    CHECK(error < 0.3 * last);
    last = error;
  }
  CHECK(last < test::allowed_error("tools.stiff_contact"));
}

TEST_CASE("a run with tools and mass in two halves is one run") {
  const Springs springs(3, 1e-3, 1e4, 0.01, 0.1);
  const Inertial inertial = springs.inertial(tight());
  const Protocol protocol = in_and_out(4e-3, 0.2, 5e-3);
  const std::vector<double> times{0.03, 0.05, 0.1};
  const InertialRun whole = inertial.run(protocol, times);
  for (const double cut : {0.007, 0.02}) {
    const InertialRun first = inertial.run(history_until(protocol, cut), {});
    const InertialRun rest = inertial.run(protocol, times, {}, &first.end);
    CAPTURE(cut);
    CHECK((rest.response - whole.response).cwiseAbs().maxCoeff() <
          1e-3 * whole.response.cwiseAbs().maxCoeff());
    CHECK(first.impacts.size() + rest.impacts.size() == whole.impacts.size());
    CHECK_THAT(rest.energy->work, WithinRel(whole.energy->work, 1e-3));
    CHECK_THAT(
        rest.energy->contact_heat,
        WithinRel(whole.energy->contact_heat, test::allowed_error("tools.halves_contact_heat")));
  }
}

TEST_CASE("KLU and the eliminated form integrate tools alike") {
  const Springs springs(3, 1e-3, 1e3, 0.01, 0.1);
  const auto times = even_times(0.06, 30);
  InertialOptions options = tight();
  const Protocol protocol = in_and_out(4e-3, 0.2, 5e-3);
  const Eigen::VectorXd eliminated = springs.inertial(options).run(protocol, times).response;
  options.newton = NewtonSolver::klu;
  const Eigen::VectorXd klu = springs.inertial(options).run(protocol, times).response;
  CHECK((eliminated - klu).cwiseAbs().maxCoeff() <
        test::allowed_error("tools.klu_and_eliminated") * klu.maxCoeff());
}
