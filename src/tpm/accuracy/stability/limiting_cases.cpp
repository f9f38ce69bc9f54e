// Declared in tpm/accuracy/stability/study.hpp.
// Degenerate cases on purpose: what every rule does, and whether that is right.
#include <cmath>
#include <functional>

#include "tpm/accuracy/stability/checked_problem.hpp"
#include "tpm/accuracy/stability/study.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpm/work/progress.hpp"

namespace tpm::accuracy {
namespace {

using Expect = std::function<StabilityClass(StepRule)>;
constexpr double kCaseStep_s = 1e-3;
constexpr double kLimitingDepth_m = 0.004;

bool same_kind(StabilityClass a, StabilityClass b) {
  const auto grows = [](StabilityClass c) {
    return c == StabilityClass::diverged || c == StabilityClass::energy_grew;
  };
  return a == b || (grows(a) && grows(b));
}

LimitingCase tried(std::string name, std::string setup, std::string expected,
                   const CheckedProblem& checked, double step_s, const Expect& expect) {
  LimitingCase limiting_case{std::move(name), std::move(setup), std::move(expected), {}};
  for (const StepRuleEntry& entry : kStepRules) {
    MethodSettings settings;
    settings.rule = entry.meaning;
    settings.step_s = step_s;
    settings.most_rates = 2'000'000;
    LimitingCell cell{entry.meaning, checked.verdict(settings), expect(entry.meaning), false};
    cell.right = same_kind(cell.verdict.found, cell.expected);
    limiting_case.cells.push_back(std::move(cell));
  }
  return limiting_case;
}

StabilityClass all_hold(StepRule) {
  return StabilityClass::holds;
}

/// Theory of a viscous state that starts without delay: explicit rules beyond their limit diverge,
/// and rules without damping of fast modes let it ring.
Expect of_theory(const LinearElement& linear, double step_s, double steps) {
  return [=](StepRule rule) {
    const auto limit = stable_step_s(rule, linear);
    if (limit && step_s > *limit) return StabilityClass::diverged;
    if (rule == StepRule::implicit_midpoint || rule == StepRule::newmark) {
      const double z = 0.5 * step_s / linear.relaxation_time_s;
      const double left = std::pow(std::abs((1.0 - z) / (1.0 + z)), steps);
      if (z > 1.0 && left > kHoldsWithin) return StabilityClass::oscillates;
    }
    return StabilityClass::holds;
  };
}

LinearElement under_depth(const BondElement& p) {
  LinearElement e = linear_element(p, 0.0);
  e.depth_imposed = true;
  return e;
}

LimitingCase instantaneous_depth(std::string name, const BondElement& p, double depth_m,
                                 double step_s, std::string expected) {
  const Protocol protocol = step_and_hold(depth_m, kStudySteps * step_s);
  return tried(std::move(name),
               significant(1e3 * depth_m, 3) + " mm in a step and held for 300 steps of " +
                   significant(step_s, 3) + " s",
               std::move(expected), massless_problem(p, protocol, step_s), step_s,
               of_theory(under_depth(p), step_s, kStudySteps - kComparedSteps));
}

const char* const kByTheory =
    "forward Euler and RK4 diverge beyond 2 and 2.785 tau, midpoint and Newmark ring far above "
    "tau, all else holds";

constexpr double kPaperSum_Pa = 24e3;  // E1 + E2

void add_relaxation_times(std::vector<LimitingCase>& limiting_cases) {
  BondElement p = paper_element(1e-9 / kPaperSum_Pa);
  limiting_cases.push_back(instantaneous_depth(
      "eta1 -> 0 (1e-9 Pa s)", p, kLimitingDepth_m, kCaseStep_s,
      "explicit rules diverge, Adams too or is too much work, midpoint and Newmark "
      "ring, all else holds"));
  // Functional iteration follows the relaxation time for as long as it runs.
  for (LimitingCell& cell : limiting_cases.back().cells) {
    if (cell.rule == StepRule::cvode_adams) {
      cell.expected = StabilityClass::too_much_work;
      cell.right = cell.verdict.found == cell.expected;
    }
  }
  p = paper_element(1e15 / kPaperSum_Pa);
  limiting_cases.push_back(instantaneous_depth("eta1 -> infinity (1e15 Pa s)", p, kLimitingDepth_m,
                                               kCaseStep_s, "an elastic element: all hold"));
  for (const double ratio : {1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9}) {
    LimitingCase limiting_case =
        instantaneous_depth("h/tau = " + significant(ratio, 2), paper_element(kCaseStep_s / ratio),
                            kLimitingDepth_m, kCaseStep_s, kByTheory);
    for (LimitingCell& cell : limiting_case.cells) {
      if (cell.rule != StepRule::cvode_adams || ratio < 1e4) continue;
      cell.expected = StabilityClass::too_much_work;
      cell.right = cell.verdict.found == cell.expected;
    }
    limiting_cases.push_back(std::move(limiting_case));
  }
}

void add_moduli(std::vector<LimitingCase>& limiting_cases) {
  constexpr double kTau_s = 0.02;
  BondElement maxwell = paper_element(kTau_s);
  maxwell.branches.front().modulus_Pa = maxwell.instantaneous_Pa();
  maxwell.equilibrium_Pa = 0.0;
  limiting_cases.push_back(instantaneous_depth("E1 = 0, a depth", maxwell, kLimitingDepth_m,
                                               kCaseStep_s,
                                               "a Maxwell fluid: all hold, down to the tension"));
  maxwell.lateral_Pa = 0.0;
  const double end = kStudySteps * kCaseStep_s;
  CheckedProblem flow;
  constexpr double kLoad_N = 0.05;
  flow.problem = element_problem(maxwell, creep(kLoad_N, end));
  flow.times_s = last_steps(end, kCaseStep_s, kComparedSteps);
  flow.reference.resize(kComparedSteps);
  for (int i = 0; i < kComparedSteps; ++i) {
    const double t = flow.times_s[static_cast<std::size_t>(i)];
    flow.reference[i] =
        kLoad_N / maxwell.modulus_to_stiffness_m() / maxwell.relaxing_Pa() * (1.0 + t / kTau_s);
  }
  flow.peak = flow.reference.maxCoeff();
  limiting_cases.push_back(
      tried("E1 = 0, a load", "0.05 N in a step and held; no tension",
            "it flows for as long as it is pushed: semi-implicit Euler and XPBD too "
            "slowly by h/tau = 5 %, all else holds",
            flow, kCaseStep_s, [](StepRule rule) {
              return rule == StepRule::semi_implicit_euler || rule == StepRule::xpbd
                         ? StabilityClass::wrong_steady_state
                         : StabilityClass::holds;
            }));
  BondElement loose = paper_element(kTau_s);
  loose.equilibrium_Pa = loose.branches.front().modulus_Pa = 0.0;
  limiting_cases.push_back(instantaneous_depth("E2 = 0, a depth", loose, kLimitingDepth_m,
                                               kCaseStep_s, "tension only: all hold"));
  limiting_cases.push_back(
      tried("E2 = 0, a load", "0.05 N in a step and held",
            "tension carries it: all hold but XPBD, whose made-up mass is that of the "
            "stiffness at rest, 0",
            massless_problem(loose, creep(0.05, end), kCaseStep_s), kCaseStep_s, [](StepRule rule) {
              return rule == StepRule::xpbd ? StabilityClass::diverged : StabilityClass::holds;
            }));
  loose.lateral_Pa = 0.0;
  CheckedProblem nothing;
  nothing.times_s = last_steps(end, kCaseStep_s, kComparedSteps);
  nothing.reference.setZero(kComparedSteps);
  nothing.peak = 1.0;
  nothing.problem = element_problem(loose, creep(0.05, end));
  limiting_cases.push_back(tried("E2 = E' = 0, a load", "0.05 N in a step and held",
                                 "nothing carries it: Newton fails, and XPBD diverges", nothing,
                                 kCaseStep_s, [](StepRule rule) {
                                   return rule == StepRule::xpbd ? StabilityClass::diverged
                                                                 : StabilityClass::newton_failed;
                                 }));
}

void add_depths(std::vector<LimitingCase>& limiting_cases) {
  const BondElement p = paper_element(0.02);
  limiting_cases.push_back(instantaneous_depth(
      "beyond 12 mm", p, 0.015, kCaseStep_s,
      "all hold: no rule fails at the depth where liver is damaged, results carry a flag"));
  limiting_cases.push_back(
      instantaneous_depth("theta over pi/6", p, 0.020, kCaseStep_s,
                          "all hold: 33.7 degrees at x = 30 mm, results carry a flag"));
}

/// A star whose sphere B is guided onto its partner D, or free.
struct CornerStar {
  explicit CornerStar(const BondElement& p, bool guided)
      : organ(star(p.spacing_m, 0.020)),
        network(join(organ, pairs(), {}, "star")),
        bonds(network, p),
        driven{bonds, organ.position, freedom_of(guided), Probes(Probe{1, down(), 1.0}), {}} {}
  CornerStar(const CornerStar&) = delete;
  CornerStar& operator=(const CornerStar&) = delete;

