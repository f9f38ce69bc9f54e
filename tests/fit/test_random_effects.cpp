// Specimens pooled by random effects, ends of the starts, and trade-offs between parameters.
#include <boost/math/distributions/students_t.hpp>
#include <catch2/catch.hpp>
#include <cmath>

#include "expected_values.hpp"
#include "statistics_problems.hpp"
#include "tpm/fit/groups/random_effects.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/fit/waterfall.hpp"

using namespace tpm;
using namespace tpm::fit;
using namespace tpm::test;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

FitResult result_with(std::vector<FitParameter> parameters, const std::vector<double>& direction,
                      double weakest, bool full_rank) {
  FitResult result;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    ParameterResult p;
    p.parameter = parameters[i];
    result.parameters.push_back(p);
    result.covariance.free.push_back(i);
  }
  result.covariance.weakest_direction =
      Eigen::Map<const Eigen::VectorXd>(direction.data(),
                                        static_cast<Eigen::Index>(direction.size()))
          .normalized();
  result.covariance.singular_values = Eigen::Vector2d(1.4, weakest);
  result.covariance.full_rank = full_rank;
  return result;
}

const Unit kPascal{"Pa", Dimension::stress, 1.0};
const Unit kPascalSecond{"Pa s", Dimension::viscosity, 1.0};

FitParameter log_parameter(const char* name, const Unit& unit = kPascal) {
  return parameter(name, Scale::log, 1.0, 1e-3, 1e3, unit);
}

}  // namespace

// --- specimens -----------------------------------------------------------------------------------

TEST_CASE("random effects of the BCG vaccine trials are metafor's") {
  // Cases and non-cases of tuberculosis, vaccinated and not, of the 13 trials of Colditz et al.
  // 1994 (dat.bcg of the R package metafor); log risk ratios. Printed in metafor's documentation
  // for rma(yi, vi, method = "REML"): mu = -0.7145, tau^2 = 0.3132, Q = 152.2330.
  const double trials[13][4] = {
      {4, 119, 11, 128},       {6, 300, 29, 274},        {3, 228, 11, 209},
      {62, 13536, 248, 12619}, {33, 5036, 47, 5761},     {180, 1361, 372, 1079},
      {8, 2537, 10, 619},      {505, 87886, 499, 87892}, {29, 7470, 45, 7232},
      {17, 1699, 65, 1600},    {186, 50448, 141, 27197}, {5, 2493, 3, 2338},
      {27, 16886, 29, 17825}};
  std::vector<SpecimenEstimate> specimens;
  for (const auto& t : trials) {
    const double treated = t[0] + t[1];
    const double control = t[2] + t[3];
    const double y = std::log(t[0] / treated / (t[2] / control));
    const double v = 1.0 / t[0] - 1.0 / treated + 1.0 / t[2] - 1.0 / control;
    specimens.push_back({"trial", y, std::sqrt(v)});
  }
  const RandomEffects r = random_effects(specimens);
  CHECK_THAT(r.mean, test::expected("bcg_trials.mean"));
  CHECK_THAT(*r.tau_squared, test::expected("bcg_trials.tau_squared"));
  CHECK_THAT(*r.q, test::expected("bcg_trials.q"));
  CHECK_THAT(*r.i_squared, WithinRel((*r.q - 12.0) / *r.q, 1e-12));
  CHECK(*r.q_p_value < 1e-20);

  // Hartung and Knapp's variance by its definition, from the estimates above.
  double weights = 0.0;
  double squares = 0.0;
  for (const SpecimenEstimate& s : specimens) {
    const double w = 1.0 / (s.standard_error * s.standard_error + *r.tau_squared);
    weights += w;
    squares += w * (s.estimate - r.mean) * (s.estimate - r.mean);
  }
  const double se = std::sqrt(std::max(1.0, squares / 12.0) / weights);
  const double t = boost::math::quantile(boost::math::students_t(12), 0.975);
  CHECK_THAT(r.standard_error, WithinRel(se, 1e-12));
  CHECK_THAT(r.interval.upper, WithinRel(r.mean + t * se, 1e-12));
  CHECK_THAT(r.new_specimen->lower,
             WithinRel(r.mean - t * std::sqrt(*r.tau_squared + se * se), 1e-12));
}

TEST_CASE("equal standard errors have REML in closed form, and its boundary") {
  // tau^2 = max(0, sample variance - s^2)
  const std::vector<double> y{1.0, 1.5, 3.0, 2.2};
  std::vector<SpecimenEstimate> specimens;
  specimens.reserve(y.size());
  for (const double value : y) specimens.push_back({"", value, 0.4});
  const double mean = 7.7 / 4.0;
  double variance = 0.0;
  for (const double value : y) variance += (value - mean) * (value - mean) / 3.0;
  const RandomEffects r = random_effects(specimens);
  CHECK_THAT(r.mean, WithinRel(mean, 1e-12));
  CHECK_THAT(*r.tau_squared, WithinRel(variance - 0.16, 1e-6));
  // The classic t interval of the mean.
  CHECK_THAT(r.standard_error, WithinRel(std::sqrt(variance / 4.0), 1e-6));
  CHECK_FALSE(r.tau_at_zero);

  for (SpecimenEstimate& s : specimens) s.standard_error = 2.0;
  const RandomEffects homogeneous = random_effects(specimens);
  CHECK(*homogeneous.tau_squared == 0.0);
  CHECK(homogeneous.tau_at_zero);
  CHECK(*homogeneous.i_squared == 0.0);
  CHECK_THAT(homogeneous.standard_error, WithinRel(1.0, 1e-12));  // 2 / sqrt(4), not less
  CHECK_THAT(homogeneous.summary, Contains("no spread"));
}

