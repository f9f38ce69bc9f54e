#pragma once
#include <optional>

#include "tpm/organ/run/simulation.hpp"

namespace tpm::organ {

/// Where a run stands.
struct Checkpoint {
  SimulationRecord record;
  QuasiStaticState latest;
  std::optional<InertialState> motion;  ///< of an inertial run
};

/// Stands for the scene, tissue or mass-spring model, the places of its spheres, and the version of
/// the program.
[[nodiscard]] std::string checkpoint_identity(const ExperimentScene& scene);

/// Writes HDF5, whole or not at all. Throws Error(environment).
void write_checkpoint(const std::filesystem::path& path, const std::string& identity,
                      const Checkpoint& checkpoint);

/// None if there is no such file or if it belongs to another identity, which the note then tells.
/// Throws Error(bad_input) for a file that is no whole checkpoint.
[[nodiscard]] std::optional<Checkpoint> read_checkpoint(
    const std::filesystem::path& path, const std::string& identity,
    const std::function<void(const std::string&)>& note);

}  // namespace tpm::organ
