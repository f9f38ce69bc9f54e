// The inertial network: closed forms of one sphere, energy, the slow limit, invariance.
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "loaded_oscillator.hpp"
#include "star_network.hpp"
#include "tpm/base/random.hpp"
#include "tpm/organ/balance/inertial.hpp"
#include "tpm/organ/balance/inertial_equation.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm_test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double kMass = 0.05;

Inertial inertial_star(const Star& star, const InertialOptions& options) {
  return {star.bonds,    star.network.organ.position,         star.constraints,
          Star::probe(), Eigen::VectorXd::Constant(4, kMass), options};
}

/// A block of two layers, its lower layer partly held, the contact in the middle of the upper one.
struct HeldBlock {
  explicit HeldBlock(const TpmParameters& p,
                     const Eigen::Matrix3d& rotation = Eigen::Matrix3d::Identity(),
                     const Eigen::Vector3d& shift = Eigen::Vector3d::Zero(),
                     const std::vector<std::size_t>& order = {})
      : network(build_network(renumbered(moved(organ(), rotation, shift), order), {}, "block")),
        bonds(network, p),
        constraints(network.organ.size()),
        probe{*network.organ.contact, -rotation.col(2)} {
    for (std::size_t i = 0; i < network.organ.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      const Eigen::Vector3d at =
          rotation.transpose() * (network.organ.position.col(column) - shift);
      if (network.organ.layer[i] == 1 && at.x() < 0.03) constraints.fix(i);
    }
  }

  /// 4 x 3 x 2 spheres 20 mm apart, not quite on a lattice.
  static Organ organ() {
    Organ o = block(3, 2, 1, 0.02, Lattice::cubic);
    Random random(3);
    for (double& x : o.position.reshaped()) x += 1e-3 * random.normal();
    o.contact = 5;
    return o;
  }
  static Organ renumbered(Organ o, const std::vector<std::size_t>& order) {
    if (order.empty()) return o;
    const Organ old = o;
    for (std::size_t i = 0; i < order.size(); ++i) {
      const auto to = static_cast<Eigen::Index>(i);
      const auto from = static_cast<Eigen::Index>(order[i]);
      o.position.col(to) = old.position.col(from);
      o.normal.col(to) = old.normal.col(from);
      o.layer[i] = old.layer[order[i]];
      if (order[i] == *old.contact) o.contact = i;
    }
    return o;
  }
  [[nodiscard]] Inertial inertial(const InertialOptions& options) const {
    return {bonds, network.organ.position,          constraints,
            probe, sphere_masses_kg(network.organ), options};
  }

  Network network;
  BondSystem bonds;
  Constraints constraints;
  Probe probe;
};

TpmParameters slow_tissue() {
  TpmParameters p;
  p.eta1_Pa_s = 2.4e3;  // tau = 0.1 s
  return p;
}

Protocol push_and_release() {
  return {Drive::displacement, {{0.0, 0.0}, {0.2, 4e-3}, {0.5, 4e-3}, {0.6, 1e-3}, {0.8, 1e-3}}};
}

}  // namespace

TEST_CASE("the mass of a sphere is density times volume") {
  const Star star{TpmParameters{}};
  const Eigen::VectorXd mass = sphere_masses_kg(star.network.organ);
  CHECK(mass.size() == 4);
  CHECK_THAT(mass[0], WithinRel(1060.0 * 4.0 / 3.0 * std::numbers::pi * 1e-6, 1e-15));
}

