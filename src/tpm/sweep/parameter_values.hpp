#pragma once
#include <cstdint>
#include <functional>
#include <vector>

namespace tpm::sweep {

/// Spacing of the places between two ends.
enum class AxisScale { linear, logarithmic };

/// The values that a swept parameter takes along its axis, SI, each by its number alone. What can
/// be computed is not kept: an axis may have tens of millions of places.
class ParameterValues {
 public:
  /// @param values at least one, finite
  [[nodiscard]] static ParameterValues list(std::vector<double> values);
  /// From the first end to the last, both reached exactly.
  /// @param count at least 1; 1 gives the first end alone
  [[nodiscard]] static ParameterValues range(double from, double to, std::uint64_t count,
                                             AxisScale scale);
  /// Places between two ends given by a coordinate in [0, 1) of each point.
  [[nodiscard]] static ParameterValues samples(double from, double to, AxisScale scale,
                                               std::function<double(std::uint64_t)> coordinate);

  [[nodiscard]] double at(std::uint64_t number) const;

 private:
  std::vector<double> values_;
  double from_ = 0.0, to_ = 0.0;
  std::uint64_t count_ = 0;
  AxisScale scale_ = AxisScale::linear;
  std::function<double(std::uint64_t)> coordinate_;
};

}  // namespace tpm::sweep
