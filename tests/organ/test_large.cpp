// Iterative solvers against the direct one: linear systems, equilibria, buckling.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>

#include "indented_scene.hpp"
#include "tpm/base/random.hpp"
#include "tpm/organ/balance/buckling.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpm/organ/linear/preconditioners.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

Eigen::Matrix3Xd random_forces(const Constraints& constraints) {
  Eigen::Matrix3Xd forces(3, static_cast<Eigen::Index>(constraints.size()));
  Random random(3);
  for (double& value : forces.reshaped()) value = random.normal();
  constraints.project(forces);
  return forces;
}

ViscousState zero_viscous_state(const BondSystem& bonds) {
  return {Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())), 0.0};
}

}  // namespace

TEST_CASE("conjugate gradients solve what the factorisation solves") {
  IndentedScene scene(solid_liver(1500), 0.02, 0.03);
  scene.constraints.slide(700, Eigen::Vector3d(1, 2, 2) / 3.0);  // one that is partly free
  const ViscousState viscous_state = zero_viscous_state(scene.bonds);
  Equilibrium direct(scene.bonds, scene.constraints);
  REQUIRE(direct.factorise(scene.rest(), viscous_state));
  const Eigen::Matrix3Xd forces = random_forces(scene.constraints);
  Eigen::Matrix3Xd exact = forces;
  direct.displace(exact);
  for (const auto& entry : kPreconditionerWords) {
    LargeEquilibriumOptions options;
    options.preconditioner = entry.meaning;
    LargeEquilibrium large(scene.bonds, scene.constraints, scene.rest(), options);
    Eigen::Matrix3Xd x = forces;
    CAPTURE(entry.text);
    REQUIRE(large.solve(scene.rest(), viscous_state, x, 1e-12) == TangentAnswer::solved);
    CAPTURE(large.work().iterations);
    CHECK((x - exact).norm() < 1e-9 * exact.norm());
  }
}

TEST_CASE("the preconditioners are symmetric") {
  const IndentedScene scene(solid_liver(1500), 0.02, 0.03);
  StiffnessRows stiffness(scene.bonds, scene.constraints);
  const auto& matrix = stiffness.assemble(scene.rest(), zero_viscous_state(scene.bonds));
  RigidModes<3> modes(scene.constraints.size());
  for (std::size_t i = 0; i < modes.size(); ++i) {
    modes[i].setZero();
    modes[i].leftCols<3>() = scene.constraints.projector(i);
  }
  const BlockJacobi jacobi(matrix);
  const IncompleteCholesky cholesky(matrix);
  const Multigrid multigrid(matrix, modes);
  const Eigen::Matrix3Xd a = random_forces(scene.constraints);
  const Eigen::Matrix3Xd b = a.rowwise().reverse();
  for (const Preconditioner* p :
       {static_cast<const Preconditioner*>(&jacobi), static_cast<const Preconditioner*>(&cholesky),
        static_cast<const Preconditioner*>(&multigrid)}) {
    REQUIRE(p->definite());
    Eigen::Matrix3Xd pa;
    Eigen::Matrix3Xd pb;
    p->apply(a, pa);
    p->apply(b, pb);
    CHECK_THAT(b.cwiseProduct(pa).sum(),
               WithinAbs(a.cwiseProduct(pb).sum(), 1e-12 * pa.norm() * b.norm()));
    CHECK(a.cwiseProduct(pa).sum() > 0.0);
  }
}

TEST_CASE("iterative and direct equilibria of the paper's liver are the same") {
  compare_solvers({paper_liver(), 0.03, 0.05});
}

