#include "tpm/accuracy/benchmark_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/organ/balance/inertial.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {

BenchmarkCase::BenchmarkCase(DrivenNetwork driven, Protocol imposed, std::vector<double> asked_s)
    : network(std::move(driven)), protocol(std::move(imposed)), times_s(std::move(asked_s)) {}

void BenchmarkCase::set_masses(Eigen::VectorXd mass_kg, double ratio) {
  damping_ratio = ratio;
  const LowestMode lowest = lowest_mode(network.bonds, network.rest, network.constraints, mass_kg);
  mass = MethodMasses{std::move(mass_kg), 2.0 * ratio * lowest.angular_frequency()};
}

DrivenNetwork driven_star(const BondElement& material) {
  constexpr double kRadialLength = 0.020;
  const Organ organ = star(material.spacing_m, kRadialLength);
  const std::vector<NeighbourPair> pairs{{0, 1}, {1, 2}, {1, 3}};
  const Network network = join(organ, pairs, {}, "star");
  constexpr std::size_t kB = 1;  // A, B, C, D
  const Eigen::Vector3d into = -organ.normal.col(kB);
  Constraints constraints(organ.size());
  constraints.slide(kB, into);
  for (const std::size_t held : {0u, 2u, 3u}) constraints.fix(held);
  return driven_network(BondSystem(network, material), organ, constraints, {{kB, into, 1.0}}, {});
}

std::vector<double> times_every(double spacing_s, double end_s, int first) {
  const auto count = static_cast<int>(std::lround(end_s / spacing_s));
  // Divided by a whole number, a time is the double next to its decimals, as a knot there is.
  const double per_s = std::round(1.0 / spacing_s);
  std::vector<double> times;
  for (int i = first; i <= count; ++i) {
    times.push_back(spacing_s < 1.0 ? i / per_s : i * spacing_s);
  }
  return times;
}

std::vector<double> with_moments_after_kinks(std::vector<double> times_s,
                                             const Protocol& protocol) {
  const std::span<const Knot> knots = protocol.knots();
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    for (const double after_s : {2.5e-4, 5e-4, 1e-3, 2e-3}) {
      times_s.push_back(knots[i].time_s + after_s);
    }
  }
  std::sort(times_s.begin(), times_s.end());
  return times_s;
}

std::shared_ptr<const MethodProblem> rules_on(
    const std::shared_ptr<const BenchmarkCase>& benchmark) {
  struct Kept {
    std::shared_ptr<const BenchmarkCase> benchmark;
    std::unique_ptr<MethodProblem> problem;
  };
  const auto kept = std::make_shared<Kept>(
      Kept{benchmark, network_problem(benchmark->network, benchmark->protocol, benchmark->mass)});
  return {kept, kept->problem.get()};
}

BenchmarkSetting rule_setting(const std::shared_ptr<const MethodProblem>& problem,
                              const std::vector<double>& times_s, const MethodSettings& method) {
  const StepRuleEntry& rule =
      *std::find_if(kStepRules.begin(), kStepRules.end(),
                    [&](const StepRuleEntry& entry) { return entry.meaning == method.rule; });
  BenchmarkSetting setting;
  setting.method = rule.text;
  setting.parameter = rule.adaptive ? "tolerance" : "step_s";
  setting.value = rule.adaptive ? method.tolerance : method.step_s;
  if (!rule.adaptive) setting.step_s = method.step_s;
  setting.run = [problem, times_s, method](bool) -> BenchmarkRun {
    return {problem->run(method, times_s), {}};
  };
  return setting;
}

namespace {

/// A sweep takes far less than the factorisation that comes with an evaluation elsewhere.
constexpr long kSweepsPerRate = 3;

std::string sweeps_words(int sweeps) {
  return sweeps == 1 ? "1 sweep" : fmt::format("{} sweeps", sweeps);
}

}  // namespace

std::vector<BenchmarkSetting> rule_settings(const std::shared_ptr<const MethodProblem>& problem,
                                            const std::vector<double>& times_s,
                                            const RuleSettings& settings) {
  std::vector<BenchmarkSetting> all;
  for (const StepRuleEntry& rule : kStepRules) {
    MethodSettings method;
    method.rule = rule.meaning;
    method.most_rates = settings.most_rates;
    const bool swept = rule.meaning == StepRule::xpbd;
    if (swept) method.most_rates *= kSweepsPerRate;
    for (const int sweeps : swept ? settings.sweeps : std::vector<int>{1}) {
      method.sweeps = sweeps;
      for (const double value : rule.adaptive ? settings.tolerances : settings.steps_s) {
        (rule.adaptive ? method.tolerance : method.step_s) = value;
        all.push_back(rule_setting(problem, times_s, method));
        if (swept && settings.sweeps.size() > 1) all.back().variant = sweeps_words(sweeps);
      }
    }
  }
  return all;
}

