#include "patch_test.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>

#include "tpm/organ/balance/equilibrium.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

using Voigt = Eigen::Matrix<double, 6, 1>;

/// The components of a symmetric tensor a b as a stress is written.
Voigt stress_like(const Eigen::Matrix3d& t) {
  Voigt v;
  v << t(0, 0), t(1, 1), t(2, 2), 0.5 * (t(1, 2) + t(2, 1)), 0.5 * (t(0, 2) + t(2, 0)),
      0.5 * (t(0, 1) + t(1, 0));
  return v;
}

/// The displacement gradient without rotation of a unit strain.
Eigen::Matrix3d unit_strain(Eigen::Index component) {
  Eigen::Matrix3d strain = Eigen::Matrix3d::Zero();
  if (component < 3) {
    strain(component, component) = 1.0;
  } else {
    const Eigen::Index i = (component - 2) % 3;
    const Eigen::Index j = (component - 1) % 3;
    strain(i, j) = strain(j, i) = 0.5;
  }
  return strain;
}

Eigen::AlignedBox3d box_of(const Organ& organ) {
  return {organ.position.rowwise().minCoeff(), organ.position.rowwise().maxCoeff()};
}

/// 1 for every sphere of a list, else 0.
std::vector<int> counted(std::span<const std::size_t> spheres, std::size_t size) {
  std::vector<int> is_in(size, 0);
  for (const std::size_t i : spheres) is_in.at(i) = 1;
  return is_in;
}

ViscousState state_at_rest(const BondSystem& bonds, double relaxation_factor) {
  return {Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())), relaxation_factor};
}

/// The first-order displacements of a network at rest, some imposed and the rest in balance.
class LinearBlock {
 public:
  LinearBlock(const Network& network, const BondSystem& bonds, double relaxation_factor,
              Constraints constraints)
      : rest_(network.organ.position),
        viscous_state_(state_at_rest(bonds, relaxation_factor)),
        bonds_(bonds),
        constraints_(std::move(constraints)),
        equilibrium_(bonds_, constraints_) {
    if (!equilibrium_.factorise(rest_, viscous_state_) || !equilibrium_.is_stable()) {
      throw Error(ExitCode::numerical, "patch test", "the block has loose spheres");
    }
  }

  /// @param displacement with what is imposed in place
  void balance(Eigen::Matrix3Xd& displacement) const {
    Eigen::Matrix3Xd left = forces(displacement);
    equilibrium_.displace(left);
    displacement += left;
  }
  /// Force of the bonds on each sphere, N per unit of the displacement.
  [[nodiscard]] Eigen::Matrix3Xd forces(const Eigen::Matrix3Xd& displacement) const {
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest_.cols());
    bonds_.add_stiffness_times(rest_, viscous_state_, displacement, force);
    return -force;
  }

 private:
  const Positions& rest_;
  ViscousState viscous_state_;
  const BondSystem& bonds_;
  Constraints constraints_;
  Equilibrium equilibrium_;
};

/// Stress of some spheres, half of each of their bonds, under first-order displacements.
Voigt virial_stress(const Network& network, const BondSystem& bonds, double relaxation_factor,
                    std::span<const int> is_in, double volume,
                    const Eigen::Matrix3Xd& displacement) {
  Eigen::VectorXd change;
  bonds.elongation_changes(network.organ.position, displacement, change);
  const Eigen::VectorXd pull =
      (bonds.stiffness() - relaxation_factor * bonds.relaxing()).cwiseProduct(change);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < network.bonds.size(); ++i) {
    const Bond& bond = network.bonds[i];
    const double share = 0.5 * (is_in[bond.a] + is_in[bond.b]);
    if (share == 0.0) continue;
    const Eigen::Vector3d along =
        network.organ.position.col(bond.b) - network.organ.position.col(bond.a);
    sum += (share * pull[static_cast<Eigen::Index>(i)] / bond.rest_length_m) * along *
           along.transpose();
  }
  return stress_like(sum / volume);
}

/// The uniform gradient nearest to a displacement field, least squares over all spheres.
Eigen::Matrix3d mean_gradient(const Positions& rest, const Eigen::Matrix3Xd& displacement) {
  const Eigen::Matrix3Xd from = rest.colwise() - rest.rowwise().mean();
  const Eigen::Matrix3Xd moved = displacement.colwise() - displacement.rowwise().mean();
  return moved * from.transpose() * (from * from.transpose()).inverse();
}

}  // namespace

Moduli moduli_of(const Elasticity& c) {
  const Eigen::LLT<Elasticity> factor(c);
  if (factor.info() != Eigen::Success) {
    throw Error(ExitCode::numerical, "patch test", "the elasticity is not positive definite");
  }
  const Elasticity s = factor.solve(Elasticity::Identity());
  Moduli m;
  m.young_Pa = s.diagonal().head<3>().cwiseInverse();
  m.shear_Pa = s.diagonal().tail<3>().cwiseInverse();
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) m.poisson(i, j) = -s(i, j) / s(i, i);
    m.volume_change[i] = s.col(i).head<3>().sum() / s(i, i);
  }
  const double c11 = c.diagonal().head<3>().mean();
  const double c12 = (c(0, 1) + c(0, 2) + c(1, 2)) / 3.0;
  m.bulk_Pa = (c11 + 2.0 * c12) / 3.0;
  m.anisotropy = 2.0 * c.diagonal().tail<3>().mean() / (c11 - c12);
  return m;
}

