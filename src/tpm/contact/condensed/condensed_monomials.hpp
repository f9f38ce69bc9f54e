#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace tpm::contact {

/// Axes and scales of the contact: the depth p along the push, scaled to -1..1 over the depths of
/// the fit, and two tangential coordinates in units of the largest tangential displacement.
struct CondensedFrame {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< columns: into the tissue, two tangents
  double middle_depth_m = 0.0, half_depth_m = 1.0;
  double tangential_m = 1.0;

  /// In the axes, m, from a displacement in the coordinates of the organ.
  [[nodiscard]] Eigen::Vector3d local(const Eigen::Vector3d& displacement_m) const {
    return axes.transpose() * displacement_m;
  }
  /// Length that scales a coordinate of u or w: 0, 1 the depths of u and w.
  [[nodiscard]] double scale_m(int coordinate) const {
    return coordinate < 2 ? half_depth_m : tangential_m;
  }
};

/// Exponents of the six scaled coordinates: depths of u and w, tangents of u, tangents of w.
using CondensedExponents = std::array<int, 6>;

/// Where the coordinates of u and of w stand among the six.
inline constexpr std::array<int, 3> kCondensedOfU{0, 2, 3};
inline constexpr std::array<int, 3> kCondensedOfW{1, 4, 5};

/// Of the monomials in the four tangents of degree b, those times the monomials in the two depths
/// up to degree depth_degree[b].
[[nodiscard]] std::vector<CondensedExponents> condensed_monomials(
    std::span<const int> depth_degree);

/// Expansion of the potential: the degree in the depths, by that in the tangents.
inline constexpr std::array<int, 4> kCondensedDegrees{7, 5, 3, 1};

/// Powers of the six coordinates of a place, up to 7.
class CondensedPowers {
 public:
  /// @param u_m, w_m in the axes of the frame
  CondensedPowers(const CondensedFrame& frame, const Eigen::Vector3d& u_m,
                  const Eigen::Vector3d& w_m);

  /// A monomial differentiated by up to two scaled coordinates (-1: by none).
  [[nodiscard]] double monomial(CondensedExponents e, int by = -1, int again = -1) const;

 private:
  std::array<std::array<double, 8>, 6> of_{};
};

}  // namespace tpm::contact
