// The shapes that a bond's force usually has: straight, or steeper the farther the bond is
// stretched.
#include <cmath>

#include "tpmkit/elongation_function.hpp"

namespace tpm::law {
namespace {

class LinearShape final : public ElongationShape {
 public:
  using ElongationShape::ElongationShape;
  [[nodiscard]] double value(double l, const ShapeValues& /*p*/) const override { return l; }
  [[nodiscard]] double slope(double /*l*/, const ShapeValues& /*p*/) const override { return 1.0; }
  [[nodiscard]] double integral(double l, const ShapeValues& /*p*/) const override {
    return 0.5 * l * l;
  }
  [[nodiscard]] double derivative(double /*l*/, const ShapeValues& /*p*/,
                                  std::size_t /*k*/) const override {
    return 0.0;
  }
  [[nodiscard]] double inverse(double w, const ShapeValues& /*p*/) const override { return w; }
  [[nodiscard]] std::optional<double> cubic_per_m2(const ShapeValues& /*p*/) const override {
    return 0.0;
  }
  [[nodiscard]] bool is_linear() const override { return true; }
};

/// W(l) = l (1 + (l/s)^2): at l = s the slope is 4 times that at rest.
class CubicShape final : public ElongationShape {
 public:
  using ElongationShape::ElongationShape;
  [[nodiscard]] double value(double l, const ShapeValues& p) const override {
    const double q = l / p[0];
    return l * (1.0 + q * q);
  }
  [[nodiscard]] double slope(double l, const ShapeValues& p) const override {
    const double q = l / p[0];
    return 1.0 + 3.0 * q * q;
  }
  [[nodiscard]] double integral(double l, const ShapeValues& p) const override {
    const double q = l / p[0];
    return l * l * (0.5 + 0.25 * q * q);
  }
  [[nodiscard]] double derivative(double l, const ShapeValues& p,
                                  std::size_t /*k*/) const override {
    const double q = l / p[0];
    return -2.0 * q * q * q;
  }
  [[nodiscard]] double inverse(double w, const ShapeValues& p) const override {
    // q + q^3 = w/s by hyperbolic functions (the one real root of a depressed cubic).
    const double root3 = std::sqrt(3.0);
    return p[0] * (2.0 / root3) * std::sinh(std::asinh(1.5 * root3 * w / p[0]) / 3.0);
  }
  [[nodiscard]] std::optional<double> cubic_per_m2(const ShapeValues& p) const override {
    return 1.0 / (p[0] * p[0]);
  }
};

/// W(l) = s sinh(l/s): at l = s the slope is 1.54 times that at rest.
class SinhShape final : public ElongationShape {
 public:
  using ElongationShape::ElongationShape;
  [[nodiscard]] double value(double l, const ShapeValues& p) const override {
    return p[0] * std::sinh(l / p[0]);
  }
  [[nodiscard]] double slope(double l, const ShapeValues& p) const override {
    return std::cosh(l / p[0]);
  }
  [[nodiscard]] double integral(double l, const ShapeValues& p) const override {
    const double half = std::sinh(0.5 * l / p[0]);
    return 2.0 * p[0] * p[0] * half * half;
  }
  [[nodiscard]] double derivative(double l, const ShapeValues& p,
                                  std::size_t /*k*/) const override {
    const double q = l / p[0];
    return std::sinh(q) - q * std::cosh(q);
  }
  [[nodiscard]] double inverse(double w, const ShapeValues& p) const override {
    return p[0] * std::asinh(w / p[0]);
  }
};

std::vector<MaterialParameter> stiffening_length() {
  return {{"stiffening", Dimension::length, 0.0, true, "stiffening length s"}};
}

}  // namespace

ElongationShapes stiffening_elongation_shapes() {
  static const LinearShape linear({.name = "linear", .meaning = "W = l", .rank = 0});
  static const CubicShape cubic({.name = "cubic",
                                 .meaning = "W = l (1 + (l/s)^2)",
                                 .parameters = stiffening_length(),
                                 .rank = 10});
  static const SinhShape sinh({.name = "sinh",
                               .meaning = "W = s sinh(l/s)",
                               .parameters = stiffening_length(),
                               .rank = 20});
  static const std::vector<const ElongationShape*> all{&linear, &cubic, &sinh};
  return all;
}

}  // namespace tpm::law