Elasticity affine_elasticity(const Network& network, const BondSystem& bonds,
                             double relaxation_factor, std::span<const std::size_t> spheres,
                             double volume_m3) {
  const std::vector<int> is_in = counted(spheres, network.organ.size());
  Elasticity sum = Elasticity::Zero();
  for (std::size_t i = 0; i < network.bonds.size(); ++i) {
    const Bond& bond = network.bonds[i];
    const double share = 0.5 * (is_in[bond.a] + is_in[bond.b]);
    if (share == 0.0) continue;
    const Eigen::Vector3d along =
        network.organ.position.col(bond.b) - network.organ.position.col(bond.a);
    const Voigt nn = stress_like(along * along.transpose() / (bond.rest_length_m));
    const auto row = static_cast<Eigen::Index>(i);
    sum += share * (bonds.stiffness()[row] - relaxation_factor * bonds.relaxing()[row]) * nn *
           nn.transpose();
  }
  return sum / volume_m3;
}

std::vector<std::size_t> interior_spheres(const Organ& organ, double margin_m) {
  const Eigen::AlignedBox3d box = box_of(organ);
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    const Eigen::Vector3d p = organ.position.col(static_cast<Eigen::Index>(i));
    const double depth = std::min((p - box.min()).minCoeff(), (box.max() - p).minCoeff());
    if (depth > margin_m) found.push_back(i);
  }
  return found;
}

PatchTest affine_patch_test(const Network& block, const BondSystem& bonds, double relaxation_factor,
                            double margin_m, double volume_per_sphere_m3) {
  const std::vector<std::size_t> interior = interior_spheres(block.organ, margin_m);
  if (interior.empty()) {
    throw bad_input(
        "patch test",
        fmt::format("no sphere of {} lies deeper than {} m", block.organ.name, margin_m),
        "a larger block");
  }
  const std::vector<int> is_in = counted(interior, block.organ.size());
  Constraints constraints(block.organ.size());
  for (std::size_t i = 0; i < is_in.size(); ++i) {
    if (is_in[i] == 0) constraints.fix(i);
  }
  const LinearBlock linear(block, bonds, relaxation_factor, constraints);
  const double volume = volume_per_sphere_m3 * static_cast<double>(interior.size());
  const Positions from = block.organ.position.colwise() - box_of(block.organ).center();

  PatchTest result;
  result.interior = interior.size();
  for (Eigen::Index component = 0; component < 6; ++component) {
    const Eigen::Matrix3Xd affine = unit_strain(component) * from;
    Eigen::Matrix3Xd displacement = affine;
    constraints.project(displacement);
    displacement = affine - displacement;  // only the boundary moves yet
    linear.balance(displacement);
    result.elasticity.col(component) =
        virial_stress(block, bonds, relaxation_factor, is_in, volume, displacement);
    const double off = (displacement - affine).colwise().norm().maxCoeff();
    result.deviation = std::max(result.deviation, off / affine.colwise().norm().maxCoeff());
  }
  return result;
}

PlateTest plate_test(const Network& block, const BondSystem& bonds, double relaxation_factor) {
  const Eigen::AlignedBox3d box = box_of(block.organ);
  const double tolerance_m = 1e-6 * block.organ.spacing;
  Constraints constraints(block.organ.size());
  std::vector<Eigen::Index> top;
  Eigen::Matrix3Xd displacement = Eigen::Matrix3Xd::Zero(3, block.organ.position.cols());
  for (std::size_t i = 0; i < block.organ.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d p = block.organ.position.col(column);
    const bool is_top = p.z() > box.max().z() - tolerance_m;
    const bool is_bottom = p.z() < box.min().z() + tolerance_m;
    if (is_top || is_bottom) constraints.impose(i, Eigen::Vector3d::UnitZ());
    // The rigid motions that smooth plates leave: one corner stands, another may only slide along
    // x.
    if (is_bottom && p.y() < box.min().y() + tolerance_m) {
      if (p.x() < box.min().x() + tolerance_m) constraints.fix(i);
      if (p.x() > box.max().x() - tolerance_m) constraints.impose(i, Eigen::Vector3d::UnitY());
    }
    if (!is_top) continue;
    displacement(2, column) = -box.sizes().z();  // a compression of 1
    top.push_back(column);
  }
  const LinearBlock linear(block, bonds, relaxation_factor, constraints);
  linear.balance(displacement);
  const Eigen::Matrix3Xd force = linear.forces(displacement);
  PlateTest result;
  for (const Eigen::Index i : top) result.young_Pa += force(2, i);
  result.young_Pa /= box.sizes().x() * box.sizes().y();
  const Eigen::Matrix3d gradient = mean_gradient(block.organ.position, displacement);
  result.poisson = gradient.diagonal().head<2>();
  result.volume_change = 1.0 - result.poisson.sum();
  return result;
}

}  // namespace tpm::organ
