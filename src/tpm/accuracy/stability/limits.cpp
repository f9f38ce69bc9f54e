// Declared in tpm/accuracy/stability/study.hpp.
// Limits found by bisection, and the servo rates at the paper's own eta1.
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "tpm/accuracy/stability/checked_problem.hpp"
#include "tpm/accuracy/stability/study.hpp"
#include "tpm/law/element/closed_form.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {
namespace {

constexpr double kShare = 0.005;  // to which a limit is bisected: less than 1 %

/// @param fails that a run of this step grows; at a tenth of the theory it must not, at ten times
///   it must
double bisected(double theory_s, const std::function<bool(double)>& fails) {
  double holds = 0.1 * theory_s;
  double too_long = 10.0 * theory_s;
  if (fails(holds) || !fails(too_long)) return std::numeric_limits<double>::quiet_NaN();
  while (too_long > holds * (1.0 + kShare)) {
    const double middle = std::sqrt(holds * too_long);
    (fails(middle) ? too_long : holds) = middle;
  }
  return std::sqrt(holds * too_long);
}

MethodSettings stepped(StepRule rule, double step_s) {
  MethodSettings settings;
  settings.rule = rule;
  settings.step_s = step_s;
  return settings;
}

/// A run long enough for growth of a part in a thousand a step to show.
bool run_fails(const MethodProblem& problem, StepRule rule, double step_s) {
  const std::vector<double> end{problem.protocol().end_s()};
  const MethodRun run = problem.run(stepped(rule, step_s), end);
  return run.end != MethodEnd::completed;
}

void add_limit(std::vector<StabilityLimit>& limits, std::string problem, StepRule rule,
               std::string theory, double theory_s, const std::function<bool(double)>& fails) {
  limits.push_back(
      {std::move(problem), rule, std::move(theory), theory_s, bisected(theory_s, fails), false});
}

constexpr double kRestSteps = 4000.0;
constexpr double kMotionSteps = 400000.0;  // forward Euler's growth with drag is slow

void add_rest_limits(std::vector<StabilityLimit>& limits) {
  const BondElement paper = paper_element();
  const BondElement slow = paper_element(0.1);
  constexpr double kLoad_N = 0.3;
  const double depth = equilibrium_depth_m(slow, slow.equilibrium_Pa, kLoad_N);
  LinearElement imposed = linear_element(paper, 0.0);
  imposed.depth_imposed = true;
  for (const auto& [rule, factor] :
       {std::pair{StepRule::forward_euler, "2"}, std::pair{StepRule::rk4, "2.785"}}) {
    const StepRule r = rule;
    add_limit(limits, "element, the paper's eta1, a depth in a step", r,
              std::string(factor) + " tau", *stable_step_s(r, imposed), [&](double h) {
                return run_fails(*element_problem(paper, step_and_hold(0.004, kRestSteps * h)), r,
                                 h);
              });
    limits.back().at_papers_eta1 = true;
    add_limit(limits, "element with tension, tau = 0.1 s, 0.3 N in a step", r,
              std::string(factor) + " tau/(1 - g/(k + tension'))",
              *stable_step_s(r, linear_element(slow, depth)), [&](double h) {
                return run_fails(*element_problem(slow, creep(kLoad_N, kRestSteps * h)), r, h);
              });
  }
}

void add_motion_limits(std::vector<StabilityLimit>& limits) {
  BondElement elastic = paper_element(1e9);
  elastic.lateral_Pa = 0.0;
  BondElement relaxing = paper_element(0.01);
  relaxing.lateral_Pa = 0.0;
  struct Case {
    std::string problem;
    const BondElement& p;
    double drag;
    StepRule rule;
    std::string theory;
  };
  const std::string free = "elastic sphere of 4.4 g, no drag";
  const std::string damped = "elastic sphere of 4.4 g, drag 20 1/s";
  const std::string tissue = "sphere of 4.4 g, tau = 0.01 s, drag 20 1/s";
  const std::vector<Case> cases{
      {free, elastic, 0.0, StepRule::semi_implicit_euler, "2/omega"},
      {free, elastic, 0.0, StepRule::rk4, "2 sqrt(2)/omega"},
      {damped, elastic, 20.0, StepRule::forward_euler, "drag/omega^2"},
      {damped, elastic, 20.0, StepRule::semi_implicit_euler,
       "(drag + sqrt(drag^2 + 4 omega^2))/omega^2"},
      {tissue, relaxing, 20.0, StepRule::forward_euler, "eigenvalues of (x, v, y)"},
      {tissue, relaxing, 20.0, StepRule::semi_implicit_euler, "eigenvalues of (x, v, y)"},
      {tissue, relaxing, 20.0, StepRule::rk4, "eigenvalues of (x, v, y)"},
  };
  for (const Case& c : cases) {
    LinearElement linear = linear_element(c.p, 0.0);
    linear.mass_kg = kSphereMass_kg;
    linear.drag_per_s = c.drag;
    const MethodMasses mass{Eigen::VectorXd::Constant(1, kSphereMass_kg), c.drag};
    add_limit(limits, c.problem, c.rule, c.theory, *stable_step_s(c.rule, linear), [&](double h) {
      return run_fails(*element_problem(c.p, creep(0.05, kMotionSteps * h), mass), c.rule, h);
    });
  }
}

/// The highest angular frequency of a network about rest without relaxation, by powers of M^-1 K.
double highest_frequency(const DrivenNetwork& network, const Eigen::VectorXd& mass_kg) {
  constexpr int kMost = 20000;
  const Eigen::Index n = network.rest.cols();
  const ViscousState none{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(network.bonds.size())),
                          0.0};
  Eigen::Matrix3Xd u(3, n);
  std::mt19937_64 random(1);  // any start that is not orthogonal to the mode
  for (double& value : u.reshaped()) value = static_cast<double>(random() >> 11) * 0x1p-53 - 0.5;
  double square = 0.0;
  for (int i = 0; i < kMost; ++i) {
    network.constraints.project(u);
    u /= std::sqrt((u.colwise().squaredNorm() * mass_kg).value());
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, n);
    network.bonds.add_stiffness_times(network.rest, none, u, force);
    network.constraints.project(force);
    const double next = force.cwiseProduct(u).sum();
    u = force * mass_kg.cwiseInverse().asDiagonal();
    if (std::abs(next - square) <= 1e-12 * next) return std::sqrt(next);
    square = next;
  }
  throw Error(ExitCode::numerical, "highest frequency", "the power iteration did not converge");
}

