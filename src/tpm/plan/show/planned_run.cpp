// Declared in tpm/plan/show/plan_report.hpp.
// Response of a planned model.
#include <fmt/format.h>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5_members.hpp"
#include "tpm/plan/show/plan_report.hpp"
#include "tpm/plan/show/trajectory_report.hpp"
#include "tpmkit/version.hpp"

namespace tpm::plan {
namespace {

std::string model_words(const PlannedCandidate& c) {
  return fmt::format("{} ({}{}{})", c.name, c.formulation, c.settings.empty() ? "" : ", ",
                     c.settings);
}

/// Knowledge of the response where the claim is about displacements; else empty.
std::string response_words(const Plan& plan) {
  const auto& error = plan.chosen().verified_response_error;
  if (!error) return {};
  return fmt::format("{}: nothing claimed, verified error {} %\n",
                     plan.by_depth ? "contact force" : "indentation depth",
                     significant(100.0 * shown_error(plan, *error), 3));
}

/// The plan, the claim and its errors.
Json planned_members(const Plan& plan, const ExperimentScene& scene) {
  const PlannedCandidate& c = plan.chosen();
  const auto& response = c.verified_response_error;
  return {{"title", plan.title},
          {"version", version()},
          {"scene_sha256", sha256_hex(scene.text)},
          {"model", c.name},
          {"formulation", c.formulation},
          {"settings", c.settings},
          {"claim", claim_json(plan)},
          {"claimed_error", rounded(shown_error(plan, c.claimed_error.value()), 6)},
          {"verified_error", rounded(shown_error(plan, c.verified_error.value()), 6)},
          {"verified_response_error",
           response ? Json(rounded(shown_error(plan, *response), 6)) : Json(nullptr)},
          {"tolerance", plan.request.tolerance},
          {"masses_matter", masses_matter_json(plan)}};
}

Json planned_remarks(const Plan& plan) {
  return {{"validity_passed", remarks_json(plan.validity)},
          {"remarks", remarks_json(plan_remarks(plan))}};
}

}  // namespace

Json planned_run_json(const Plan& plan, const ExperimentScene& scene,
                      const std::vector<double>& times_s, const Trajectory& answer) {
  Json json = planned_members(plan, scene);
  add_trajectory(json, scene, times_s, answer);
  json.update(planned_remarks(plan));
  return json;
}

std::string planned_run_text(const Plan& plan, const std::vector<double>& times_s,
                             const Trajectory& answer) {
  std::string text;
  const ShortAnswer parts = short_answer(plan, times_s, answer);
  for (const std::string& line : parts.conclusion) text += line + "\n";
  for (const std::string& line : parts.limits) text += line + "\n";
  for (const std::string& words : parts.warnings) text += fmt::format("WARNING: {}\n", words);
  return text;
}

ShortAnswer short_answer(const Plan& plan, const std::vector<double>& times_s,
                         const Trajectory& answer) {
  const PlannedCandidate& c = plan.chosen();
  const auto add = [](std::vector<std::string>& lines, const std::string& line) {
    if (!line.empty()) lines.push_back(line.substr(0, line.find_last_not_of('\n') + 1));
  };
  ShortAnswer short_one;
  short_one.conclusion = {
      fmt::format("{}: planned model {}", plan.title, model_words(c)),
      fmt::format("{}: claimed error at most {} %, verified {} % ({})", claim_of(plan).quantity,
                  significant(100.0 * shown_error(plan, *c.claimed_error), 3),
                  significant(100.0 * shown_error(plan, *c.verified_error), 3),
                  claim_of(plan).norm)};
  add(short_one.conclusion, response_words(plan));
  add(short_one.conclusion, trajectory_text(plan.by_depth, times_s, answer));
  if (plan.request.measure.output == PlanOutput::force) {
    add(short_one.limits,
        "outputs: the response alone; --outputs field plans and stores the whole network");
  }
  add(short_one.limits, offline_text(plan));
  short_one.warnings = remark_texts(plan_remarks(plan));
  return short_one;
}

void write_planned_run(const Plan& plan, const ExperimentScene& scene,
                       const std::vector<double>& times_s, const Trajectory& answer,
                       const std::filesystem::path& path) {
  Hdf5Writer file(path);
  write_members(file, "/", planned_members(plan, scene));
  write_members(file, "/",
                {{"masses_left_out", plan.masses_left_out ? Json(*plan.masses_left_out) : Json()},
                 {"scene", scene.text},
                 {"provenance", "model"}});
  write_members(file, "/", planned_remarks(plan));
  write_trajectory(scene, times_s, answer, file);
  file.commit();
}

}  // namespace tpm::plan
