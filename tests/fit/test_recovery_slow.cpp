// Selection and intervals checked by simulation on a few laws; docs/selection.md has the whole
// family with 200 trials each.
#include <boost/math/distributions/binomial.hpp>
#include <catch2/catch.hpp>

#include "tpm/fit/design/recovery.hpp"

using namespace tpm;
using namespace tpm::fit;

namespace {

constexpr int kTrials = 20;

/// The most failures that happen with a probability of at least 0.1 % if each has one of 5 %.
int most_failures() {
  const boost::math::binomial distribution(kTrials, 0.05);
  int k = 0;
  while (boost::math::cdf(boost::math::complement(distribution, k)) > 0.001) ++k;
  return k;
}

RecoveryOptions few_trials() {
  RecoveryOptions options;
  options.trials = kTrials;
  options.seed = 20130707;
  return options;
}

void require_recovered(const char* name, std::vector<LawSpec> contest = {}) {
  const LawSpec law = parse_law_name(name, "test");
  RecoveryOptions options = few_trials();
  options.selection.laws = std::move(contest);
  const std::vector<RecoveryResult> results{recover(law, visible_parameters(law), options)};
  const RecoveryResult& r = results.front();
  INFO(to_terminal_text(results));
  CHECK(r.failed == 0);
  CHECK(r.trials - r.choices.front().right() <= most_failures());
  CHECK(r.choices.front().larger <= most_failures());
  for (const ParameterCoverage& p : r.parameters) {
    INFO(p.name);
    CHECK(p.p_value > 0.001);
  }
}

std::vector<LawSpec> contest_of(std::initializer_list<const char*> names) {
  std::vector<LawSpec> laws;
  for (const char* name : names) laws.push_back(parse_law_name(name, "test"));
  return laws;
}

}  // namespace

TEST_CASE("the law behind the data is returned: linear-1") {
  require_recovered("linear-1",
                    contest_of({"linear", "linear-1", "linear-2", "hertz-1", "power-1"}));
}

TEST_CASE("the law behind the data is returned: hertz-2") {
  require_recovered("hertz-2",
                    contest_of({"linear-2", "hertz-1", "hertz-2", "hertz-3", "power-2"}));
}

TEST_CASE("the law behind the data is returned: power-1") {
  require_recovered("power-1", contest_of({"linear-1", "hertz-1", "power", "power-1", "power-2",
                                           "linear-1-elastic", "linear-1-relaxing"}));
}

TEST_CASE("the law behind the data is returned: linear-1-elastic") {
  require_recovered("linear-1-elastic",
                    contest_of({"linear-1", "hertz-1", "power-1", "linear-1-elastic",
                                "linear-2-elastic", "linear-1-relaxing"}));
}

TEST_CASE("a law that cannot describe the data is not called right") {
  const LawSpec law = parse_law_name("linear-2", "test");
  RecoveryOptions options = few_trials();
  options.selection.laws = contest_of({"linear", "linear-1", "linear-2"});
  options.trials = 3;
  std::vector<double> one_branch = visible_parameters(law);
  one_branch[2] = 0.0;  // k2: linear-1 is then the law behind the data, and less is right
  const RecoveryResult less = recover(law, one_branch, options);
  CHECK(less.choices.front().returned == 0);
  CHECK(less.choices.front().equivalent == 3);
  CHECK(less.choices.front().larger == 0);

  options.selection.laws = contest_of({"linear"});
  const RecoveryResult wrong = recover(law, visible_parameters(law), options);
  CHECK(wrong.choices.front().right() == 0);
  CHECK_FALSE(wrong.fulfilled());
}

TEST_CASE("the simulated recording is the law's answer to a ramp from above the surface") {
  LawSpec law = parse_law_name("linear", "test");
  law.reference = 5e-3;
  const SimulatedTest test;
  const Recording r = simulated_recording(law, std::vector<double>{200.0, 0.0, 0.0}, test);
  CHECK(r.time_s.front() == Approx(-0.1));
  CHECK(r.time_s.back() == Approx(21.0));
  CHECK(r.response.front() == 0.0);
  CHECK(r.response.back() == Approx(1.0).epsilon(1e-9));
  CHECK(r.response.size() == 1 + 110 + 400);
}