namespace {

/// Outcome of a run whose formulation gave up with this error.
MethodRun failed_run(const Error& error) {
  MethodRun run;
  const bool lost =
      error.cause() == ErrorCause::buckled || error.cause() == ErrorCause::snapped_through;
  run.end = lost ? MethodEnd::buckled : MethodEnd::newton_failed;
  run.reason = error.what();
  return run;
}

template <class Run>
BenchmarkRun outcome_of(Run&& run) {
  try {
    return {run(), {}};
  } catch (const Error& error) {
    if (error.code() != ExitCode::numerical) throw;
    return {failed_run(error), {}};
  }
}

MethodRun run_collocation(const BenchmarkCase& benchmark, double tolerance) {
  const DrivenNetwork& n = benchmark.network;
  const QuasiStatic solver(n.bonds, n.rest, n.constraints, n.probes, {.tolerance = tolerance});
  QuasiStaticRun run = solver.run(benchmark.protocol, benchmark.times_s);
  MethodRun outcome;
  outcome.response = std::move(run.response);
  outcome.end_time_s = benchmark.times_s.back();
  outcome.work = {run.work.steps + run.work.rejected, run.work.iterations, run.work.factorisations,
                  run.work.back_solves};
  return outcome;
}

MethodRun run_inertial(const BenchmarkCase& benchmark, double tolerance, int order) {
  const DrivenNetwork& n = benchmark.network;
  InertialOptions options;
  options.tolerance = tolerance;
  options.highest_order = order;
  options.damping_ratio = benchmark.damping_ratio;
  const Inertial solver(n.bonds, n.rest, n.constraints, n.probes, benchmark.mass->mass_kg, options);
  InertialRun run = solver.run(benchmark.protocol, benchmark.times_s);
  MethodRun outcome;
  outcome.response = std::move(run.response);
  outcome.end_time_s = benchmark.times_s.back();
  outcome.work = {run.work.steps + run.work.rejected, run.work.rates, run.work.factorisations,
                  run.work.newton_iterations};
  return outcome;
}

}  // namespace

std::vector<BenchmarkSetting> collocation_settings(
    const std::shared_ptr<const BenchmarkCase>& benchmark,
    std::initializer_list<double> tolerances) {
  std::vector<BenchmarkSetting> all;
  for (const double tolerance : tolerances) {
    all.push_back({"collocation", "", "tolerance", tolerance, {}, [benchmark, tolerance](bool) {
                     return outcome_of([&] { return run_collocation(*benchmark, tolerance); });
                   }});
  }
  return all;
}

std::vector<BenchmarkSetting> inertial_settings(
    const std::shared_ptr<const BenchmarkCase>& benchmark,
    std::initializer_list<double> tolerances) {
  std::vector<BenchmarkSetting> all;
  for (const int order : {2, 5}) {
    for (const double tolerance : tolerances) {
      all.push_back({"inertial",
                     fmt::format("order {}", order),
                     "tolerance",
                     tolerance,
                     {},
                     [benchmark, tolerance, order](bool) {
                       return outcome_of(
                           [&] { return run_inertial(*benchmark, tolerance, order); });
                     }});
    }
  }
  return all;
}

std::vector<BenchmarkSetting> own_formulation_settings(
    const std::shared_ptr<const ExperimentScene>& scene, const std::vector<double>& times_s) {
  const Formulations shipped = shipped_formulations();
  std::vector<BenchmarkSetting> all;
  for (const Formulation* f : linked_formulations()) {
    if (std::find(shipped.begin(), shipped.end(), f) != shipped.end()) continue;
    const auto own = std::make_shared<ExperimentScene>(*scene);
    own->formulation = {};
    own->formulation.kind = f->name();
    own->formulation.where = "problem";
    try {
      require_runnable(*own);
    } catch (const Error& error) {
      if (error.code() != ExitCode::bad_input) throw;
      all.push_back(not_applicable(own->formulation.kind, error.what()));
      continue;
    }
    all.push_back({own->formulation.kind, "", "", 0.0, {}, [own, times_s](bool) {
                     return outcome_of([&] {
                       Trajectory answer = run_scene(*own, times_s, false);
                       MethodRun run;
                       run.response = std::move(answer.response);
                       run.end_time_s = times_s.back();
                       run.work.steps = std::lround(answer.steps);
                       return run;
                     });
                   }});
  }
  return all;
}

BenchmarkSetting not_applicable(std::string method, std::string reason) {
  MethodRun run;
  run.end = MethodEnd::not_applicable;
  run.reason = std::move(reason);
  return {std::move(method), "", "", 0.0, {}, [run](bool) -> BenchmarkRun { return {run, {}}; }};
}

BenchmarkAnswer answer_of(const BenchmarkSetting& setting, std::string words) {
  BenchmarkRun run = setting.run(false);
  if (run.outcome.end == MethodEnd::completed) {
    return {setting.method, std::move(words), std::move(run.outcome.response)};
  }
  throw Error(ExitCode::numerical, "reference", fmt::format("{}: {}", words, run.outcome.reason));
}

void add(std::vector<BenchmarkSetting>& all, std::vector<BenchmarkSetting> more) {
  for (BenchmarkSetting& setting : more) all.push_back(std::move(setting));
}

}  // namespace tpm::accuracy
