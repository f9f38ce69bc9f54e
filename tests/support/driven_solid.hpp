#pragma once
// A linear solid driven along knots that lie between its samples, and what a fit of it owes.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "placed_recordings.hpp"
#include "tpm/fit/recording/unseen_rises.hpp"
#include "tpm/fit/select/selection.hpp"

namespace tpm::test {

inline constexpr double kSampleStep_s = 0.05;

/// A linear solid of 60 and 45 N/m, 2 s, driven along knots that lie between its samples.
inline Recording driven(std::vector<Knot> knots, double end_s, std::uint64_t seed) {
  Recording r;
  r.header.id = "made";
  for (int i = 0; i * kSampleStep_s < end_s; ++i) r.time_s.push_back(i * kSampleStep_s);
  const Protocol path(Drive::displacement, std::move(knots));
  for (const double t : r.time_s) r.drive.push_back(value_at(path, t));
  LawSpec spec = parse_law_name("linear-1", "test");
  spec.reference = 4e-3;
  const Eigen::VectorXd force =
      LawModel(spec)
          .respond(path, r.time_s, std::vector{60.0, 45.0, 2.0, 0.0, 0.0}, Want::values)
          .value;
  Random random(seed);
  for (const double f : force) r.response.push_back(f + 4e-4 * random.normal());
  return r;
}

/// Steps of 1 mm that take 20 ms each.
inline std::vector<Knot> steps(const std::vector<double>& begins_s, double each_m, double end_s) {
  std::vector<Knot> knots{{0.0, 0.0}};
  double depth = 0.0;
  for (const double begin : begins_s) {
    knots.push_back({begin, depth});
    depth += each_m;
    knots.push_back({begin + 0.02, depth});
  }
  knots.push_back({end_s, depth});
  return knots;
}

/// An adequate fit whose intervals contain the solid's coefficients.
/// @param widest_k1 upper limit of the width of the interval of k1, N/m
inline void check_intervals(const FitResult& fit, double widest_k1) {
  REQUIRE(fit.adequacy);
  CHECK(fit.adequacy->verdict == "adequate");
  int seen = 0;
  for (const ParameterResult& p : fit.parameters) {
    const double expected = p.parameter.name == "k_inf"  ? 60.0
                            : p.parameter.name == "k1"   ? 45.0
                            : p.parameter.name == "tau1" ? 2.0
                                                         : 0.0;
    if (expected == 0.0) continue;
    ++seen;
    INFO(p.summary);
    CHECK(p.lower.value() < expected);
    CHECK(p.upper.value() > expected);
    if (p.parameter.name == "k1") CHECK(*p.upper - *p.lower < widest_k1);
    CHECK(p.conditional_on.empty());
  }
  CHECK(seen == 3);
}

/// Fits a step of 4 mm that begins between two samples, at `begin_s`.
inline Selection check_step_between_samples(double begin_s) {
  const PreparedRecording one =
      prepare_recording("step.csv", driven(steps({begin_s}, 4e-3, 40.0), 35.0, 5));
  const std::vector<UnseenRise> rises = unseen_rises(one);
  REQUIRE(rises.size() == 1);
  CHECK(std::abs(rises.front().begin_s - 5.0) < 1e-11);
  Selection s = select_law(std::span(&one, 1), {});
  const FitResult& fit = s.candidates[s.recommended].fit;
  CHECK(law_name(fit.config.law.value()) == "linear-1");
  check_intervals(fit, 1.4);
  return s;
}

/// Fits four steps of 1 mm that begin between two samples.
inline void check_stairs_between_samples(std::uint64_t seed) {
  Random random(seed);
  std::vector<double> begins;
  for (int i = 0; i < 4; ++i) begins.push_back(5.0 + 8.0 * i + 0.03 * random.uniform());
  const PreparedRecording one =
      prepare_recording("stairs.csv", driven(steps(begins, 1e-3, 60.0), 45.0, seed));
  CHECK(unseen_rises(one).size() == 4);
  const Selection s = select_law(std::span(&one, 1), {});
  check_intervals(s.candidates[s.recommended].fit, 1.4);
}

}  // namespace tpm::test
