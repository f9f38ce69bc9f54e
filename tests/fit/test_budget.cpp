// Error budgets: sums that telescope, lines against closed forms, the random part against the
// prediction, and what a file that is no budget says.
#include <sys/resource.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "refusal.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/predict/budget_parts.hpp"
#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/fit/show/budget_report.hpp"
#include "tpm/organ/scene/protocol_file.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;

/// k_inf = 100 N/m, k1 = 50 N/m, tau = 2 s, with a sensor's contact and offset that no budget
/// feels.
LawFile zener() {
  LawFile law;
  law.spec = parse_law_name("linear-1", "test");
  law.spec.reference = 4e-3;
  law.values = {100.0, 50.0, 2.0, 3e-4, 0.02};
  law.provenance = Provenance::derived;
  law.fitted_to = 4e-3;
  LawUncertainty u;
  u.place = {0, 1, 2};
  u.coordinate = {Coordinate::linear, Coordinate::linear, Coordinate::log};
  u.covariance = Eigen::Vector3d(4.0, 9.0, 0.01).asDiagonal();
  u.noise.absolute = 3e-3;
  law.uncertainty = u;
  return law;
}

const BudgetLine& line_named(const ErrorBudget& budget, const std::string& name) {
  for (const BudgetLine& line : budget.lines) {
    if (line.name == name) return line;
  }
  throw std::logic_error("no line " + name);
}

double force_of(const LawFile& law, const Protocol& motion, double time_s) {
  return LawModel(law.spec)
      .respond(motion, std::vector{time_s}, at_surface(law).values, Want::values)
      .value[0];
}

}  // namespace

TEST_CASE("the memory of a budget does not grow with the length of the motion") {
  const auto peak_kib = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  const auto stepped = [](double end_s, double period_s) {
    const Protocol motion(Drive::displacement, {{0.0, 0.0}, {1.0, 1e-3}, {end_s, 1e-3}});
    const std::vector<double> times{end_s, 0.5, 1.0 + 0.25 * period_s};
    return stepped_forces(
        motion, period_s, 0.0, [](double depth) { return 2.0 * depth; }, times,
        std::vector{0.0, period_s});
  };
  const auto few = stepped(10.0, 1e-3);
  const long before = peak_kib();
  const auto many = stepped(1e4, 1e-3);
  CHECK(peak_kib() - before < 8192);  // a force for each of 1e7 periods is 80 MB
  for (const auto& forces : {few, many}) {
    REQUIRE(forces.size() == 2);
    CHECK(forces[0][0] == Approx(2e-3));
    CHECK(forces[0][1] == Approx(1e-3));
    CHECK(forces[0][2] == Approx(2e-3));
    CHECK(forces[1][1] == Approx(2.0 * 0.499e-3));
  }
}

TEST_CASE("the lines of any stages add up to the ends' difference") {
  Random random(1);
  std::vector<double> times(50);
  std::vector<BudgetStage> stages;
  for (std::size_t i = 0; i < times.size(); ++i) times[i] = static_cast<double>(i);
  for (int s = 0; s < 6; ++s) {
    BudgetStage stage{"stage " + std::to_string(s),
                      "",
                      "line " + std::to_string(s),
                      s % 2 == 0 ? BudgetKind::computation : BudgetKind::device,
                      {}};
    for (std::size_t i = 0; i < times.size(); ++i) stage.force_N.push_back(random.normal());
    stages.push_back(std::move(stage));
  }
  const std::vector<double> first = stages.front().force_N, last = stages.back().force_N;
  ErrorBudget budget = budget_of(times, stages);
  conclude(budget);
  CHECK(budget.lines.size() == 5);
  CHECK(budget.not_closed < 1e-14);
  double total = 0.0, peak = 0.0, own = 0.0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    total = std::max(total, std::abs(last[i] - first[i]));
    peak = std::max(peak, std::abs(first[i]));
    own = std::max(own, std::abs(stages[3].force_N[i] - stages[2].force_N[i]));
  }
  CHECK(budget.total == Approx(total / peak).epsilon(1e-12));
  CHECK(budget.lines[2].largest == Approx(own / peak).epsilon(1e-12));
  CHECK(budget.combined == budget.total);
  CHECK(test::refusal_of([&] { (void)budget_of(times, {stages.front()}); }) != "");
  stages[3].force_N.pop_back();
  CHECK_THAT(test::refusal_of([&] { (void)budget_of(times, stages); }),
             Contains("stage 3: 49 forces for 50 times"));
}