TEST_CASE("a guided sphere under a small load follows the damped oscillator with a Zener bond") {
  for (const double eta1 : {5.0, 240.0, 2.4e3, 1e6}) {
    TpmParameters p;
    p.eta1_Pa_s = eta1;
    const Star star(p);
    InertialOptions options;
    options.tolerance = 1e-10;
    options.highest_order = 5;
    const Inertial inertial = inertial_star(star, options);
    const double drag_per_s = 2.0 * 0.1 * inertial.lowest().angular_frequency();
    // 1e-8 N: the tension of the lateral bonds, cubic in the depth, is below rounding.
    const double load = 1e-8;
    const auto times = even_times(0.5, 25);
    const InertialRun run = inertial.run(creep(load, 0.5), times);
    const double end = load / (p.equilibrium_modulus_Pa() * p.modulus_to_stiffness_m());
    const Eigen::VectorXd exact = loaded_oscillator(p, kMass, drag_per_s, load, times);
    CAPTURE(eta1, run.work.steps);
    for (std::size_t i = 0; i < times.size(); ++i) {
      CAPTURE(times[i]);
      const auto at = static_cast<Eigen::Index>(i);
      CHECK_THAT(run.response[at], WithinAbs(exact[at], 2e-7 * end));
    }
  }
}

TEST_CASE("the lowest mode of the star is the root of its own storage stiffness") {
  for (const double eta1 : {5.0, 240.0, 2.4e3, 1e6}) {
    TpmParameters p;
    p.eta1_Pa_s = eta1;
    const Star star(p);
    const LowestMode mode = inertial_star(star, {}).lowest();
    const double scale = p.modulus_to_stiffness_m();
    const double tau = p.relaxation_time_s();
    const double omega = mode.angular_frequency();
    const double storage =
        scale * (p.E2_Pa - p.relaxing_modulus_Pa() / (1.0 + omega * omega * tau * tau));
    CAPTURE(eta1);
    CHECK_THAT(omega, WithinRel(std::sqrt(storage / kMass), 1e-11));
    CHECK_THAT(kMass * mode.shape.squaredNorm(), WithinRel(1.0, 1e-12));
  }
}

TEST_CASE("released, the star rings down with the frequency and the ratio of its lowest mode") {
  TpmParameters p;
  p.eta1_Pa_s = 1e8;  // relaxes within an hour: the bond is a spring here
  const Star star(p);
  for (const double share : {0.0, 1.0}) {
    InertialOptions options;
    options.tolerance = 1e-10;
    options.highest_order = 5;
    options.stiffness_share = share;
    const Inertial inertial = inertial_star(star, options);
    const double omega = inertial.lowest().angular_frequency();
    const double damped = omega * std::sqrt(1.0 - 0.01);
    // A load that acts briefly; then the free swing repeats after one period, weaker.
    const Protocol tap(Drive::force, {{0.0, 0.0}, {1e-3, 1e-7}, {2e-3, 0.0}, {2.0, 0.0}});
    const double period = 2.0 * std::numbers::pi / damped;
    const std::vector<double> times{0.05, 0.05 + period, 0.05 + 2.0 * period};
    const InertialRun run = inertial.run(tap, times);
    const double ratio = std::exp(-0.1 * omega * period);
    CAPTURE(share);
    CHECK_THAT(run.response[1] / run.response[0], WithinRel(ratio, 1e-5));
    CHECK_THAT(run.response[2] / run.response[1], WithinRel(ratio, 1e-5));
  }
}

TEST_CASE("the lowest mode of a block agrees with the dense eigenvalue problem") {
  TpmParameters p;
  p.eta1_Pa_s = 1e9;  // nothing relaxes
  const HeldBlock block(p);
  const Eigen::VectorXd mass = sphere_masses_kg(block.network.organ);
  const LowestMode mode =
      lowest_mode(block.bonds, block.network.organ.position, block.constraints, mass);
  const Eigen::Index n = block.network.organ.position.cols();
  Eigen::MatrixXd stiffness(3 * n, 3 * n);
  const ViscousState none{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(block.bonds.size())),
                          0.0};
  for (Eigen::Index i = 0; i < 3 * n; ++i) {
    Eigen::Matrix3Xd unit = Eigen::Matrix3Xd::Zero(3, n);
    unit.reshaped()[i] = 1.0;
    block.constraints.project(unit);
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, n);
    block.bonds.add_stiffness_times(block.network.organ.position, none, unit, force);
    block.constraints.project(force);
    stiffness.col(i) = force.reshaped() / mass[0];
  }
  const Eigen::VectorXd squares =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(stiffness).eigenvalues();
  const auto held = 3 * n - static_cast<Eigen::Index>(block.constraints.count());
  CHECK(squares[held - 1] < 1e-6 * squares[held]);
  CHECK_THAT(mode.angular_frequency(), WithinRel(std::sqrt(squares[held]), 1e-8));
}

