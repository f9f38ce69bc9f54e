#include "tpm/fit/recording/repeated_readings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/likelihood/quantum.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kRowsAround = 16;    // rows on each side
constexpr std::size_t kFewestMoving = 20;  // rows that move
constexpr std::size_t kFewestTimes = 5;
constexpr double kShareRepeated = 0.4;  // of the rows that move
constexpr double kShareOfTrend = 0.5;   // of the trend

/// Change from row to row, about the row.
double trend(std::span<const double> values, std::size_t row) {
  const std::size_t first = row > kRowsAround ? row - kRowsAround - 1 : 0;
  const std::size_t last = std::min(row + kRowsAround, values.size() - 1);
  return (values[last] - values[first]) / static_cast<double>(last - first);
}

/// Largest step that rounding may have. Changes to and from the extremes do not count: the limit of
/// a force cell lies beside the grid.
double step_of(std::span<const double> values) {
  constexpr std::ptrdiff_t kSmallest = 20;  // one of so many
  const auto [low, high] = std::ranges::minmax(values);
  const auto extreme = [=](double value) { return value == low || value == high; };
  std::vector<double> changes;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double change = std::abs(values[i] - values[i - 1]);
    if (change > 0.0 && !extreme(values[i]) && !extreme(values[i - 1])) changes.push_back(change);
  }
  if (changes.empty()) return HUGE_VAL;
  const auto small = changes.begin() + std::ssize(changes) / kSmallest;
  std::ranges::nth_element(changes, small);
  return std::max(*small, quantum_of(values));
}

std::size_t repeats_of(std::span<const double> values) {
  std::size_t count = 0;
  for (std::size_t i = 1; i < values.size(); ++i) count += values[i] == values[i - 1];
  return count;
}

/// What a channel does in the rows in which it moves.
struct Repeats {
  std::size_t moving = 0, repeated = 0, stretches = 0;
  double other_moved = 0.0;     ///< the other channel along its trend, in the repeated rows
  double other_expected = 0.0;  ///< by its trend

  [[nodiscard]] bool is_held() const {
    return moving >= kFewestMoving && stretches >= kFewestTimes &&
           static_cast<double>(repeated) >= kShareRepeated * static_cast<double>(moving) &&
           other_expected > 0.0 && other_moved >= kShareOfTrend * other_expected;
  }
};

Repeats repeats_in(std::span<const double> values, std::span<const double> other) {
  constexpr double kSteps = 3.0;
  Repeats found;
  // Most recordings repeat too little to be looked at closely.
  if (repeats_of(values) < static_cast<std::size_t>(kShareRepeated * kFewestMoving)) return found;
  const double least = kSteps * step_of(values);
  bool before = false;  // repeats, too
  for (std::size_t i = 1; i < values.size(); ++i) {
    const bool moves = std::abs(trend(values, i)) >= least;
    const bool repeats = moves && values[i] == values[i - 1];
    found.moving += moves;
    found.repeated += repeats;
    found.stretches += repeats && !before;
    before = repeats;
    if (!repeats) continue;
    const double expected = trend(other, i);
    found.other_moved += std::copysign(1.0, expected) * (other[i] - other[i - 1]);
    found.other_expected += std::abs(expected);
  }
  return found;
}

std::string held_words(const Repeats& found, std::string_view held, std::string_view other) {
  return fmt::format(
      "the {} repeats its last reading in {} of {} rows while the {} moves: a logger that holds "
      "its "
      "value; take one row of each reading",
      held, found.repeated, found.moving, other);
}

}  // namespace

std::string repeated_readings(const Recording& recording) {
  const std::vector<double>& drive = recording.drive;
  const std::vector<double>& response = recording.response;
  if (drive.size() != response.size()) return {};
  const bool load_is_drive = is_load_imposed(recording);
  const std::string_view of_drive = load_is_drive ? load_word(recording) : answer_word(recording);
  const std::string_view of_response =
      load_is_drive ? answer_word(recording) : load_word(recording);
  if (const Repeats found = repeats_in(response, drive); found.is_held())
    return held_words(found, of_response, of_drive);
  if (const Repeats found = repeats_in(drive, response); found.is_held())
    return held_words(found, of_drive, of_response);
  return {};
}

}  // namespace tpm::fit