TEST_CASE("one and two specimens are answered, none and bad ones refused") {
  const std::vector<SpecimenEstimate> one{{"A", 2.0, 0.5}};
  const RandomEffects single = random_effects(one);
  CHECK(single.mean == 2.0);
  CHECK_THAT(single.interval.upper, WithinRel(2.0 + 0.5 * 1.959963984540054, 1e-12));
  CHECK_FALSE(single.tau_squared);
  CHECK_FALSE(single.new_specimen);
  const std::vector<SpecimenEstimate> two{{"A", 2.0, 0.5}, {"B", 4.0, 0.5}};
  const RandomEffects pair = random_effects(two);
  CHECK_THAT(*pair.tau_squared, WithinRel(2.0 - 0.25, 1e-6));
  CHECK_THAT(pair.interval.upper, WithinRel(3.0 + 12.706204736 * 1.0, 1e-6));
  CHECK_FALSE(pair.new_specimen);
  const std::vector<SpecimenEstimate> same{{"A", 2.0, 0.5}, {"B", 2.0, 0.5}};
  CHECK(*random_effects(same).tau_squared == 0.0);
  CHECK(random_effects(same).interval.upper > 2.5);
  CHECK_THROWS_WITH(random_effects({}), Contains("at least one"));
  const std::vector<SpecimenEstimate> bad{{"A", 2.0, 0.5}, {"B", 4.0, 0.0}};
  CHECK_THROWS_WITH(random_effects(bad), Contains("specimen 'B'"));
  CHECK_THROWS_WITH(random_effects(two, 1.0), Contains("between 0 and 1"));
}

// --- starts and words ----------------------------------------------------------------------------

TEST_CASE("the waterfall sorts, clusters and counts the ends of the starts") {
  const double nan = std::nan("");
  const std::vector<double> ends{12.0, 10.0, nan, 10.000001, 10.05, 12.0, 300.0};
  const Waterfall w = waterfall(ends);
  CHECK(w.deviances == std::vector<double>{10.0, 10.000001, 10.05, 12.0, 12.0, 300.0});
  CHECK(w.clusters == std::vector<int>{0, 0, 1, 2, 2, 3});
  CHECK(w.summary == "2 of 7 starts end at the best minimum; 4 distinct minima, 1 failed");
  CHECK(waterfall(std::vector<double>{nan}).summary == "none of 1 starts ended in a usable point");
  CHECK(waterfall({}).at_best == 0);
}

TEST_CASE("simple trade-offs are named by what remains known") {
  const FitParameter e = log_parameter("E1");
  const FitParameter eta = log_parameter("eta1", kPascalSecond);
  const FitParameter linear1 = parameter("F1", Scale::linear, 0, -1, 1, kPascal);
  const FitParameter linear2 = parameter("F2", Scale::linear, 0, -1, 1, kPascal);
  const FitParameter other = parameter("x0", Scale::linear, 0, -1, 1, kPascalSecond);
  using Names = std::vector<FitParameter>;
  const auto known = [](const Names& names, const std::vector<double>& steps) {
    return known_combination(names, steps);
  };
  CHECK(known({e, eta}, {0.7, 0.7}) == "their ratio E1 / eta1");
  CHECK(known({e, eta}, {-0.72, 0.69}) == "their product E1 eta1");
  CHECK(known({e, eta}, {0.894, -0.447}) == "the product E1 eta1^2");
  CHECK(known({e, eta}, {0.447, 0.894}) == "the ratio E1^2 / eta1");
  CHECK(known({e, eta}, {0.97, 0.22}).empty());
  CHECK(known({linear1, linear2}, {0.7, -0.7}) == "their sum F1 + F2");
  CHECK(known({linear1, linear2}, {0.7, 0.7}) == "their difference F1 - F2");
  CHECK(known({linear1, other}, {0.7, -0.7}).empty());
  CHECK(known({e, linear1}, {0.7, -0.7}).empty());
  CHECK(known({e, log_parameter("E2"), eta}, {0.57, 0.58, 0.58}) ==
        "the ratios of E1, E2 and eta1");
  CHECK(known({e, log_parameter("E2"), eta}, {0.57, -0.58, 0.58}).empty());
  CHECK(known({e}, {1.0}).empty());

  CHECK(weakest_direction_words(result_with({e, eta}, {1.0, 1.0}, 0.0, false)) ==
        "rank-deficient: E1 and eta1 trade off: only their ratio E1 / eta1 can be known (singular "
        "values 1.4:0 of the scaled Jacobian)");
  CHECK(weakest_direction_words(result_with({e, eta}, {1.0, -1.0}, 0.01, true)) ==
        "E1 and eta1 trade off: their product E1 eta1 is known much better than they are (singular "
        "values 1.4:0.01 of the scaled Jacobian)");
  CHECK(weakest_direction_words(result_with({e, eta}, {1.0, -1.0}, 0.4, true)) ==
        "least determined by the data: E1 up and eta1 down together; they trade off (singular "
        "values 1.4:0.4 "
        "of the scaled Jacobian)");
  CHECK(weakest_direction_words(result_with({e, eta}, {0.1, 1.0}, 0.4, true)) ==
        "least determined by the data: eta1 up (singular values 1.4:0.4 of the scaled Jacobian)");
  FitResult unevaluated = result_with({e, eta}, {0.1, 1.0}, 0.4, true);
  unevaluated.covariance.weakest_direction.resize(0);
  CHECK(weakest_direction_words(unevaluated).empty());
}
