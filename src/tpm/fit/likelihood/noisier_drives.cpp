// Declared in tpm/fit/likelihood/experiment_residuals.hpp.
#include <bit>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

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
    std::vector<RoundedLevels>& found, const LevelError& error_of) const {
  std::size_t recording = 0;
  return with_moved_drives([&](const Experiment&, std::vector<Knot>& knots) {
    if (recording == found.size()) {
      std::vector<double> values;
      for (const Knot& knot : knots) values.push_back(knot.value);
      found.push_back(rounded_levels(values));
    }
    const RoundedLevels& rounded = found[recording];
    bool moved = false;
    for (std::size_t l = 0; l < rounded.levels.size(); ++l) {
      const RoundedLevel& level = rounded.levels[l];
      const double share = error_of(recording, l, level.held(knots.size()));
      if (share == 0.0) continue;
      moved = true;
      const double off = share * rounded.error_sd(level, knots.size());
      for (std::size_t i = level.first; i < level.end; ++i) knots[i].value += off;
    }
    ++recording;
    return moved;
  });
}

std::vector<Eigen::VectorXd> ExperimentResiduals::drive_rounding_slopes(
    std::span<const double> natural) const {
  std::vector<std::unique_ptr<ExperimentResiduals>> others;
  std::vector<std::pair<std::size_t, std::size_t>> holds;
  Random random(kRoundingSeed);  // the same signs in every draw
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> passed;
  std::vector<RoundedLevels> found;
  const auto listed =
      with_other_rounding(found, [&](std::size_t recording, std::size_t level, bool held) {
        if (held) holds.emplace_back(recording, level);
        if (!held)
          passed.emplace(std::pair{recording, level},
                         random.below(2) * kDraws + passed.size() % kDraws);
        return held ? 0.0 : 1.0;
      });
  for (const auto& hold : holds) {
    others.push_back(
        with_other_rounding(found, [&](std::size_t recording, std::size_t level, bool) {
          return hold == std::pair{recording, level} ? 1.0 : 0.0;
        }));
  }
  for (std::size_t draw = 0; listed && draw < kDraws; ++draw) {
    others.push_back(
        with_other_rounding(found, [&](std::size_t recording, std::size_t level, bool held) {
          if (held) return 0.0;
          // Rows of a Hadamard matrix, by turns: draws of eight levels are uncorrelated.
          const std::size_t row = passed.at({recording, level});
          const bool up = std::popcount(draw & (row % kDraws)) % 2 == (row < kDraws ? 0 : 1);
          return (up ? 1.0 : -1.0) / std::sqrt(static_cast<double>(kDraws));
        }));
  }
  Eigen::VectorXd before, after;
  RowMatrix slopes;
  std::vector<Eigen::VectorXd> moved;
  for (const auto& other : others) {
    if (moved.empty() && !evaluate(natural, before, &slopes)) return {};
    if (!other->evaluate(natural, after, nullptr)) return {};
    moved.emplace_back(slopes.transpose() * (after - before));
  }
  return moved;
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
