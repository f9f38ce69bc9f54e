// Tools that push and do not hold: against closed forms of single bonds, balances of force and
// energy, and the same runs with spheres driven themselves.
#include <boost/math/tools/roots.hpp>
#include <catch2/catch.hpp>
#include <cmath>

#include "columns.hpp"
#include "star_network.hpp"
#include "tpm/organ/balance/driven_network.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpm/organ/run/static_path.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/model.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using tpm_test::even_times;
using tpm_test::Star;

namespace {

TpmParameters material(double relaxation_time_s) {
  return TpmParameters{}.with_relaxation_time(relaxation_time_s);
}

Tool tool_at(const Organ& organ, std::size_t sphere, const Eigen::Vector3d& direction,
             ToolShape shape = {}) {
  return touching_tool(shape, organ, sphere, direction);
}

/// Columns of two spheres with one radial bond each, the lower one held, side by side along x; the
/// top of each lower by a step than that before it. Springs with a viscous branch and nothing else.
struct Columns {
  Columns(int count, double step, const TpmParameters& p, double stiffness,
          ToolShape shape = {ToolKind::punch, 1.0})
      : network(test::columns(count, step)),
        bonds(network, p),
        constraints(network.organ.size()),
        stiffness_N_per_m(stiffness) {
    for (int i = 0; i < count; ++i) {
      constraints.slide(top(i), Eigen::Vector3d::UnitZ());
      constraints.fix(top(i) + 1);
    }
    const Tool tool = tool_at(network.organ, 0, Eigen::Vector3d::UnitZ(), shape);
    driven.emplace(driven_network(bonds, network.organ, constraints, {}, {{tool, 1.0, stiffness}}));
  }
  static std::size_t top(int column) { return 2 * static_cast<std::size_t>(column); }
  [[nodiscard]] QuasiStaticRun run(const Protocol& protocol, std::span<const double> times,
                                   QuasiStaticOptions options,
                                   const QuasiStaticObserver& observer = {}) const {
    return QuasiStatic(driven->bonds, driven->rest, driven->constraints, driven->probes,
                       std::move(options))
        .run(protocol, times, observer);
  }
  Network network;
  BondSystem bonds;
  Constraints constraints;
  double stiffness_N_per_m;
  std::optional<DrivenNetwork> driven;
};

/// A Zener bond in series with a contact spring that only pushes, under a depth that moves at a
/// rate: l = (c D + g y)/(k + c) while they touch, dy/dt = (l - y)/tau.
struct Press {
  double k, g, c, tau;
  double y = 0.0;

  [[nodiscard]] double leak() const { return 1.0 - g / (k + c); }
  [[nodiscard]] double gain() const { return c / (k + c); }
  [[nodiscard]] double y_after(double time, double depth, double rate) const {
    // The particular solution is linear in time, the rest decays.
    const double a = leak() / tau;
    const double slope = gain() * rate / leak();
    const double offset = (gain() * depth / tau - slope) / a;
    return (y - offset) * std::exp(-a * time) + offset + slope * time;
  }
  [[nodiscard]] double force(double depth, double viscous) const {
    return c * (depth - (c * depth + g * viscous) / (k + c));
  }
};

}  // namespace

TEST_CASE("a tool is put where it first touches") {
  const Organ organ = test::columns(3, -0.001).organ;  // the last is the highest
  const Eigen::Vector3d down = Eigen::Vector3d::UnitZ();
  const Tool ball = tool_at(organ, 0, down);
  CHECK_THAT(ball.position.z(), WithinAbs(-0.012, 1e-15));
  const Tool wide = tool_at(organ, 0, down, {ToolKind::punch, 1.0});
  CHECK_THAT(wide.position.z(), WithinAbs(-0.002 - 0.010, 1e-15));
  CHECK(possible_contacts(wide, 6, organ, 1.0).size() == 6);
  const auto of_ball = possible_contacts(ball, 6, organ, 1.0);
  REQUIRE(of_ball.size() == 2);
  CHECK(of_ball.front().sphere == 0);
  CHECK_THAT(of_ball.front().reach_m, WithinAbs(0.012, 1e-15));
}

