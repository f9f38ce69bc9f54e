#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/files/json.hpp"
#include "tpm/plan/plan.hpp"
#include "tpm/plan/spheres_plan.hpp"
#include "tpm/show/short_answer.hpp"

namespace tpm::plan {

/// Expected cost of planning (`tpm plan --estimate`).
[[nodiscard]] Json expected_plan_json(const ExpectedPlanWork& work);
[[nodiscard]] std::string expected_plan_text(const ExpectedPlanWork& work);
/// A plan, as docs/json.md describes the keys.
[[nodiscard]] Json plan_json(const Plan& plan);
[[nodiscard]] std::string plan_text(const Plan& plan);
/// The short answer: the pick with its errors and cost, the candidates that were run, what matters,
/// robustness margins, and every warning.
[[nodiscard]] ShortAnswer short_answer(const Plan& plan);
/// Remarks that a user must know: masses that are left out, limits of validity that the scene
/// passes.
[[nodiscard]] std::vector<Remark> plan_remarks(const Plan& plan);

/// The choice of the number of spheres: the key `spheres_choice` of a plan.
[[nodiscard]] Json spheres_json(const SpheresPlan& plan);
[[nodiscard]] std::string spheres_text(const SpheresPlan& plan);
/// The first line of it: how many spheres, and how far from the limit.
[[nodiscard]] std::string spheres_words(const SpheresPlan& plan);

/// That the network itself takes less than a second, where no loop and no budget asks for less;
/// else empty.
[[nodiscard]] std::string offline_text(const Plan& plan);

/// Quantity whose errors a plan states.
[[nodiscard]] Json claim_json(const Plan& plan);
/// True if masses change the answer by more than the tolerance; null if that is not known.
[[nodiscard]] Json masses_matter_json(const Plan& plan);

/// Answer of the planned model, and the same in words.
[[nodiscard]] Json planned_run_json(const Plan& plan, const ExperimentScene& scene,
                                    const std::vector<double>& times_s, const Trajectory& answer);
[[nodiscard]] std::string planned_run_text(const Plan& plan, const std::vector<double>& times_s,
                                           const Trajectory& answer);
/// The same as a short answer; files and the next command are the caller's.
[[nodiscard]] ShortAnswer short_answer(const Plan& plan, const std::vector<double>& times_s,
                                       const Trajectory& answer);

/// HDF5 with the answer and, as attributes of /, the scene, the model and its errors.
void write_planned_run(const Plan& plan, const ExperimentScene& scene,
                       const std::vector<double>& times_s, const Trajectory& answer,
                       const std::filesystem::path& file);

}  // namespace tpm::plan