TEST_CASE("the Jacobian is the derivative of the equations of motion") {
  const HeldBlock block(slow_tissue());
  for (const Drive drive : {Drive::displacement, Drive::force}) {
    DrivenTissue tissue(block.bonds, block.network.organ.position, block.constraints, block.probe,
                        drive);
    Inertia inertia{sphere_masses_kg(block.network.organ), 3.0,
                    Eigen::VectorXd::Constant(static_cast<Eigen::Index>(block.bonds.size()), 0.1)};
    InertialEquation equation(tissue, block.network.organ.position, inertia);
    equation.set_piece({0.0, 0.0}, {1.0, 4e-3});
    const Eigen::Index n = equation.size();
    const Eigen::Index coordinates = equation.coordinates();
    Random random(1);
    Eigen::VectorXd state(n);
    for (double& x : state) x = 1e-3 * random.normal();
    state.segment(coordinates, coordinates) *= 100.0;
    const auto project = [&](Eigen::VectorXd& s) {
      for (const Eigen::Index begin : {Eigen::Index{0}, coordinates}) {
        Eigen::Map<Eigen::Matrix3Xd> spheres(s.data() + begin, 3, coordinates / 3);
        tissue.constraints().project(spheres);
      }
    };
    project(state);
    const Eigen::MatrixXd jacobian = equation.jacobian(0.5, state);
    Eigen::VectorXd up(n);
    Eigen::VectorXd down(n);
    for (int trial = 0; trial < 20; ++trial) {
      Eigen::VectorXd step(n);
      for (double& x : step) x = 1e-7 * random.normal();
      project(step);
      equation.rate(0.5, state + step, up);
      equation.rate(0.5, state - step, down);
      const Eigen::VectorXd difference = 0.5 * (up - down);
      CHECK((difference - jacobian * step).norm() < 1e-7 * difference.norm());
    }
    // Without the bonds' dashpots, whose turning it leaves out, the eliminated solve is exact.
    InertialEquation undamped(tissue, block.network.organ.position,
                              {inertia.mass_kg, inertia.drag_per_s, {}});
    undamped.set_piece({0.0, 0.0}, {1.0, 4e-3});
    for (const double gamma : {1e-5, 1e-2, 10.0}) {
      const Eigen::MatrixXd newton =
          Eigen::MatrixXd::Identity(n, n) - gamma * Eigen::MatrixXd(undamped.jacobian(0.5, state));
      Eigen::VectorXd right(n);
      for (double& x : right) x = random.normal();
      project(right);
      const Eigen::VectorXd exact = newton.lu().solve(right);
      REQUIRE(undamped.factorise(0.5, state, gamma));
      Eigen::VectorXd solution = right;
      undamped.solve(solution);
      CAPTURE(gamma);
      CHECK((solution - exact).norm() < 1e-8 * exact.norm());
    }
  }
}

TEST_CASE("KLU and the eliminated form integrate alike") {
  const HeldBlock block(slow_tissue());
  const auto times = even_times(0.8, 16);
  InertialOptions options;
  options.tolerance = 1e-8;
  options.stiffness_share = 0.3;
  const InertialRun eliminated = block.inertial(options).run(push_and_release(), times);
  options.newton = NewtonSolver::klu;
  const InertialRun klu = block.inertial(options).run(push_and_release(), times);
  const double peak = klu.response.cwiseAbs().maxCoeff();
  CHECK((eliminated.response - klu.response).cwiseAbs().maxCoeff() < 1e-5 * peak);
  CHECK(klu.work.steps > 10);
}

