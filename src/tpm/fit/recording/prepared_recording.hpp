#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/data/phases.hpp"
#include "tpm/files/instrument.hpp"
#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// A recording ready to be fitted: what happened in it and which part is used.
struct PreparedRecording {
  std::string name;  ///< unique within a fit; a path where the configuration is to be rerun
  Recording recording;
  RecordingPhases phases;
  double from_s = 0.0;        ///< window that is fitted: from the start
  double to_s = 0.0;          ///< to the end of the first hold (before the drive first falls back)
  ImportOptions import;       ///< with which it was read, for the configuration
  std::string specimen = {};  ///< whose repeat it is, in a folder; empty: a specimen of its own
  /// Limits of the force cell: readings that stand there are censored, SI.
  std::optional<double> clipped_above = std::nullopt, clipped_below = std::nullopt;
  bool load_imposed = false;  ///< creep: drive and response of `recording` have changed places
  std::vector<Remark> remarks = {};  ///< what the recording cannot tell
  std::string read_as = {};          ///< how its columns and units were understood, in one sentence
  std::optional<double> contact_response = std::nullopt;  ///< at which contact was said to begin
  bool contact_held = false;  ///< contact is where a stated force is passed: it is not fitted
  std::string start_up = {};  ///< what is left out after a step, in one sentence; empty: nothing
  std::optional<Instrument> instrument = std::nullopt;  ///< if it is stated (take_instrument)
};

/// Time between two samples, at the median.
[[nodiscard]] double median_step(std::span<const double> time_s);

}  // namespace tpm::fit
