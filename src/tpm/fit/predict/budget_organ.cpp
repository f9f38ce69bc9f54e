// Declared in tpm/fit/predict/error_budget.hpp.
// The stages of an organ.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/fit/predict/budget_parts.hpp"
#include "tpm/plan/plan.hpp"
#include "tpm/plan/plan_scene.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr double kTighterRun = 0.01;   // of the scene's tolerance: what its runs are compared with
constexpr double kInertialRun = 1e-6;  // of a step, of the run with masses
constexpr int kTimesPerPiece = 160, kMostBudgetTimes = 600;

std::vector<double> response_of(const Trajectory& run) {
  return {run.response.begin(), run.response.end()};
}

/// The tool holds the sphere across the push, as in a loop.
ExperimentScene guided(ExperimentScene scene) {
  const Probe probe = scene.probe();
  const bool single = scene.contacts.size() == 1 &&
                      scene.contacts.front().kind == ContactKind::sphere &&
                      scene.protocol.drive() == Drive::displacement;
  if (!single) {
    throw bad_input("budget of an organ", "more than one sphere driven to a depth",
                    "a scene with one contact of the kind sphere and a protocol of depths");
  }
  std::vector<Slider>& sliders = scene.tissue.sliders;
  const bool there = std::ranges::find(sliders, probe.sphere, &Slider::sphere) != sliders.end();
  if (!there) sliders.push_back({probe.sphere, probe.direction});
  return scene;
}

/// By how much the bonds of a network are stiffer than at the paper's spacing.
double stiffness_of_spacing(const Network& network) {
  if (network.options.spacing_law == SpacingLaw::paper) return 1.0;
  return network.organ.spacing / network.options.reference_spacing_m;
}

/// The finer organ is one material with the scene's: its bonds follow the law `continuum` from the
/// scene's spacing on.
void require_refinement(const Network& scene, const Network& finer) {
  const double ratio = finer.organ.spacing / scene.organ.spacing;
  const auto millimetres = [](double x_m) { return shortest(rounded(1e3 * x_m)) + " mm"; };
  if (!(ratio < 1.0)) {
    throw bad_input("budget of an organ",
                    fmt::format("the finer scene has the spacing {}, the scene {}",
                                millimetres(finer.organ.spacing), millimetres(scene.organ.spacing)),
                    "a smaller one");
  }
  constexpr double kEqual = 1e-9;
  const double stiffness = stiffness_of_spacing(finer) / stiffness_of_spacing(scene);
  if (std::abs(stiffness - ratio) <= kEqual) return;
  throw bad_input(
      "budget of an organ",
      fmt::format("the bonds of the finer scene are {} times as stiff at {} times the spacing",
                  significant(stiffness, 4), significant(ratio, 4)),
      fmt::format("\"spacing_law\": \"continuum\", \"reference_spacing\": \"{}\" in its bonds",
                  millimetres(scene.organ.spacing / stiffness_of_spacing(scene))));
}

std::vector<double> quasi_static_forces(const PlanScene& scene, double tolerance,
                                        const std::vector<double>& times_s) {
  QuasiStaticOptions options;
  options.tolerance = std::max(tolerance, 1e-12);
  return response_of(scene.quasi_static(options, times_s, false));
}

std::vector<double> forces_with_masses(const PlanScene& scene, const std::vector<double>& times_s) {
  InertialOptions options;
  options.tolerance = kInertialRun;
  options.damping_ratio = scene.scene().formulation.damping_ratio;
  return response_of(scene.inertial(options, times_s, false));
}

std::vector<double> plus(std::vector<double> a, const std::vector<double>& b,
                         const std::vector<double>& less) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += b[i] - less[i];
  return a;
}