TEST_CASE("pressing, releasing and recovering: one bond under a tool, in closed form") {
  const TpmParameters p = material(2.0);
  const double k = 1e3;
  const Columns column(
      1, 0.0, p, k * 37.0,
      GENERATE(ToolShape{ToolKind::punch, 0.005}, ToolShape{ToolKind::sphere, 0.002}));
  const Press press{column.bonds.stiffness()[0], column.bonds.relaxing()[0],
                    column.stiffness_N_per_m, p.relaxation_time_s()};
  const double rate = 0.004;
  const Protocol protocol(Drive::displacement,
                          {{0.0, 0.0}, {1.0, rate}, {4.0, rate}, {6.0, -rate}, {12.0, -rate}}, "t");
  std::vector<double> place;
  const std::vector<double> times = even_times(12.0, 120);
  const QuasiStaticRun run =
      column.run(protocol, times, {.tolerance = 1e-9},
                 [&](const QuasiStaticState& state) { place.push_back(state.position(2, 0)); });
  Press in = press;
  const double at_hold = in.y_after(1.0, 0.0, rate);
  in.y = at_hold;
  const double at_release = in.y_after(3.0, rate, 0.0);
  in.y = at_release;
  const auto force_released = [&](double t) {
    return in.force(rate - rate * t, in.y_after(t, rate, -rate));
  };
  std::uintmax_t most = 200;
  const double gone =
      boost::math::tools::toms748_solve(force_released, 0.0, 1.9,
                                        boost::math::tools::eps_tolerance<double>(), most)
          .first;
  const double y_gone = in.y_after(gone, rate, -rate);
  CHECK(run.work.contact_changes == 1);
  double worst = 0.0;
  double worst_place = 0.0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double t = times[i];
    double force = 0.0;
    double depth = 0.0;
    if (t <= 1.0) {
      force = press.force(rate * t, press.y_after(t, 0.0, rate));
      depth = rate * t - force / press.c;
    } else if (t <= 4.0) {
      Press hold = press;
      hold.y = at_hold;
      force = hold.force(rate, hold.y_after(t - 1.0, rate, 0.0));
      depth = rate - force / press.c;
    } else if (t - 4.0 <= gone) {
      force = force_released(t - 4.0);
      depth = rate - rate * (t - 4.0) - force / press.c;
    } else {
      // Without force k l = g y, and the viscous elongation fades with what the bond keeps of it.
      const double keeps = press.g / press.k;
      depth = keeps * y_gone * std::exp(-(1.0 - keeps) * (t - 4.0 - gone) / press.tau);
    }
    worst = std::max(worst, std::abs(run.response[static_cast<Eigen::Index>(i)] - force));
    worst_place = std::max(worst_place, std::abs(place[i] - depth));
    if (t - 4.0 > gone) CHECK(run.response[static_cast<Eigen::Index>(i)] == 0.0);
  }
  CHECK(worst < 1e-8 * run.response.maxCoeff());
  CHECK(worst_place < 1e-8 * rate);
}

TEST_CASE("a punch meets one column after another at the depth of their steps") {
  const TpmParameters p = material(1e9);  // nothing relaxes
  const Columns columns(4, 0.0005, p, 1e5);
  const double k = columns.bonds.stiffness()[0];
  const double together = k * 1e5 / (k + 1e5);
  const std::vector<double> times = even_times(1.0, 40);
  const Protocol ramp(Drive::displacement, {{0.0, 0.0}, {1.0, 0.004}}, "ramp");
  const QuasiStaticRun run = columns.run(ramp, times, {.tolerance = 1e-10});
  CHECK(run.work.contact_changes == 3);
  for (std::size_t i = 0; i < times.size(); ++i) {
    double expected = 0.0;
    for (int c = 0; c < 4; ++c) {
      expected += together * std::max(0.004 * times[i] - 0.0005 * c, 0.0);
    }
    CHECK_THAT(run.response[static_cast<Eigen::Index>(i)], WithinAbs(expected, 1e-8));
  }
  SECTION("under a load as under a depth") {
    const double load = run.response[40];
    const QuasiStaticRun creep = columns.run(
        Protocol(Drive::force, {{0.0, 0.0}, {1.0, load}}, "load"), times, {.tolerance = 1e-10});
    CHECK_THAT(creep.response[40], WithinRel(0.004, 1e-7));
  }
  SECTION("at once as in steps") {
    const QuasiStaticRun jump =
        columns.run(Protocol(Drive::displacement, {{0.0, 0.004}, {1.0, 0.004}}, "jump"), times, {});
    CHECK_THAT(jump.response[0], WithinRel(run.response[40], 1e-7));
  }
  SECTION("in equilibria as in time") {
    StaticPath path(columns.driven->bonds, columns.driven->rest, 0.02, columns.driven->constraints,
                    columns.driven->probes, Drive::displacement, 0.004, 1e-8);
    const double relaxed = 1.0 - columns.bonds.relaxing()[0] / k;
    const double soft = relaxed * k * 1e5 / (relaxed * k + 1e5);
    double expected = 0.0;
    for (int c = 0; c < 4; ++c) expected += soft * (0.004 - 0.0005 * c);
    CHECK_THAT(path.move_to(0.004, 0.0).response, WithinRel(expected, 1e-7));
    CHECK(path.move_to(-0.001, 1.0).response == 0.0);
  }
}

