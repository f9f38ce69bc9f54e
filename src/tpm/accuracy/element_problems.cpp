// One bond: the element of the paper, driven and loaded, with and without mass.
#include <array>
#include <boost/numeric/odeint.hpp>
#include <cmath>

#include "tpm/accuracy/benchmark_case.hpp"
#include "tpm/accuracy/element_problems.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpmkit/model.hpp"

namespace tpm::accuracy {
namespace {

/// One bond under a protocol, and the star of four spheres, which is the same thing.
struct BondCase {
  BondElement material;
  std::shared_ptr<const BenchmarkCase> star;
  std::shared_ptr<const MethodProblem> element;
};

/// The paper's springs with a dashpot.
BondElement material_of(double eta1_Pa_s) {
  return paper_element(eta1_Pa_s / kPaperSprings_Pa);
}

BondCase bond_case(double eta1_Pa_s, const Protocol& protocol, std::vector<double> times_s) {
  const BondElement material = material_of(eta1_Pa_s);
  return {material,
          std::make_shared<BenchmarkCase>(driven_star(material), protocol, std::move(times_s)),
          element_problem(material, protocol)};
}

MethodRun run_closed_form(const BondElement& material, const Protocol& protocol,
                          std::span<const double> times_s) {
  const TpmVector parameters = element_constants(material);
  MethodRun run;
  run.response =
      make_model("closed_form")->respond(protocol, times_s, parameters, Want::values).value;
  run.end_time_s = times_s.back();
  return run;
}

BenchmarkSetting closed_form(const BondCase& bond) {
  return {"closed_form", "", "", 0.0, {}, [bond](bool) -> BenchmarkRun {
            return {run_closed_form(bond.material, bond.star->protocol, bond.star->times_s), {}};
          }};
}

const char* const kNoMass = "the problem has no masses";

/// Everything that solves a bond without mass.
std::vector<BenchmarkSetting> massless_settings(const BondCase& bond, const RuleSettings& rules) {
  std::vector<BenchmarkSetting> all = rule_settings(bond.element, bond.star->times_s, rules);
  add(all, collocation_settings(bond.star, {1e-2, 1e-4, 1e-6, 1e-8, 1e-10}));
  all.push_back(not_applicable("inertial", kNoMass));
  all.push_back(closed_form(bond));
  return all;
}

BenchmarkReference exact_reference(const BondCase& bond, const std::string& name) {
  return checked_reference(answer_of(closed_form(bond), "the closed form"),
                           answer_of(collocation_settings(bond.star, {1e-12}).front(),
                                     "collocation on the star of four spheres at 1e-12"),
                           true, 1e-8, name);
}

BenchmarkProblem exact_problem(const BondCase& bond, std::string name, std::string title,
                               std::string text, const RuleSettings& rules) {
  const bool depth = bond.star->protocol.drive() == Drive::force;
  BenchmarkProblem problem;
  problem.title = std::move(title);
  problem.text = std::move(text);
  problem.response = depth ? "depth" : "contact force";
  problem.unit = depth ? "m" : "N";
  problem.simulated_s = bond.star->protocol.end_s();
  problem.relaxation_time_s = bond.material.relaxation_time_s();
  problem.settings = massless_settings(bond, rules);
  problem.reference = [bond, name] { return exact_reference(bond, name); };
  problem.name = std::move(name);
  return problem;
}

BondCase ramped_bond(double eta1_Pa_s) {
  const Protocol protocol = ramp_and_hold(8e-3, 4e-3, 29.0);
  return bond_case(eta1_Pa_s, protocol, with_moments_after_kinks(times_every(0.5, 31.0), protocol));
}

/// The bond with mass under a suddenly applied load: depth, speed, and y, which follows the depth.
/// Written down once more here, away from the methods that it checks.
Eigen::VectorXd integrated_depth(const BondCase& bond, double load_N) {
  using State = std::array<double, 3>;
  const BondElement& p = bond.material;
  const TensionLaw tension = p.tension();
  const double instantaneous_Pa = p.instantaneous_Pa(), relaxing_Pa = p.relaxing_Pa();
  const double mass_kg = bond.star->mass->mass_kg[0];
  const double drag_per_s = bond.star->mass->drag_per_s;
  const auto rates = [&](const State& s, State& rate, double /*time*/) {
    const double pull = (instantaneous_Pa * s[0] - relaxing_Pa * s[2] + tension.value(s[0])) *
                        p.modulus_to_stiffness_m();
    rate = {s[1], (load_N - pull) / mass_kg - drag_per_s * s[1],
            (s[0] - s[2]) / p.relaxation_time_s()};
  };
  namespace odeint = boost::numeric::odeint;
  // Tolerances are parts of millimetres; speeds and depths are of comparable size.
  auto stepper = odeint::make_controlled(1e-17, 1e-14, odeint::runge_kutta_fehlberg78<State>());
  State state{0.0, 0.0, 0.0};
  const std::vector<double>& times = bond.star->times_s;
  Eigen::VectorXd depth(static_cast<Eigen::Index>(times.size()));
  Eigen::Index row = 0;
  std::vector<double> from_start{0.0};
  from_start.insert(from_start.end(), times.begin() + (times.front() == 0.0 ? 1 : 0), times.end());
  const bool asked_at_start = times.front() == 0.0;
  odeint::integrate_times(stepper, rates, state, from_start.begin(), from_start.end(), 1e-6,
                          [&](const State& s, double time) {
                            if (time > 0.0 || asked_at_start) depth[row++] = s[0];
                          });
  return depth;
}

}  // namespace

BenchmarkProblem bond_paper_problem() {
  return exact_problem(
      ramped_bond(kPaperEta1_Pa_s), "bond_paper", "One bond, the paper's own eta1",
      "The star of the paper with E1 = E2 = E' = 12 kPa, x = 30 mm and eta1 = 5 Pa s: a relaxation "
      "time of 0.208 ms. Pushed 8 mm deep at 4 mm/s and held to 31 s. Stiff: nothing happens on "
      "the "
      "scale of the relaxation time, and explicit rules still have to follow it.",
      {.steps_s = {0.5, 0.1, 1e-2, 2e-3, 1e-3, 5e-4, 4e-4, 2.5e-4, 1e-4, 5e-5},
       .tolerances = {1e-2, 1e-4, 1e-6, 1e-8, 1e-10}});
}

BenchmarkProblem bond_fitted_problem() {
  return exact_problem(
      ramped_bond(kFittedEta1_Pa_s), "bond_fitted", "One bond, eta1 as fitted",
      "The same with eta1 = 257.3 kPa s, as `tpm fit configs/liver_relaxation.json` finds it: a "
      "relaxation time of 10.7 s. Not stiff: here the order of a method shows.",
      {.steps_s = {2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 1e-2, 1e-3, 2.5e-4},
       .tolerances = {1e-2, 1e-4, 1e-6, 1e-8, 1e-10}});
}

BenchmarkProblem star_creep_problem() {
  const BondCase bond = bond_case(kFittedEta1_Pa_s, creep(0.98, 60.0), times_every(1.0, 60.0));
  return exact_problem(bond, "star_creep", "Creep of the star under 0.98 N",
                       "The larger of the paper's loads, applied in a step and kept for 60 s; eta1 "
                       "= 257.3 kPa s, the "
                       "true lambda1 of each depth. The exact answer is a quadrature over depth.",
                       {.steps_s = {10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 1e-2, 1e-3},
                        .tolerances = {1e-2, 1e-4, 1e-6, 1e-8, 1e-10}});
}

BenchmarkProblem bond_mass_problem() {
  constexpr double kLoad_N = 0.5;
  constexpr double kEnd_s = 0.5;
  constexpr double kDampingRatio = 0.1;
  BondCase bond;
  bond.material = material_of(kPaperEta1_Pa_s);
  const auto benchmark = std::make_shared<BenchmarkCase>(
      driven_star(bond.material), creep(kLoad_N, kEnd_s), times_every(0.01, kEnd_s));
  const Organ sphere = [] {
    Organ organ;
    organ.position = Positions::Zero(3, 4);
    organ.radius = 0.01;
    return organ;
  }();
  benchmark->set_masses(sphere_masses_kg(sphere), kDampingRatio);
  const MethodMasses one{benchmark->mass->mass_kg.head(1), benchmark->mass->drag_per_s};
  bond.star = benchmark;
  bond.element = element_problem(bond.material, benchmark->protocol, one);
  RuleSettings rules;
  rules.steps_s = {1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1e-4, 1e-5};
  rules.tolerances = {1e-2, 1e-4, 1e-6, 1e-8, 1e-10};
  BenchmarkProblem problem;
  problem.name = "bond_mass";
  problem.title = "One bond with a mass, loaded in a step";
  problem.text =
      "A sphere of liver (10 mm radius, 4.4 g) on the paper's bond (eta1 = 5 Pa s), 0.5 N put on "
      "at "
      "once: it rings at 30 Hz, damped by a tenth. The depth over 0.5 s.";
  problem.response = "depth";
  problem.unit = "m";
  problem.simulated_s = kEnd_s;
  problem.relaxation_time_s = bond.material.relaxation_time_s();
  problem.settings = rule_settings(bond.element, bond.star->times_s, rules);
  add(problem.settings, collocation_settings(bond.star, {1e-6}));
  add(problem.settings, inertial_settings(bond.star, {1e-2, 1e-4, 1e-6, 1e-8, 1e-10}));
  problem.settings.push_back(not_applicable("closed_form", "no closed form with mass and tension"));
  problem.reference = [bond] {
    return checked_reference(
        {"odeint", "Fehlberg's 7(8) pair of Boost.Odeint on the equation of one sphere, at 1e-14",
         integrated_depth(bond, kLoad_N)},
        answer_of(inertial_settings(bond.star, {1e-12}).back(),
                  "CVODES on the star of four spheres, order 5, at 1e-12"),
        false, 1e-6, "bond_mass");
  };
  return problem;
}

}  // namespace tpm::accuracy
