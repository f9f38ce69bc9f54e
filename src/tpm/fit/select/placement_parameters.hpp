#pragma once
#include <span>
#include <string_view>
#include <vector>

#include "tpm/fit/likelihood/config.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {

/// Automatic bounds, and how far they may be moved out; nowhere, if they are physical.
struct AutomaticBounds {
  FitParameter fit;
  std::optional<WidestBounds> widest;
};

void add_automatic(FitConfig& config, AutomaticBounds bounds, std::vector<Target> sets);

/// Drive at which the phases of a recording say that contact begins.
[[nodiscard]] double start_drive(const PreparedRecording& recording);

/// Refuses a depth of contact that is held and that a recording does not go beyond. Throws
/// Error(usage).
/// @param where what stated it: "--contact"
void require_contact_within(double contact, std::span<const PreparedRecording> recordings,
                            std::string_view where);

/// Adds a drift of the zero that the recording does not tell from a slow branch: with what its
/// rests say of it as a prior, or freely.
/// @param place of the recording in the configuration
void add_possible_drift(FitConfig& config, const PreparedRecording& recording, std::size_t place);

/// Adds what belongs to the recordings and not to the material: zero, contact and drift of each,
/// with what was measured of them (measure_placement) as priors, or holds them where the user
/// stated them. Marks the lasting stiffness as not separable where no recording tells a drift from
/// a slow branch.
void add_placement(FitConfig& config, const LawModel& model,
                   std::span<const PreparedRecording> recordings, const SetupOptions& options);

}  // namespace tpm::fit