TEST_CASE("a stiff tool on one sphere is that sphere driven") {
  const TpmParameters p = material(10.0);
  const Star star(p);
  const std::vector<double> times = even_times(12.0, 24);
  const Protocol protocol = ramp_and_hold(0.008, 0.004, 10.0);
  const Eigen::VectorXd direct = star.run(protocol, times, {.tolerance = 1e-9}).response;
  std::vector<double> difference;
  for (const double stiffness : {1e4, 1e5, 1e6}) {
    const Tool tool = tool_at(star.network.organ, 0, Eigen::Vector3d::UnitZ());
    const DrivenNetwork driven = driven_network(star.bonds, star.network.organ, star.constraints,
                                                {}, {{tool, 1.0, stiffness}});
    const QuasiStaticRun run = QuasiStatic(driven.bonds, driven.rest, driven.constraints,
                                           driven.probes, {.tolerance = 1e-9})
                                   .run(protocol, times);
    CHECK(run.work.contact_changes == 0);
    difference.push_back((run.response - direct).cwiseAbs().maxCoeff() / direct.maxCoeff());
    const ToolState state = tool_states(driven, run.position).front();
    CHECK_THAT(state.force.z(), WithinRel(run.response[24], 1e-7));
    CHECK_THAT(state.overlap_m, WithinRel(run.response[24] / stiffness, 1e-6));
    CHECK(state.touching == 1);
  }
  CHECK_THAT(difference[0] / difference[1], WithinRel(10.0, 0.05));
  CHECK_THAT(difference[1] / difference[2], WithinRel(10.0, 0.05));
}

namespace {

/// A slab with a free top and a held bottom.
struct Slab {
  Slab()
      : network(build_network(block(5, 5, 2, 0.02, Lattice::cubic), {}, "slab")),
        bonds(network, material(3.0)),
        constraints(network.organ.size()) {
    for (std::size_t i = 0; i < network.organ.size(); ++i) {
      if (network.organ.layer[i] == 2) constraints.fix(i);
    }
  }
  static constexpr std::size_t kMiddle = 14;  // of the top plane
  [[nodiscard]] Eigen::Vector3d down() const { return -Eigen::Vector3d::UnitZ(); }
  [[nodiscard]] DrivenNetwork pressed(std::vector<PressedTool> tools) const {
    return driven_network(bonds, network.organ, constraints, {}, std::move(tools));
  }
  [[nodiscard]] PressedTool punch(std::size_t sphere, double radius, double share = 1.0) const {
    return {tool_at(network.organ, sphere, down(), {ToolKind::punch, radius}), share,
            usual_contact_stiffness_N_per_m(bonds)};
  }
  Network network;
  BondSystem bonds;
  Constraints constraints;
};

QuasiStaticRun quasi_static_run(const DrivenNetwork& driven, const Protocol& protocol,
                                std::span<const double> times, QuasiStaticOptions options) {
  return QuasiStatic(driven.bonds, driven.rest, driven.constraints, driven.probes,
                     std::move(options))
      .run(protocol, times);
}

}  // namespace

TEST_CASE("a punch on a flat face is its spheres driven together") {
  const Slab slab;
  const Protocol protocol = ramp_and_hold(0.004, 0.004, 5.0);
  const std::vector<double> times = even_times(6.0, 12);
  std::vector<Probe> patch;
  for (std::size_t i = 0; i < slab.network.organ.size(); ++i) {
    const auto at = [&](std::size_t s) {
      return slab.network.organ.position.col(static_cast<Eigen::Index>(s));
    };
    if (slab.network.organ.layer[i] == 0 && (at(i) - at(Slab::kMiddle)).norm() < 0.021) {
      patch.push_back({i, slab.down()});
    }
  }
  REQUIRE(patch.size() == 5);
  const QuasiStaticRun bonded =
      QuasiStatic(slab.bonds, slab.network.organ.position, slab.constraints, Probes(patch), {})
          .run(protocol, times);
  const DrivenNetwork driven = slab.pressed({slab.punch(Slab::kMiddle, 0.021)});
  const QuasiStaticRun pressed = quasi_static_run(driven, protocol, times, {});
  CHECK((pressed.response - bonded.response).cwiseAbs().maxCoeff() <
        5e-4 * bonded.response.maxCoeff());
  CHECK(tool_states(driven, pressed.position).front().touching == 5);
}