TEST_CASE("multigrid needs about as many iterations for more spheres, block Jacobi more",
          "[heavy]") {
  const auto iterations = [](int cells, PreconditionerKind kind) {
    const IndentedScene scene(block(cells, cells, cells, 0.1 / cells, Lattice::fcc), 0.03, 0.02,
                              -Eigen::Vector3d::UnitZ());
    LargeEquilibriumOptions options;
    options.preconditioner = kind;
    LargeEquilibrium large(scene.bonds, scene.constraints, scene.rest(), options);
    Eigen::Matrix3Xd x = random_forces(scene.constraints);
    REQUIRE(large.solve(scene.rest(), zero_viscous_state(scene.bonds), x, 1e-8) ==
            TangentAnswer::solved);
    return large.work().iterations;
  };
  const int small = iterations(6, PreconditionerKind::multigrid);
  const int large = iterations(14, PreconditionerKind::multigrid);
  const int small_jacobi = iterations(6, PreconditionerKind::block_jacobi);
  const int large_jacobi = iterations(14, PreconditionerKind::block_jacobi);
  CAPTURE(small, large, small_jacobi, large_jacobi);
  CHECK(large <= small + small / 2);
  CHECK(large_jacobi >= 2 * small_jacobi);
  CHECK(large_jacobi >= 4 * large);
}

TEST_CASE("a column pressed beyond its buckling load is found unstable by both solvers") {
  // Straight between smooth plates it stays in balance; only the sign of the stiffness tells.
  const Organ column = block(2, 2, 24, 0.01, Lattice::cubic);
  const Network network = build_network(column, {}, "column");
  const BondSystem bonds(network, TpmParameters{});
  Constraints constraints(column.size());
  const double top = column.position.row(2).maxCoeff();
  for (std::size_t i = 0; i < column.size(); ++i) {
    const double z = column.position(2, static_cast<Eigen::Index>(i));
    if (z < 1e-9 || z > top - 1e-9) constraints.fix(i);
  }
  const ViscousState viscous_state = zero_viscous_state(bonds);
  const Eigen::Matrix3Xd no_load = Eigen::Matrix3Xd::Zero(3, column.position.cols());
  bool buckled = false;
  bool stood = false;
  for (const double compression : {0.005, 0.02, 0.08}) {
    Positions pressed = column.position;
    pressed.row(2) *= 1.0 - compression;
    Positions again = pressed;
    Equilibrium direct(bonds, constraints);
    LargeEquilibrium large(bonds, constraints, column.position);
    const EquilibriumSearch a = direct.find(pressed, viscous_state, no_load, 1e-9);
    const EquilibriumSearch b = large.find(again, viscous_state, no_load, 1e-9);
    CAPTURE(compression, a.stable, b.stable, a.converged, b.converged);
    CHECK(a.stable == b.stable);
    if (!b.stable) {
      // Where the stiffness is not positive, the iterative solver names a sphere of the middle
      // third, as the direct one does.
      Equilibrium iterative(bonds, constraints, {.solver = StiffnessSolver::iterative});
      for (Equilibrium* solver : {&direct, &iterative}) {
        const std::string place = buckling_place(*solver, pressed, viscous_state, pressed.cols());
        CAPTURE(place);
        std::size_t number = 0;
        REQUIRE(std::sscanf(place.c_str(), " around sphere %zu at (", &number) == 1);
        const double height = column.position(2, static_cast<Eigen::Index>(number - 1)) / top;
        CHECK((height > 0.25 && height < 0.75));
      }
    }
    buckled = buckled || !b.stable;
    stood = stood || (b.stable && b.converged);
  }
  CHECK(stood);
  CHECK(buckled);
}

TEST_CASE("a probe with random forces finds loose spheres that the load does not stir") {
  // A cubic lattice without diagonals, pushed exactly along its bonds, carries the load.
  NetworkOptions narrow;
  narrow.support = 1.1;
  const Organ organ = block(3, 3, 3, 0.01, Lattice::cubic);
  const Network network = build_network(organ, narrow, "lattice");
  const BondSystem bonds(network, TpmParameters{});
  Constraints constraints(organ.size());
  for (std::size_t i = 0; i < 16; ++i) constraints.fix(i);
  LargeEquilibrium large(bonds, constraints, organ.position);
  Positions position = organ.position;
  const EquilibriumSearch search = large.find(
      position, zero_viscous_state(bonds), Eigen::Matrix3Xd::Zero(3, organ.position.cols()), 1e-9);
  CHECK(search.converged);
  CHECK_FALSE(search.stable);
}

