// The material of bonds: its functions, laws, table, regions in scenes, and networks of several
// branches against the same branches written out and integrated by CVODES.
#include <catch2/catch.hpp>
#include <complex>

#include "organ_scene.hpp"
#include "refusal.hpp"
#include "shape_suite.hpp"
#include "tpm/base/random.hpp"
#include "tpm/law/relaxation/fractional_branches.hpp"
#include "tpm/law/relaxation/mittag_leffler.hpp"
#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpm/organ/balance/inertial.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"
#include "written_out_scene.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm_test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using tpm::testing::OrganScene;

namespace {

/// G(s) of a linear law.
std::complex<double> modulus(const BondLaw& law, std::complex<double> s) {
  std::complex<double> sum = law.equilibrium_N_per_m();
  for (const BondLaw::Branch& branch : law.branches) {
    const std::complex<double> z = s * branch.relaxation_time_s;
    sum += branch.stiffness_N_per_m * z / (1.0 + z);
  }
  return sum;
}

BondLaw linear_law(double equilibrium, std::vector<BondLaw::Branch> branches) {
  BondLaw law;
  law.springs = {{equilibrium, {}}};
  law.branches = std::move(branches);
  law.tidy();
  return law;
}

std::string refusal_of(const std::string& scene) {
  return test::refusal_of(
      [&] { static_cast<void>(parse_tissue(Json::parse(scene), "s.json", {})); });
}

std::string block_scene(const std::string& material) {
  return R"({"organ": {"kind": "block", "cells": [2, 2, 2], "spacing": "10 mm"}, "material": )" +
         material + "}";
}

}  // namespace

TEST_CASE("the shapes of materials keep their promises") {
  for (const ElongationShape* shape : elongation_shapes()) {
    CAPTURE(shape->name());
    CHECK(test::broken_promises(*shape) == std::vector<std::string>{});
  }
  CHECK_THROWS_WITH(
      elongation_function("quintic", {1e-3}),
      Catch::Contains("unknown shape 'quintic'; expected one of linear, cubic, sinh"));
  CHECK_THROWS_WITH(elongation_function("cubic", {0.0}), Catch::Contains("above 0"));
  CHECK_THROWS_WITH(elongation_function("cubic"), Catch::Contains("0 values"));
}

TEST_CASE("every formulation runs the shapes that it takes and refuses the others", "[heavy]") {
  for (const ElongationShape* shape : elongation_shapes()) {
    CAPTURE(shape->name());
    CHECK(test::broken_in_scenes(*shape) == std::vector<std::string>{});
  }
}

TEST_CASE("the linear function is the shape linear") {
  const ElongationShape& linear = elongation_shape("linear", "test");
  const ElongationFunction w = elongation_function("linear");
  CHECK(w == ElongationFunction{});
  CHECK(w.shape_name() == "linear");
  for (const double l : {-3e-3, 0.0, 5e-3}) {
    CHECK(w.value(l) == linear.value(l, {}));
    CHECK(w.slope(l) == linear.slope(l, {}));
    CHECK(w.integral(l) == linear.integral(l, {}));
    CHECK(w.inverse(l) == linear.inverse(l, {}));
  }
}

TEST_CASE("the series of two linear laws has the harmonic mean of their moduli") {
  const BondLaw a = linear_law(3.0, {{2.0, 0.1}, {4.0, 7.0}});
  for (const BondLaw& b : {linear_law(1.0, {{9.0, 0.5}}), linear_law(5.0, {}),
                           linear_law(2.0, {{1.0, 7.0}, {3.0, 40.0}}),
                           linear_law(0.0, {{1.0, 0.02}, {5.0, 3.0}}), a.scaled(5.0)}) {
    const BondLaw series = blended(a, b, BlendRule::series, "test");
    const BondLaw mean = blended(a, b, BlendRule::mean, "test");
    for (const BondLaw::Branch& branch : series.branches) CHECK(branch.stiffness_N_per_m > 0.0);
    for (const double omega : {0.0, 1e-3, 0.05, 0.7, 3.0, 40.0, 1e4}) {
      const std::complex<double> s(0.0, omega);
      const std::complex<double> ga = modulus(a, s), gb = modulus(b, s);
      CAPTURE(omega, series.branches.size());
      CHECK(std::abs(modulus(mean, s) - 0.5 * (ga + gb)) < 1e-13 * std::abs(ga));
      const std::complex<double> expected = 2.0 * ga * gb / (ga + gb);
      CHECK(std::abs(modulus(series, s) - expected) < 1e-11 * std::abs(ga));
    }
  }
  BondLaw stiffening = a;
  stiffening.springs[0].function = elongation_function("cubic", {1e-3});
  CHECK_THROWS_WITH(blended(a, stiffening, BlendRule::series, "s"), Catch::Contains("mean"));
  CHECK_NOTHROW(blended(stiffening, stiffening.scaled(3.0), BlendRule::series, "s"));
  CHECK(blended(a, stiffening, BlendRule::mean, "s").springs.size() == 2);
  BondLaw kernel = a;
  kernel.kernel = elongation_function("sinh", {1e-3});
  CHECK_THROWS_WITH(blended(a, kernel, BlendRule::mean, "s"), Catch::Contains("kernels"));
}

