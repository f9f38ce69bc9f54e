#pragma once
#include <map>
#include <string>

#include "tpm/store/json.hpp"

namespace tpm {

/// What changes from run to run and so stays out of the results: version, compiler, machine, date
/// and wall times.
/// @param seconds wall time of each part of the run
[[nodiscard]] Json run_record(const std::map<std::string, double>& seconds);

}  // namespace tpm