TEST_CASE("an indentation refuses what it cannot do") {
  const IndentedScene scene(block(4, 4, 4, 0.01, Lattice::fcc), 0.015, 0.005,
                            -Eigen::Vector3d::UnitZ());
  Equilibrium direct(scene.bonds, scene.constraints);
  const auto run = [&](const PatchIndentation& push) {
    return indent(scene.bonds, scene.constraints, scene.rest(), push, finder_of(direct));
  };
  PatchIndentation none = scene.push;
  none.patch.clear();
  CHECK_THROWS_WITH(run(none), Catch::Contains("without spheres"));
  PatchIndentation still = scene.push;
  still.strides = 0;
  CHECK_THROWS_WITH(run(still), Catch::Contains("0 strides"));
  PatchIndentation far = scene.push;
  far.depth_m = 0.05;  // through the block
  CHECK_THROWS_AS(run(far), Error);
}

TEST_CASE("a solver is chosen by what the factor takes, counted before it is made") {
  const IndentedScene scene(solid_liver(700), 0.02, 0.03);
  const SolverChoice usual =
      choose_solver(scene.bonds, scene.constraints, {.solver = StiffnessSolver::automatic});
  CHECK(usual.direct);
  CHECK(usual.operations > 1e6);
  CHECK(usual.bytes > 1e6);
  const auto chosen = [&](double operations, double bytes) {
    return choose_solver(scene.bonds, scene.constraints,
                         {.solver = StiffnessSolver::automatic,
                          .most_operations = operations,
                          .most_bytes = bytes})
        .direct;
  };
  CHECK(chosen(usual.operations, usual.bytes));
  CHECK_FALSE(chosen(0.99 * usual.operations, usual.bytes));
  CHECK_FALSE(chosen(usual.operations, 0.99 * usual.bytes));
  CHECK(
      choose_solver(scene.bonds, scene.constraints,
                    {.solver = StiffnessSolver::direct, .most_operations = 0.0, .most_bytes = 0.0})
          .direct);
  CHECK_FALSE(
      choose_solver(scene.bonds, scene.constraints, {.solver = StiffnessSolver::iterative}).direct);
}

TEST_CASE("a quasi-static run is the same with either solver, within its tolerance", "[heavy]") {
  const Organ organ = solid_liver(700);
  const Network network = build_network(organ, {}, "liver");
  const BondSystem bonds(network, TpmParameters{}.with_relaxation_time(0.7));
  Constraints constraints(organ.size());
  for (const std::size_t i : far_side(organ, Eigen::Vector3d::UnitZ(), 0.02)) constraints.fix(i);
  Eigen::Index front = 0;
  organ.position.row(2).minCoeff(&front);
  const Probe probe{static_cast<std::size_t>(front), Eigen::Vector3d::UnitZ()};
  const double spacing = organ.spacing;
  const Protocol push{
      Drive::displacement, {{0.0, 0.0}, {1.0, 0.1 * spacing}, {2.0, 0.1 * spacing}}, "push", true};
  const Protocol load{Drive::force, {{0.0, 0.0}, {1.0, 1e-3}, {2.0, 1e-3}}, "load", true};
  const std::vector<double> times{0.0, 0.3, 1.0, 1.5, 2.0};
  for (const Protocol& protocol : {push, load}) {
    const auto run = [&](StiffnessSolver solver) {
      return QuasiStatic(bonds, organ.position, constraints, probe,
                         {.tolerance = 1e-6, .equilibrium = {.solver = solver}})
          .run(protocol, times);
    };
    const QuasiStaticRun direct = run(StiffnessSolver::direct);
    const QuasiStaticRun iterative = run(StiffnessSolver::iterative);
    CHECK(direct.solver.direct);
    CHECK_FALSE(iterative.solver.direct);
    const double peak = direct.response.cwiseAbs().maxCoeff();
    CHECK(peak > 0.0);
    CHECK((direct.response - iterative.response).cwiseAbs().maxCoeff() < 2e-6 * peak);
  }
}