/// The scene's network: with masses (at a finer spacing if there is one), and what is left out.
void add_organ_stages(std::vector<BudgetStage>& stages, const PlanScene& scene,
                      const std::optional<PlanScene>& finer, const std::vector<double>& times_s) {
  const double own = scene.scene().formulation.tolerance;
  const std::vector<double> without = quasi_static_forces(scene, kTighterRun * own, times_s);
  const std::vector<double> with = forces_with_masses(scene, times_s);
  if (finer) {
    stages.push_back(
        {"organ", "the network at a finer spacing, with masses", "organ", BudgetKind::tissue,
         plus(quasi_static_forces(*finer, kTighterRun * own, times_s), with, without)});
    stages.push_back({"scene", "the scene's spacing", "spacing", BudgetKind::tissue, with});
  } else {
    stages.push_back(
        {"organ", "the scene's network with masses", "organ", BudgetKind::tissue, with});
  }
  stages.push_back({"massless", "masses left out", "masses", BudgetKind::tissue, without});
  stages.push_back({"run", fmt::format("tolerance {}", shortest(own)), "tolerance",
                    BudgetKind::computation, quasi_static_forces(scene, own, times_s)});
}

/// The model that a plan picks for the loop.
void add_planned_stages(std::vector<BudgetStage>& stages, const ExperimentScene& scene,
                        const std::string& tolerance, const std::vector<double>& times_s,
                        const BudgetDevice& device) {
  PlanRequest request;
  set_tolerance(request, tolerance);
  request.for_loop = true;
  request.relevance = request.changes = false;
  request.budget.rate_Hz = 1.0 / device.period_s;
  const Plan plan = make_plan(scene, request);
  if (!plan.choice) {
    throw Error(ExitCode::answer_is_no, "budget",
                fmt::format("nothing that a loop steps is within {} at {} Hz", tolerance,
                            significant(1.0 / device.period_s, 4)),
                "a wider --tolerance or a lower --loop-rate");
  }
  const auto contacts = planned_contacts(plan, scene, std::array{device.period_s, device.period_s});
  const Eigen::Vector3d push = scene.probe().direction;
  const auto in_loop = [&push](ContactModel& contact) {
    return [&push, &contact](double depth) {
      return std::max(-push.dot(contact.step(depth * push).force_N), 0.0);
    };
  };
  add_device_stages(
      stages, scene.protocol, in_loop(*contacts.front()), in_loop(*contacts.back()), times_s,
      device,
      {"loop",
       fmt::format("{}, which tpm plan picks within {}, each {} ms", plan.chosen().name, tolerance,
                   significant(1e3 * device.period_s, 3)),
       "reduction",
       BudgetKind::computation,
       {}});
}

}  // namespace

ErrorBudget organ_budget(const std::optional<LawFile>& law, const ExperimentScene& given,
                         const std::optional<ExperimentScene>& finer, const std::string& tolerance,
                         const BudgetOptions& options) {
  require_possible(options.device);
  const ExperimentScene scene = guided(given);
  const PlanScene network(scene);
  std::optional<PlanScene> fine;
  if (finer) {
    ExperimentScene other = guided(*finer);
    require_refinement(scene.tissue.network, other.tissue.network);
    other.protocol = scene.protocol;
    fine.emplace(std::move(other));
  }
  std::vector<double> times_s = sampled_times(scene.protocol, kTimesPerPiece, kMostBudgetTimes,
                                              network.driven().bonds.shortest_relaxation_time_s());
  std::vector<BudgetStage> stages;
  if (law) stages.push_back(law_stage(at_surface(*law), scene.protocol, times_s));
  add_organ_stages(stages, network, fine, times_s);
  add_planned_stages(stages, scene, tolerance, times_s, options.device);
  ErrorBudget budget = budget_of(std::move(times_s), std::move(stages));
  budget.title = fmt::format("an organ of {} spheres", network.network().organ.position.cols());
  if (law) add_random_part(budget, at_surface(*law), scene.protocol, options);
  if (fine) {
    budget.remarks.push_back(
        {"masses_from_coarse_spacing",
         "what masses change is taken from the scene's spacing at the finer one, too"});
    budget.remarks.push_back(
        {"contact_depends_on_spacing",
         "the contact is one sphere, which is smaller at the finer spacing: the line spacing does "
         "not vanish as the spacing does"});
  }
  conclude(budget);
  return budget;
}

}  // namespace tpm::fit
