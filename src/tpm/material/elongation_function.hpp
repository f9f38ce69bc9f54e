#pragma once
#include "tpm/material/elongation_shape.hpp"

namespace tpm {

/// An odd, strictly increasing function W of a bond's elongation with slope 1 at rest, in m: a
/// shape with values of its parameters. Times a stiffness it is an elastic force: U'(l) = k W(l) of
/// an equilibrium potential, or the kernel that branches act on. W(l) = l unless another shape is
/// set.
class ElongationFunction {
 public:
  ElongationFunction() = default;
  /// @param values in the order of the shape's parameters
  ElongationFunction(const ElongationShape& shape, std::initializer_list<double> values);

  [[nodiscard]] bool is_linear() const { return shape_ == nullptr; }
  /// The linear function is one of the shape `linear`.
  [[nodiscard]] std::string_view shape_name() const;
  /// Of the shape; the linear function has none.
  [[nodiscard]] std::span<const MaterialParameter> parameters() const {
    if (shape_ == nullptr) return {};
    return shape_->parameters();
  }
  /// The values of the parameters, SI. Without meaning beyond parameters().size().
  [[nodiscard]] const ShapeValues& values() const { return values_; }
  /// Sets a value; `k` below parameters().size().
  void set_value(std::size_t k, double value) { values_[k] = value; }

  [[nodiscard]] bool operator==(const ElongationFunction& other) const {
    return shape_ == other.shape_ && values_ == other.values_;
  }

  /// W(l), m.
  [[nodiscard]] double value(double l) const {
    return shape_ == nullptr ? l : shape_->value(l, values_);
  }
  /// W'(l) > 0.
  [[nodiscard]] double slope(double l) const {
    return shape_ == nullptr ? 1.0 : shape_->slope(l, values_);
  }
  /// Change of W(l) with small changes of the parameters, m.
  [[nodiscard]] double change(double l, const ShapeValues& of_values) const;
  /// P(l), the integral of W from 0 to l, m^2.
  [[nodiscard]] double integral(double l) const {
    return shape_ == nullptr ? 0.5 * l * l : shape_->integral(l, values_);
  }
  /// The elongation l at which W(l) = w, m.
  [[nodiscard]] double inverse(double w) const {
    return shape_ == nullptr ? w : shape_->inverse(w, values_);
  }
  /// Energy of a spring W that was stretched to l while its reference follows at w, m^2 (times a
  /// stiffness: J): P(l) + P*(w) - l w with P* the Legendre transform of P. Non-negative, and 0
  /// where w = W(l) (Fenchel-Young). For a linear function (l - w)^2/2.
  [[nodiscard]] double gap(double l, double w) const;
  /// c where W(l) = l + c l^3, 1/m^2: what runs at servo rate.
  [[nodiscard]] std::optional<double> cubic_per_m2() const {
    return shape_ == nullptr ? 0.0 : shape_->cubic_per_m2(values_);
  }

 private:
  const ElongationShape* shape_ = nullptr;  ///< null where W(l) = l
  ShapeValues values_{};
};

/// A function by the name of its shape. Throws Error(bad_input) that names the shapes, for another
/// number of values, and for a value out of its range.
[[nodiscard]] ElongationFunction elongation_function(std::string_view shape,
                                                     std::initializer_list<double> values = {});

}  // namespace tpm
