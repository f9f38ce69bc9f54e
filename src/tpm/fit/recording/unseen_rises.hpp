#pragma once
#include <string>
#include <vector>

#include "tpm/fit/recording/prepared_recording.hpp"
#include "tpmkit/law_uncertainty.hpp"

namespace tpm::fit {

/// An interval between two samples in which the drive rose or fell, and what is known of the delay
/// of its centre against that of the straight line: a uniform distribution.
struct UnseenRise {
  double begin_s = 0.0, end_s = 0.0;
  double earliest_s = 0.0, latest_s = 0.0;  ///< delay, s
  /// Mean and standard deviation of that distribution.
  [[nodiscard]] DelayedRise expected() const {
    return {begin_s, end_s, 0.5 * (earliest_s + latest_s)};
  }
  [[nodiscard]] double u_s() const;
  /// Standard deviation of the prior of each of `rises` delays, s. Devices change at ticks of their
  /// clock: the delays of a recording are no independent draws, all may lie at the same end. An
  /// interval of 95 % contains what they do together, whatever the sampling.
  [[nodiscard]] double prior_sd_s(std::size_t rises) const;
};

/// Rises of up to the end of the window that the samples do not resolve. A rise within one
/// interval may be anywhere in it. One of two intervals of unequal change goes at a constant speed,
/// from that of the faster interval to that of a jump: it is late in the first and early in the
/// second. Of three to five intervals, the first and the last hold a corner, at its sharpest where
/// the drive is as fast there as at its fastest within the rise. Two of equal change, and more
/// samples, show a rise well enough.
[[nodiscard]] std::vector<UnseenRise> unseen_rises(const PreparedRecording& recording);

/// Ends the window of the recording before a gap in which the drive moved, and says so in its
/// remarks: an interval of many times the neighbouring ones, across which the drive neither rests
/// nor goes on as fast as before. How it moved is unknown for as long as the gap lasts, and the
/// tissue remembers it; within an interval of the sampling it is a rise (unseen_rises). Leaves the
/// window as it is where no ramp was recorded before the gap.
void end_before_unseen_motion(PreparedRecording& recording);

/// Adds the delay of each of these rises to what is estimated, with its prior (prior_sd_s).
/// @param i place of the recording in config.data
/// @param suffix of the names of the parameters
void add_rise_delays(FitConfig& config, const PreparedRecording& recording, std::size_t i,
                     const std::string& suffix);

/// One sentence on how the fit allows for the rises of the recording that were not recorded; empty
/// without such a rise.
[[nodiscard]] std::string unseen_rise_words(const PreparedRecording& recording);

/// Where a probe met the tissue within a jump of the drive, so that no sample tells at which depth:
/// says so, what the fit supposes, and the option that states it. Empty if the onset is sampled, if
/// contact is stated, and for recordings that are no indentations.
/// @param config that was fitted
[[nodiscard]] std::string contact_in_jump_words(const PreparedRecording& recording,
                                                const FitConfig& config);

}  // namespace tpm::fit
