#include "tpm/fit/noise_rows.hpp"

#include <algorithm>
#include <iterator>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpm/fit/likelihood/quantum.hpp"

namespace tpm::fit {
namespace {

/// Readings without rounding are all different.
bool repeats_itself(std::vector<double> readings) {
  constexpr double kShare = 0.2;
  const auto n = static_cast<double>(readings.size());
  std::ranges::sort(readings);
  // clang 14 cannot read std::ranges::unique of libstdc++ 12.
  const auto repeated =
      std::distance(std::unique(readings.begin(), readings.end()), readings.end());
  return static_cast<double>(repeated) > kShare * n;
}

/// Half the step that the readings of a recording are rounded to, on the scale of the noise.
std::vector<double> half_steps(const ExperimentResiduals& function, const Experiment& experiment) {
  std::vector<double> readings;
  for (const std::size_t i : experiment.data) {
    const FitDatum& d = function.data()[i];
    if (!d.held_out && d.value) readings.push_back(*d.value);
  }
  const bool absolute = function.config().data[experiment.choice].noise.kind != NoiseKind::log;
  const double half = absolute && repeats_itself(readings) ? 0.5 * quantum_of(readings) : 0.0;
  std::vector<double> steps;
  for (const std::size_t i : experiment.data) {
    const FitDatum& d = function.data()[i];
    if (!d.held_out && d.value) steps.push_back(half / d.sigma);
  }
  return steps;
}

double median_of(std::vector<double> values) {
  if (values.empty()) return 1.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::optional<NoiseRows> noise_rows(const ExperimentResiduals& function,
                                    std::span<const std::size_t> free,
                                    std::span<const double> natural) {
  constexpr double kApart = 1e5;  // steps between recordings: no correlation reaches so far
  Eigen::VectorXd residual;
  RowMatrix jacobian;
  if (!function.evaluate(natural, residual, &jacobian)) return std::nullopt;
  NoiseRows rows;
  std::vector<Eigen::Index> kept;
  std::vector<double> half, distances, own_time;
  Eigen::Index row = 0;
  for (const Experiment& experiment : function.experiments()) {
    const Eigen::Index first = std::ssize(kept);
    if (experiment.is_recording) {
      const std::vector<double> steps = half_steps(function, experiment);
      half.insert(half.end(), steps.begin(), steps.end());
    }
    for (const std::size_t i : experiment.data) {
      const FitDatum& d = function.data()[i];
      if (d.held_out) continue;
      if (d.value) {
        if (experiment.is_recording && std::ssize(kept) > first) {
          distances.push_back(d.time_s - own_time.back());
        }
        kept.push_back(row);
        own_time.push_back(d.time_s);
        if (!experiment.is_recording) half.push_back(0.0);
      }
      ++row;
    }
    if (experiment.is_recording) rows.recordings.push_back({first, std::ssize(kept) - first});
  }
  if (std::ranges::any_of(distances, [](double d) { return !(d > 0.0); })) return std::nullopt;
  rows.step_s = median_of(distances);
  for (const Experiment& experiment : function.experiments()) {
    if (!experiment.is_recording) continue;
    rows.at_rest.push_back(measured_at_rest(function, experiment, rows.step_s));
  }
  const Eigen::Index values = std::ssize(kept);
  for (; row < residual.size(); ++row) kept.push_back(row);
  for (const EstimatedParameter& p : function.config().parameters) {
    if (!p.prior) continue;
    const auto place = &p - function.config().parameters.data();
    const Eigen::Index at = kept[static_cast<std::size_t>(values + rows.priors())];
    rows.prior_weight.push_back(jacobian(at, place) * p.prior->sd);
  }
  const std::vector<Eigen::Index> columns(free.begin(), free.end());
  rows.residual = residual(kept);
  rows.jacobian = jacobian(kept, columns);
  rows.half_step = Eigen::VectorXd::Map(half.data(), std::ssize(half));
  // Time goes on within a recording and leaps between what is independent.
  double now = 0.0;
  std::size_t recording = 0;
  for (Eigen::Index i = 0; i < std::ssize(kept); ++i) {
    while (recording < rows.recordings.size() &&
           i >= rows.recordings[recording].first + rows.recordings[recording].count) {
      ++recording;
    }
    const bool within = recording < rows.recordings.size() && i > rows.recordings[recording].first;
    const auto k = static_cast<std::size_t>(i);
    now += within ? own_time[k] - own_time[k - 1] : kApart * rows.step_s;
    rows.time_s.push_back(now);
  }
  return rows;
}

}  // namespace tpm::fit
