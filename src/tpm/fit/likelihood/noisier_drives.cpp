// Declared in tpm/fit/likelihood/experiment_residuals.hpp.
#include <cmath>

#include "tpm/base/median.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"

namespace tpm::fit {
namespace {

/// Standard deviation of a drive about the line between its neighbours, over its first samples; 0
/// if they are few, or if most of them lie on a line.
double drive_noise_at_rest(std::span<const Knot> knots, std::size_t count) {
  constexpr std::size_t kFewest = 20;
  constexpr double kOfMedian = 1.4826;
  if (count < kFewest) return 0.0;
  std::vector<double> off;
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const Knot &a = knots[i - 1], &b = knots[i], &c = knots[i + 1];
    const double share = (b.time_s - a.time_s) / (c.time_s - a.time_s);
    off.push_back(std::abs(b.value - a.value - share * (c.value - a.value)) /
                  std::sqrt(1.0 + share * share + (1.0 - share) * (1.0 - share)));
  }
  return kOfMedian * median(std::move(off));
}

}  // namespace

std::unique_ptr<ExperimentResiduals> ExperimentResiduals::with_noisier_drives(
    std::uint64_t seed) const {
  std::unique_ptr<ExperimentResiduals> noisier;
  Random random(seed);
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
    for (Knot& knot : noisy) knot.value += sd * random.normal();
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
  constexpr std::uint64_t kSeed = 1;
  const auto noisier = with_noisier_drives(kSeed);
  Eigen::VectorXd before, after;
  RowMatrix slopes_before, slopes_after;
  if (!noisier || !evaluate(natural, before, &slopes_before) ||
      !noisier->evaluate(natural, after, &slopes_after)) {
    return std::nullopt;
  }
  return (slopes_after - slopes_before).transpose() * (after - before);
}

}  // namespace tpm::fit
