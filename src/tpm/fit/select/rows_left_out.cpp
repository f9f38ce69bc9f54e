#include "tpm/fit/select/rows_left_out.hpp"

#include <fmt/format.h>

namespace tpm::fit {

void warn_of_rows_left_out(PreparedRecording& recording,
                           const std::vector<ImportFinding>& findings) {
  for (const ImportFinding& finding : findings) {
    if (finding.what != "missing") continue;
    recording.remarks.push_back(
        {"rows_left_out", fmt::format("{}: {}", recording.name, finding.value)});
  }
}

}  // namespace tpm::fit