TEST_CASE("one table names the parameters of a material") {
  BondMaterial m = material_of({0.1, 5.0}, 0.5);
  m.potential = elongation_function("cubic", {5e-3});
  std::vector<std::string> names;
  for (const MaterialParameter& parameter : parameters_of(m)) names.push_back(parameter.name);
  CHECK(names == std::vector<std::string>{"Einf", "Eprime", "stiffening", "g1", "tau1", "g2",
                                          "tau2", "A0", "l0"});
  set_value(m, "tau2", 8.0, "here");
  CHECK(m.branches[1].relaxation_time_s == 8.0);
  CHECK(value_of(m, "tau2") == 8.0);
  CHECK_FALSE(value_of(m, "tau3"));
  CHECK_THROWS_WITH(set_value(m, "tau3", 1.0, "here"), Catch::Contains("one of Einf, Eprime"));
  CHECK_THROWS_WITH(set_value(m, "tau1", 0.0, "here"), Catch::Contains("above 0"));
  CHECK_THROWS_WITH(set_value(m, "g1", -1.0, "here"), Catch::Contains("0 or above"));
  m.branches.resize(41, {1.0, 1.0});
  CHECK_THROWS_WITH(require_valid(m, "here"), Catch::Contains("at most 40"));
}

TEST_CASE("the paper's element is one material") {
  const TpmParameters p = TpmParameters{}.with_relaxation_time(0.7);
  const BondMaterial m = p.bonds();
  CHECK_THAT(m.instantaneous_Pa(), WithinRel(p.E2_Pa, 1e-15));
  CHECK_THAT(m.equilibrium_Pa, WithinRel(p.equilibrium_modulus_Pa(), 1e-15));
  REQUIRE(m.branches.size() == 1);
  CHECK_THAT(m.branches[0].relaxation_time_s, WithinRel(0.7, 1e-15));
}

TEST_CASE("a fractional branch is a sum of exponentials within its stated error") {
  for (const double alpha : {0.15, 0.5, 0.8, 1.0}) {
    const FractionalBranches sum = fractional_branches(alpha, 2.0, {1e-3, 1e3, 1e-3}, 40);
    double whole = sum.constant, worst = 0.0;
    for (const auto& [share, time] : sum.branches) {
      CHECK(share > 0.0);
      whole += share;
    }
    CHECK_THAT(whole, WithinRel(1.0, 1e-12));
    for (int i = 0; i <= 400; ++i) {
      const double t = 1e-3 * std::pow(10.0, 6.0 * i / 400.0);
      double value = sum.constant;
      for (const auto& [share, time] : sum.branches) value += share * std::exp(-t / time);
      worst =
          std::max(worst, std::abs(value - mittag_leffler(alpha, 1.0, std::pow(t / 2.0, alpha))));
    }
    CAPTURE(alpha, sum.branches.size(), sum.error);
    CHECK(sum.error <= 1e-3);
    CHECK(worst <= 1.05 * sum.error + 1e-12);
    if (alpha == 1.0) CHECK(sum.branches.size() == 1);
  }
  CHECK_THROWS_WITH(fractional_branches(0.3, 1.0, {1e-6, 1e5, 1e-6}, 5), Catch::Contains("reach"));
  CHECK_THROWS_AS(fractional_branches(1.5, 1.0, {1e-3, 1.0, 1e-3}, 5), Error);
}

