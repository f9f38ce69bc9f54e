// The short answer of a plan: at most 25 lines, whatever was tried, and every warning.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>

#include "tpm/plan/show/plan_report.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::plan;
using Catch::Matchers::Contains;

namespace {

/// A plan with everything that a text can say, and more candidates and warnings than fit.
Plan full_plan(bool chosen) {
  Plan plan;
  plan.title = "a plan";
  plan.spheres = 424;
  plan.bonds = 3080;
  plan.duration_s = 10.0;
  plan.masses_left_out = 0.04;
  plan.needs_full = true;
  for (int i = 0; i < 30; ++i) {
    PlannedCandidate c;
    c.name = fmt::format("model_{}", i);
    c.formulation = "linear";
    c.cost_s_per_s = 1e-6 * (i + 1);
    c.claimed_error = 0.01;
    c.verified_error = 0.005;
    c.accurate = c.feasible = chosen;
    if (!chosen) c.reason = "the claimed error is above the tolerance";
    plan.candidates.push_back(c);
  }
  if (chosen) plan.choice = 7;
  plan.reference = {"nonlinear network", "another rule", 1e-6, 0.0, 3.2e-5};
  plan.relevance = {{"inertia", 0.04, true, true, "by the linear network"},
                    {"layers", 1.3, false, true, "layer 2 fixed"},
                    {"tension", {}, false, true, "not tried"},
                    {"viscosity", 0.002, false, false, ""}};
  plan.changes = {{"deeper, and as much faster", 1.66, 1.64, "tolerance"},
                  {"faster", {}, 4.0, ""},
                  {"stiffer", {}, kMostChange, ""}};
  for (int i = 0; i < 20; ++i) {
    plan.validity.push_back({fmt::format("limit_{}", i), fmt::format("limit {} is passed.", i)});
  }
  return plan;
}

}  // namespace

TEST_CASE("the short answer of a plan has 25 lines, the pick first, and every warning",
          "[plan][answer]") {
  for (const bool chosen : {true, false}) {
    const Plan plan = full_plan(chosen);
    show::ShortAnswer answer = short_answer(plan);
    show::end_answer(answer, "", {}, "tpm simulate scene.json --planned");
    const std::string text = show::to_text(answer);
    INFO(text);
    CHECK(std::ranges::count(text, '\n') <= 25);
    const files::Json written = plan_json(plan);
    for (const files::Json& remark : written.at("remarks")) {
      CHECK_THAT(text, Contains(remark.at("text").get<std::string>()));
    }
    CHECK(plan_json(plan).at("remarks").size() == 21);
    CHECK_THAT(text, Contains("peak 32 uN"));
    CHECK_THAT(text, Contains("matters, in parts of the peak: layers 130 %"));
    CHECK_THAT(text, Contains("not known whether it matters: tension (not tried)"));
    if (chosen) CHECK_THAT(text, Contains("pick: model_7"));
    if (!chosen) CHECK_THAT(text, Contains("no model meets tolerance and budget"));
  }
}

TEST_CASE("a margin or an offline time that is no number is an error, not one that is absent",
          "[plan][answer]") {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  Plan plan = full_plan(true);
  REQUIRE(files::to_text(plan_json(plan)).find("\"margin\"") != std::string::npos);
  plan.candidates[plan.choice.value()].verified_error = kNone;
  CHECK_FALSE(plan_json(plan).at("margin").is_null());
  CHECK_THROWS_AS(files::to_text(plan_json(plan)), Error);
  plan = full_plan(true);
  plan.candidates[3].reach = ModelReach::full;
  CHECK(plan_json(plan).at("network_offline_s") == 4e-5);
  plan.duration_s = kNone;
  CHECK_FALSE(plan_json(plan).at("network_offline_s").is_null());
}

TEST_CASE("the short answer of a plan counts the candidates that it does not show",
          "[plan][answer]") {
  Plan plan = full_plan(true);
  plan.validity.clear();
  plan.candidates[29].verified_error.reset();
  const std::string text = show::to_text(short_answer(plan));
  INFO(text);
  const auto first = text.find("\nmodel_7 ");
  REQUIRE(first != std::string::npos);
  CHECK(text.find("\nmodel_0 ") > first);
  CHECK_THAT(text, Contains("more candidates") && !Contains("\nmodel_20 "));
}

TEST_CASE("masses that no error counts are a warning where they and the claim exceed the tolerance",
          "[plan][answer]") {
  Plan plan = full_plan(true);
  plan.masses_left_out.reset();
  plan.validity.clear();
  plan.relevance = {{"inertia", 0.0378, true, false, ""}};
  plan.request.tolerance = 0.04;  // the claim is 0.01
  const std::vector<Remark> remarks = plan_remarks(plan);
  REQUIRE(remarks.size() == 1);
  CHECK(remarks.front().code == "masses_uncounted");
  CHECK_THAT(remarks.front().text,
             Contains("by 3.78 % of the peak: with the claimed error 4.78 %, which exceeds"));
  CHECK_THAT(show::to_text(short_answer(plan)), Contains("! no error above counts masses"));
  plan.request.tolerance = 0.05;
  CHECK(plan_remarks(plan).empty());
  plan.request.tolerance = 0.04;
  plan.relevance.front().error.reset();
  CHECK(plan_remarks(plan).empty());
  plan.relevance.front().error = 0.0378;
  plan.inertial = true;
  CHECK(plan_remarks(plan).empty());
}
