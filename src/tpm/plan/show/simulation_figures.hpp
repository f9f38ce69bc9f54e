#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/run/simulation.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::plan {

/// A run to be drawn; all must live as long as this.
struct FiguredRun {
  const ExperimentScene* scene;
  const RunNetwork* network;
  const SimulationRun* run;
};

/// Draws all of them into a folder as SVG, PNG and PDF. Returns the names of the files,
/// figures.json and pictures.json, from which they can be drawn again, among them.
/// @param runs one or two, of the same spheres
/// Throws Error(environment) if drawing is not possible; the two JSON files are then there.
std::vector<std::string> write_simulation_figures(const std::filesystem::path& folder,
                                                  const std::vector<FiguredRun>& runs);

}  // namespace tpm::plan
