// The step rules on the element and the star: orders, stability limits, failures.
#include <catch2/catch.hpp>

#include "expected_values.hpp"
#include "method_problems.hpp"
#include "tpm/organ/steps/cvodes_element.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm_test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

std::vector<double> tenths(double end) {
  std::vector<double> times;
  for (int i = 1; i <= 8; ++i) times.push_back(end * i / 8.0);
  return times;
}

/// Every rule with given steps at its order, every adaptive one at its tolerance.
/// @param step_s at which first order is seen; higher orders take longer steps
/// @param exact rules that make no error here
void check_orders(const ReferenceProblem& checked, double step_s,
                  std::vector<StepRule> exact = {}) {
  for (const StepRuleEntry& entry : kStepRules) {
    INFO(checked.name << ", " << entry.text);
    if (std::find(exact.begin(), exact.end(), entry.meaning) != exact.end()) {
      CHECK(checked.error(entry.meaning, step_s) < 1e-13);
    } else if (entry.adaptive) {
      MethodSettings settings;
      settings.rule = entry.meaning;
      settings.tolerance = 1e-5;
      const double coarse = checked.error(checked.run(settings));
      settings.tolerance = 1e-9;
      const double fine = checked.error(checked.run(settings));
      CHECK(coarse < 20.0 * 1e-5);
      CHECK(fine < 20.0 * 1e-9);
    } else {
      // XPBD without masses lags behind the balance: its order shows late.
      const double longer = entry.meaning == StepRule::xpbd ? 1.0 / 16.0
                            : entry.order == 1              ? 1.0
                            : entry.order == 2              ? 4.0
                                                            : 8.0;
      CHECK_THAT(observed_order(checked, entry.meaning, longer * step_s),
                 WithinAbs(entry.order, 0.1));
    }
  }
}

/// Element at rest, then held at a depth for `count` steps.
MethodRun held(const TpmParameters& p, StepRule rule, double step_s, double count) {
  MethodSettings settings;
  settings.rule = rule;
  settings.step_s = step_s;
  const std::vector<double> end{count * step_s};
  return element_problem(p, step_and_hold(0.004, end.back()))->run(settings, end);
}

/// The same under a load, with mass.
MethodRun loaded(const TpmParameters& p, const MethodMasses& mass, StepRule rule, double step_s,
                 double count) {
  MethodSettings settings;
  settings.rule = rule;
  settings.step_s = step_s;
  const std::vector<double> end{count * step_s};
  return element_problem(p, creep(0.05, end.back()), mass)->run(settings, end);
}

bool done(const MethodRun& run) {
  return run.end == MethodEnd::completed;
}

}  // namespace

TEST_CASE("method: orders on the element under an imposed depth") {
  const TpmParameters p = TpmParameters{}.with_relaxation_time(0.1);
  const ReferenceProblem checked =
      checked_element("ramp and hold", p, ramp_and_hold(0.004, 0.02, 0.2), tenths(0.4));
  check_orders(checked, 0.00125, {StepRule::exponential});
}

TEST_CASE("method: orders on the element under a load") {
  const TpmParameters p = TpmParameters{}.with_relaxation_time(0.1);
  const ReferenceProblem checked = checked_element("creep", p, creep(0.3, 1.0), tenths(0.4));
  check_orders(checked, 0.00125);
}

TEST_CASE("method: orders on the element with mass") {
  TpmParameters p = TpmParameters{}.with_relaxation_time(0.02);
  p.Eprime_Pa = 0.0;
  // 10 Hz or so, damped enough for forward Euler.
  const ReferenceProblem checked = element_with_mass(p, 0.03, 40.0, 0.1, tenths(0.2));
  check_orders(checked, 2e-5);
}

TEST_CASE("method: orders on the star") {
  const TpmParameters p = TpmParameters{}.with_relaxation_time(0.1);
  const Star star(p);
  const DrivenNetwork network{
      star.bonds, star.network.organ.position, star.constraints, Probes(Star::probe()), {}};
  const Protocol protocol(Drive::force, {{0.0, 0.0}, {0.2, 0.2}, {0.4, 0.2}});
  QuasiStaticOptions options;
  options.tolerance = 1e-12;
  const std::vector<double> times = tenths(0.4);
  const ReferenceProblem checked{"star", network_problem(network, protocol), times,
                                 star.run(protocol, times, options).response};
  check_orders(checked, 0.00125);
}