TEST_CASE("the work of the probe is stored, moves spheres or becomes heat") {
  const HeldBlock block(slow_tissue());
  const Protocol loads(Drive::force, {{0.0, 0.0}, {0.1, 0.3}, {0.3, 0.3}, {0.3, -0.1}, {0.5, 0.1}});
  for (const Protocol& protocol : {push_and_release(), loads}) {
    for (const double share : {0.0, 0.5}) {
      for (const double tolerance : {1e-6, 1e-8, 1e-10}) {
        InertialOptions options;
        options.tolerance = tolerance;
        options.highest_order = 5;
        options.stiffness_share = share;
        options.energy = true;
        const InertialEnergy energy = *block.inertial(options).run(protocol, {}).energy;
        CAPTURE(protocol.drive() == Drive::force, share, tolerance, energy.work);
        CHECK(energy.bond_heat > 0.0);
        CHECK(energy.damping_heat > 0.0);
        CHECK(energy.kinetic > 0.0);
        const double spent = energy.bond_heat + energy.damping_heat;
        CAPTURE(energy.missing() / spent);
        CHECK(std::abs(energy.missing()) < 2000.0 * tolerance * spent);
      }
    }
  }
}

TEST_CASE("a run with mass in two halves is one run") {
  const HeldBlock block(slow_tissue());
  const Protocol loads(Drive::force, {{0.0, 0.0}, {0.1, 0.3}, {0.3, 0.3}, {0.3, -0.1}, {0.5, 0.1}});
  InertialOptions options;
  options.tolerance = 1e-9;
  options.highest_order = 5;
  options.energy = true;
  const Inertial inertial = block.inertial(options);
  for (const Protocol& protocol : {push_and_release(), loads}) {
    const double end = protocol.end_s();
    const std::vector<double> times{0.7 * end, end};
    const InertialRun whole = inertial.run(protocol, times);
    // In the middle of a piece, at a kink or jump, and just before the end.
    for (const double cut : {0.15 * end, protocol.knots()[1].time_s, protocol.knots()[2].time_s}) {
      CAPTURE(protocol.drive() == Drive::force, cut);
      const InertialRun first = inertial.run(history_until(protocol, cut), {});
      const InertialRun rest = inertial.run(protocol, times, {}, &first.end);
      CHECK((rest.response - whole.response).cwiseAbs().maxCoeff() <
            1e-5 * whole.response.cwiseAbs().maxCoeff());
      CHECK((rest.position - whole.position).cwiseAbs().maxCoeff() < 1e-7);
      CHECK_THAT(rest.energy->work, WithinRel(whole.energy->work, 1e-4));
      CHECK_THAT(rest.energy->damping_heat, WithinRel(whole.energy->damping_heat, 1e-4));
      CHECK(rest.impacts.size() + first.impacts.size() == whole.impacts.size());
      CHECK_THROWS_WITH(inertial.run(protocol, std::vector{0.0}, {}, &first.end),
                        Catch::Matchers::Contains("times from"));
      InertialState cut_short = first.end;
      cut_short.motion.conservativeResize(5);
      CHECK_THROWS_WITH(inertial.run(protocol, times, {}, &cut_short),
                        Catch::Matchers::Contains("as the network has"));
    }
  }
}

TEST_CASE("driven slowly, the inertial network is the quasi-static one", "[heavy]") {
  const HeldBlock block(slow_tissue());
  double last = 1.0;
  for (const double slowness : {1.0, 10.0, 100.0}) {
    const Protocol ramp = ramp_and_hold(4e-3, 4e-3 / slowness, 9.0 * slowness);
    const std::vector<double> times{0.5 * slowness, 10.0 * slowness};
    InertialOptions options;
    options.tolerance = 1e-9;
    const InertialRun run = block.inertial(options).run(ramp, times);
    const QuasiStaticRun exact = QuasiStatic(block.bonds, block.network.organ.position,
                                             block.constraints, block.probe, {1e-9})
                                     .run(ramp, times);
    const Eigen::VectorXd error = (run.response - exact.response) / exact.response[1];
    CAPTURE(slowness, error.transpose());
    // On the ramp the difference is the drag on the moving spheres, in proportion to the speed.
    CHECK(std::abs(error[0]) < 0.5 * last);
    CHECK(std::abs(error[1]) < 1e-6);
    last = std::abs(error[0]);
  }
  CHECK(last < 1e-4);
}

