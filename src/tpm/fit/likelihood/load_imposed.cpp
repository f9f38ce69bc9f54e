#include "tpm/fit/likelihood/load_imposed.hpp"

#include <fmt/format.h>

#include <utility>

#include "tpmkit/error.hpp"

namespace tpm::fit {

bool is_load_imposed(const Recording& recording) noexcept {
  return recording.drive_quantity == Quantity::stress &&
         recording.response_quantity == Quantity::strain;
}

Recording with_imposed_load(Recording recording) {
  std::swap(recording.drive, recording.response);
  std::swap(recording.drive_quantity, recording.response_quantity);
  recording.response_sd.clear();
  return recording;
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
                  "the stress was imposed (it was held while the strain went on: creep)",
                  fmt::format("an imposed strain for {}", what));
}

}  // namespace tpm::fit
