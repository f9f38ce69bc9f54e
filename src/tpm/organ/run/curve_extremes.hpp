#pragma once
#include <vector>

#include "tpm/organ/run/simulation.hpp"

namespace tpm::organ {

/// Finds the extremes of a curve between its points from the steps of an integrator: the vertex of
/// the parabola through three steps, and the ends of a smooth stretch. Only what exceeds all points
/// of the curve is an extreme, so that the largest value does not depend on where the points are.
/// Each response and the force on the tissue are watched. Contacts that settle after an impact end
/// a smooth stretch; none of their points is an extreme.
class CurveExtremes {
 public:
  /// Takes a point of the curve into account.
  void see(const CurvePoint& point);
  /// True if a quantity is larger than in all points of the curve.
  [[nodiscard]] bool exceeded_by(const CurvePoint& point) const;

  /// Takes the next step of a smooth stretch; times rise.
  /// @returns extremes that it reveals, marked `between`
  [[nodiscard]] std::vector<CurvePoint> step(const CurvePoint& point);
  /// Ends a smooth stretch.
  /// @returns as step()
  [[nodiscard]] std::vector<CurvePoint> corner();

 private:
  [[nodiscard]] bool exceeds(double value, std::size_t quantity) const;

  std::vector<double> largest_;    ///< by quantity
  std::vector<CurvePoint> steps_;  ///< the last two of the stretch
};

}  // namespace tpm::organ