TEST_CASE("method: the element and the star answer alike under every rule") {
  const TpmParameters p = TpmParameters{}.with_relaxation_time(0.1);
  const Star star(p);
  const DrivenNetwork network{
      star.bonds, star.network.organ.position, star.constraints, Probes(Star::probe()), {}};
  const std::vector<double> times = tenths(0.4);
  for (const bool moves : {false, true}) {
    const double load = 0.2;
    const Protocol protocol(Drive::force, {{0.0, 0.0}, {0.2, load}, {0.4, load}});
    std::optional<MethodMasses> one, four;
    if (moves) {
      one = one_mass(0.01, 30.0);
      four = MethodMasses{Eigen::VectorXd::Constant(4, 0.01), 30.0};
    }
    const auto of_element = element_problem(p, protocol, one);
    const auto of_star = network_problem(network, protocol, four);
    for (const StepRuleEntry& entry : kStepRules) {
      if (entry.meaning == StepRule::xpbd) continue;  // there three constraints, here one
      INFO(entry.text << (moves ? ", moving" : ", resting"));
      MethodSettings settings;
      settings.rule = entry.meaning;
      settings.step_s = 0.002;
      settings.tolerance = 1e-10;
      const MethodRun a = of_element->run(settings, times);
      const MethodRun b = of_star->run(settings, times);
      REQUIRE(done(a));
      REQUIRE(done(b));
      const double allowed = entry.adaptive ? 1e-7 : moves ? 1e-9 : 1e-11;
      CHECK((a.response - b.response).cwiseAbs().maxCoeff() <=
            allowed * a.response.cwiseAbs().maxCoeff());
    }
  }
}

TEST_CASE("method: what orders fall to where the step is far above the relaxation time") {
  const TpmParameters p = TpmParameters{}.with_relaxation_time(1e-5);
  SECTION("a load that rises: elongations are not linear in time") {
    const Protocol protocol(Drive::force, {{0.0, 0.0}, {1.0, 0.5}});
    const std::vector<double> times = tenths(1.0);
    ModelOptions tight;
    tight.relative_tolerance = 1e-13;
    const ReferenceProblem checked{
        "stiff load", element_problem(p, protocol), times,
        CvodesElement(tight).respond(protocol, times, to_vector(p), Want::values).value};
    const auto order = [&](StepRule rule) { return observed_order(checked, rule, 0.125 / 4.0); };
    CHECK_THAT(order(StepRule::semi_implicit_euler), WithinAbs(1.0, 0.1));
    CHECK_THAT(order(StepRule::backward_euler), WithinAbs(1.0, 0.1));
    CHECK_THAT(order(StepRule::exponential), WithinAbs(1.0, 0.1));
    CHECK_THAT(order(StepRule::tr_bdf2), WithinAbs(2.0, 0.1));
    // What the kink at the start left behind is not damped.
    CHECK_THAT(order(StepRule::newmark), WithinAbs(0.0, 0.1));
    CHECK(checked.error(StepRule::backward_euler, 0.03) < 1e-7);
    CHECK(checked.error(StepRule::exponential, 0.03) < 1e-7);
    CHECK(checked.error(StepRule::semi_implicit_euler, 0.03) > 1e-2);
  }
  SECTION("a depth step: the viscous state has to catch up within a step") {
    const ReferenceProblem checked =
        checked_element("stiff step", p, step_and_hold(0.004, 1.0), tenths(1.0));
    for (const StepRule rule : {StepRule::implicit_midpoint, StepRule::newmark}) {
      CHECK_THAT(observed_order(checked, rule, 0.125), WithinAbs(0.0, 0.1));
      CHECK(checked.error(rule, 0.125) > 0.9);
    }
    for (const StepRule rule : {StepRule::backward_euler, StepRule::tr_bdf2, StepRule::xpbd}) {
      CHECK(checked.error(rule, 0.0125) < 1e-9);
    }
    CHECK(checked.error(StepRule::exponential, 0.125) < 1e-13);
    for (const StepRule rule : {StepRule::forward_euler, StepRule::rk4}) {
      MethodSettings settings;
      settings.rule = rule;
      settings.step_s = 0.0125;
      CHECK(checked.run(settings).end == MethodEnd::diverged);
    }
  }
}

