#include "tpm/fit/select/clipping.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"

namespace tpm::fit {
namespace {

/// An elastic tissue answers a drive at rest with equal readings, too: those say nothing of a limit
/// unless the readings change before the drive does.
bool is_of_the_drive(const EqualRun& run, std::span<const double> drive) {
  constexpr double kAtRest = 0.01;  // of the drive's range
  const auto [low, high] = std::ranges::minmax_element(drive);
  const double still = kAtRest * (*high - *low);
  const auto along = drive.subspan(run.first, run.length);
  const auto [least, most] = std::ranges::minmax_element(along);
  if (*most - *least > still) return false;
  const std::size_t next = run.first + run.length;
  return next >= drive.size() || std::abs(drive[next] - along.back()) > still;
}

/// Under a load that is kept, the drive slows down where the readings stop and goes on for long; a
/// clipped force cell stops while the drive goes on as before.
bool is_of_a_kept_load(const EqualRun& run, std::span<const double> time_s,
                       std::span<const double> drive) {
  constexpr std::size_t kBefore = 4;
  constexpr double kMost = 0.9, kSlower = 2.0;
  const std::size_t before = run.first > kBefore ? run.first - kBefore : 0;
  const std::size_t last = run.first + run.length - 1;
  const double moved = drive[last] - drive[run.first];
  if (before == run.first || moved == 0.0) return false;
  const double rate = (drive[run.first] - drive[before]) / (time_s[run.first] - time_s[before]);
  std::size_t i = run.first;
  while (i < last && std::abs(drive[i] - drive[run.first]) < kMost * std::abs(moved)) ++i;
  const double took_s = time_s[i] - time_s[run.first];
  const double step_s = (time_s[last] - time_s[run.first]) / static_cast<double>(run.length - 1);
  return took_s > kSlower * (kMost * std::abs(moved / rate) + step_s);
}

/// Coarsely rounded readings repeat everywhere, and a run at a limit is not much longer than
/// others. What tells it: the drive goes on, and the slope of the readings before it would have
/// raised them by several steps.
std::optional<EqualRun> run_against_the_drive(std::span<const double> readings,
                                              std::span<const double> drive) {
  constexpr std::size_t kLeast = 4, kBefore = 4;
  constexpr double kSteps = 3.0;
  const double step = quantum_of(readings);
  if (!(step > 0.0)) return std::nullopt;
  EqualRun run{0, 0, *std::ranges::max_element(readings), true};
  std::size_t length = 0;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    length = readings[i] == run.value ? length + 1 : 0;
    if (length > run.length) run = {i + 1 - length, length, run.value, true};
  }
  if (run.length < kLeast || run.first < kBefore) return std::nullopt;
  const std::size_t before = run.first - kBefore;
  const double moved = drive[run.first] - drive[before];
  if (moved == 0.0) return std::nullopt;
  const double slope = (run.value - readings[before]) / moved;
  const double went_on = drive[run.first + run.length - 1] - drive[run.first];
  if (slope * went_on <= kSteps * step) return std::nullopt;
  return run;
}

}  // namespace

void find_clipping(PreparedRecording& recording) {
  const Recording& r = recording.recording;
  const auto end = static_cast<std::size_t>(std::ranges::upper_bound(r.time_s, recording.to_s) -
                                            r.time_s.begin());
  const std::span<const double> readings = std::span(r.response).first(end);
  const std::span<const double> rest =
      readings.first(std::min(samples_at_rest(recording.phases), end));
  const std::span<const double> drive = std::span(r.drive).first(end);
  auto run = clipped_run(readings, rest);
  if (!run) run = run_against_the_drive(readings, drive);
  if (!run || is_of_the_drive(*run, drive)) return;
  if (run->largest && is_of_a_kept_load(*run, r.time_s, r.drive)) return;
  if (!run->largest && run->first == 0) return;  // what precedes the load is no limit
  // A reading that is rounded stands for what is up to half a step away from it.
  const double half = 0.5 * quantum_of(readings);
  if (run->largest) {
    recording.clipped_above = run->value - half;
  } else {
    recording.clipped_below = run->value + half;
  }
  const Unit unit = shown_unit(quantity_dimension(r.response_quantity));
  recording.phases.summary.insert(
      recording.phases.summary.begin(),
      fmt::format("clipping: {} readings in a row from {} s on are all the {}, {}, which rounding "
                  "does not make: they are censored",
                  run->length, significant(r.time_s[run->first], 4),
                  run->largest ? "largest" : "smallest",
                  with_unit(significant(run->value / unit.to_si, 4), unit)));
}

bool is_clipped(const PreparedRecording& recording, double reading) {
  return (recording.clipped_above && reading >= *recording.clipped_above) ||
         (recording.clipped_below && reading <= *recording.clipped_below);
}

Eigen::Array<bool, Eigen::Dynamic, 1> clipped_readings(const PreparedRecording& recording) {
  const std::vector<double>& readings = recording.recording.response;
  return Eigen::ArrayXd::Map(readings.data(), std::ssize(readings)).unaryExpr([&](double reading) {
    return is_clipped(recording, reading);
  });
}

}  // namespace tpm::fit
