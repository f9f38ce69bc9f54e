#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "tpm/reduce/condensed_samples.hpp"

namespace tpm {

/// Axes and scales of the contact: p along the push, scaled to -1..1 over the depths of the fit,
/// and two tangential coordinates in units of the largest tangential displacement.
struct CondensedFrame {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< columns: into the tissue, two tangents
  double middle_depth_m = 0.0, half_depth_m = 1.0;
  double tangential_m = 1.0;

  /// In the axes, m, from a displacement in the coordinates of the organ.
  [[nodiscard]] Eigen::Vector3d local(const Eigen::Vector3d& displacement_m) const {
    return axes.transpose() * displacement_m;
  }
};

/// How the potential is expanded: of the monomials in the four tangential coordinates of u and w
/// of degree b, those times the monomials in the two depths up to degree depth_degree[b].
inline constexpr std::array<int, 4> kCondensedDegrees{7, 5, 3, 1};

/// Psi(u, w) as a polynomial, fitted to values, gradients and second derivatives of samples.
/// Displacements are local (CondensedFrame).
class CondensedPotential {
 public:
  static constexpr int kDepthPower = kCondensedDegrees[0];
  /// Monomials in the two depths up to a degree.
  static constexpr int depth_terms(int degree) { return (degree + 1) * (degree + 2) / 2; }

  /// Value and gradient.
  struct Gradient {
    double value_J = 0.0;
    Eigen::Vector3d by_u_N = Eigen::Vector3d::Zero(), by_w_N = Eigen::Vector3d::Zero();
  };

  CondensedPotential() = default;
  /// Least squares; at rest value and gradient are 0 exactly.
  /// @param samples in the coordinates of the organ
  CondensedPotential(const CondensedFrame& frame, std::span<const CondensedSample> samples);

  [[nodiscard]] Gradient gradient(const Eigen::Vector3d& u_m, const Eigen::Vector3d& w_m) const;

 private:
  CondensedFrame frame_;
  std::vector<double> coefficients_;
};

/// Exponents of the six coordinates: depths of u and w, tangents of u, tangents of w.
using CondensedExponents = std::array<int, 6>;
[[nodiscard]] std::vector<CondensedExponents> condensed_monomials();

}  // namespace tpm