void add_organ_limits(std::vector<StabilityLimit>& limits) {
  constexpr std::size_t kSmall = 24;
  constexpr double kOrganSteps = 600.0;
  const StudyOrgan rest(paper_element(0.1), kSmall);
  for (const auto& [rule, factor, theory] :
       {std::tuple{StepRule::forward_euler, 2.0, "2 tau"},
        std::tuple{StepRule::rk4, 2.785293563405282, "2.785 tau"}}) {
    const StepRule r = rule;
    add_limit(limits, "24 spheres, far outer layer fixed without mass, 1 mm in a step and held", r,
              theory, factor * 0.1, [&](double h) {
                const Protocol protocol(Drive::displacement,
                                        {{0.0, 0.0}, {h, 1e-3}, {kOrganSteps * h, 1e-3}});
                return run_fails(*network_problem(rest.driven, protocol), r, h);
              });
  }
  // So small a load that what grows is found before it is large enough to change its frequency.
  const StudyOrgan elastic(paper_element(1e9), 424);
  const MethodMasses mass{sphere_masses_kg(elastic.network.organ), 0.0};
  const double omega = highest_frequency(elastic.driven, mass.mass_kg);
  for (const auto& [rule, factor, theory] :
       {std::tuple{StepRule::semi_implicit_euler, 2.0, "2/omega_max"},
        std::tuple{StepRule::rk4, 2.0 * std::sqrt(2.0), "2 sqrt(2)/omega_max"}}) {
    const StepRule r = rule;
    add_limit(limits, "424 elastic spheres, far outer layer fixed, no drag, 1e-6 N in a step", r,
              theory, factor / omega, [&](double h) {
                return run_fails(*network_problem(elastic.driven, creep(1e-6, 3000.0 * h), mass), r,
                                 h);
              });
  }
}

