#include "tpm/fit/select/file_remarks.hpp"

#include <fmt/format.h>

#include "tpm/base/text.hpp"

namespace tpm::fit {

void warn_of_rows_left_out(PreparedRecording& recording,
                           const std::vector<ImportFinding>& findings) {
  for (const ImportFinding& finding : findings) {
    if (finding.what != "missing") continue;
    recording.remarks.push_back(
        {"rows_left_out", fmt::format("{}: {}", recording.name, finding.value)});
  }
}

void take_instrument(PreparedRecording& recording, const std::filesystem::path& file) {
  const auto block = instrument_beside(file);
  if (!block) return;
  const Recording& r = recording.recording;
  recording.instrument = read_instrument(*block, quantity_dimension(r.response_quantity),
                                         quantity_dimension(r.drive_quantity),
                                         fmt::format("{}: instrument", file.string()));
  const auto& force = recording.instrument->force;
  if (!force || !(force->relative > 0.0)) return;
  recording.remarks.push_back(
      {"gain_not_in_intervals",
       fmt::format(
           "the gain of instrument {} (u {} %) is not in the intervals: it moves all stiffnesses "
           "alike; tpm validate and tpm budget count it",
           recording.instrument->id, significant(100.0 * force->relative, 2))});
}

}  // namespace tpm::fit
