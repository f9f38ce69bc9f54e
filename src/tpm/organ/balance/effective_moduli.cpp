#include "tpm/organ/balance/effective_moduli.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/organ/balance/equilibrium.hpp"
#include "tpm/organ/body/lattice.hpp"

namespace tpm::organ {
namespace {

using Eigen::Index;

constexpr double kHalfBox = 4.5;  // of the block, in spacings
constexpr std::size_t kFewest = 8;

/// The block: which spheres are free, and which belong to its shell.
struct InnerBlock {
  Eigen::Vector3d centre;
  std::vector<bool> free;
  std::size_t count = 0;  ///< of free ones
};

/// Layers lie flat one on another, as in a block of cells: the first covers the top alone.
bool is_stack(const Organ& organ) {
  return (organ.normal.colwise() - organ.normal.col(0)).isZero(0.0);
}

/// The deepest sphere; of a stack that nearest to the middle.
Index middle_of(const Organ& organ) {
  Index middle = std::max_element(organ.layer.begin(), organ.layer.end()) - organ.layer.begin();
  if (!is_stack(organ)) return middle;
  const Eigen::Vector3d centre =
      0.5 * (organ.position.rowwise().minCoeff() + organ.position.rowwise().maxCoeff());
  (organ.position.colwise() - centre).colwise().squaredNorm().minCoeff(&middle);
  return middle;
}

/// Spheres at the surface: of a stack those with fewer bonds than the others.
std::vector<bool> at_surface(const Network& network) {
  const Organ& organ = network.organ;
  std::vector<bool> surface(organ.size());
  for (std::size_t i = 0; i < organ.size(); ++i) surface[i] = organ.layer[i] == 0;
  if (!is_stack(organ)) return surface;
  std::vector<int> bonds(organ.size(), 0);
  for (const Bond& bond : network.bonds) {
    ++bonds[bond.a];
    ++bonds[bond.b];
  }
  const int most = *std::max_element(bonds.begin(), bonds.end());
  for (std::size_t i = 0; i < organ.size(); ++i) surface[i] = bonds[i] < most;
  return surface;
}

InnerBlock inner_block(const Network& network) {
  const Organ& organ = network.organ;
  InnerBlock block;
  block.centre = organ.position.col(middle_of(organ));
  block.free.resize(organ.size());
  const std::vector<bool> surface = at_surface(network);
  const double reach = (kHalfBox - 1.01 * network.options.support) * organ.spacing;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    const Eigen::Vector3d from = organ.position.col(static_cast<Index>(i)) - block.centre;
    block.free[i] = organ.layer[i] >= 2 && !surface[i] && from.cwiseAbs().maxCoeff() <= reach;
  }
  // Bonds to the surface are not the inside's.
  for (const Bond& bond : network.bonds) {
    if (surface[bond.a]) block.free[bond.b] = false;
    if (surface[bond.b]) block.free[bond.a] = false;
  }
  block.count = static_cast<std::size_t>(std::count(block.free.begin(), block.free.end(), true));
  return block;
}

/// m^3 a sphere, where every free one has as many nearest neighbours as one lattice.
std::optional<double> volume_of_sphere(const Network& network, const InnerBlock& block) {
  std::vector<int> nearest(network.organ.size(), 0);
  for (const Bond& bond : network.bonds) {
    if (std::abs(bond.rest_length_m / network.organ.spacing - 1.0) > 1e-3) continue;
    ++nearest[bond.a];
    ++nearest[bond.b];
  }
  int found = 0;
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    if (!block.free[i]) continue;
    if (found != 0 && nearest[i] != found) return std::nullopt;
    found = nearest[i];
  }
  for (const auto& [lattice, neighbours] :
       {std::pair(Lattice::cubic, 6), {Lattice::bcc, 8}, {Lattice::fcc, 12}}) {
    if (found == neighbours) return volume_per_sphere(lattice, network.organ.spacing);
  }
  return std::nullopt;
}

Eigen::Matrix3d unit_strain(Index component) {
  Eigen::Matrix3d strain = Eigen::Matrix3d::Zero();
  if (component < 3) {
    strain(component, component) = 1.0;
  } else {
    strain((component - 2) % 3, (component - 1) % 3) = 0.5;
    strain((component - 1) % 3, (component - 2) % 3) = 0.5;
  }
  return strain;
}

