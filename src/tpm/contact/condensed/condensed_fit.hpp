#pragma once
#include "tpm/base/namespaces.hpp"
#include "tpm/contact/condensed/condensed_field.hpp"
#include "tpm/contact/condensed/condensed_potential.hpp"
#include "tpm/contact/condensed/condensed_tables.hpp"

namespace tpm::contact {

/// Matrices of the motion of the viscous state, as polynomials of w: symmetric matrices in the axes
/// of the contact.
class CondensedMatrices {
 public:
  /// Powers of the depth up to 4, each tangent times those up to 2, products of the tangents.
  static constexpr int kTerms = 5 + 2 * 3 + 3;

  CondensedMatrices(const CondensedFrame& frame, std::span<const CondensedMetric> metrics);

  /// Rows: entries 00, 11, 22, 01, 02, 12 of the mobility (J' g J)^-1, m/N, the coupling P' g P,
  /// N/m, and the energy of q, N/m. Columns: terms.
  [[nodiscard]] const Eigen::Matrix<double, 18, Eigen::Dynamic>& coefficients() const {
    return coefficients_;
  }

 private:
  Eigen::Matrix<double, 18, Eigen::Dynamic> coefficients_;
};

/// The polynomials as a step reads them.
[[nodiscard]] CondensedTables condensed_tables(const CondensedFrame& frame,
                                               const CondensedPotential& potential,
                                               const CondensedMatrices& matrices);

/// All that does not depend on relaxation time and period.
struct CondensedFit {
  CondensedFrame frame;
  double least_depth_m = 0.0, most_depth_m = 0.0, most_tangential_m = 0.0;  ///< sampled
  CondensedTables tables;
  CondensedField field;
  Eigen::Index contact = 0;
  double fit_error_N = 0.0;  ///< largest difference of force from a sample
  double lag_error_N = 0.0;  ///< per condensed_lag(), found by condensed_lag_error_N()
  /// Largest coupling to the second mode over the range, N/m: along the push and across.
  double coupling_along = 0.0, coupling_across = 0.0;
  Eigen::Matrix3d mean_metric = Eigen::Matrix3d::Zero();    ///< of w over the samples
  Eigen::Matrix3d mean_energy = Eigen::Matrix3d::Zero();    ///< -d2Psi/dw du at u = w
  Eigen::Matrix3d mean_coupling = Eigen::Matrix3d::Zero();  ///< CondensedMatrices
  Eigen::Matrix3d mean_second = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d instantaneous = Eigen::Matrix3d::Zero();  ///< at rest, N/m, of the organ's axes
  Eigen::Matrix3d equilibrium = Eigen::Matrix3d::Zero();
};

}  // namespace tpm::contact