TEST_CASE("a quasi-static network is its two branches written out") {
  const BondMaterial m = material_of({0.1, 4.0}, 0.9);
  check_pair(both(m, written_bonds(small_scene().network, m)));
}

TEST_CASE("a bond between two materials is both at half strength") {
  const Network& network = small_scene().network;
  const BondMaterial soft = material_of({0.1, 4.0}, 0.8);
  BondMaterial hard = material_of({0.6}, 0.3);
  hard.potential = elongation_function("cubic", {4e-3});
  hard.equilibrium_Pa *= 5.0;
  MaterialField field(soft);
  field.materials.push_back(hard);
  field.of_sphere.assign(network.organ.size(), 0);
  const auto contact = static_cast<Eigen::Index>(*network.organ.contact);
  for (std::size_t i = 0; i < network.organ.size(); ++i) {
    const Eigen::Vector3d apart = network.organ.position.col(static_cast<Eigen::Index>(i)) -
                                  network.organ.position.col(contact);
    if (apart.norm() < 1.2 * network.organ.spacing) field.of_sphere[i] = 1;
  }
  // Independent of the laws of blends: half of either material in every bond.
  std::vector<WrittenBond> written;
  const auto add = [&](const BondMaterial& m, std::uint16_t number) {
    const std::vector<WrittenBond> all = written_bonds(network, m, 0.5);
    for (std::size_t b = 0; b < all.size(); ++b) {
      for (const std::uint32_t end : {all[b].a, all[b].b}) {
        if (field.of_sphere[end] == number) written.push_back(all[b]);
      }
    }
  };
  add(soft, 0);
  add(hard, 1);
  check_pair(both(field, written));
  // A factor of place is a law times a number.
  MaterialField firmer(soft);
  firmer.factor = Eigen::VectorXd::Ones(network.organ.position.cols());
  for (std::size_t i = 0; i < network.organ.size(); ++i) {
    if (field.of_sphere[i] == 1) firmer.factor[static_cast<Eigen::Index>(i)] = 5.0;
  }
  const BondSystem system(network, firmer);
  CHECK(system.relaxes_alike());
  CHECK(system.relaxation_times_s().size() == 2);
}

TEST_CASE("a run with several branches goes on from its state as if it had not stopped") {
  const OrganScene& scene = small_scene();
  const BondSystem bonds(scene.network, material_of({0.1, 4.0}, 0.8));
  const QuasiStatic network(bonds, scene.network.organ.position, scene.constraints, scene.probe,
                            {.tolerance = 1e-8, .energies = true});
  std::vector<QuasiStaticState> states;
  const std::vector<double> times{1.0, 2.0, 4.0};
  const QuasiStaticRun whole =
      network.run(ramp(), times, [&](const QuasiStaticState& s) { states.push_back(s); });
  for (const QuasiStaticState& state : states) {
    CHECK_THAT(state.energy->stored_J,
               WithinRel(bonds.stored_energy_J(state.position, state.viscous), 1e-12));
  }
  const std::vector<double> rest{2.0, 4.0};
  const QuasiStaticRun second = network.run(ramp(), rest, {}, &states[0]);
  CHECK_THAT(second.response[1], WithinRel(whole.response[2], 1e-7));
  CHECK_THAT(second.energy->work_J, WithinRel(whole.energy->work_J, 1e-6));
  QuasiStaticState wrong = states[0];
  wrong.viscous.conservativeResize(wrong.viscous.rows(), 1);
  CHECK_THROWS_WITH(network.run(ramp(), rest, {}, &wrong), Catch::Contains("branches"));
}

