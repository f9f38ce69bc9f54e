#pragma once
#include "tpm/reduce/condensed_potential.hpp"

namespace tpm {

/// What the memory's motion needs, as polynomials of w: symmetric matrices in the axes of the
/// contact.
class CondensedMatrices {
 public:
  struct Values {
    Eigen::Matrix3d mobility = Eigen::Matrix3d::Zero();  ///< (J' g J)^-1, m/N
    Eigen::Matrix3d coupling = Eigen::Matrix3d::Zero();  ///< P' g P, N/m
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();    ///< energy of q, N/m
  };

  CondensedMatrices() = default;
  CondensedMatrices(const CondensedFrame& frame, std::span<const CondensedMetric> metrics);

  /// @param w_m local
  [[nodiscard]] Values at(const Eigen::Vector3d& w_m) const;

 private:
  CondensedFrame frame_;
  Eigen::Matrix<double, 18, Eigen::Dynamic> coefficients_;
};

/// All that does not depend on relaxation time and period.
struct CondensedFit {
  CondensedFrame frame;
  double depth_m = 0.0, tangential_m = 0.0;
  CondensedPotential potential;
  CondensedMatrices matrices;
  Eigen::Matrix3d mean_metric = Eigen::Matrix3d::Zero();    ///< of w over the samples
  Eigen::Matrix3d mean_energy = Eigen::Matrix3d::Zero();    ///< -d2Psi/dw du at u = w
  Eigen::Matrix3d mean_coupling = Eigen::Matrix3d::Zero();  ///< CondensedMatrices
  Eigen::Matrix3d mean_second = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d instantaneous = Eigen::Matrix3d::Zero();  ///< at rest, N/m, of the organ's axes
  Eigen::Matrix3d relaxed = Eigen::Matrix3d::Zero();
};

}  // namespace tpm
