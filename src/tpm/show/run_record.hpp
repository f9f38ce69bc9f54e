#pragma once
#include <chrono>
#include <map>
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"

namespace tpm::show {

/// Facts that change from run to run and so stay out of the results: version, compiler, machine,
/// date and wall times.
/// @param seconds wall time of each part of the run
[[nodiscard]] Json run_record(const std::map<std::string, double>& seconds);

/// Wall time of a call, noted under a name.
template <class Work>
auto timed(std::map<std::string, double>& seconds, const char* part, Work work) {
  const auto start = std::chrono::steady_clock::now();
  auto result = work();
  seconds[part] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace tpm::show
