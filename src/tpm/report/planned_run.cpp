// What a planned model answered.
#include <fmt/format.h>

#include "tpm/core/text.hpp"
#include "tpm/core/version.hpp"
#include "tpm/report/plan_report.hpp"
#include "tpm/store/file.hpp"
#include "tpm/store/hdf5.hpp"

namespace tpm {
namespace {

constexpr int kPlannedDigits = 9;

Eigen::Index largest_of(const PlanTrajectory& answer) {
  Eigen::Index at = 0;
  answer.response.cwiseAbs().maxCoeff(&at);
  return at;
}

std::string model_words(const PlannedCandidate& c) {
  return fmt::format("{} ({}{}{})", c.name, c.formulation, c.settings.empty() ? "" : ", ",
                     c.settings);
}

/// What is known of the response where the claim is about displacements; else empty.
std::string response_words(const Plan& plan) {
  const auto& error = plan.chosen().verified_response_error;
  if (!error) return {};
  return fmt::format("{}: nothing claimed, verified error {} %\n",
                     plan.by_depth ? "contact force" : "indentation depth",
                     significant(100.0 * *error, 3));
}

/// Under /claim: what is claimed of which quantity, in numbers and words.
void write_claim(const Plan& plan, Hdf5Writer& file) {
  const PlannedCandidate& c = plan.chosen();
  const PlanClaim claim = claim_of(plan);
  file.group("/claim");
  file.attribute("/claim", "quantity", claim.quantity);
  file.attribute("/claim", "norm", claim.norm);
  file.attribute("/claim", "protocol", claim.protocol);
  file.numbers("/claim/claimed_error", {rounded(*c.claimed_error, 6)});
  file.numbers("/claim/verified_error", {rounded(*c.verified_error, 6)});
  if (c.verified_response_error) {
    file.numbers("/claim/verified_response_error", {rounded(*c.verified_response_error, 6)});
  }
  file.numbers("/claim/tolerance", {plan.request.tolerance});
}

}  // namespace

Json planned_run_json(const Plan& plan, const ExperimentScene& scene,
                      const std::vector<double>& times_s, const PlanTrajectory& answer) {
  const PlannedCandidate& c = plan.chosen();
  const auto point = [&](Eigen::Index i) {
    const double time = times_s[static_cast<std::size_t>(i)];
    return Json{{"time_s", rounded(time, kPlannedDigits)},
                {"imposed", rounded(value_at(scene.protocol, time), kPlannedDigits)},
                {"response", rounded(answer.response[i], kPlannedDigits)}};
  };
  return {
      {"title", plan.title},
      {"version", version()},
      {"scene_sha256", sha256_hex(scene.text)},
      {"model", c.name},
      {"formulation", c.formulation},
      {"settings", c.settings},
      {"claim", claim_json(plan)},
      {"claimed_error", rounded(c.claimed_error.value(), 6)},
      {"verified_error", rounded(c.verified_error.value(), 6)},
      {"verified_response_error",
       c.verified_response_error ? Json(rounded(*c.verified_response_error, 6)) : Json(nullptr)},
      {"tolerance", plan.request.tolerance},
      {"imposed", plan.by_depth ? "depth_m" : "load_N"},
      {"response", plan.by_depth ? "force_N" : "depth_m"},
      {"largest", point(largest_of(answer))},
      {"last", point(answer.response.size() - 1)},
      {"outputs", answer.displacement.size()},
      {"validity_passed", plan.validity}};
}

std::string planned_run_text(const Plan& plan, const std::vector<double>& times_s,
                             const PlanTrajectory& answer) {
  const PlannedCandidate& c = plan.chosen();
  const auto point = [&](Eigen::Index i) {
    const double value = answer.response[i];
    return fmt::format("{} {} at {} s", significant(plan.by_depth ? value : 1e3 * value, 6),
                       plan.by_depth ? "N" : "mm",
                       significant(times_s[static_cast<std::size_t>(i)], 4));
  };
  std::string text = fmt::format(
      "{}: planned model {}\n{}: claimed error at most {} %, verified {} % ({})\n{}largest {}: {}; "
      "at "
      "the end: {}\n",
      plan.title, model_words(c), claim_of(plan).quantity, significant(100.0 * *c.claimed_error, 3),
      significant(100.0 * *c.verified_error, 3), claim_of(plan).norm, response_words(plan),
      plan.by_depth ? "force" : "depth", point(largest_of(answer)),
      point(answer.response.size() - 1));
  for (const std::string& limit : plan.validity) text += fmt::format("WARNING: {}\n", limit);
  return text;
}

void write_planned_run(const Plan& plan, const ExperimentScene& scene,
                       const std::vector<double>& times_s, const PlanTrajectory& answer,
                       const std::filesystem::path& path) {
  const PlannedCandidate& c = plan.chosen();
  Hdf5Writer file(path);
  file.attribute("/", "title", plan.title);
  file.attribute("/", "scene", scene.text);
  file.attribute("/", "scene_sha256", sha256_hex(scene.text));
  file.attribute("/", "written_by", fmt::format("tpm {}", version()));
  file.attribute("/", "formulation", c.formulation);
  file.attribute("/", "model", model_words(c));
  file.attribute("/", "provenance", "model");
  write_claim(plan, file);
  std::vector<double> imposed;
  imposed.reserve(times_s.size());
  for (const double time : times_s) imposed.push_back(value_at(scene.protocol, time));
  const std::vector<double> response(answer.response.begin(), answer.response.end());
  file.numbers("/curve/time_s", times_s);
  file.numbers(plan.by_depth ? "/curve/depth_m" : "/curve/load_N", imposed);
  file.numbers(plan.by_depth ? "/curve/force_N" : "/curve/depth_m", response);
  if (!answer.displacement.empty()) file.numbers("/steps/time_s", times_s);
  for (std::size_t i = 0; i < answer.displacement.size(); ++i) {
    const Eigen::Matrix3Xd& u = answer.displacement[i];
    file.table(fmt::format("/steps/{:05}/displacement_m", i), {u.data(), u.data() + u.size()}, 3);
  }
  file.commit();
}

}  // namespace tpm
