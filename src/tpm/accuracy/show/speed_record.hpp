#pragma once
#include <filesystem>

#include "tpm/accuracy/speed.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"

namespace tpm::accuracy {

/// Values that the rows of one measurement share.
struct SpeedOrigin {
  std::string commit;  ///< that the program was built from, as told; "unknown"
};

/// Appends rows to a CSV file that is kept: what was in it stays. A new file gets a first row of
/// names.
/// Throws Error(bad_input) if the file's first row is not that of a speed record,
/// Error(environment) if it cannot be written.
void append_speed_record(const std::filesystem::path& file, const std::vector<SpeedRow>& rows,
                         const SpeedOrigin& origin);

/// For --format json: a list `works` of the same columns.
[[nodiscard]] Json speed_json(const std::vector<SpeedRow>& rows, const SpeedOrigin& origin);

/// A table for people.
[[nodiscard]] std::string speed_text(const std::vector<SpeedRow>& rows);

}  // namespace tpm::accuracy
