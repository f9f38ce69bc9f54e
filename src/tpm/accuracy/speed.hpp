#pragma once
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace tpm::accuracy {

/// A named piece of work whose processor time is followed from commit to commit.
struct SpeedWork {
  std::string_view name, summary;
  /// Sets the work up and returns it; what it is set up with is not timed.
  std::function<std::function<void()>()> prepare;
};

/// In the order in which they are measured.
[[nodiscard]] const std::vector<SpeedWork>& speed_works();

/// Those named, or all. Throws Error(usage) for a name that is none.
[[nodiscard]] std::vector<SpeedWork> chosen_speed_works(const std::vector<std::string>& names);

struct SpeedOptions {
  int repeats = 20;       ///< of every work, >= 1
  double least_s = 0.02;  ///< shorter work is done several times within a repeat
};

/// Processor time of one piece of work, s, over the repeats.
struct SpeedRow {
  std::string work;
  int repeats = 0;
  long times_per_repeat = 0;
  double median_s = 0.0, lower_quartile_s = 0.0, upper_quartile_s = 0.0, least_s = 0.0;
  double calibration_s = 0.0;  ///< median of a fixed loop in the same repeats
  double ratio = 0.0;          ///< median over the repeats of the work's time over the loop's
};

/// Measures works in turn, each repeat with the calibration loop just before: what slows the
/// machine down for a while slows both.
/// @param done called after each repeat of a work
[[nodiscard]] std::vector<SpeedRow> measure_speed(const std::vector<SpeedWork>& works,
                                                  const SpeedOptions& options,
                                                  const std::function<void()>& done);

}  // namespace tpm::accuracy