  static Eigen::Vector3d down() { return -Eigen::Vector3d::UnitZ(); }
  static const std::vector<NeighbourPair>& pairs() {
    static const std::vector<NeighbourPair> list{{0, 1}, {1, 2}, {1, 3}};
    return list;
  }
  static Constraints freedom_of(bool guided) {
    Constraints constraints(4);
    if (guided) constraints.slide(1, Eigen::Vector3d::UnitZ());
    for (const std::size_t i : {0u, 2u, 3u}) constraints.fix(i);
    return constraints;
  }

  Organ organ;
  Network network;
  BondSystem bonds;
  DrivenNetwork driven;
};

/// The guided star under a rising depth: its bond to the partner is |L0 - depth| long, and its
/// viscous state is the closed form in pieces of that, linear in time.
double star_force_N(const BondElement& p, double rate, double time_s) {
  constexpr double kLength_m = 0.020;
  const double tau = p.relaxation_time_s();
  const double depth = rate * time_s;
  const double meets_s = kLength_m / rate;
  const double first = std::min(time_s, meets_s);
  double l = -rate * first;
  const RelaxationWeights a = relaxation_weights(first / tau);
  double y = a.w1 * l;
  if (time_s > meets_s) {
    const RelaxationWeights b = relaxation_weights((time_s - meets_s) / tau);
    const double before = l;
    l = depth - 2.0 * kLength_m;
    y = b.r * y + b.w0 * before + b.w1 * l;
  }
  const double unit = p.modulus_to_stiffness_m();
  const double pull = unit * (p.instantaneous_Pa() * l - p.relaxing_Pa() * y);
  return unit * p.tension().value(depth) - (depth < kLength_m ? pull : -pull);
}

/// Sets the last steps of a star's straight path as reference.
void set_star_reference(const BondElement& p, double rate, double end_s, CheckedProblem& checked) {
  checked.times_s = last_steps(end_s, kCaseStep_s, kComparedSteps);
  checked.reference.resize(kComparedSteps);
  for (int i = 0; i < kComparedSteps; ++i) {
    checked.reference[i] = star_force_N(p, rate, checked.times_s[static_cast<std::size_t>(i)]);
  }
  checked.peak = checked.reference.cwiseAbs().maxCoeff();
}

LimitingCase pushed_star(std::string name, std::string setup, std::string expected, double depth_m,
                         const Expect& expect) {
  const BondElement p = paper_element(0.02);
  const CornerStar star(p, true);
  const double end = kStudySteps * kCaseStep_s;
  CheckedProblem checked;
  checked.problem =
      network_problem(star.driven, Protocol(Drive::displacement, {{0.0, 0.0}, {end, depth_m}}));
  set_star_reference(p, depth_m / end, end, checked);
  return tried(std::move(name), std::move(setup), std::move(expected), checked, kCaseStep_s,
               expect);
}

void add_stars(std::vector<LimitingCase>& limiting_cases) {
  limiting_cases.push_back(pushed_star(
      "bond of no length", "guided star, 0 to 20 mm in 300 steps: B ends on its partner D",
      "the direction of the bond is lost: rules that balance forces find no "
      "balance; CVODE and XPBD, which do not look, end with no number",
      0.020, [](StepRule rule) {
        return rule == StepRule::xpbd || rule == StepRule::cvode_adams ||
                       rule == StepRule::cvode_bdf
                   ? StabilityClass::diverged
                   : StabilityClass::newton_failed;
      }));
  limiting_cases.push_back(pushed_star(
      "inverted bond", "guided star, 0 to 25.04 mm in 300 steps: B passes D within a step",
      "the law of the bond goes on with the other sign: fixed steps hold; a rule that controls its "
      "error sees the jump",
      0.02504, all_hold));
  const BondElement p = paper_element(0.02);
  const CornerStar star(p, false);
  const double end = kStudySteps * kCaseStep_s;
  CheckedProblem checked;
  checked.problem =
      network_problem(star.driven, Protocol(Drive::displacement, {{0.0, 0.0}, {end, 0.004}}));
  set_star_reference(p, 0.004 / end, end, checked);
  limiting_cases.push_back(
      tried("buckling", "star, B not guided, 0 to 4 mm in 300 steps",
            "its stiffness across the plane is negative from the start: buckled; XPBD "
            "does not look and follows the straight path",
            checked, kCaseStep_s, [](StepRule rule) {
              return rule == StepRule::xpbd ? StabilityClass::holds : StabilityClass::buckled;
            }));
}

void add_masses(std::vector<LimitingCase>& limiting_cases) {
  BondElement p = paper_element(0.02);
  p.lateral_Pa = 0.0;
  for (const double mass : {1e-9, 1e3}) {
    constexpr double kDrag_per_s = 20.0;
    LinearElement linear = linear_element(p, 0.0);
    linear.mass_kg = mass;
    linear.drag_per_s = kDrag_per_s;
    const CheckedProblem checked =
        problem_with_mass(p, mass, kDrag_per_s, 0.05, kStudySteps * kCaseStep_s, kCaseStep_s);
    limiting_cases.push_back(
        tried("mass " + significant(mass, 2) + " kg", "0.05 N in a step and held, drag 20 1/s",
              mass < 1.0 ? "far above 2/omega: explicit rules grow, midpoint, Newmark and the "
                           "exponential rule on them ring, damped rules hold"
                         : "hardly moves: all hold",
              checked, kCaseStep_s, [&](StepRule rule) {
                const auto limit = stable_step_s(rule, linear);
                if (limit && kCaseStep_s > *limit) return StabilityClass::diverged;
                const bool rings = rule == StepRule::implicit_midpoint ||
                                   rule == StepRule::newmark || rule == StepRule::exponential;
                return rings && mass < 1.0 ? StabilityClass::oscillates : StabilityClass::holds;
              }));
  }
}

}  // namespace

std::vector<LimitingCase> find_limiting_cases() {
  std::vector<LimitingCase> limiting_cases;
  Progress progress("limiting cases", 5);
  for (const auto& add : {add_relaxation_times, add_moduli, add_depths, add_stars, add_masses}) {
    add(limiting_cases);
    progress.advance();
  }
  return limiting_cases;
}

}  // namespace tpm::accuracy
