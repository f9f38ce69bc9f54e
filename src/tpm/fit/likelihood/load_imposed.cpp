#include "tpm/fit/likelihood/load_imposed.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "tpm/data/phases.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {

namespace {

bool is_pressed(const Recording& recording) noexcept {
  return recording.drive_quantity == Quantity::contact_force &&
         recording.response_quantity == Quantity::indentation_depth;
}

double mean_reading(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

bool is_load_imposed(const Recording& recording) noexcept {
  return is_pressed(recording) || (recording.drive_quantity == Quantity::stress &&
                                   recording.response_quantity == Quantity::strain);
}

std::string_view load_word(const Recording& recording) noexcept {
  const auto is_force = [](Quantity q) { return q == Quantity::contact_force; };
  return is_force(recording.drive_quantity) || is_force(recording.response_quantity) ? "force"
                                                                                     : "stress";
}

Recording with_imposed_load(Recording recording) {
  std::swap(recording.drive, recording.response);
  std::swap(recording.drive_quantity, recording.response_quantity);
  recording.response_sd.clear();
  if (!is_pressed(recording)) return recording;
  const auto rest = std::span(recording.drive).first(samples_before_load(recording));
  if (!rest.empty()) std::ranges::fill(rest, mean_reading(rest));
  return recording;
}

std::size_t samples_before_load(const Recording& recording) {
  constexpr std::size_t kFewest = 3;
  constexpr double kNoPreload = 0.05;  // of the largest force
  if (!is_pressed(recording)) return 0;
  const std::vector<Phase> phases = find_phases(recording).phases;
  if (phases.size() < 2 || phases.front().kind != PhaseKind::hold) return 0;
  const std::size_t count = phases.front().last + 1;
  const double most = *std::ranges::max_element(recording.drive);
  const double level = mean_reading(std::span(recording.drive).first(count));
  return count < kFewest || std::abs(level) > kNoPreload * most ? 0 : count;
}

std::string_view answer_word(const Recording& recording) noexcept {
  return load_word(recording) == "force" ? "depth" : "strain";
}

Quantity law_drive(const Recording& recording) noexcept {
  return is_load_imposed(recording) ? recording.response_quantity : recording.drive_quantity;
}

Quantity law_response(const Recording& recording) noexcept {
  return is_load_imposed(recording) ? recording.drive_quantity : recording.response_quantity;
}

Protocol imposed_history(const Recording& recording) {
  const Drive drive = is_load_imposed(recording) ? Drive::force : Drive::displacement;
  Protocol history = measured_history(drive, recording.time_s, recording.drive);
  history.set_equilibrium_at_start(true);
  return history;
}

void require_imposed_motion(const Recording& recording, std::string_view name,
                            std::string_view what) {
  if (!is_load_imposed(recording)) return;
  throw bad_input(fmt::format("recording '{}'", name),
                  fmt::format("the {} was imposed (it was held while the {} went on: creep)",
                              load_word(recording), answer_word(recording)),
                  fmt::format("an imposed {} for {}", answer_word(recording), what));
}

}  // namespace tpm::fit
