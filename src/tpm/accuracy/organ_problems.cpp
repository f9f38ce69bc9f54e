// The liver of 424 spheres: held, poked, under a load, and with masses.
#include "tpm/accuracy/organ_problems.hpp"

#include "tpm/accuracy/benchmark_case.hpp"
#include "tpm/accuracy/element_problems.hpp"
#include "tpm/files/file.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpm/organ/scene/scene.hpp"

namespace tpm::accuracy {
namespace {

/// The scene's tissue driven at its contact sphere along the normal.
std::shared_ptr<BenchmarkCase> liver_case(const Tissue& tissue, const Protocol& protocol,
                                          std::vector<double> times_s) {
  const Organ& organ = tissue.network.organ;
  const std::size_t contact = organ.contact.value();
  const Eigen::Vector3d into = -organ.normal.col(static_cast<Eigen::Index>(contact));
  return std::make_shared<BenchmarkCase>(
      driven_network(tissue.bonds(), organ, tissue.constraints(), {{contact, into, 1.0}}, {}),
      protocol, std::move(times_s));
}

/// The same as a scene.
std::shared_ptr<const ExperimentScene> scene_on(const Tissue& tissue, const Protocol& protocol) {
  const Organ& organ = tissue.network.organ;
  const std::size_t contact = organ.contact.value();
  SceneContact driven;
  driven.probe = {contact, -organ.normal.col(static_cast<Eigen::Index>(contact)), 1.0};
  return std::make_shared<ExperimentScene>(ExperimentScene{tissue, {driven}, protocol, {}, {}, {}});
}

constexpr double kPokeWithMass_s = 0.2;

/// The paper's liver with another dashpot.
Tissue liver(double eta1_Pa_s = kPaperEta1_Pa_s) {
  Tissue tissue = read_tissue(share_dir() / "configs" / "liver_scene.json");
  set_value(tissue.materials.materials.front(), "tau1", eta1_Pa_s / kPaperSprings_Pa, "liver");
  return tissue;
}

/// The setting of a rule that the collocation is compared with, and how far off it may be.
struct Referee {
  StepRule rule;  ///< an adaptive one
  double tolerance;
  std::string words;
  double worst_floor;
};

/// As in BenchmarkProblem.
struct ProblemText {
  std::string name, title, text;
};

BenchmarkProblem massless_organ_problem(ProblemText about, const Tissue& tissue,
                                        const Protocol& protocol,
                                        const std::vector<double>& times_s,
                                        const RuleSettings& rules, const Referee& referee) {
  const std::shared_ptr<const BenchmarkCase> benchmark = liver_case(tissue, protocol, times_s);
  const std::shared_ptr<const MethodProblem> rule_problem = rules_on(benchmark);
  BenchmarkProblem problem;
  problem.name = std::move(about.name);
  problem.title = std::move(about.title);
  problem.text = std::move(about.text);
  const bool loaded = benchmark->protocol.drive() == Drive::force;
  problem.response = loaded ? "depth" : "contact force";
  problem.unit = loaded ? "m" : "N";
  problem.simulated_s = benchmark->protocol.end_s();
  problem.relaxation_time_s = benchmark->network.bonds.relaxation_time_s();
  problem.settings = rule_settings(rule_problem, benchmark->times_s, rules);
  add(problem.settings,
      collocation_settings(benchmark, {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}));
  problem.settings.push_back(not_applicable("inertial", "the problem has no masses"));
  problem.settings.push_back(not_applicable("closed_form", "a network has no closed form"));
  add(problem.settings, own_formulation_settings(scene_on(tissue, protocol), times_s));
  problem.reference = [benchmark, rule_problem, referee] {
    MethodSettings method;
    method.rule = referee.rule;
    method.tolerance = referee.tolerance;
    return checked_reference(
        answer_of(collocation_settings(benchmark, {1e-11}).front(), "collocation at 1e-11"),
        answer_of(rule_setting(rule_problem, benchmark->times_s, method), referee.words), false,
        referee.worst_floor, "the organ");
  };
  return problem;
}

/// The poke of a network with masses, 0.2 s.
/// @param guided the driven sphere moves along the push alone; else it is free across
std::shared_ptr<BenchmarkCase> moving_liver_case(const Tissue& tissue, bool guided) {
  constexpr double kDampingRatio = 0.1;
  constexpr double kSpacing_s = 5e-3;
  std::vector<double> times_s = times_every(kSpacing_s, kPokeWithMass_s);
  times_s.pop_back();
  // At a kink the force jumps: it is asked for between them.
  for (double& time : times_s) time += 0.5 * kSpacing_s;
  auto benchmark = liver_case(tissue, ramp_and_hold(8e-3, 0.1, kPokeWithMass_s - 0.08), times_s);
  if (guided) {
    const Probe& probe = benchmark->network.probes.front();
    benchmark->network.constraints.slide(probe.sphere, probe.direction);
  }
  benchmark->set_masses(sphere_masses_kg(tissue.network.organ), kDampingRatio);
  return benchmark;
}

}  // namespace

BenchmarkProblem organ_hold_problem() {
  return massless_organ_problem(
      {"organ_hold", "Organ, ramp and hold",
       "The liver of 424 spheres (configs/liver_scene.json) with eta1 = 257.3 kPa s, pushed 8 mm "
       "deep at sphere 71 at 4 mm/s and held to 31 s."},
      liver(kFittedEta1_Pa_s), ramp_and_hold(8e-3, 4e-3, 29.0), times_every(0.5, 31.0),
      {.steps_s = {2.0, 1.0, 0.5, 0.2, 1e-3},
       .tolerances = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6},
       .sweeps = {1, 10, 100},
       .most_rates = 20'000},
      {StepRule::cvode_adams, 1e-11, "CVODE, Adams, at 1e-11", 1e-6});
}

BenchmarkProblem organ_poke_problem() {
  const Protocol protocol(Drive::displacement, {{0.0, 0.0}, {0.08, 8e-3}, {0.12, 8e-3}, {0.2, 0.0}},
                          "poke");
  return massless_organ_problem(
      {"organ_poke", "Organ, poked at 100 mm/s",
       "The same liver with the paper's eta1 = 5 Pa s (relaxation time 0.208 ms): 8 mm in at 100 "
       "mm/s, held for 40 ms, and out again, 0.2 s in all."},
      liver(), protocol, with_moments_after_kinks(times_every(5e-3, 0.2), protocol),
      {.steps_s = {2e-2, 5e-3, 2e-3, 1e-3, 2.5e-4},
       .tolerances = {1e-2, 1e-4, 1e-6},
       .sweeps = {1, 10, 100},
       .most_rates = 20'000},
      {StepRule::cvode_bdf, 1e-11, "CVODE, BDF, at 1e-11", 1e-6});
}

BenchmarkProblem organ_creep_problem() {
  return massless_organ_problem(
      {"organ_creep", "Organ, 300 s of creep",
       "The same liver with eta1 = 257.3 kPa s under the smaller of the paper's loads, 0.196 N, "
       "applied in a step and kept for 300 s."},
      liver(kFittedEta1_Pa_s), creep(0.196, 300.0), times_every(5.0, 300.0),
      {.steps_s = {20.0, 10.0, 5.0, 2.0, 1e-3},
       .tolerances = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6},
       .sweeps = {1, 10, 100},
       .most_rates = 20'000},
      {StepRule::cvode_adams, 1e-11, "CVODE, Adams, at 1e-11", 1e-6});
}

BenchmarkProblem poke_with_mass_problem(const std::shared_ptr<const BenchmarkCase>& benchmark) {
  const std::shared_ptr<const MethodProblem> rule_problem = rules_on(benchmark);
  RuleSettings rules;
  rules.steps_s = {1e-2, 2.5e-3, 1e-3, 5e-4, 2.5e-4};
  rules.tolerances = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
  rules.sweeps = {1, 10};
  rules.most_rates = 20'000;
  BenchmarkProblem problem;
  problem.response = "contact force";
  problem.simulated_s = kPokeWithMass_s;
  problem.relaxation_time_s = benchmark->network.bonds.relaxation_time_s();
  problem.settings = rule_settings(rule_problem, benchmark->times_s, rules);
  add(problem.settings, collocation_settings(benchmark, {1e-2, 1e-4, 1e-6}));
  add(problem.settings, inertial_settings(benchmark, {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}));
  problem.settings.push_back(not_applicable("closed_form", "a network has no closed form"));
  problem.reference = [benchmark, rule_problem] {
    MethodSettings method;
    method.rule = StepRule::rk4;
    method.step_s = 2.5e-5;
    return checked_reference(answer_of(inertial_settings(benchmark, {1e-9}).back(),
                                       "CVODES (inertial), order 5, at 1e-9"),
                             answer_of(rule_setting(rule_problem, benchmark->times_s, method),
                                       "Runge-Kutta of order 4 with steps of 25 microseconds"),
                             false, 1e-4, "the organ with masses");
  };
  return problem;
}

BenchmarkProblem organ_poke_mass_problem() {
  BenchmarkProblem problem = poke_with_mass_problem(moving_liver_case(liver(), false));
  problem.name = "organ_poke_mass";
  problem.title = "Organ with masses, poked at 100 mm/s";
  problem.text =
      "The liver with the paper's eta1 and a mass of 4.4 g in each sphere (1060 kg/m3), damped by "
      "a tenth of the lowest mode: 8 mm in at 100 mm/s, held to 0.2 s. The collocation leaves the "
      "masses out: its error is what inertia matters.";
  return problem;
}

std::shared_ptr<const BenchmarkCase> elastic_poke_case() {
  Tissue tissue = liver();
  // A dashpot that gives nothing for 1e9 s leaves E2 alone.
  set_value(tissue.materials.materials.front(), "tau1", 1e9, "elastic poke");
  // The engines move a sphere as a whole.
  return moving_liver_case(tissue, true);
}

}  // namespace tpm::accuracy
