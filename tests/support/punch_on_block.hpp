#pragma once
// A cube of a cubic lattice on a rigid ground, under a glued flat punch: for studies of refinement.
#include <cmath>

#include "indentation.hpp"
#include "tpm/organ/balance/large_equilibrium.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::organ {
enum class PunchShape { square, round };

struct PunchOnBlock {
  double side_m = 0.16;   ///< of the cube
  double punch_m = 0.08;  ///< side of a square, diameter of a round punch
  PunchShape shape = PunchShape::square;
  StiffnessRule rule = StiffnessRule::per_bond;
  SpacingLaw law = SpacingLaw::continuum;
};

inline bool is_below(const PunchOnBlock& scene, const Eigen::Vector2d& from_axis) {
  const double half = 0.5 * scene.punch_m + 1e-9 * scene.side_m;
  return scene.shape == PunchShape::square ? from_axis.cwiseAbs().maxCoeff() <= half
                                           : from_axis.norm() <= half;
}

/// Force per depth of the punch on a cube of cells^3 cells, N/m.
inline double punch_stiffness(const PunchOnBlock& scene, int cells) {
  NetworkOptions options;
  options.rule = scene.rule;
  options.spacing_law = scene.law;
  const double x = scene.side_m / cells;
  const Network network =
      build_network(block(cells, cells, cells, x, Lattice::cubic), options, "punch on a block");
  const BondSystem bonds(network, TpmParameters{});
  Constraints constraints(network.organ.size());
  std::vector<std::size_t> patch;
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    const Eigen::Vector3d p = network.organ.position.col(static_cast<Eigen::Index>(i));
    const bool on_top = p.z() > scene.side_m - 0.5 * x;
    const Eigen::Vector2d from_axis = p.head<2>().array() - 0.5 * scene.side_m;
    const bool below_punch = on_top && is_below(scene, from_axis);
    if (below_punch) patch.push_back(i);
    if (below_punch || p.z() < 0.5 * x) constraints.fix(i);
  }
  LargeEquilibrium solver(bonds, constraints, network.organ.position);
  return punch_stiffness(solver, network.organ.position, patch, -Eigen::Vector3d::UnitZ(), 0.0,
                         1e-7);
}

/// Order and limit of a quantity that was computed at spacings falling by a constant ratio, from
/// three in a row (Richardson): q(x) = limit + c x^order.
struct Richardson {
  double order, limit;
};

inline Richardson richardson(double coarse, double middle, double fine, double ratio) {
  const double factor = (coarse - middle) / (middle - fine);
  return {std::log(factor) / std::log(ratio), fine - (middle - fine) / (factor - 1.0)};
}

/// The limit of limit + b x + c x^2 from three spacings that halve: faces and edges of a block.
inline double polynomial_limit(double coarse, double middle, double fine) {
  return (8.0 * fine - 6.0 * middle + coarse) / 3.0;
}

}  // namespace tpm::organ
