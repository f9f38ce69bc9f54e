#pragma once
#include <cmath>

namespace tpm {

enum class ElongationShape {
  linear,  ///< W(l) = l
  cubic,   ///< W(l) = l (1 + (l/s)^2)
  sinh,    ///< W(l) = s sinh(l/s)
};

/// An odd, strictly increasing function W of a bond's elongation with slope 1 at rest, in m. Times
/// a stiffness it is an elastic force: U'(l) = k W(l) of an equilibrium potential, or the kernel
/// that branches act on.
struct ElongationFunction {
  ElongationShape shape = ElongationShape::linear;
  /// The stiffening length s, m, > 0: at l = s the slope is 4 times (cubic) or 1.54 times (sinh)
  /// that at rest. Without meaning for a linear function.
  double length_m = 0.0;

  [[nodiscard]] bool is_linear() const { return shape == ElongationShape::linear; }
  [[nodiscard]] bool operator==(const ElongationFunction& other) const {
    return shape == other.shape && (is_linear() || length_m == other.length_m);
  }

  /// W(l), m.
  [[nodiscard]] double value(double l) const {
    if (shape == ElongationShape::linear) return l;
    const double q = l / length_m;
    return shape == ElongationShape::cubic ? l * (1.0 + q * q) : length_m * std::sinh(q);
  }
  /// W'(l) >= 1.
  [[nodiscard]] double slope(double l) const {
    if (shape == ElongationShape::linear) return 1.0;
    const double q = l / length_m;
    return shape == ElongationShape::cubic ? 1.0 + 3.0 * q * q : std::cosh(q);
  }
  /// The derivative of W(l) by ln s, m.
  [[nodiscard]] double d_log_length(double l) const {
    if (shape == ElongationShape::linear) return 0.0;
    const double q = l / length_m;
    return shape == ElongationShape::cubic ? -2.0 * l * q * q
                                           : length_m * (std::sinh(q) - q * std::cosh(q));
  }
  /// The integral of W from 0 to l, m^2.
  [[nodiscard]] double integral(double l) const {
    if (shape == ElongationShape::linear) return 0.5 * l * l;
    const double q = l / length_m;
    if (shape == ElongationShape::cubic) return l * l * (0.5 + 0.25 * q * q);
    const double half = std::sinh(0.5 * q);
    return 2.0 * length_m * length_m * half * half;
  }
  /// The elongation l at which W(l) = w, m.
  [[nodiscard]] double inverse(double w) const {
    if (shape == ElongationShape::linear) return w;
    if (shape == ElongationShape::sinh) return length_m * std::asinh(w / length_m);
    // q + q^3 = w/s by hyperbolic functions (the one real root of a depressed cubic).
    const double root3 = std::sqrt(3.0);
    return length_m * (2.0 / root3) * std::sinh(std::asinh(1.5 * root3 * w / length_m) / 3.0);
  }
  /// Energy of a spring W that was stretched to l while its reference follows at w, m^2 (times a
  /// stiffness: J): P(l) + P*(w) - l w with P the integral of W and P* its Legendre transform.
  /// Non-negative, and 0 where w = W(l) (Fenchel-Young). For a linear function (l - w)^2/2.
  [[nodiscard]] double gap(double l, double w) const {
    if (shape == ElongationShape::linear) return 0.5 * (l - w) * (l - w);
    const double u = inverse(w);
    return integral(l) - integral(u) - (l - u) * w;
  }
};

}  // namespace tpm
