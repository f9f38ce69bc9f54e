#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "tpm/contact/condensed/condensed_monomials.hpp"
#include "tpm/contact/condensed/condensed_samples.hpp"

namespace tpm::contact {

/// Psi(u, w) as a polynomial, fitted to values, gradients and second derivatives of samples.
/// Displacements are local (CondensedFrame).
class CondensedPotential {
 public:
  /// Value and gradient.
  struct Gradient {
    double value_J = 0.0;
    Eigen::Vector3d by_u_N = Eigen::Vector3d::Zero(), by_w_N = Eigen::Vector3d::Zero();
  };

  CondensedPotential() = default;
  /// Least squares; at rest value and gradient are 0 exactly.
  /// @param samples in the coordinates of the organ
  CondensedPotential(const CondensedFrame& frame, std::span<const CondensedSample> samples);

  /// Largest difference of force from a sample, N.
  [[nodiscard]] double worst_N() const { return worst_N_; }
  [[nodiscard]] Gradient gradient(const Eigen::Vector3d& u_m, const Eigen::Vector3d& w_m) const;

  /// Of condensed_monomials(kCondensedDegrees).
  [[nodiscard]] const std::vector<double>& coefficients() const { return coefficients_; }

 private:
  CondensedFrame frame_;
  std::vector<CondensedExponents> monomials_;
  std::vector<double> coefficients_;
  double worst_N_ = 0.0;
};

}  // namespace tpm::contact