const std::vector<double>& servo_rates_Hz() {
  static const std::vector<double> rates{500,  1000, 1500, 2000, 2300, 2380,
                                         2420, 2500, 3000, 4000, 4800};
  return rates;
}

// 4 mm at 90 mm/s. At 100 mm/s the ramp is 96 times 2 tau: just below the limit forward Euler's
// error changes sign 96 times and cancels, and nothing is left to grow.
const double kServoRamp_s = 0.004 / 0.09;
// Long enough for what grows by 1 % a step to be seen growing.
const double kServoEnd_s = 1.0;

std::vector<double> ticks(double rate_Hz) {
  std::vector<double> times;
  for (double i = 1.0; i / rate_Hz <= kServoEnd_s * (1.0 + 1e-12); ++i) {
    times.push_back(std::min(i / rate_Hz, kServoEnd_s));
  }
  return times;
}

/// A protocol as a servo samples it: its values at the ticks, linear in between. Corners between
/// two ticks are lost, as they are in the loop.
Protocol as_sampled(const Protocol& protocol, const std::vector<double>& ticks_s) {
  std::vector<Knot> knots{{protocol.start_s(), value_at(protocol, protocol.start_s())}};
  for (const double time : ticks_s) knots.push_back({time, value_at(protocol, time)});
  return {protocol.drive(), std::move(knots), protocol.name()};
}

ServoRow servo_row(std::string name, const MethodProblem& problem, const Eigen::VectorXd& reference,
                   const std::vector<double>& times, double rate_Hz) {
  ServoRow row{std::move(name), rate_Hz, {}};
  const double peak = reference.cwiseAbs().maxCoeff();
  for (const StepRuleEntry& entry : kStepRules) {
    if (entry.adaptive) continue;
    row.cells.push_back(
        {entry.meaning, classify_run(problem.run(stepped(entry.meaning, 1.0 / rate_Hz), times),
                                     reference, peak, false)});
  }
  return row;
}

}  // namespace

std::vector<StabilityLimit> stability_limits() {
  std::vector<StabilityLimit> limits;
  Progress progress("limits", 3);
  for (const auto& add : {add_rest_limits, add_motion_limits, add_organ_limits}) {
    add(limits);
    progress.advance();
  }
  return limits;
}

std::vector<ServoRow> stability_at_servo_rates() {
  const BondElement paper = paper_element();
  const Protocol protocol = ramp_and_hold(0.004, 0.004 / kServoRamp_s, kServoEnd_s - kServoRamp_s);
  std::vector<ServoRow> rows;
  const ClosedForm exact{ModelOptions{}};
  constexpr std::array kNetworkRates_Hz{1000.0, 2500.0, 4000.0};
  Progress progress("servo rates", servo_rates_Hz().size() + kNetworkRates_Hz.size());
  for (const double rate : servo_rates_Hz()) {
    const std::vector<double> times = ticks(rate);
    const Eigen::VectorXd reference =
        exact.respond(protocol, times, element_constants(paper), Want::values).value;
    const auto element = element_problem(paper, as_sampled(protocol, times));
    rows.push_back(servo_row("element", *element, reference, times, rate));
    progress.advance();
  }
  constexpr std::size_t kSmall = 24;
  const StudyOrgan organ(paper, kSmall);
  for (const double rate : kNetworkRates_Hz) {
    const std::vector<double> times = ticks(rate);
    QuasiStaticOptions options;
    options.tolerance = 1e-9;
    const Eigen::VectorXd reference =
        QuasiStatic(organ.bonds, organ.driven.rest, organ.driven.constraints, organ.driven.probes,
                    options)
            .run(protocol, times)
            .response;
    const auto network = network_problem(organ.driven, as_sampled(protocol, times));
    rows.push_back(servo_row("24 spheres", *network, reference, times, rate));
    progress.advance();
  }
  return rows;
}

StabilityStudy run_stability_study(int along, const StabilityParts& parts) {
  StabilityStudy study;
  if (parts.maps) study.maps = stability_maps(along);
  if (parts.limits) study.limits = stability_limits();
  if (parts.limiting_cases) study.limiting_cases = find_limiting_cases();
  if (parts.servo) study.servo = stability_at_servo_rates();
  return study;
}

}  // namespace tpm::accuracy