TEST_CASE("several tools at once balance, and energy is accounted for") {
  const Slab slab;
  // One presses by the full depth, one by half of it, one stands still beside them.
  const DrivenNetwork driven =
      slab.pressed({slab.punch(8, 0.005), slab.punch(20, 0.005, 0.5), slab.punch(25, 0.005, 0.0)});
  const Protocol protocol(Drive::displacement,
                          {{0.0, 0.0},
                           {1.0, 0.006},
                           {3.0, 0.006},
                           {3.5, 0.001},
                           {4.5, 0.005},
                           {5.0, -0.002},
                           {9.0, -0.002}},
                          "pokes");
  const std::vector<double> times = even_times(9.0, 90);
  Eigen::Vector3d on_tissue = Eigen::Vector3d::Zero();
  std::size_t shown = 0;
  std::vector<double> response;
  const QuasiStatic equations(driven.bonds, driven.rest, driven.constraints, driven.probes,
                              {.tolerance = 1e-9, .energies = true});
  const QuasiStaticRun run = equations.run(protocol, times, [&](const QuasiStaticState& state) {
    const auto tools = tool_states(driven, state.position);
    const double conjugate =
        tools[0].force.dot(slab.down()) + 0.5 * tools[1].force.dot(slab.down());
    CHECK_THAT(state.response, WithinAbs(conjugate, 1e-7));
    for (const ToolState& tool : tools) CHECK(tool.force.dot(slab.down()) >= -1e-9);
    CHECK_THAT(state.energy->stored_J,
               WithinAbs(driven.bonds.stored_energy_J(state.position, state.viscous), 1e-12));
    if (state.time_s == 3.0) {
      for (const ToolState& tool : tools) on_tissue += tool.force;
      Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, driven.rest.cols());
      driven.bonds.add_forces(state.position, {state.viscous.col(0), 0.0}, force);
      Eigen::Vector3d reaction = Eigen::Vector3d::Zero();
      for (std::size_t i = 0; i < slab.network.organ.size(); ++i) {
        if (slab.network.organ.layer[i] == 2) {
          reaction -= force.col(static_cast<Eigen::Index>(i));
        }
      }
      CHECK((on_tissue + reaction).norm() < 1e-8 * on_tissue.norm());
    }
    ++shown;
  });
  CHECK(shown == times.size());
  CHECK(run.work.contact_changes > 1);
  const QuasiStaticEnergy energy = run.energy.value();
  CHECK(energy.dissipated_J > 0.0);
  CHECK_THAT(energy.stored_J + energy.dissipated_J, WithinRel(energy.work_J, 1e-7));
}

TEST_CASE("derivatives go on through contacts") {
  const TpmParameters p = material(2.0);
  const std::vector<double> times = even_times(3.0, 12);
  const Protocol protocol(Drive::displacement,
                          {{0.0, 0.0}, {1.0, 0.004}, {2.0, 0.004}, {3.0, 0.003}}, "t");
  const auto force = [&](double log_change) {
    TpmParameters changed = p;
    changed.eta1_Pa_s *= std::exp(log_change);
    return Columns(3, 0.0008, changed, 1e5).run(protocol, times, {.tolerance = 1e-11}).response;
  };
  const Columns columns(3, 0.0008, p, 1e5);
  const Eigen::VectorXd zero =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(columns.driven->bonds.size()));
  const QuasiStaticRun run =
      columns.run(protocol, times, {.tolerance = 1e-11, .directions = {{zero, zero, 1.0, 0.0}}});
  const double step = 1e-4;
  const Eigen::VectorXd central = (force(step) - force(-step)) / (2.0 * step);
  CHECK((run.derivative.col(0) - central).cwiseAbs().maxCoeff() <
        1e-6 * central.cwiseAbs().maxCoeff());
}

TEST_CASE("what cannot be driven is refused") {
  const Columns columns(2, 0.0, material(1.0), 1e5);
  const DrivenNetwork& driven = *columns.driven;
  CHECK_THROWS_AS(driven_network(columns.bonds, columns.network.organ, columns.constraints, {}, {}),
                  Error);
  const Probe twice = driven.probes.front();
  CHECK_THROWS_AS(QuasiStatic(driven.bonds, driven.rest, driven.constraints,
                              Probes(std::vector<Probe>{twice, twice}), {}),
                  Error);
  Positions away = driven.rest;
  away.col(driven.column_of_tool(0)).z() -= 0.001;
  const QuasiStatic equations(driven.bonds, away, driven.constraints, driven.probes, {});
  const std::vector<double> times{1.0};
  CHECK_THROWS_WITH(equations.run(ramp_and_hold(0.001, 0.001, 1.0), times),
                    Catch::Matchers::Contains("touches nothing at rest"));
}
