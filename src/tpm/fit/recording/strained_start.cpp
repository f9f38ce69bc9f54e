#include "tpm/fit/recording/strained_start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/sized_unit.hpp"

namespace tpm::fit {

std::optional<Remark> strained_start_remark(const PreparedRecording& recording) {
  constexpr double kSure = 6.0;  // standard deviations of a reading
  constexpr double kOfRange = 0.01;
  const Recording& r = recording.recording;
  if (r.drive_quantity != Quantity::strain || recording.load_imposed) return std::nullopt;
  const auto [low, high] = std::ranges::minmax_element(r.drive);
  const double least =
      std::max(kOfRange * (*high - *low), kSure * recording.phases.drive_jitter_sd);
  const double start = r.drive.front();
  if (std::abs(start) <= least) return std::nullopt;
  const double stress = r.response.front();
  const bool loaded = std::abs(stress) > kSure * recording.phases.noise_sd_estimate;
  return Remark{
      "strain_from_start",
      fmt::format(
          "{}: the strain starts at {} and counts from there, as if the specimen were "
          "unloaded at the first sample{}; --contact \"0\" counts from the column's own zero",
          recording.name, sized_text(quantity_dimension(r.drive_quantity), start, 3),
          loaded ? fmt::format(", where it reads {}",
                               sized_text(quantity_dimension(r.response_quantity), stress, 3))
                 : "")};
}

}  // namespace tpm::fit