TEST_CASE("method: stability limits of the viscous state alone are those of theory") {
  const TpmParameters p = TpmParameters{}.with_relaxation_time(0.1);
  const auto limit = [&](StepRule rule) {
    return bisected_limit(0.01, 10.0, 2e-3,
                          [&](double h) { return done(held(p, rule, h, 4000.0)); });
  };
  CHECK_THAT(limit(StepRule::forward_euler), WithinRel(2.0 * 0.1, 0.01));
  CHECK_THAT(limit(StepRule::rk4), WithinRel(2.785293563 * 0.1, 0.01));
}

TEST_CASE("method: stability limits of a vibrating sphere are those of theory") {
  TpmParameters p = TpmParameters{}.with_relaxation_time(1e9);  // elastic
  p.Eprime_Pa = 0.0;
  const double mass = 0.0044;
  const double omega = std::sqrt(p.E2_Pa * p.modulus_to_stiffness_m() / mass);
  const auto limit = [&](StepRule rule, double drag) {
    return bisected_limit(1e-6, 10.0, 2e-3, [&](double h) {
      return done(loaded(p, one_mass(mass, drag), rule, h, 200000.0));
    });
  };
  CHECK_THAT(limit(StepRule::semi_implicit_euler, 0.0), WithinRel(2.0 / omega, 0.01));
  CHECK_THAT(limit(StepRule::rk4, 0.0), WithinRel(2.0 * std::sqrt(2.0) / omega, 0.01));
  const double drag = 0.2 * omega;
  CHECK_THAT(limit(StepRule::forward_euler, drag), WithinRel(drag / (omega * omega), 0.01));
  CHECK_THAT(
      limit(StepRule::semi_implicit_euler, drag),
      WithinRel((drag + std::sqrt(drag * drag + 4.0 * omega * omega)) / (omega * omega), 0.01));
}

TEST_CASE("method: implicit rules have no stability limit") {
  const TpmParameters p = TpmParameters{}.with_relaxation_time(0.1);
  TpmParameters elastic = TpmParameters{}.with_relaxation_time(1e9);
  elastic.Eprime_Pa = 0.0;
  for (const StepRule rule :
       {StepRule::backward_euler, StepRule::implicit_midpoint, StepRule::newmark, StepRule::tr_bdf2,
        StepRule::exponential, StepRule::xpbd}) {
    for (const double ratio : {1e-9, 1.0, 1e9}) {
      CHECK(done(held(p, rule, ratio * 0.1, 300.0)));
      CHECK(done(loaded(elastic, one_mass(0.0044, 0.0), rule, ratio * 0.1, 300.0)));
    }
  }
}

TEST_CASE("method: at the paper's eta1 forward Euler fails at every servo rate below 2.4 kHz") {
  const TpmParameters p;  // eta1 = 5 Pa s
  const double limit_s = bisected_limit(1.0 / 10e3, 1.0 / 500.0, 2e-3, [&](double h) {
    return done(held(p, StepRule::forward_euler, h, 4000.0));
  });
  CHECK_THAT(1.0 / limit_s, WithinRel(2400.0, 0.01));
  for (const double rate_Hz : {500.0, 1000.0, 1500.0, 2000.0, 2300.0, 2370.0}) {
    CHECK(held(p, StepRule::forward_euler, 1.0 / rate_Hz, 4000.0).end == MethodEnd::diverged);
  }
  for (const double rate_Hz : {2430.0, 2500.0, 3000.0, 4000.0, 4800.0}) {
    CHECK(done(held(p, StepRule::forward_euler, 1.0 / rate_Hz, 4000.0)));
  }
}

TEST_CASE("method: which rules hold the paper's element at 1 kHz, and how well") {
  const TpmParameters p;
  std::vector<double> times;
  for (int i = 1; i <= 60; ++i) times.push_back(1e-3 * i);
  const ReferenceProblem checked =
      checked_element("servo", p, ramp_and_hold(0.004, 0.1, 0.02), times);
  for (const StepRule rule : {StepRule::forward_euler, StepRule::rk4}) {
    MethodSettings settings;
    settings.rule = rule;
    CHECK(checked.run(settings).end == MethodEnd::diverged);
  }
  CHECK(checked.error(StepRule::backward_euler, 1e-3) <
        test::allowed_error("element.backward_euler_at_1_kHz"));
  CHECK(checked.error(StepRule::tr_bdf2, 1e-3) < test::allowed_error("element.tr_bdf2_at_1_kHz"));
  CHECK(checked.error(StepRule::implicit_midpoint, 1e-3) <
        test::allowed_error("element.implicit_midpoint_at_1_kHz"));
  CHECK(checked.error(StepRule::exponential, 1e-3) < 1e-14);
}