TEST_CASE("the lines of a linear contact are those of its closed form") {
  const LawFile law = zener();
  const Protocol motion = ramp_and_hold(4e-3, 4e-3, 6.0);
  const std::vector<double> times = times_over(motion, 701);  // a period's multiples
  BudgetOptions options;
  options.device = {1e-3, 7e-6, 2};
  const ErrorBudget budget = contact_budget(law, motion, times, options);
  CHECK(budget.stages.front().name == "law");
  // A linear kernel that goes linearly within a period: the update is exact.
  CHECK(line_named(budget, "integration").largest < 1e-12);
  // Delay and period: the force some periods ago; fastest while the ramp goes.
  const BudgetLine& delay = line_named(budget, "delay");
  const BudgetLine& period = line_named(budget, "period");
  double most_delay = 0.0, most_period = 0.0;
  for (const double t : times) {
    const auto at = [&](double late) { return force_of(law, motion, std::max(t - late, 0.0)); };
    most_delay = std::max(most_delay, std::abs(at(2e-3) - at(0.0)));
    most_period = std::max(most_period, std::abs(at(3e-3) - at(2e-3)));
  }
  const double peak = force_of(law, motion, 1.0);
  CHECK(budget.peak_N == Approx(peak));
  // Positions in steps move each of these by up to a step: 7e-6 m of 150 N/m.
  CHECK(delay.largest == Approx(most_delay / peak).margin(1.1 * 1.05e-3 / peak));
  CHECK(period.largest == Approx(most_period / peak).margin(1.1 * 1.05e-3 / peak));
  CHECK(line_named(budget, "quantisation").largest <= 0.51 * 7e-6 * 150.0 / peak);
  CHECK(line_named(budget, "quantisation").largest > 0.1 * 7e-6 * 150.0 / peak);
  CHECK(budget.not_closed < 1e-13);

  // The figure draws no point at another value than the line has.
  const show::Figure figure = budget_figure(budget);
  const std::vector<std::string>& names = figure.panels.at(1).x.names;
  const auto at = std::find(names.begin(), names.end(), "integration (< 0.001 %)");
  REQUIRE(at != names.end());
  const show::Series& own = figure.panels.at(1).series.at(0);
  CHECK(own.label == "largest of the line");
  CHECK(own.x.size() == names.size() - 1);
  const double place = static_cast<double>(at - names.begin()) + 1.0;
  CHECK(std::find(own.x.begin(), own.x.end(), place) == own.x.end());
}

TEST_CASE("a stiffening kernel is linear within a period only to second order") {
  LawFile law = zener();
  law.spec = parse_law_name("power-1", "test");
  law.spec.reference = 4e-3;
  law.values = {100.0, 50.0, 0.05, 2.5, 0.0, 0.0};
  law.uncertainty.reset();
  const Protocol motion = ramp_and_hold(4e-3, 40e-3, 1.0);
  const std::vector<double> times = times_over(motion, 56);
  BudgetOptions options;
  const auto integration = [&](double period_s) {
    options.device = {period_s, 0.0, 0};
    return line_named(contact_budget(law, motion, times, options), "integration").largest;
  };
  const double coarse = integration(4e-3), fine = integration(2e-3);
  CHECK(coarse > 1e-6);
  CHECK(coarse / fine == Approx(4.0).epsilon(0.15));
  options.device = {2e-3, 0.0, 0};
  const ErrorBudget budget = contact_budget(law, motion, times, options);
  CHECK_FALSE(budget.random);
  CHECK(budget.remarks.front().code == "no_random_part");
  CHECK(budget.sentences[1].code == "data_part_unknown");
  CHECK(budget.sentences[2].code == "not_noticeable");
  CHECK_THAT(budget.sentences[2].text, Contains("if the law is right: no recording"));
  CHECK(line_named(budget, "quantisation").largest == 0.0);
  CHECK(line_named(budget, "delay").largest == 0.0);
}

TEST_CASE("the random part is the band of the prediction, and is added in quadrature") {
  const LawFile law = zener();
  const Protocol motion = ramp_and_hold(4e-3, 4e-3, 6.0);
  const ErrorBudget budget = contact_budget(law, motion, times_over(motion, 101), {});
  REQUIRE(budget.random);
  const LawPrediction p = predict_law(law, motion, times_over(motion, 101), {});
  double half = 0.0;
  for (std::size_t i = 0; i < p.time_s.size(); ++i) {
    half = std::max(half, p.quantile * p.standard_error[i] / budget.peak_N);
  }
  CHECK(budget.random->largest == Approx(half).epsilon(0.1));
  CHECK(budget.combined == Approx(std::hypot(budget.total, budget.random->largest)));
  CHECK(budget.data_part == Approx(budget.random->largest));  // no recording: no line of the law
  REQUIRE(budget.sentences.size() == 3);
  const Json sentences = to_json(budget).at("sentences");
  CHECK(sentences[0].at("code") == "largest_is_parameters");
  CHECK(sentences[1].at("code") == "finer_is_wasted");
}

TEST_CASE("a plan's tolerance is read from a budget, and from nothing else") {
  const Protocol motion = ramp_and_hold(4e-3, 4e-3, 6.0);
  const ErrorBudget budget = contact_budget(zener(), motion, times_over(motion, 101), {});
  const double tolerance = tolerance_of_data(to_json(budget), "budget.json");
  CHECK(tolerance == Approx(budget.data_part).epsilon(1e-5));
  CHECK_THAT(test::refusal_of([] {
               (void)tolerance_of_data(Json{{"a", 1}}, "x.json");
             }),
             Contains("x.json: is no budget"));
  LawFile assumed = zener();
  assumed.uncertainty.reset();
  const ErrorBudget nothing = contact_budget(assumed, motion, times_over(motion, 101), {});
  CHECK_THAT(test::refusal_of([&] { (void)tolerance_of_data(to_json(nothing), "b.json"); }),
             Contains("knows nothing of the data"));
}

TEST_CASE("laws and devices that no budget is made for are refused") {
  const Protocol motion = ramp_and_hold(4e-3, 4e-3, 6.0);
  BudgetOptions options;
  options.device.period_s = 0.0;
  CHECK_THAT(test::refusal_of(
                 [&] { (void)contact_budget(zener(), motion, times_over(motion, 11), options); }),
             Contains("out of range"));
  CHECK_THAT(test::refusal_of([&] {
               (void)contact_budget(zener(), creep(1.0, 5.0), std::vector{1.0, 5.0}, {});
             }),
             Contains("a protocol of loads"));
}

}  // namespace tpm::fit
