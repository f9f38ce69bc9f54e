#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/json.hpp"
#include "tpm/organ/run/scene_runner.hpp"

namespace tpm::plan {

/// Scene, formulation and tolerance of a run.
[[nodiscard]] Json scene_run_members(const ExperimentScene& scene);
/// Adds what is imposed, the response, its largest and last value and the number of outputs to a
/// description of a run.
void add_course(Json& json, const ExperimentScene& scene, const CurvePoint& largest,
                const CurvePoint& last, std::size_t outputs);
void add_trajectory(Json& json, const ExperimentScene& scene, const std::vector<double>& times_s,
                    const Trajectory& answer);
/// The same in a line.
[[nodiscard]] std::string trajectory_text(bool by_depth, const std::vector<double>& times_s,
                                          const Trajectory& answer);
/// Writes /curve and, where displacements are known, /steps.
void write_trajectory(const ExperimentScene& scene, const std::vector<double>& times_s,
                      const Trajectory& answer, Hdf5Writer& file);

// Runs of scenes by formulations that do not show whole states.
[[nodiscard]] Json scene_run_json(const ExperimentScene& scene, const std::vector<double>& times_s,
                                  const Trajectory& answer);
[[nodiscard]] std::string scene_run_text(const ExperimentScene& scene,
                                         const std::vector<double>& times_s,
                                         const Trajectory& answer);
/// Throws Error(environment).
void write_scene_run(const ExperimentScene& scene, const std::vector<double>& times_s,
                     const Trajectory& answer, const std::filesystem::path& path);

}  // namespace tpm::plan
