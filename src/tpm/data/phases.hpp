#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/curve.hpp"

namespace tpm::data {

/// Kinds of parts of a recording.
enum class PhaseKind {
  before_contact,  ///< the probe does not touch yet
  loading,         ///< the drive rises: the ramp
  hold,            ///< the drive is constant within its own jitter
  creep,           ///< the response is held constant and the drive still rises: force control
  unloading,       ///< the drive falls
  detached,        ///< the response is down at its floor before the drive is back
  recovery,        ///< what comes after the last detachment, whoever controls it
};

/// "before contact", "loading", ...
[[nodiscard]] std::string_view phase_name(PhaseKind kind) noexcept;

/// One phase: samples `first` to `last`, both included. Neighbours share the sample between them.
struct Phase {
  PhaseKind kind = PhaseKind::hold;
  std::size_t first = 0;
  std::size_t last = 0;
  double mean_rate = 0.0;     ///< drive per second: the straight line of least squares
  double typical_rate = 0.0;  ///< drive per second: the median over time, which leaves out how the
                              ///< machine speeds up and slows down
};

/// Values that a caller may state, which are found otherwise.
struct PhaseOptions {
  /// Contact is where the response passes this and stays there (SI, above 0), instead of where it
  /// leaves its noise.
  std::optional<double> contact_response;
  double hold_tolerance = 0.01;       ///< part of the drive's range that a held drive may creep
  std::size_t sustained_samples = 3;  ///< in a row that make a crossing, from 1
};

/// Phases of a recording. Indices count samples from 0.
struct RecordingPhases {
  std::vector<Phase> phases;  ///< in order; together they cover all samples
  bool contact_found = false;
  std::size_t contact_index = 0;   ///< first sample in contact; 0 if it was not found
  double contact_drive = 0.0;      ///< drive there, SI
  double peak_drive = 0.0;         ///< largest drive, SI
  double peak_response = 0.0;      ///< largest response, SI
  double floor_response = 0.0;     ///< level before contact: zero error or preload, SI
  double noise_sd_estimate = 0.0;  ///< of the response, in the longest hold if there is one, SI; 0
                                   ///< if there are too few samples
  double drive_jitter_sd = 0.0;    ///< of the drive, SI
  bool preloaded = false;  ///< the response is above 0 and rises with the first movement. A zero
                           ///< error of the force cell looks the same
  std::optional<std::size_t> detachment_index;  ///< first sample of the last phase `detached`
  std::vector<std::string> summary;             ///< all of this in sentences, oddities first
};

/// Finds the phases of a recording from its drive, and contact and detachment from its response.
/// Contact and detachment are looked for only where a depth is imposed and a contact force
/// observed. Whatever is odd (no contact, no hold, a response that falls under load) is no error
/// but a sentence in `summary`.
///
/// Throws Error(bad_input), naming the recording, if it has no times or no drive, fewer than 3
/// samples, or a value that is not finite.
[[nodiscard]] RecordingPhases find_phases(const Recording& recording,
                                          const PhaseOptions& options = {});

}  // namespace tpm::data
