#include "tpm/organ/run/curve_extremes.hpp"

#include <algorithm>
#include <cmath>

namespace tpm::organ {
namespace {

constexpr double kNotable = 1e-7;  // in parts of the largest; below lies rounding

std::size_t quantities(const CurvePoint& point) {
  return 2 + point.beside.size();
}

double& response_of(CurvePoint& point, std::size_t index) {
  if (index == 0) return point.response;
  return index == 1 ? point.force_on_tissue_N : point.beside[index - 2];
}

double response_of(const CurvePoint& point, std::size_t index) {
  if (index == 0) return point.response;
  return index == 1 ? point.force_on_tissue_N : point.beside[index - 2];
}

/// Newton's form of the parabola through three values at rising times.
struct Parabola {
  Parabola(const double (&time_s)[3], const double (&value)[3])
      : first_s(time_s[0]), middle_s(time_s[1]), start(value[0]) {
    slope = (value[1] - value[0]) / (time_s[1] - time_s[0]);
    const double next = (value[2] - value[1]) / (time_s[2] - time_s[1]);
    bend = (next - slope) / (time_s[2] - time_s[0]);
  }
  [[nodiscard]] double vertex_s() const {
    return bend == 0.0 ? middle_s : 0.5 * (first_s + middle_s - slope / bend);
  }
  [[nodiscard]] double at(double time_s) const {
    return start + (time_s - first_s) * (slope + bend * (time_s - middle_s));
  }
  double first_s, middle_s, start, slope, bend;
};

/// The point of the parabolas through three points at which one quantity has its vertex.
CurvePoint vertex(const CurvePoint& before, const CurvePoint& middle, const CurvePoint& after,
                  std::size_t index) {
  const double times[] = {before.time_s, middle.time_s, after.time_s};
  const auto parabola = [&](const auto& value) {
    return Parabola(times, {value(before), value(middle), value(after)});
  };
  CurvePoint point = middle;
  point.time_s =
      std::clamp(parabola([&](const CurvePoint& p) { return response_of(p, index); }).vertex_s(),
                 times[0], times[2]);
  point.imposed = parabola([](const CurvePoint& p) { return p.imposed; }).at(point.time_s);
  for (std::size_t i = 0; i < quantities(point); ++i) {
    response_of(point, i) =
        parabola([&](const CurvePoint& p) { return response_of(p, i); }).at(point.time_s);
  }
  return point;
}

}  // namespace

void CurveExtremes::see(const CurvePoint& point) {
  if (!counts(point)) return;
  largest_.resize(quantities(point), 0.0);
  for (std::size_t i = 0; i < largest_.size(); ++i) {
    largest_[i] = std::max(largest_[i], std::abs(response_of(point, i)));
  }
}

bool CurveExtremes::exceeds(double value, std::size_t quantity) const {
  return quantity >= largest_.size() || std::abs(value) > (1.0 + kNotable) * largest_[quantity];
}

bool CurveExtremes::exceeded_by(const CurvePoint& point) const {
  if (!counts(point)) return false;
  for (std::size_t i = 0; i < quantities(point); ++i) {
    if (exceeds(response_of(point, i), i)) return true;
  }
  return false;
}

std::vector<CurvePoint> CurveExtremes::step(const CurvePoint& point) {
  if (!counts(point)) return corner();
  std::vector<CurvePoint> found;
  for (std::size_t i = 0; i < quantities(point) && !steps_.empty(); ++i) {
    const CurvePoint& middle = steps_.back();
    const double size = std::abs(response_of(middle, i));
    if (size < std::abs(response_of(point, i))) continue;
    if (steps_.size() == 1) {
      if (exceeds(size, i)) found.push_back(middle);
      continue;
    }
    const CurvePoint& before = steps_.front();
    const double size_before = std::abs(response_of(before, i));
    if (size < size_before || size == std::abs(response_of(point, i))) continue;
    CurvePoint extreme = vertex(before, middle, point, i);
    if (exceeds(response_of(extreme, i), i)) found.push_back(std::move(extreme));
  }
  if (steps_.size() == 2) steps_.erase(steps_.begin());
  steps_.push_back(point);
  for (CurvePoint& extreme : found) extreme.between = true;
  return found;
}

std::vector<CurvePoint> CurveExtremes::corner() {
  std::vector<CurvePoint> found;
  if (!steps_.empty() && exceeded_by(steps_.back())) {
    found.push_back(std::move(steps_.back()));
    found.back().between = true;
  }
  steps_.clear();
  return found;
}

}  // namespace tpm::organ