TEST_CASE("stored energy and heat of several branches close along any motion") {
  const OrganScene& scene = small_scene();
  BondMaterial m = material_of({0.05, 0.5, 9.0}, 0.85);
  m.kernel = elongation_function("sinh", {3e-3});
  m.potential = elongation_function("cubic", {5e-3});
  const BondSystem bonds(scene.network, m);
  const Positions rest = scene.network.organ.position;
  Random random(7);
  Eigen::MatrixXd viscous =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(bonds.size()), bonds.most_branches());
  for (double& y : viscous.reshaped()) y = 2e-3 * random.normal();
  Positions position = rest;
  for (double& x : position.reshaped()) x += 2e-3 * random.normal();
  Eigen::Matrix3Xd velocity(3, rest.cols());
  for (double& v : velocity.reshaped()) v = 1e-2 * random.normal();
  // d stored/dt = power of the bonds' forces - heat, by central differences along the motion.
  const double h = 1e-6;
  Eigen::VectorXd followed;
  bonds.followed(position, followed);
  Eigen::MatrixXd rate = viscous;
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    rate.row(row).setZero();
    if (!(bonds.relaxing()[row] > 0.0)) continue;
    Eigen::Index j = 0;
    for (const ViscousLaw::Branch& branch : bonds.laws()[bonds.law_of(i)].branches) {
      rate(row, j) = (followed[row] - viscous(row, j)) / branch.relaxation_time_s;
      ++j;
    }
  }
  const auto stored = [&](double t) {
    const Positions at = position + t * velocity;
    const Eigen::MatrixXd then = viscous + t * rate;
    return bonds.stored_energy_J(at, then);
  };
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest.cols());
  bonds.add_forces(position, {bonds.mean_viscous(viscous), 0.0}, force);
  const double power = -force.cwiseProduct(velocity).sum();
  const double heat = bonds.dissipation_W(position, viscous);
  CHECK(heat > 0.0);
  CHECK_THAT((stored(h) - stored(-h)) / (2 * h), WithinRel(power - heat, 1e-6));
  // The force is minus the gradient of potential_J, its stiffness the derivative of the force.
  const ViscousState viscous_state =
      bonds.viscous_state_at(bonds.mean_viscous(viscous), followed, 0.37);
  Eigen::Matrix3Xd change = Eigen::Matrix3Xd::Zero(3, rest.cols());
  bonds.add_stiffness_times(position, viscous_state, velocity, change);
  const auto potential = [&](double t) {
    return bonds.potential_J(position + t * velocity, viscous_state);
  };
  const auto forces = [&](double t) {
    Eigen::Matrix3Xd f = Eigen::Matrix3Xd::Zero(3, rest.cols());
    bonds.add_forces(position + t * velocity, viscous_state, f);
    return f;
  };
  CHECK_THAT((potential(h) - potential(-h)) / (2 * h),
             WithinRel(-forces(0.0).cwiseProduct(velocity).sum(), 1e-6));
  const Eigen::Matrix3Xd slope = (forces(-h) - forces(h)) / (2 * h);
  CHECK((slope - change).cwiseAbs().maxCoeff() < 1e-6 * change.cwiseAbs().maxCoeff());
}

TEST_CASE("an inertial network is its equations with the branches written out") {
  const OrganScene& scene = small_scene();
  BondMaterial m = material_of({0.02, 0.3}, 0.7);
  const bool kernel = GENERATE(false, true);
  if (kernel) m.kernel = elongation_function("cubic", {3e-3});
  const BondSystem bonds(scene.network, m);
  const Eigen::VectorXd mass = sphere_masses_kg(scene.network.organ);
  InertialOptions options{.tolerance = 1e-9, .highest_order = 5};
  options.energy = true;
  const Inertial inertial(bonds, scene.network.organ.position, scene.constraints, scene.probe, mass,
                          options);
  const double drag = 2.0 * options.damping_ratio * inertial.lowest().angular_frequency();
  const double speed = 4e-3 / 0.1;
  const Protocol protocol(Drive::displacement, {{0.0, 0.0}, {0.1, 4e-3}}, "ramp");
  const std::vector<double> times{0.02, 0.05, 0.1};
  const InertialRun run = inertial.run(protocol, times);

  WrittenNetwork written(scene.network, written_bonds(scene.network, m), scene.constraints,
                         scene.probe);
  const Eigen::Index n = written.freedoms();
  Eigen::VectorXd state = Eigen::VectorXd::Zero(2 * n + written.states());
  std::vector<double> force;
  const auto rate = [&](double t, const double* y, double* out) {
    const Eigen::Map<const Eigen::VectorXd> q(y, n), v(y + n, n);
    const Eigen::Matrix3Xd x = written.place(q, speed * t);
    const Eigen::Matrix3Xd f = written.forces(x, y + 2 * n);
    Eigen::Map<Eigen::VectorXd>(out, n) = v;
    Eigen::Map<Eigen::VectorXd>(out + n, n) = written.on_free(f) / mass[0] - drag * v;
    std::vector<double> l;
    for (const WrittenBond& bond : written.bonds()) {
      l.push_back((x.col(bond.b) - x.col(bond.a)).norm() - bond.rest);
    }
    written.rates_of(l, y + 2 * n, out + 2 * n);
  };
  integrate(rate, state, 0.0, times, 1e-10, 1e-13, false, [&](double t, const Eigen::VectorXd& y) {
    const Eigen::Matrix3Xd x = written.place(y.head(n), speed * t);
    const auto contact = static_cast<Eigen::Index>(scene.probe.sphere);
    force.push_back(-written.forces(x, y.data() + 2 * n).col(contact).dot(scene.probe.direction) +
                    drag * mass[contact] * speed);
  });
  const double peak = *std::max_element(force.begin(), force.end());
  for (std::size_t i = 0; i < times.size(); ++i) {
    CHECK_THAT(run.response[static_cast<Eigen::Index>(i)], WithinAbs(force[i], 1e-6 * peak));
  }
  REQUIRE(run.energy);
  CHECK(std::abs(run.energy->missing()) < 1e-5 * run.energy->work);
  CHECK(run.energy->bond_heat > 0.0);
}

