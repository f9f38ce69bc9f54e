#pragma once
#include <Eigen/Core>
#include <vector>

#include "tpm/reduce/condensed_monomials.hpp"
#include "tpm/reduce/condensed_samples.hpp"

namespace tpm {

/// Displacements of all spheres from few modes, whose amplitudes are polynomials of u and w. In
/// single precision.
class CondensedField {
 public:
  static constexpr int kMostModes = 24;
  static constexpr int kTerms = 21 + 4 * 15 + 10 * 6;

  CondensedField() = default;
  /// @param rest 3 x n, m
  CondensedField(const CondensedFrame& frame, const Eigen::Matrix3Xd& rest,
                 std::span<const CondensedSample> samples);

  [[nodiscard]] Eigen::Index spheres() const { return spheres_; }
  /// @param u_m, w_m in the axes of the frame
  /// @param all 3 x n, m, in the coordinates of the organ
  void displacements(const Eigen::Vector3d& u_m, const Eigen::Vector3d& w_m,
                     Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept;

 private:
  /// A monomial is an earlier one times a coordinate.
  struct Step {
    int parent, coordinate;
  };
  CondensedFrame frame_;
  Eigen::Index spheres_ = 0;
  std::vector<Step> steps_;
  Eigen::MatrixXf amplitude_;  ///< kMostModes x kTerms
  std::vector<float> modes_;   ///< by groups of 16 spheres: mode by mode
};

}  // namespace tpm
