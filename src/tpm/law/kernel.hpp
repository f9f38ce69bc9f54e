#pragma once
#include <array>
#include <optional>

#include "tpmkit/law.hpp"

namespace tpm::law {

/// T(u) = u phi(u)/phi(u_ref), phi = 1 - cos(arctan(u/x)): the pull of the neighbour bonds, scaled
/// so that T(u_ref) = u_ref. The spacing x may be infinite (T = u^3/u_ref^2).
struct TensionShape {
  double reference;
  double spacing;

  struct Values {
    double value, slope, d_spacing;
  };
  /// u >= 0
  [[nodiscard]] Values at(double u) const;

  /// T'(u) and its derivative by the spacing.
  struct Tangent {
    double slope, d_spacing;
  };
  [[nodiscard]] Tangent tangent(double u) const;
};

/// V(u) = (1 - share) V0(u) + share T(u) for u >= 0, V0 the Kernel: what the relaxation acts on.
/// V(0) = 0, V rises strictly, and V(u_ref) = u_ref.
class KernelShape {
 public:
  /// @param exponent used by Kernel::power
  /// @param tension_share nothing for a law without relaxing tension: derivatives by it are then 0
  KernelShape(Kernel kernel, double reference, double exponent, std::optional<double> tension_share,
              double spacing);

  struct Values {
    double value, slope, d_exponent, d_share, d_spacing;
  };
  [[nodiscard]] Values at(double u) const;
  [[nodiscard]] double value(double u) const;
  /// V'(u) for u > 0.
  [[nodiscard]] double slope(double u) const;
  /// V'(u) for u >= 0, just inside the contact at 0, and its derivatives.
  struct Tangent {
    double slope, d_exponent, d_share, d_spacing;
  };
  [[nodiscard]] Tangent tangent(double u) const;
  /// Both at once.
  struct Jet {
    Values values;
    Tangent tangent;
  };
  [[nodiscard]] Jet jet(double u) const;
  /// Error of the polynomial of fourth degree through V at five evenly spaced depths from a to b,
  /// at 1/8 and 7/8 of the way, where it is largest. a, b >= 0
  [[nodiscard]] double quartic_error(double a, double b) const;
  /// u with value(u) = v; v >= 0
  [[nodiscard]] double inverse(double v) const;
  /// V is a straight line: histories need no refinement.
  [[nodiscard]] bool is_linear() const { return kernel_ == Kernel::linear && share_ == 0.0; }

 private:
  Kernel kernel_;
  double reference_;
  double exponent_;
  bool has_share_;
  double share_;
  TensionShape tension_;
};

/// The kernel at 1/4, 1/2 and 3/4 between two depths from its values and slopes at both: cubic
/// interpolation, for depths that differ by so little (kCubicPart) that it holds to 1e-10.
struct KernelBetween {
  std::array<double, 3> value;
  std::array<double, 3> slope;  ///< dV/du
};
inline constexpr double kCubicPart = 3e-3;  ///< of the smaller depth
[[nodiscard]] KernelBetween kernel_between(double depth_change, double v0, double slope0, double v1,
                                           double slope1);

}  // namespace tpm::law
