// A shape that breaks every promise of ElongationShape: the suite has to find each.
#include "tpmkit/elongation_function.hpp"

namespace tpm {
namespace {

class BrokenShape final : public ElongationShape {
 public:
  using ElongationShape::ElongationShape;

  /// Neither odd nor rising, and not of slope 1 at rest.
  [[nodiscard]] double value(double l, const ShapeValues& p) const override {
    return 1.5 * l + l * l / p[0] - l * l * l / (p[0] * p[0]);
  }
  /// Without the square.
  [[nodiscard]] double slope(double l, const ShapeValues& p) const override {
    return 1.5 - 3.0 * l * l / (p[0] * p[0]);
  }
  /// Of the linear function.
  [[nodiscard]] double integral(double l, const ShapeValues& /*p*/) const override {
    return 0.5 * l * l;
  }
  [[nodiscard]] double derivative(double l, const ShapeValues& /*p*/,
                                  std::size_t /*k*/) const override {
    return l;
  }
  [[nodiscard]] double inverse(double w, const ShapeValues& /*p*/) const override { return w; }
  [[nodiscard]] std::optional<double> cubic_per_m2(const ShapeValues& /*p*/) const override {
    return 1e5;
  }
};

}  // namespace

ElongationShapes broken_elongation_shapes() {
  static const BrokenShape shape({.name = "broken",
                                  .meaning = "keeps none of its word",
                                  .parameters = {{"length", Dimension::length, 0.0, true, "s"}}});
  static const std::vector<const ElongationShape*> all{&shape};
  return all;
}

}  // namespace tpm