TEST_CASE("both solvers of the inertial network take several branches") {
  const OrganScene& scene = small_scene();
  BondMaterial m = material_of({0.02, 0.3, 8.0}, 0.7);
  m.kernel = elongation_function("cubic", {3e-3});
  const BondSystem bonds(scene.network, m);
  const Eigen::VectorXd mass = sphere_masses_kg(scene.network.organ);
  const Protocol protocol(Drive::displacement, {{0.0, 0.0}, {0.2, 4e-3}, {0.5, 4e-3}}, "ramp");
  const std::vector<double> times{0.1, 0.2, 0.5};
  InertialOptions options{.tolerance = 1e-7};
  const auto run = [&](NewtonSolver solver) {
    options.newton = solver;
    return Inertial(bonds, scene.network.organ.position, scene.constraints, scene.probe, mass,
                    options)
        .run(protocol, times);
  };
  const InertialRun a = run(NewtonSolver::eliminated);
  const InertialRun b = run(NewtonSolver::klu);
  CHECK((a.response - b.response).cwiseAbs().maxCoeff() < 1e-5 * b.response.maxCoeff());
  // The eliminated matrix is that of the whole Jacobian: Newton does not need more steps.
  CHECK(static_cast<double>(a.work.newton_iterations) <
        1.3 * static_cast<double>(b.work.newton_iterations));
}

TEST_CASE("a scene says materials, branches and regions") {
  const Tissue tissue = parse_tissue(Json::parse(R"json({
    "organ": {"kind": "block", "cells": [3, 3, 3], "spacing": "10 mm", "lattice": "cubic"},
    "bonds": {"lateral": "relaxing"},
    "material": {"Einf": "6 kPa", "Eprime": "9 kPa",
      "branches": [{"g": "4 kPa", "tau": "1.86 s"}, {"g": "2 kPa", "tau": "51.3 s"}],
      "potential": {"shape": "cubic", "stiffening": "5 mm"},
      "regions": [
        {"kind": "box", "from": ["-1 m", "-1 m", "-1 m"], "to": ["1 m", "1 m", "1 m"], "factor": 2},
        {"kind": "spheres", "spheres": [1, 2], "material": {"Einf": "50 kPa"}},
        {"kind": "function", "factor": "1 + (x > 0.005)"}]
}
})json"),
                                     "s.json", {});
  CHECK(tissue.materials.materials.size() == 2);
  CHECK(tissue.materials.lateral() == LateralBond::relaxing);
  CHECK(tissue.materials.of_sphere[0] == 1);
  CHECK(tissue.materials.of_sphere[2] == 0);
  const BondMaterial& m = tissue.materials.materials.front();
  CHECK(m.branches.size() == 2);
  CHECK(m.branches[1].relaxation_time_s == 51.3);
  CHECK(m.potential.values()[0] == 5e-3);
  const auto& at = tissue.network.organ.position;
  for (Eigen::Index i = 0; i < at.cols(); ++i) {
    CHECK(tissue.materials.factor[i] == (at(0, i) > 0.005 ? 4.0 : 2.0));
  }
  const BondSystem bonds = tissue.bonds();
  CHECK(bonds.relaxation_times_s().size() == 2);
  CHECK_FALSE(bonds.is_linear());
  CHECK_THROWS_WITH(tissue.element("a test"), Catch::Contains("regions"));
  CHECK_THROWS_WITH(require_one_linear_branch(bonds, "a test"), Catch::Contains("quasi_static"));
  CHECK_THROWS_WITH(bonds.relaxation_time_s(), Catch::Contains("2 relaxation times"));
}

