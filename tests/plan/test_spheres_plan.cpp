// How many spheres a scene needs: the limit, what is not known of it, and claims that hold.
#include <catch2/catch.hpp>
#include <cmath>

#include "refusal.hpp"
#include "tpm/base/random.hpp"
#include "tpm/plan/plan_scene.hpp"
#include "tpm/plan/show/plan_report.hpp"
#include "tpm/plan/spheres_plan.hpp"

using namespace tpm;
using namespace tpm::plan;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// A cube of 80 mm glued to the ground; the patch covers its whole top.
RefilledScene cube() {
  return {parse_json(R"({
    "organ": {"kind": "block", "cells": [4, 4, 4], "spacing": "20 mm", "lattice": "cubic"},
    "bonds": {"spacing_law": "continuum"},
    "anchors": [{"kind": "half_space", "point": ["0 mm", "0 mm", "0.1 mm"], "normal": [0, 0, -1]}],
    "contacts": [{"kind": "patch", "number": 13, "radius": "60 mm"}],
    "protocol": {"kind": "ramp_hold", "depth": "0.2 mm", "rate": "0.2 mm/s", "hold": "1 s"}
  })",
                     "cube.json"),
          "cube.json",
          {}};
}

}  // namespace

TEST_CASE("a line in the spacing has its limit, and its scatter the uncertainty") {
  const Eigen::Matrix<double, 5, 1> spacing{0.02, 0.014, 0.01, 0.007, 0.005};
  const Eigen::Matrix<double, 5, 1> area{0.3, -0.2, 0.1, -0.05, 0.02};
  Eigen::MatrixXd terms(5, 2);
  terms << spacing, area;
  Eigen::MatrixXd exact(2, 5);  // at two instants
  exact.row(0) = (1.0 + 9.0 * spacing.array() + 0.7 * area.array()).matrix().transpose();
  exact.row(1) = 0.5 * exact.row(0);
  const SpacingLimit limit = spacing_limit(terms, exact);
  CHECK_THAT(limit.response(0), WithinRel(1.0, 1e-12));
  CHECK_THAT(limit.response(1), WithinRel(0.5, 1e-12));
  CHECK(limit.uncertainty < 1e-12);

  terms.col(1).setConstant(0.1);  // the same on every filling: no line through these is the one
  CHECK_THAT(test::refusal_of([&] { (void)spacing_limit(terms, exact); }),
             Contains("are linearly dependent"));
  terms.col(1) = area;

  // Scatter in proportion to the spacing: 95 of 100 intervals have the true limit.
  constexpr int kTrials = 2000;
  Random random(4);
  int covered = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Eigen::MatrixXd one = exact.topRows(1);
    for (Eigen::Index i = 0; i < 5; ++i) one(0, i) += 2.0 * spacing(i) * random.normal();
    const SpacingLimit found = spacing_limit(terms, one);
    if (std::abs(found.response(0) - 1.0) <= found.uncertainty) ++covered;
  }
  const double share = covered / double{kTrials};
  CHECK_THAT(share, WithinAbs(0.95, 4.0 * std::sqrt(0.95 * 0.05 / kTrials)));
}

TEST_CASE("claims of a cube hold against one that is much finer", "[heavy]") {
  const RefilledScene scene = cube();
  SpheresRequest request;
  request.tolerance = 0.05;
  request.most = 2500;
  const SpheresPlan plan = plan_spheres(scene, request);
  REQUIRE(plan.tried.size() >= 5);
  // The error is of first order: two finer cubes give the limit by themselves.
  const auto peak = [&](double finer) {
    const PlanScene filled(scene.scene({finer, 0}));
    QuasiStaticOptions options;
    options.tolerance = 1e-5;
    return filled.quasi_static(options, {0.5, 1.0, 2.0}, false).response.cwiseAbs().maxCoeff();
  };
  const double limit = 2.0 * peak(4.0) - peak(2.0);
  CHECK(std::abs(plan.limit_peak - limit) <= plan.limit_uncertainty * plan.limit_peak);
  double finest_claim = 1.0;
  for (const TriedSpheres& tried : plan.tried) {
    REQUIRE(tried.claimed_error);
    CHECK(std::abs(*tried.peak - limit) / limit <= *tried.claimed_error);
    finest_claim = *tried.claimed_error;
  }
  CHECK(finest_claim < *plan.tried.front().claimed_error);
  if (plan.choice) {
    CHECK(*plan.chosen().claimed_error <= request.tolerance);
    for (std::size_t i = *plan.choice; i < plan.tried.size(); ++i) {
      CHECK(*plan.tried[i].claimed_error <= request.tolerance);
    }
    if (*plan.choice > 0) CHECK(*plan.tried[*plan.choice - 1].claimed_error > request.tolerance);
  }
  const Json json = plan::spheres_json(plan);
  CHECK(json.at("tried").size() == plan.tried.size());
}

TEST_CASE("a contact that is narrower than every spacing says how narrow it is") {
  Json document = parse_json(
      R"({"organ": {"kind": "liver", "filling": "solid", "count": 100, "shape": {"width": "200 mm"}},
          "bonds": {"spacing_law": "continuum"},
          "contacts": [{"kind": "ball", "radius": "2 mm"}],
          "protocol": {"kind": "ramp_hold", "depth": "1 mm", "rate": "1 mm/s", "hold": "1 s"}})",
      "s.json");
  const RefilledScene scene(document, "s.json", {});
  SpheresRequest request;
  request.most = 1000;
  CHECK_THAT(test::refusal_of([&] { (void)plan_spheres(scene, request); }),
             Contains("2 mm") && Contains("more spheres"));
}
