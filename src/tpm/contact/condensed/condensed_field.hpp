#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "tpm/contact/condensed/condensed_monomials.hpp"
#include "tpm/contact/condensed/condensed_samples.hpp"

namespace tpm::contact {

/// Displacements of all spheres from few modes. Their amplitudes are polynomials of u and w, and
/// linear in q with polynomials of w. In single precision.
class CondensedField {
 public:
  static constexpr int kModes = 14;

  CondensedField() = default;
  /// @param rest 3 x n, m
  CondensedField(const CondensedFrame& frame, const Eigen::Matrix3Xd& rest,
                 std::span<const CondensedSample> samples,
                 std::span<const CondensedMetric> metrics);

  [[nodiscard]] Eigen::Index spheres() const { return spheres_; }
  /// @param u_m, w_m, q_m in the axes of the frame
  /// @param all 3 x n, m, in the coordinates of the organ
  void displacements(const Eigen::Vector3d& u_m, const Eigen::Vector3d& w_m,
                     const Eigen::Vector3d& q_m, Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept;

 private:
  static constexpr int kTangents = 15;  ///< monomials of the four tangents, to degree 2
  static constexpr int kDepths = 21;    ///< of the two depths, to degree 5
  static constexpr int kOfW = 10;       ///< of w, to degree 2, times each of q
  using Eight [[gnu::vector_size(8 * sizeof(float))]] = float;
  /// Of each mode; the last two are 0.
  struct Amplitudes {
    [[gnu::always_inline]] void add(float factor, const Amplitudes& other) {
      low += factor * other.low;
      high += factor * other.high;
    }
    Eight low, high;
  };

  [[nodiscard]] Amplitudes amplitudes(const Eigen::Vector3d& u_m, const Eigen::Vector3d& w_m,
                                      const Eigen::Vector3d& q_m) const noexcept;

  CondensedFrame frame_;
  Eigen::Index spheres_ = 0;
  std::vector<Amplitudes> terms_;   ///< in the order of condensed_monomials
  std::vector<Amplitudes> second_;  ///< of each of q, for each monomial of w; 1/m
  std::vector<float> modes_;        ///< by groups of 16 spheres: mode by mode; m
};

}  // namespace tpm::contact
