#pragma once
#include <span>

#include "tpm/organ/bonds/network.hpp"

namespace tpm::organ {

/// Distance, m, by which each sphere stands out of the smooth continuation of its neighbours'
/// displacements:
///
///     r_i = n_i . u_i - (c at i),   c + g . t_j the least-squares fit of n_i . u_j over its
///                                   lateral neighbours j, t_j their place in the plane across n_i
///
/// with n_i the outward normal at rest. On a regular ring of neighbours the fit's value at i is
/// their mean, and r_i the umbrella Laplacian with its sign turned (Kobbelt et al. 1998), that is
/// -a^2/4 times the Laplacian of the normal displacement; the gradient makes it exact for linear
/// displacements at irregular and one-sided neighbourhoods too, as linear precision asks of a
/// discrete Laplacian (Wardetzky et al. 2007). It is 0 for translations and infinitesimal
/// rotations of the organ, and does not depend on numbering or on a rigid motion of the scene.
///
/// Spheres without lateral neighbours have 0; where neighbours do not determine the gradient it is
/// the smallest that fits.
///
/// Linear in displacements: the shares of the neighbours are found once.
class Unevenness {
 public:
  Unevenness(const Network& network, std::span<const std::size_t> spheres);
  /// @param displacement from the organ's positions, m
  /// @return one number a sphere, m, in the order of the spheres
  [[nodiscard]] Eigen::VectorXd of(const Eigen::Matrix3Xd& displacement) const;

 private:
  struct Stencil {
    Eigen::Index sphere = 0;
    Eigen::Vector3d normal;
    std::vector<std::uint32_t> neighbours;
    Eigen::VectorXd share;  ///< of each neighbour
  };
  std::vector<Stencil> stencils_;
};

/// Root mean square of the unevenness over some spheres, over the largest displacement of any
/// sphere; dimensionless. 0 for a smooth (linear) displacement.
/// Throws Error(bad_input) for an empty list of spheres, or if nothing has moved.
[[nodiscard]] double roughness(const Network& network, const Eigen::Matrix3Xd& displacement,
                               std::span<const std::size_t> spheres);
/// The same for many displacements of one network.
[[nodiscard]] double roughness(const Unevenness& spheres, const Eigen::Matrix3Xd& displacement);

/// The spheres of a layer that lateral bonds reach from one sphere in at most so many steps, that
/// one included; rising.
[[nodiscard]] std::vector<std::size_t> spheres_around(const Network& network, std::size_t sphere,
                                                      int steps);

/// The spheres of the outer layer at its sharp edges: those whose normal differs from those of
/// their lateral neighbours by more than `angle_rad` in the mean; rising. A closed layer has no
/// other edge.
[[nodiscard]] std::vector<std::size_t> spheres_at_rim(const Network& network, double angle_rad);

}  // namespace tpm::organ
