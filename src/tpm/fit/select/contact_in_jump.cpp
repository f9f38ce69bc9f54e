#include "tpm/fit/select/contact_in_jump.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"

namespace tpm::fit {
namespace {

/// The samples between which the drive jumps into the tissue.
struct JumpIntoContact {
  std::size_t before = 0, after = 0;
};

/// None if the drive goes on beyond contact by small steps, or as in a ramp of few samples.
std::optional<JumpIntoContact> jump_into_contact(const PreparedRecording& r) {
  constexpr double kJump = 0.1;      // of the travel: coefficients are as uncertain
  constexpr double kMuchOfIt = 0.3;  // of the travel: a jump, whatever follows
  constexpr double kLikeARamp = 0.5;
  const std::vector<double>& drive = r.recording.drive;
  const std::size_t contact = r.phases.contact_index;
  if (contact + 1 >= drive.size()) return std::nullopt;
  const double begin =
      *std::min_element(drive.begin(), drive.begin() + static_cast<std::ptrdiff_t>(contact) + 1);
  const double travel = r.phases.peak_drive - begin;
  const double jump = drive[contact + 1] - drive[contact];
  const double next = contact + 2 < drive.size() ? drive[contact + 2] - drive[contact + 1] : 0.0;
  const bool of_a_ramp = jump <= kMuchOfIt * travel && next > kLikeARamp * jump;
  if (!(jump > kJump * travel) || of_a_ramp) return std::nullopt;
  return JumpIntoContact{contact, contact + 1};
}

}  // namespace

std::string contact_in_jump_words(const PreparedRecording& r, const FitConfig& config) {
  const bool pressed = r.recording.drive_quantity == Quantity::indentation_depth &&
                       r.recording.response_quantity == Quantity::contact_force;
  if (!pressed || r.load_imposed || r.contact_held || !r.phases.contact_found) return {};
  const auto jump = jump_into_contact(r);
  if (!jump) return {};
  const auto depth = [&r](std::size_t i) {
    return sized_text(Dimension::length, r.recording.drive[i], 4);
  };
  const std::string start = depth(jump->before);
  const bool searched = std::ranges::any_of(config.parameters, [](const EstimatedParameter& p) {
    return p.fit.name.starts_with("contact");
  });
  return fmt::format(
      "{}: contact lies within a jump of the drive, from {} at {} s to {} at {} s, and no sample "
      "tells where: {}; --contact \"{}\" states that the probe touched before the jump",
      r.name, start, significant(r.recording.time_s[jump->before], 6), depth(jump->after),
      significant(r.recording.time_s[jump->after], 6),
      searched ? "contact is fitted from what follows"
               : fmt::format("every coefficient supposes {}", start),
      start);
}

}  // namespace tpm::fit