TEST_CASE("what a material cannot be is said with its key") {
  CHECK(refusal_of(block_scene(R"({"E1": "1 kPa", "Einf": "2 kPa"})")) ==
        "s.json: key /material/E1: stands beside Einf, which is another way to say it; expected "
        "E1, E2 and eta1, or Einf with branches");
  CHECK(refusal_of(block_scene(R"({"branches": [{"g": "0 kPa", "tau": "1 s"}]})")) ==
        "s.json: key /material: has no modulus above 0; expected Einf or a branch above 0");
  CHECK_THAT(refusal_of(block_scene(R"({"Einf": "1 kPa", "potential": {"shape": "cubic"}})")),
             Catch::Contains("/material/potential/stiffening: is missing"));
  CHECK_THAT(refusal_of(block_scene(R"({"Einf": "1 kPa", "regions": [{"kind": "layer", "layer": 9,
                                        "factor": 2}]})")),
             Catch::Contains("/material/regions/0: holds no sphere"));
  CHECK_THAT(refusal_of(block_scene(R"({"Einf": "1 kPa", "regions": [{"kind": "function",
                                        "factor": "1 + q"}]})")),
             Catch::Contains("formula '1 + q'"));
  CHECK_THAT(refusal_of(block_scene(R"({"Einf": "1 kPa", "regions": [{"kind": "box",
                                        "radius": "1 mm", "factor": 2}]})")),
             Catch::Contains("/material/regions/0/radius: is no key of the kind 'box'"));
  CHECK_THAT(refusal_of(block_scene(R"({"Einf": "1 kPa", "fractional": {"g": "1 kPa", "order": 0.3,
               "tau": "1 s", "shortest": "1 us", "longest": "1000 s", "error": 1e-6}})")),
             Catch::Contains("/material/fractional: fractional branch: an error of 1e-06 takes"));
}

TEST_CASE("a million random steps of bonds with branches never make energy") {
  // l is linear within a step, m_j exact: tau dm/dt = l - m makes the work of branch j over a step
  // g_j [tau_j dl (m1 - m0)/h], without quadrature.
  Random random(11);
  const ElongationFunction potential = elongation_function("cubic", {3e-3});
  double least = 0.0, heat = 0.0, work = 0.0;
  for (int bond = 0; bond < 100; ++bond) {
    const std::size_t n = 1 + static_cast<std::size_t>(bond) % 6;
    std::vector<double> g(n), tau(n), m(n, 0.0);
    for (std::size_t j = 0; j < n; ++j) {
      g[j] = 100.0 * random.uniform();
      tau[j] = std::pow(10.0, -4.0 + 6.0 * random.uniform());
    }
    double l = 0.0;
    const auto stored = [&] {
      double sum = 50.0 * potential.integral(l);
      for (std::size_t j = 0; j < n; ++j) sum += g[j] * ElongationFunction{}.gap(l, m[j]);
      return sum;
    };
    for (int step = 0; step < 10'000; ++step) {
      const double h = std::pow(10.0, -5.0 + 6.0 * random.uniform());
      const double to = 5e-3 * random.normal();
      const double before = stored();
      double done = 50.0 * (potential.integral(to) - potential.integral(l));
      for (std::size_t j = 0; j < n; ++j) {
        const RelaxationWeights w = relaxation_weights(h / tau[j]);
        const double change = std::expm1(-h / tau[j]) * m[j] + w.w0 * l + w.w1 * to;
        done += g[j] * tau[j] * (to - l) * change / h;
        m[j] += change;
      }
      l = to;
      const double lost = done - (stored() - before);
      least = std::min(least, lost / (std::abs(done) + before + 1e-12));
      heat += lost;
      work += done;
    }
  }
  CHECK(least > -1e-11);
  CHECK(heat > 0.0);
  CHECK(work > 0.0);
}
