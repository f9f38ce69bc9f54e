// Declared in tpm/accuracy/verify/verification.hpp.
// Observed orders: errors of two runs of which one takes half the step, against a reference that
// the rule under test did not compute.
#include <fmt/format.h>

#include <memory>
#include <mutex>
#include <optional>

#include "tpm/accuracy/benchmark_case.hpp"
#include "tpm/accuracy/contact_reference.hpp"
#include "tpm/accuracy/stability/checked_problem.hpp"
#include "tpm/accuracy/stability/theory.hpp"
#include "tpm/accuracy/verify/flawed.hpp"
#include "tpm/accuracy/verify/verification.hpp"
#include "tpm/organ/balance/inertial.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/model.hpp"

namespace tpm::accuracy {
namespace {

/// A problem of which the answer is known.
struct KnownProblem {
  std::string name;
  std::string source;  ///< of the reference
  std::vector<double> times_s;
  Eigen::VectorXd reference;
  /// With one coefficient wrong by a share.
  std::function<std::shared_ptr<const MethodProblem>(double flaw)> with_flaw;
  double step_s = 0.0;  ///< at which a rule of first order shows its order

  /// Largest error in parts of the peak.
  [[nodiscard]] double error(const MethodProblem& problem, const MethodSettings& settings) const {
    const MethodRun run = problem.run(settings, times_s);
    if (run.end != MethodEnd::completed) {
      throw Error(ExitCode::numerical, step_rule_name(settings.rule), run.reason);
    }
    return relative_difference(run.response, reference);
  }
};

std::vector<double> eighths(double end_s) {
  std::vector<double> times;
  for (int i = 1; i <= 8; ++i) times.push_back(end_s * i / 8.0);
  return times;
}

Eigen::VectorXd closed_form_response(const BondElement& p, const Protocol& protocol,
                                     const std::vector<double>& times_s) {
  return make_closed_form()->respond(protocol, times_s, element_constants(p), Want::values).value;
}

constexpr double kRelaxationTime_s = 0.1;
const char* const kClosedForm = "closed form of the element, Bao et al. (2013), Eqs. 9 to 14";

using KnownProblemPtr = std::shared_ptr<const KnownProblem>;

/// The paper's element under a protocol.
KnownProblemPtr element_known(std::string name, const Protocol& protocol) {
  const BondElement p = paper_element(kRelaxationTime_s);
  auto known = std::make_shared<KnownProblem>();
  known->name = std::move(name);
  known->source = kClosedForm;
  known->times_s = eighths(0.4);
  known->reference = closed_form_response(p, protocol, known->times_s);
  known->with_flaw = [p, protocol](double flaw) -> std::shared_ptr<const MethodProblem> {
    return element_problem(flawed(p, flaw), protocol);
  };
  known->step_s = 1.25e-3;
  return known;
}

/// One sphere with mass on an element without tension, under a load put on suddenly.
KnownProblemPtr moving_known() {
  BondElement p = paper_element(0.02);
  p.lateral_Pa = 0.0;
  constexpr double kMass_kg = 0.03, kDrag_per_s = 40.0, kLoad_N = 0.1;
  LinearElement linear = linear_element(p, 0.0);
  linear.mass_kg = kMass_kg;
  linear.drag_per_s = kDrag_per_s;
  auto known = std::make_shared<KnownProblem>();
  known->name = "one sphere with mass under a load";
  known->source = "modes of the equation of motion (eigenvectors of a 3 by 3 matrix)";
  known->times_s = eighths(0.2);
  known->reference = linear_motion_m(linear, kLoad_N, known->times_s);
  known->with_flaw = [=](double flaw) -> std::shared_ptr<const MethodProblem> {
    return element_problem(flawed(p, flaw), creep(kLoad_N, 0.2),
                           MethodMasses{Eigen::VectorXd::Constant(1, kMass_kg), kDrag_per_s});
  };
  known->step_s = 2e-5;
  return known;
}

/// The star of four spheres as a network.
KnownProblemPtr star_known() {
  const BondElement p = paper_element(kRelaxationTime_s);
  const Protocol protocol = creep(0.2, 0.4);
  auto known = std::make_shared<KnownProblem>();
  known->name = "the star of four spheres under a load, as a network";
  known->source = kClosedForm;
  known->times_s = eighths(0.4);
  known->reference = closed_form_response(p, protocol, known->times_s);
  known->with_flaw = [p, protocol](double flaw) {
    return rules_on(
        std::make_shared<BenchmarkCase>(driven_star(flawed(p, flaw)), protocol, eighths(0.4)));
  };
  known->step_s = 1.25e-3;
  return known;
}

Eigen::VectorXd quasi_static_response(const DrivenNetwork& n, const Protocol& protocol,
                                      const std::vector<double>& times_s,
                                      const QuasiStaticOptions& options) {
  return QuasiStatic(n.bonds, n.rest, n.constraints, n.probes, options)
      .run(protocol, times_s)
      .response;
}

/// An organ of 24 spheres under a load that rises and stays.
KnownProblemPtr organ_known() {
  const BondElement p = paper_element(kRelaxationTime_s);
  const Protocol protocol(Drive::force, {{0.0, 0.0}, {0.2, 0.2}, {0.4, 0.2}});
  constexpr std::size_t kSpheres = 24;
  auto known = std::make_shared<KnownProblem>();
  known->name = "a network of 24 spheres under a load";
  known->source = "quasi-static collocation at a tolerance of 1e-11, another formulation";
  known->times_s = eighths(0.4);
  known->reference = quasi_static_response(StudyOrgan(p, kSpheres).driven, protocol, known->times_s,
                                           {.tolerance = 1e-11});
  known->with_flaw = [p, protocol](double flaw) {
    return rules_on(std::make_shared<BenchmarkCase>(StudyOrgan(flawed(p, flaw), kSpheres).driven,
                                                    protocol, eighths(0.4)));
  };
  known->step_s = 1.25e-3;
  return known;
}

/// Where a rule shows its order: short enough to be there, long enough to be above rounding.
double step_for(const StepRuleEntry& rule, double first_order_s) {
  // XPBD without masses lags behind the balance: its order shows late.
  if (rule.meaning == StepRule::xpbd) return first_order_s / 16.0;
  if (rule.order == 1) return first_order_s;
  return rule.order == 2 ? 4.0 * first_order_s : 8.0 * first_order_s;
}

constexpr double kOrderTolerance = 0.1;

/// @param exact the rule makes no error on this problem
VerificationCheck rule_check(const KnownProblemPtr& known, const StepRuleEntry& rule, bool exact) {
  VerificationCheck check;
  check.what = fmt::format("{}, {}", rule.text, known->name);
  check.source = known->source;
  check.problem = known->name;
  MethodSettings settings;
  settings.rule = rule.meaning;
  if (rule.adaptive) {
    settings.tolerance = 1e-9;
    check.quantity = "error of the peak at a tolerance of 1e-9";
    check.tolerance = 20.0 * settings.tolerance;
  } else if (exact) {
    settings.step_s = known->step_s;
    check.quantity = "error of the peak; the update is exact";
    check.tolerance = 1e-12;
  }
  if (rule.adaptive || exact) {
    check.measure = [known, settings](double flaw) {
      return known->error(*known->with_flaw(flaw), settings);
    };
    return check;
  }
  settings.step_s = step_for(rule, known->step_s);
  check.quantity = fmt::format("observed order, steps {:.4g} and {:.4g} ms", 1e3 * settings.step_s,
                               5e2 * settings.step_s);
  check.expected = rule.order;
  check.tolerance = kOrderTolerance;
  check.measure = [known, settings](double flaw) {
    const auto problem = known->with_flaw(flaw);
    MethodSettings half = settings;
    half.step_s *= 0.5;
    return std::log2(known->error(*problem, settings) / known->error(*problem, half));
  };
  return check;
}

/// Steps of one length of the quasi-static network, with collocation at Radau nodes.
VerificationCheck quasi_static_check(int stages, double step_s) {
  const BondElement p = paper_element(kRelaxationTime_s);
  const Protocol protocol = creep(0.2, 0.4);
  const auto error = [=](double flaw, double step) {
    const QuasiStaticOptions options{.tolerance = 1e-12, .stages = stages, .step_s = step};
    const std::vector<double> times = eighths(0.4);
    return relative_difference(
        quasi_static_response(driven_star(flawed(p, flaw)), protocol, times, options),
        closed_form_response(p, protocol, times));
  };
  return {fmt::format("quasi-static, {} stages, the star under a load", stages),
          fmt::format("observed order, steps {:.4g} and {:.4g} ms", 1e3 * step_s, 5e2 * step_s),
          kClosedForm,
          2.0 * stages - 1.0,
          0.3,
          [=](double flaw) { return std::log2(error(flaw, step_s) / error(flaw, 0.5 * step_s)); }};
}

VerificationCheck quasi_static_tolerance_check() {
  const BondElement p = paper_element(kRelaxationTime_s);
  return {"quasi-static, adaptive, the star under a load",
          "error of the peak at a tolerance of 1e-10",
          kClosedForm,
          0.0,
          1e-9,
          [=](double flaw) {
            const Protocol protocol = creep(0.2, 0.4);
            const std::vector<double> times = eighths(0.4);
            return relative_difference(quasi_static_response(driven_star(flawed(p, flaw)), protocol,
                                                             times, {.tolerance = 1e-10}),
                                       closed_form_response(p, protocol, times));
          }};
}

/// The network with masses (CVODES) on the star without tension.
VerificationCheck inertial_check(std::size_t highest_order) {
  BondElement p = paper_element(0.02);
  p.lateral_Pa = 0.0;
  return {fmt::format("inertial, order to {}, one sphere with mass under a load", highest_order),
          "error of the peak at a tolerance of 1e-9",
          "modes of the equation of motion (eigenvectors of a 3 by 3 matrix)",
          0.0,
          1e-6,
          [p, highest_order](double flaw) {
            constexpr double kMass_kg = 0.03, kLoad_N = 0.1, kDampingRatio = 0.5;
            const std::vector<double> times = eighths(0.2);
            const auto case_with = [&](const BondElement& material) {
              auto benchmark = std::make_shared<BenchmarkCase>(driven_star(material),
                                                               creep(kLoad_N, 0.2), times);
              benchmark->set_masses(Eigen::VectorXd::Constant(4, kMass_kg), kDampingRatio);
              return benchmark;
            };
            LinearElement linear = linear_element(p, 0.0);
            linear.mass_kg = kMass_kg;
            linear.drag_per_s = case_with(p)->mass->drag_per_s;
            const std::vector<BenchmarkSetting> settings =
                inertial_settings(case_with(flawed(p, flaw)), {1e-9});
            const BenchmarkAnswer answer =
                answer_of(settings[highest_order == 2 ? 0 : 1], "inertial");
            return relative_difference(answer.response, linear_motion_m(linear, kLoad_N, times));
          }};
}

/// The paper's equation under CVODES, as tables and fits ask it.
VerificationCheck cvodes_check() {
  return {"cvodes, the element, ramp and hold",
          "error of the peak at a tolerance of 1e-10",
          kClosedForm,
          0.0,
          1e-8,
          [](double flaw) {
            const BondElement p = paper_element(kRelaxationTime_s);
            const Protocol protocol = ramp_and_hold(4e-3, 0.02, 0.2);
            const std::vector<double> times = eighths(0.4);
            return relative_difference(
                make_model("cvodes")
                    ->respond(protocol, times, element_constants(flawed(p, flaw)), Want::values)
                    .value,
                closed_form_response(p, protocol, times));
          }};
}

/// Viscous elongations advanced exactly for elongations that are linear in a step.
VerificationCheck exponential_network_check() {
  return {"exact exponential update in a network of 24 spheres (FineContact), depth imposed",
          "observed order, steps 4 and 2 ms",
          "quasi-static collocation at a tolerance of 1e-10, another formulation",
          2.0,
          kOrderTolerance,
          [](double flaw) {
            const BondElement p = paper_element(kRelaxationTime_s);
            const StudyOrgan exact(p, 24), wrong(flawed(p, flaw), 24);
            const Probe probe = exact.driven.probes.front();
            const ContactMotion motion = ramp_motion(probe.direction, 4e-3, 0.02, 0.2, 4e-3);
            const auto touched = [&](const StudyOrgan& organ) {
              return TouchedTissue{organ.bonds, organ.driven.rest, organ.driven.constraints,
                                   probe.sphere};
            };
            const TouchedTissue right = touched(exact), tested = touched(wrong);
            const Eigen::VectorXd reference = line_reference(right, motion, 1e-10);
            const auto error = [&](int pieces) {
              const ContactMotion fine = refined(motion, pieces);
              FineContact contact(tested, fine.period_s);
              Eigen::VectorXd force(motion.steps());
              for (Eigen::Index i = 0; i < fine.steps(); ++i) {
                const double along = contact.step(fine.displacement_m.col(i)).dot(probe.direction);
                if ((i + 1) % pieces == 0) force[i / pieces] = along;
              }
              return relative_difference(force, reference);
            };
            return std::log2(error(1) / error(2));
          }};
}

}  // namespace

std::vector<VerificationCheck> order_checks() {
  const std::vector<KnownProblemPtr> problems{
      element_known("one bond, ramp and hold of a depth", ramp_and_hold(4e-3, 0.02, 0.2)),
      element_known("one bond under a load", creep(0.3, 0.4)), moving_known(), star_known(),
      organ_known()};
  std::vector<VerificationCheck> checks;
  for (const KnownProblemPtr& known : problems) {
    for (const StepRuleEntry& rule : kStepRules) {
      const bool exact = known == problems.front() && rule.meaning == StepRule::exponential;
      checks.push_back(rule_check(known, rule, exact));
    }
  }
  checks.push_back(exponential_network_check());
  checks.push_back(quasi_static_check(2, 0.05));
  checks.push_back(quasi_static_check(3, 0.05));
  checks.push_back(quasi_static_tolerance_check());
  checks.push_back(inertial_check(2));
  checks.push_back(inertial_check(5));
  checks.push_back(cvodes_check());
  return checks;
}

}  // namespace tpm::accuracy
