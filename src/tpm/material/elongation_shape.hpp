#pragma once
#include <array>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/material/material_parameter.hpp"

namespace tpm {

inline constexpr std::size_t kMostShapeParameters = 4;
/// Values of a shape's parameters, SI; those that it does not have are 0.
using ShapeValues = std::array<double, kMostShapeParameters>;

/// A family of functions W(l; p) of a bond's elongation l, m: what the potentials and kernels of a
/// material are made of (elongation_function.hpp). For all parameters in their ranges W must be
///
///   - odd and smooth, with W'(0) = 1: the moduli are those at rest;
///   - strictly increasing, so that its integral P is convex and the bond stores energy.
///
/// Shapes are objects that never change, one or several in a file of shapes/, which the build lists
/// (docs/architecture.md, "Adding a material").
class ElongationShape {
 public:
  struct Entry {
    std::string_view name;     ///< its word in files
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
  /// c where W(l) = l + c l^3, 1/m^2. The kernels at servo rate step such functions; they refuse
  /// shapes that have none.
  [[nodiscard]] virtual std::optional<double> cubic_per_m2(const ShapeValues& /*p*/) const {
    return std::nullopt;
  }
  /// W(l) = l: everything runs through the faster code of linear bonds.
  [[nodiscard]] virtual bool is_linear() const { return false; }

 private:
  Entry entry_;
};

using ElongationShapes = std::span<const ElongationShape* const>;

/// All shapes by rank. Defined in a source that the build writes from the files of shapes/: a
/// program that is linked with another list has other shapes.
[[nodiscard]] ElongationShapes elongation_shapes();

/// Those of several lists, by rank and name. Throws std::logic_error if two share a name.
[[nodiscard]] std::vector<const ElongationShape*> joined(
    std::initializer_list<ElongationShapes> lists);

/// The shape of this name. Throws Error(bad_input) that names all.
[[nodiscard]] const ElongationShape& elongation_shape(std::string_view name,
                                                      std::string_view where);

}  // namespace tpm
