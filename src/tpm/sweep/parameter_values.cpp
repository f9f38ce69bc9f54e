#include "tpm/sweep/parameter_values.hpp"

#include <cmath>
#include <utility>

namespace tpm::sweep {
namespace {

double between(double from, double to, AxisScale scale, double share) {
  if (scale == AxisScale::linear) return from + (to - from) * share;
  return from * std::exp(std::log(to / from) * share);
}

}  // namespace

ParameterValues ParameterValues::list(std::vector<double> values) {
  ParameterValues made;
  made.values_ = std::move(values);
  return made;
}

ParameterValues ParameterValues::range(double from, double to, std::uint64_t count,
                                       AxisScale scale) {
  ParameterValues made;
  made.from_ = from;
  made.to_ = to;
  made.count_ = count;
  made.scale_ = scale;
  return made;
}

ParameterValues ParameterValues::samples(double from, double to, AxisScale scale,
                                         std::function<double(std::uint64_t)> coordinate) {
  ParameterValues made = range(from, to, 0, scale);
  made.coordinate_ = std::move(coordinate);
  return made;
}

double ParameterValues::at(std::uint64_t number) const {
  if (coordinate_) return between(from_, to_, scale_, coordinate_(number));
  if (!values_.empty()) return values_[number];
  if (number == 0) return from_;
  if (number + 1 == count_) return to_;
  return between(from_, to_, scale_, static_cast<double>(number) / static_cast<double>(count_ - 1));
}

}  // namespace tpm::sweep
