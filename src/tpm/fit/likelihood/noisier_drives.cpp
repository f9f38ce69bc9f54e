// Declared in tpm/fit/likelihood/experiment_residuals.hpp.
#include <algorithm>
#include <bit>
#include <functional>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"
#include "tpm/data/off_neighbours.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpm/fit/likelihood/quantum.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kDraws = 8;  // of rounding errors; a power of 2
constexpr std::uint64_t kRoundingSeed = 12;

/// Standard deviation of a drive about the line between its neighbours, over its first samples; 0
/// if they are few, or if most of them lie on a line.
double drive_noise_at_rest(std::span<const Knot> knots, std::size_t count) {
  constexpr std::size_t kFewest = 20;
  if (count < kFewest) return 0.0;
  std::vector<double> time, value;
  for (const Knot& knot : knots.first(count)) {
    time.push_back(knot.time_s);
    value.push_back(knot.value);
  }
  return data::noise_about_neighbours(time, value);
}

}  // namespace

std::unique_ptr<ExperimentResiduals> ExperimentResiduals::with_moved_drives(
    const MoveKnots& move) const {
  std::unique_ptr<ExperimentResiduals> moved;
  for (std::size_t e = 0; e < experiments_.size(); ++e) {
    const Experiment& experiment = experiments_[e];
    const auto* course = std::get_if<TimeCourse>(&experiment.imposed);
    if (course == nullptr || !experiment.is_recording || course->followed) continue;
    const std::span<const Knot> knots = course->protocol.knots();
    if (knots.size() != experiment.data.size()) continue;
    std::vector<Knot> other(knots.begin(), knots.end());
    if (!move(experiment, other)) continue;
    Protocol protocol(course->protocol.drive(), std::move(other), course->protocol.name());
    protocol.set_equilibrium_at_start(course->protocol.equilibrium_at_start());
    if (!moved) moved = copy();
    std::get<TimeCourse>(moved->experiments_[e].imposed).protocol = protocol;
    if (moved->fitted_.empty()) continue;
    std::get<TimeCourse>(moved->fitted_[e].imposed).protocol = std::move(protocol);
  }
  return moved;
}

std::unique_ptr<ExperimentResiduals> ExperimentResiduals::with_noisier_drives(
    std::size_t first, std::size_t every) const {
  Random random(first);
  return with_moved_drives([&](const Experiment& experiment, std::vector<Knot>& knots) {
    std::size_t rest = 0;
    while (rest < knots.size() && data_[experiment.data[rest]].held_out) ++rest;
    const double sd = rest < knots.size() ? drive_noise_at_rest(knots, rest) : 0.0;
    if (!(sd > 0.0)) return false;
    for (std::size_t i = first; i < knots.size(); i += every) {
      knots[i].value += random.below(2) == 0 ? sd : -sd;
    }
    return true;
  });
}

std::unique_ptr<ExperimentResiduals> ExperimentResiduals::with_other_rounding(
    std::size_t draw) const {
  Random random(kRoundingSeed);  // the same signs in every draw
  return with_moved_drives([&](const Experiment&, std::vector<Knot>& knots) {
    std::vector<double> values;
    for (const Knot& knot : knots) values.push_back(knot.value);
    const RoundedLevels rounded = rounded_levels(values);
    std::vector<RoundedLevel> levels = rounded.levels;
    std::ranges::stable_sort(levels, std::greater{},
                             [](const RoundedLevel& l) { return l.size(); });
    for (std::size_t rank = 0; rank < levels.size(); ++rank) {
      // Rows of a Hadamard matrix: draws of the longest levels are uncorrelated with each other.
      const bool turned = std::popcount(draw & (rank % kDraws)) % 2 == 1;
      const bool up = turned != (random.below(2) == 1);
      const double sd = rounded.error_sd(levels[rank], knots.size());
      const double off = up ? sd : -sd;
      for (std::size_t i = levels[rank].first; i < levels[rank].end; ++i) knots[i].value += off;
    }
    return !levels.empty();
  });
}

std::vector<Eigen::VectorXd> ExperimentResiduals::drive_rounding_slopes(
    std::span<const double> natural) const {
  Eigen::VectorXd before, after;
  RowMatrix slopes;
  std::vector<Eigen::VectorXd> draws;
  for (std::size_t draw = 0; draw < kDraws; ++draw) {
    const auto other = with_other_rounding(draw);
    if (!other) return {};
    if (draws.empty() && !evaluate(natural, before, &slopes)) return {};
    if (!other->evaluate(natural, after, nullptr)) return {};
    draws.emplace_back(slopes.transpose() * (after - before));
  }
  return draws;
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