TEST_CASE("a preload starts in equilibrium and a release rings down to rest") {
  const HeldBlock block(slow_tissue());
  Protocol release(Drive::force, {{0.0, 0.2}, {0.1, 0.2}, {0.1, 0.0}, {20.0, 0.0}});
  release.set_equilibrium_at_start(true);
  InertialOptions options;
  options.tolerance = 1e-7;
  options.energy = true;
  const std::vector<double> times{0.0, 0.05, 20.0};
  const InertialRun run = block.inertial(options).run(release, times);
  CHECK(run.response[0] > 1e-4);
  CHECK_THAT(run.response[1], WithinRel(run.response[0], 1e-4));
  CHECK_THAT(run.response[2], WithinAbs(0.0, 1e-4 * run.response[0]));
  CHECK(run.energy->stored < 0.0);
  CHECK(std::abs(run.energy->missing()) < 1e-2 * -run.energy->stored);
}

TEST_CASE("the force on the driven sphere itself is stated apart, and so are impacts") {
  const Star star(slow_tissue());
  const Inertial inertial = inertial_star(star, {});
  const std::vector<double> times{0.1, 0.5};
  const InertialRun run =
      inertial.run({Drive::displacement, {{0.0, 0.0}, {0.25, 1e-3}, {1.0, 1e-3}}}, times);
  const double drag = 0.2 * inertial.lowest().angular_frequency();
  CHECK_THAT(run.of_driven_sphere[0], WithinRel(kMass * drag * 4e-3, 1e-12));
  CHECK(run.of_driven_sphere[1] == 0.0);
  REQUIRE(run.impacts.size() == 2);
  CHECK_THAT(run.impacts[0].impulse_N_s, WithinRel(kMass * 4e-3, 1e-12));
  CHECK_THAT(run.impacts[1].impulse_N_s, WithinRel(-kMass * 4e-3, 1e-12));
  CHECK(run.impacts[1].time_s == 0.25);
}

TEST_CASE("the motion depends neither on the numbering nor on a rigid motion of the scene") {
  const TpmParameters p = slow_tissue();
  const auto times = even_times(0.8, 8);
  InertialOptions options;
  options.tolerance = 1e-8;
  options.stiffness_share = 0.3;
  const Eigen::VectorXd plain =
      HeldBlock(p).inertial(options).run(push_and_release(), times).response;
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  std::vector<std::size_t> order(24);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::reverse(order.begin(), order.begin() + 17);
  std::swap(order[3], order[20]);
  const Eigen::VectorXd other = HeldBlock(p, rotation, {0.1, -0.2, 0.3}, order)
                                    .inertial(options)
                                    .run(push_and_release(), times)
                                    .response;
  CHECK((plain - other).cwiseAbs().maxCoeff() < 1e-8 * plain.cwiseAbs().maxCoeff());
}

TEST_CASE("what an inertial run cannot do is refused in one line") {
  const Star star(slow_tissue());
  const Inertial inertial = inertial_star(star, {});
  const std::vector<double> end{1.0};
  CHECK_THROWS_WITH(inertial.run(step_and_hold(1e-3, 1.0), end),
                    Catch::StartsWith("step and hold: the depth jumps"));
  const std::vector<double> never{std::numeric_limits<double>::infinity()};
  CHECK_THROWS_WITH(inertial.run(creep(0.1, never[0]), never),
                    Catch::StartsWith("creep: an integrator does not reach t = infinity"));
  InertialOptions options;
  options.tolerance = 0.0;
  CHECK_THROWS_WITH(inertial_star(star, options), Catch::StartsWith("tolerance: 0; expected"));
  options = {};
  options.damping_ratio = -0.1;
  CHECK_THROWS_WITH(inertial_star(star, options), Catch::StartsWith("damping ratio: -0.1"));
  CHECK_THROWS_WITH(Inertial(star.bonds, star.network.organ.position, star.constraints,
                             Star::probe(), Eigen::Vector4d(1, 0, 1, 1)),
                    Catch::StartsWith("mass: of sphere 2 is not above 0"));
}
