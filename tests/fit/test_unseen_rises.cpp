// Rises of the drive that the samples do not resolve: steps, staircases, and ramps of few samples.
#include <catch2/catch.hpp>

#include "driven_solid.hpp"
#include "tpm/fit/likelihood/delayed_rise.hpp"
#include "tpm/fit/recording/unseen_rises.hpp"
#include "tpm/fit/select/selection.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

using test::driven;
using test::steps;

TEST_CASE("a delayed rise moves its centre and keeps its samples", "[rise]") {
  const Protocol line(Drive::displacement, {{0.0, 0.0}, {1.0, 0.0}, {2.0, 1.0}, {5.0, 1.0}});
  for (const double delay : {-0.5, -0.3, 0.2, 0.5}) {
    const DelayedRise rise{1.0, 2.0, delay};
    const Protocol moved = with_delays(line, std::span(&rise, 1));
    CHECK(value_at(moved, 1.0) == 0.0);
    CHECK(value_at(moved, 2.0) == 1.0);
    // The time lost to a rise at `centre` is the integral of 1 - depth after it.
    double below = 0.0;
    constexpr int kParts = 20000;
    for (int i = 0; i < kParts; ++i)
      below += (1.0 - value_at(moved, 1.0 + (i + 0.5) / kParts)) / kParts;
    CHECK_THAT(below, WithinAbs(0.5 + delay, 1e-4));
  }
  const DelayedRise elsewhere{1.5, 2.0, 0.1};
  CHECK(with_delays(line, std::span(&elsewhere, 1)).knots().size() == line.knots().size());
}

TEST_CASE("a step between two samples biases no interval", "[rise]") {
  const Selection s = test::check_step_between_samples(5.008);
  CHECK(std::ranges::any_of(s.summary, [](const std::string& words) {
    return words.find("is not known; the fit allows for it") != std::string::npos;
  }));
  CHECK(std::ranges::none_of(s.remarks, [](const Remark& remark) {
    return remark.text.starts_with("rise_delay");  // it is no time constant
  }));
}

TEST_CASE("a ramp of few samples is known but for its corners, one of many altogether", "[rise]") {
  const auto ramp = [](double begin, double lasts) {
    return prepare_recording(
        "ramp.csv",
        driven({{0.0, 0.0}, {begin, 0.0}, {begin + lasts, 4e-3}, {60.0, 4e-3}}, 35.0, 7));
  };
  const std::vector<UnseenRise> corners = unseen_rises(ramp(5.02, 0.15));
  REQUIRE(corners.size() == 2);
  CHECK(corners[0].earliest_s == 0.0);
  CHECK_THAT(corners[0].latest_s, WithinRel(0.01, 1e-6));  // the corner at 5.02 s
  CHECK(corners[1].latest_s == 0.0);
  CHECK(unseen_rises(ramp(5.0, 0.15)).empty());  // corners at samples
  CHECK(unseen_rises(ramp(5.02, 2.0)).empty());
}

TEST_CASE("a ramp whose steps lie about the threshold of a rise has none", "[rise]") {
  // Rounding and noise put some of its steps above the threshold of a rise, and others below it.
  const std::vector<Knot> ramp{{0.0, 0.0}, {1.0, 0.0}, {3.5, 8e-3}, {60.0, 8e-3}};
  CHECK(unseen_rises(prepare_recording("even.csv", driven(ramp, 20.0, 7))).empty());
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    Recording noisy = driven({{0.0, 0.0}, {1.0, 0.0}, {2.25, 4e-3}, {60.0, 4e-3}}, 20.0, seed);
    Random random(seed + 100);
    for (double& depth : noisy.drive) depth += 2e-5 * random.normal();
    INFO(seed);
    CHECK(unseen_rises(prepare_recording("noisy.csv", std::move(noisy))).empty());
  }
}

TEST_CASE("the derivative by a delay is that of the answer", "[rise]") {
  const PreparedRecording one =
      prepare_recording("step.csv", driven(steps({5.01}, 4e-3, 40.0), 20.0, 5));
  const FitConfig config =
      recording_config(parse_law_name("linear-1", "test"), std::span(&one, 1), {});
  const ExperimentResiduals residuals(config, data_sets(std::span(&one, 1)));
  std::vector<double> at;
  std::size_t rise = config.parameters.size();
  for (std::size_t i = 0; i < config.parameters.size(); ++i) {
    at.push_back(config.parameters[i].fit.start);
    if (config.parameters[i].rise) rise = i;
  }
  REQUIRE(rise < config.parameters.size());
  for (const double delay : {-0.02, 0.0, 0.02}) {
    at[rise] = delay;
    Eigen::VectorXd here, there, back;
    RowMatrix jacobian;
    REQUIRE(residuals.evaluate(at, here, &jacobian));
    std::vector<double> moved = at;
    moved[rise] = delay + 1e-4;
    REQUIRE(residuals.evaluate(moved, there, nullptr));
    const Eigen::VectorXd slope = (there - here) / 1e-4;
    const auto column = jacobian.col(static_cast<Eigen::Index>(rise));
    CHECK((slope - column).norm() < 5e-3 * column.norm());
  }
}

TEST_CASE("a written configuration keeps its delayed rises", "[rise]") {
  const PreparedRecording one =
      prepare_recording("step.csv", driven(steps({5.01}, 4e-3, 40.0), 20.0, 5));
  const FitConfig config =
      recording_config(parse_law_name("linear-1", "test"), std::span(&one, 1), {});
  const FitConfig read = parse_fit_config(config_json(config), "test");
  REQUIRE(read.parameters.size() == config.parameters.size());
  for (std::size_t i = 0; i < read.parameters.size(); ++i) {
    REQUIRE(read.parameters[i].rise.has_value() == config.parameters[i].rise.has_value());
    if (!read.parameters[i].rise) continue;
    CHECK_THAT(read.parameters[i].rise->end_s, WithinRel(config.parameters[i].rise->end_s, 1e-12));
    CHECK_THAT(read.parameters[i].prior->sd, WithinRel(config.parameters[i].prior->sd, 1e-6));
  }
}