TEST_CASE("method: steps end at kinks and jumps, and times between steps are answered") {
  const TpmParameters p = TpmParameters{}.with_relaxation_time(0.1);
  const Protocol jumps(
      Drive::displacement,
      {{0.0, 0.0}, {0.1, 0.002}, {0.1, 0.004}, {0.25, 0.004}, {0.25, 0.001}, {0.4, 0.003}});
  const std::vector<double> times{0.0, 0.0333, 0.0999999, 0.1, 0.17, 0.25, 0.3, 0.4};
  // Exact steps: whatever is wrong is the driver's.
  const ReferenceProblem checked = checked_element("jumps", p, jumps, times);
  CHECK(checked.error(StepRule::exponential, 0.03) < 1e-13);
  CHECK(checked.error(StepRule::exponential, 10.0) < 1e-13);
  MethodSettings bdf;
  bdf.rule = StepRule::cvode_bdf;
  bdf.tolerance = 1e-11;
  CHECK(checked.error(checked.run(bdf)) < 1e-9);
}

TEST_CASE("method: a preload held for ever is where a run begins") {
  const TpmParameters p = TpmParameters{}.with_relaxation_time(0.1);
  for (const Drive drive : {Drive::displacement, Drive::force}) {
    const double value = drive == Drive::displacement ? 0.003 : 0.2;
    Protocol protocol(drive, {{0.0, value}, {1.0, value}});
    protocol.set_equilibrium_at_start(true);
    const std::vector<double> times{0.0, 0.5, 1.0};
    for (const StepRuleEntry& entry : kStepRules) {
      INFO(entry.text);
      MethodSettings settings;
      settings.rule = entry.meaning;
      settings.step_s = 0.01;
      const MethodRun run = element_problem(p, protocol)->run(settings, times);
      REQUIRE(done(run));
      CHECK_THAT(run.response[2], WithinRel(run.response[0], 1e-9));
    }
  }
}

TEST_CASE("method: failures say what happened") {
  const TpmParameters p = TpmParameters{}.with_relaxation_time(0.1);
  MethodSettings settings;
  const std::vector<double> times{1.0};
  const auto problem = element_problem(p, step_and_hold(0.004, 1.0));
  SECTION("too much work") {
    settings.rule = StepRule::forward_euler;
    settings.step_s = 1e-3;
    settings.most_rates = 100;
    const MethodRun run = problem->run(settings, times);
    CHECK(run.end == MethodEnd::too_much_work);
    CHECK(std::isnan(run.response[0]));
    settings.rule = StepRule::cvode_adams;
    settings.tolerance = 1e-10;
    CHECK(problem->run(settings, times).end == MethodEnd::too_much_work);
  }
  SECTION("nothing carries the load") {
    TpmParameters loose = p;
    loose.E2_Pa = 0.0;
    loose.Eprime_Pa = 0.0;
    settings.rule = StepRule::backward_euler;
    const MethodRun run = element_problem(loose, creep(0.1, 1.0))->run(settings, times);
    CHECK(run.end == MethodEnd::newton_failed);
    CHECK_THAT(run.reason, Catch::Matchers::Contains("Newton"));
  }
  SECTION("settings") {
    settings.step_s = 0.0;
    CHECK_THROWS_AS(problem->run(settings, times), Error);
    settings = {};
    settings.tolerance = 1.0;
    CHECK_THROWS_AS(problem->run(settings, times), Error);
    settings = {};
    settings.sweeps = 0;
    CHECK_THROWS_AS(problem->run(settings, times), Error);
    settings = {};
    CHECK_THROWS_AS(problem->run(settings, std::vector<double>{1.0, 0.5}), Error);
    CHECK_THROWS_AS(problem->run(settings, std::vector<double>{2.0}), Error);
    CHECK_THROWS_AS(element_problem(p, creep(0.1, 1.0), one_mass(0.0, 0.0)), Error);
    CHECK_THROWS_AS(element_problem(p, creep(0.1, 1.0), one_mass(1.0, -1.0)), Error);
  }
}
