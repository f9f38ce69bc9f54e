#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/plan/plan.hpp"

namespace tpm::app {

/// Options of `tpm plan` and `tpm simulate --planned` as typed.
struct PlanChoice {
  std::string tolerance = "1%";
  std::string outputs = "force";
  std::string rate, wall, costs;
  std::string budget;  ///< budget.json, of --tolerance data
};

void add_plan_options(CLI::App& command, PlanChoice& choice);

/// Throws Error(usage), and Error(bad_input) for a file of costs.
[[nodiscard]] PlanRequest plan_request(const PlanChoice& choice);

/// make_plan with a line of progress.
[[nodiscard]] Plan planned(const ExperimentScene& scene, PlanRequest request);

}  // namespace tpm::app
