#pragma once
#include <string>
#include <vector>

#include "tpm/organ/run/simulation.hpp"

namespace tpm::organ {

/// Numbers that files give for each sphere or bond.
struct StepField {
  std::string name;            ///< with its unit
  std::size_t columns = 1;     ///< 1 or 3
  std::vector<double> values;  ///< row after row
};

/// Fields of an output besides positions.
struct StepFields {
  std::vector<StepField> of_spheres;
  std::vector<std::int32_t> validity;  ///< ValidityWatch::flags of each sphere
  std::vector<StepField> of_bonds;
};

/// The numbers of a matrix, column after column.
[[nodiscard]] std::vector<double> list_of(const Eigen::MatrixXd& numbers);

/// The name of the viscous elongations of a branch: viscous_m if there is one, else
/// viscous_1_m and so on.
[[nodiscard]] std::string viscous_name(Eigen::Index branch, Eigen::Index branches);

/// Those that the scene asks for.
/// @param watch of the scene
[[nodiscard]] StepFields fields_of(const ExperimentScene& scene, const RunNetwork& network,
                                   const ValidityWatch& watch, const QuasiStaticState& state);

/// Forces of the bonds of a network in a state, N: positive when a bond is in tension.
[[nodiscard]] Eigen::VectorXd bond_forces_N(const BondSystem& bonds, const QuasiStaticState& state);

/// Of each sphere the largest |force| among its bonds, N.
[[nodiscard]] std::vector<double> largest_bond_forces_N(const Network& network,
                                                        const Eigen::VectorXd& bond_force_N);

/// The displacements of the spheres from rest, m.
[[nodiscard]] Eigen::Matrix3Xd displacements_m(const RunNetwork& network,
                                               const QuasiStaticState& state);

}  // namespace tpm::organ
