// The worked example of docs/adding.md, "A material": one file, and nothing else.
#include <cmath>

#include "tpmkit/elongation_function.hpp"

namespace tpm {
namespace {

/// A part a of the force is exponential, as of collagen that comes under load:
///
///     W(l) = (1 - a) l + a s sinh(l/s),   W'(l) = 1 - a + a cosh(l/s) >= 1
class DummyShape final : public ElongationShape {
 public:
  using ElongationShape::ElongationShape;

  [[nodiscard]] double value(double l, const ShapeValues& p) const override {
    const auto [a, s] = read(p);
    return (1.0 - a) * l + a * s * std::sinh(l / s);
  }
  [[nodiscard]] double slope(double l, const ShapeValues& p) const override {
    const auto [a, s] = read(p);
    return 1.0 - a + a * std::cosh(l / s);
  }
  [[nodiscard]] double integral(double l, const ShapeValues& p) const override {
    const auto [a, s] = read(p);
    const double half = std::sinh(0.5 * l / s);
    return 0.5 * (1.0 - a) * l * l + 2.0 * a * s * s * half * half;
  }
  [[nodiscard]] double derivative(double l, const ShapeValues& p, std::size_t k) const override {
    const auto [a, s] = read(p);
    const double q = l / s;
    return k == 0 ? s * std::sinh(q) - l : a * (std::sinh(q) - q * std::cosh(q));
  }

 private:
  struct Values {
    double a, s;
  };
  static Values read(const ShapeValues& p) { return {p[0], p[1]}; }
};

}  // namespace

ElongationShapes dummy_elongation_shapes() {
  static const DummyShape shape(
      {.name = "dummy",
       .meaning = "W = (1 - a) l + a s sinh(l/s)",
       .parameters = {
           {"collagen", Dimension::dimensionless, 0.0, false, "exponential part a of the force"},
           {"uncrimped", Dimension::length, 0.0, true, "elongation s at which collagen pulls"}}});
  static const std::vector<const ElongationShape*> all{&shape};
  return all;
}

}  // namespace tpm
