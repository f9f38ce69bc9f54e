#pragma once
// A linear solid driven along knots that lie between its samples, and what a fit of it owes.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "placed_recordings.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/select/unseen_rises.hpp"

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

inline void check_truth(const FitResult& fit, double widest_k1) {
  REQUIRE(fit.adequacy);
  CHECK(fit.adequacy->verdict == "adequate");
  for (const ParameterResult& p : fit.parameters) {
    const double truth = p.parameter.name == "k_inf"  ? 60.0
                         : p.parameter.name == "k1"   ? 45.0
                         : p.parameter.name == "tau1" ? 2.0
                                                      : 0.0;
    if (truth == 0.0) continue;
    INFO(p.summary);
    REQUIRE(p.lower);
    REQUIRE(p.upper);
    CHECK(*p.lower < truth);
    CHECK(*p.upper > truth);
    if (p.parameter.name == "k1") CHECK(*p.upper - *p.lower < widest_k1);
    CHECK(p.conditional_on.empty());
  }
}

}  // namespace tpm::test