/// Mean stress over the block, from the changes of its bonds' lengths: each bond counts with the
/// share of its ends that lie in the block.
Eigen::Matrix3d mean_stress(const Network& network, const InnerBlock& block,
                            const Eigen::VectorXd& stiffness, const Eigen::VectorXd& change,
                            double volume_of_sphere_m3) {
  const Positions& position = network.organ.position;
  Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < network.bonds.size(); ++i) {
    const Bond& bond = network.bonds[i];
    const double share = 0.5 * ((block.free[bond.a] ? 1 : 0) + (block.free[bond.b] ? 1 : 0));
    if (share == 0.0) continue;
    const Eigen::Vector3d along = position.col(bond.b) - position.col(bond.a);
    const auto row = static_cast<Index>(i);
    stress +=
        (share * stiffness[row] * change[row] / bond.rest_length_m) * along * along.transpose();
  }
  return stress / (volume_of_sphere_m3 * static_cast<double>(block.count));
}

/// None where the elasticity is not positive definite.
std::optional<EffectiveModuli> moduli_of(const Eigen::Matrix<double, 6, 6>& elasticity) {
  const std::optional<Eigen::MatrixXd> inverse = positive_inverse(elasticity);
  if (!inverse) return std::nullopt;
  const Eigen::MatrixXd& compliance = *inverse;
  EffectiveModuli moduli;
  moduli.young_Pa = compliance.diagonal().head<3>().cwiseInverse();
  for (Index i = 0; i < 3; ++i) {
    for (Index j = 0; j < 3; ++j) {
      if (i != j) moduli.poisson -= compliance(i, j) / compliance(i, i) / 6.0;
    }
  }
  const double c11 = elasticity.diagonal().head<3>().mean();
  const double c12 = (elasticity(0, 1) + elasticity(0, 2) + elasticity(1, 2)) / 3.0;
  moduli.anisotropy = 2.0 * elasticity.diagonal().tail<3>().mean() / (c11 - c12);
  return moduli;
}

}  // namespace

std::optional<EffectiveModuli> effective_moduli(const Network& network, const BondSystem& bonds,
                                                double relaxation_factor) {
  const Organ& organ = network.organ;
  if (organ.layer_count() < 3) return std::nullopt;
  const InnerBlock block = inner_block(network);
  if (block.count < kFewest) return std::nullopt;
  const auto volume_m3 = volume_of_sphere(network, block);
  if (!volume_m3) return std::nullopt;

  Constraints constraints(organ.size());
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (!block.free[i]) constraints.fix(i);
  }
  const ViscousState state{Eigen::VectorXd::Zero(static_cast<Index>(bonds.size())),
                           relaxation_factor};
  Equilibrium equilibrium(bonds, constraints);
  if (!equilibrium.factorise(organ.position, state) || !equilibrium.is_stable()) {
    return std::nullopt;
  }
  const Eigen::VectorXd stiffness = bonds.stiffness_when(relaxation_factor);
  Eigen::Matrix<double, 6, 6> elasticity;
  for (Index component = 0; component < 6; ++component) {
    Eigen::Matrix3Xd moved = unit_strain(component) * (organ.position.colwise() - block.centre);
    Eigen::Matrix3Xd left = Eigen::Matrix3Xd::Zero(3, moved.cols());
    bonds.add_stiffness_times(organ.position, state, moved, left);
    left = -left;
    constraints.project(left);
    equilibrium.displace(left);
    moved += left;
    Eigen::VectorXd change;
    bonds.elongation_changes(organ.position, moved, change);
    const Eigen::Matrix3d stress = mean_stress(network, block, stiffness, change, *volume_m3);
    elasticity.col(component) << stress(0, 0), stress(1, 1), stress(2, 2), stress(1, 2),
        stress(0, 2), stress(0, 1);
  }
  std::optional<EffectiveModuli> moduli = moduli_of(0.5 * (elasticity + elasticity.transpose()));
  if (moduli) moduli->spheres = block.count;
  return moduli;
}

}  // namespace tpm::organ
