#pragma once
#include <array>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/units.hpp"

namespace tpm {

/// A parameter of a material. Files, fits, sweeps and reports address it by its name.
struct MaterialParameter {
  std::string name;
  Dimension dimension;
  double least;         ///< SI
  bool least_excluded;  ///< the value is above `least`, not at it
  std::string meaning;
  [[nodiscard]] bool allows(double value) const {
    return least_excluded ? value > least : value >= least;
  }
};

/// "above 0", "0 or above".
[[nodiscard]] std::string range_of(const MaterialParameter& parameter);

inline constexpr std::size_t kMostShapeParameters = 4;
/// Values of a shape's parameters, SI; unused ones are 0.
using ShapeValues = std::array<double, kMostShapeParameters>;

/// A family of functions W(l; p) of a bond's elongation l, m. Potentials and kernels of materials
/// are built from them. For all parameters in their ranges W must be
///
///   - odd and smooth, with W'(0) = 1: the moduli are those at rest;
///   - strictly increasing, so that its integral P is convex and the bond stores energy.
///
/// Shapes are immutable. Each file of shapes/ defines one or several, and the build lists them
/// (docs/adding.md, "A material").
class ElongationShape {
 public:
  struct Entry {
    std::string_view name;     ///< its name in files
    std::string_view meaning;  ///< its formula, in l and the parameters
    /// At most kMostShapeParameters.
    std::vector<MaterialParameter> parameters = {};
    int rank = 1000;  ///< place in lists
  };

  /// Throws std::logic_error for too many parameters.
  explicit ElongationShape(Entry entry);
  ElongationShape(const ElongationShape&) = delete;
  ElongationShape& operator=(const ElongationShape&) = delete;
  virtual ~ElongationShape() = default;

  [[nodiscard]] std::string_view name() const { return entry_.name; }
  [[nodiscard]] std::string_view meaning() const { return entry_.meaning; }
  [[nodiscard]] int rank() const { return entry_.rank; }
  [[nodiscard]] const std::vector<MaterialParameter>& parameters() const {
    return entry_.parameters;
  }

  /// W(l), m.
  [[nodiscard]] virtual double value(double l, const ShapeValues& p) const = 0;
  /// W'(l) > 0.
  [[nodiscard]] virtual double slope(double l, const ShapeValues& p) const = 0;
  /// P(l), the integral of W from 0 to l, m^2.
  [[nodiscard]] virtual double integral(double l, const ShapeValues& p) const = 0;
  /// dW(l)/dp_k.
  [[nodiscard]] virtual double derivative(double l, const ShapeValues& p, std::size_t k) const = 0;
  /// The l at which W(l) = w, m: the slope of the Legendre transform of P. By default with Newton's
  /// method between bounds, to rounding.
  [[nodiscard]] virtual double inverse(double w, const ShapeValues& p) const;
  /// c if W(l) = l + c l^3, 1/m^2; otherwise none. Models at servo rate accept only shapes that
  /// have it.
  [[nodiscard]] virtual std::optional<double> cubic_per_m2(const ShapeValues& /*p*/) const {
    return std::nullopt;
  }
  /// True if W(l) = l. The faster code of linear bonds is then used.
  [[nodiscard]] virtual bool is_linear() const { return false; }

 private:
  Entry entry_;
};

using ElongationShapes = std::span<const ElongationShape* const>;

/// All shapes by rank. Defined in a source that the build generates from the files of shapes/. A
/// program with its own definition has other shapes.
[[nodiscard]] ElongationShapes elongation_shapes();

/// The shapes of the library, for such a definition: joined({shipped_elongation_shapes(),
/// own_shapes()}).
[[nodiscard]] ElongationShapes shipped_elongation_shapes();

/// Joins several lists, ordered by rank and name. Throws std::logic_error if two share a name.
[[nodiscard]] std::vector<const ElongationShape*> joined(
    std::initializer_list<ElongationShapes> lists);

/// The shape of this name. Throws Error(bad_input) that names all.
[[nodiscard]] const ElongationShape& elongation_shape(std::string_view name,
                                                      std::string_view where);

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
  /// Name of the shape; `linear` for the linear function.
  [[nodiscard]] std::string_view shape_name() const;
  /// Parameters of the shape; the linear function has none.
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
  /// Energy of a spring W stretched to l whose viscous elongation is w, m^2 (times a stiffness: J):
  /// P(l) + P*(w) - l w with P* the Legendre transform of P. Non-negative, and 0 where w = W(l)
  /// (Fenchel-Young). For a linear function (l - w)^2/2.
  [[nodiscard]] double gap(double l, double w) const;
  /// c if W(l) = l + c l^3, 1/m^2; none if a model at servo rate cannot step it.
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
