// Declared in tpm/fit/likelihood/experiment_residuals.hpp.
#include <cmath>

#include "tpm/base/median.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"
#include "tpm/data/off_neighbours.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"

namespace tpm::fit {
namespace {

/// Standard deviation of a drive about the line between its neighbours, over its first samples; 0
/// if they are few, or if most of them lie on a line.
double drive_noise_at_rest(std::span<const Knot> knots, std::size_t count) {
  constexpr std::size_t kFewest = 20;
  constexpr double kOfMedian = 1.4826;
  if (count < kFewest) return 0.0;
  std::vector<double> time, value;
  for (const Knot& knot : knots.first(count)) {
    time.push_back(knot.time_s);
    value.push_back(knot.value);
  }
  std::vector<double> off = data::off_neighbours(time, value);
  for (double& distance : off) distance = std::abs(distance);
  return kOfMedian * median(std::move(off));
}

}  // namespace

std::unique_ptr<ExperimentResiduals> ExperimentResiduals::with_noisier_drives(
    std::size_t first, std::size_t every) const {
  std::unique_ptr<ExperimentResiduals> noisier;
  Random random(first);
  for (std::size_t e = 0; e < experiments_.size(); ++e) {
    const Experiment& experiment = experiments_[e];
    const auto* course = std::get_if<TimeCourse>(&experiment.imposed);
    if (course == nullptr || !experiment.is_recording || course->followed) continue;
    const std::span<const Knot> knots = course->protocol.knots();
    if (knots.size() != experiment.data.size()) continue;
    std::size_t rest = 0;
    while (rest < knots.size() && data_[experiment.data[rest]].held_out) ++rest;
    const double sd = rest < knots.size() ? drive_noise_at_rest(knots, rest) : 0.0;
    if (!(sd > 0.0)) continue;
    std::vector<Knot> noisy(knots.begin(), knots.end());
    for (std::size_t i = first; i < noisy.size(); i += every) {
      noisy[i].value += random.below(2) == 0 ? sd : -sd;
    }
    Protocol protocol(course->protocol.drive(), std::move(noisy), course->protocol.name());
    protocol.set_equilibrium_at_start(course->protocol.equilibrium_at_start());
    if (!noisier) noisier = copy();
    std::get<TimeCourse>(noisier->experiments_[e].imposed).protocol = protocol;
    if (noisier->fitted_.empty()) continue;
    std::get<TimeCourse>(noisier->fitted_[e].imposed).protocol = std::move(protocol);
  }
  return noisier;
}

std::optional<Eigen::VectorXd> ExperimentResiduals::drive_noise_slope(
    std::span<const double> natural) const {
  constexpr std::size_t kApart = 8;
  Eigen::VectorXd before, after;
  RowMatrix slopes_before, slopes_after;
  std::optional<Eigen::VectorXd> slope;
  for (std::size_t first = 0; first < kApart; ++first) {
    const auto noisier = with_noisier_drives(first, kApart);
    if (!noisier || (!slope && !evaluate(natural, before, &slopes_before)) ||
        !noisier->evaluate(natural, after, &slopes_after)) {
      return std::nullopt;
    }
    const Eigen::VectorXd part = (slopes_after - slopes_before).transpose() * (after - before);
    slope = slope ? Eigen::VectorXd(*slope + part) : part;
  }
  return slope;
}

}  // namespace tpm::fit
