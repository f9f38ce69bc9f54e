#pragma once
#include <filesystem>

#include "tpm/simulate/simulation.hpp"

namespace tpm {

/// What the bonds of a network pull with in a state, N: positive when a bond is in tension.
[[nodiscard]] Eigen::VectorXd bond_forces_N(const BondSystem& bonds, const QuasiStaticState& state);

/// Of each sphere the largest |force| among its bonds, N.
[[nodiscard]] std::vector<double> largest_bond_forces_N(const Network& network,
                                                        const Eigen::VectorXd& bond_force_N);

/// The displacements from rest, m, and their lengths.
[[nodiscard]] Eigen::Matrix3Xd displacements_m(const Organ& organ, const QuasiStaticState& state);

/// Writes a result to an HDF5 file and beside it, under the same name with the ending .xdmf, a
/// description that ParaView opens as a network in motion. Both appear whole or not at all; the
/// XDMF is written last. The contents are listed in docs/simulate.md. Throws Error(environment).
/// @return the XDMF file
std::filesystem::path write_simulation(const ExperimentScene& scene, const RunNetwork& network,
                                       const SimulationRun& run, const std::filesystem::path& path);

}  // namespace tpm
