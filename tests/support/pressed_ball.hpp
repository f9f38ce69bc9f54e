#pragma once
// A solid ball that is pressed at places spread over its surface.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/balance/equilibrium.hpp"
#include "tpm/organ/bonds/network.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::test {
using namespace organ;

inline const std::array<Eigen::Vector3d, 5> kPushes{
    {{0.1, 0.2, 1.0}, {1.0, 0.1, -0.2}, {-0.3, 1.0, 0.4}, {-0.6, -0.5, 0.8}, {0.7, -0.6, -0.5}}};

/// Radius in spacings of the disc that a sphere of an even layer stands for.
inline const double kOfSphere = std::sqrt(std::sqrt(3.0) / (2.0 * std::numbers::pi));

/// The 24 turns that map the axes onto each other, and with them a lattice onto itself.
inline std::vector<Eigen::Matrix3d> turns() {
  std::vector<Eigen::Matrix3d> found;
  std::array<Eigen::Index, 3> axis{0, 1, 2};
  do {
    for (unsigned signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
      for (Eigen::Index i = 0; i < 3; ++i) {
        turn(i, axis[static_cast<std::size_t>(i)]) = (signs >> i & 1U) != 0 ? -1.0 : 1.0;
      }
      if (turn.determinant() > 0.0) found.push_back(turn);
    }
  } while (std::next_permutation(axis.begin(), axis.end()));
  return found;
}

/// Force over mean displacement under an even pressure on discs about one place of a ball about the
/// origin, N/m, instantaneous at rest, with the far 30 % of the depth fixed. A sphere at the rim
/// counts with its share.
/// @param of_long stiffness of the bonds beyond 1.2 spacings (in fcc those of second neighbours)
///   over what tpm gives them
inline std::vector<double> pressed_on_discs(const Organ& organ, double ball_m,
                                            const Eigen::Vector3d& towards,
                                            const std::vector<double>& radii_m,
                                            double of_long = 1.0) {
  constexpr double kLong = 1.2;  // spacings
  Network network = build_network(organ, {}, "ball");
  for (Bond& bond : network.bonds) {
    if (bond.rest_length_m > kLong * organ.spacing) bond.factor *= of_long;
  }
  const Positions& at = network.organ.position;
  const Eigen::Vector3d normal = towards.normalized();
  const auto outer = std::count(organ.layer.begin(), organ.layer.end(), 0);
  Constraints constraints(network.organ.size());
  for (Eigen::Index i = 0; i < at.cols(); ++i) {
    if (normal.dot(at.col(i)) < -0.4 * ball_m) constraints.fix(static_cast<std::size_t>(i));
  }
  const BondSystem bonds(network, TpmParameters{});
  Equilibrium equilibrium(bonds, constraints);
  if (!equilibrium.factorise(
          at, {Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())), 0.0})) {
    throw std::runtime_error("the ball is not stable");
  }
  std::vector<double> found;
  for (const double radius_m : radii_m) {
    Eigen::VectorXd share(outer);
    Eigen::Matrix3Xd field = Eigen::Matrix3Xd::Zero(3, at.cols());
    for (Eigen::Index i = 0; i < outer; ++i) {
      const double inside = radius_m - (at.col(i) - ball_m * normal).norm();
      share[i] = std::clamp(0.5 + 0.5 * inside / (kOfSphere * organ.spacing), 0.0, 1.0);
      field.col(i) = share[i] * normal;
    }
    equilibrium.displace(field);
    const double moved = share.dot((normal.transpose() * field.leftCols(outer)).transpose());
    found.push_back(share.sum() * share.sum() / moved);
  }
  return found;
}

}  // namespace tpm::test
