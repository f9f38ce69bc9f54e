#include "tpm/show/run_record.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/utsname.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "tpm/base/text.hpp"
#include "tpmkit/version.hpp"

namespace tpm::show {
namespace {

/// "model name : ..." of /proc/cpuinfo; "unknown" where there is none.
std::string processor_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("model name")) continue;
    const auto colon = line.find(": ");
    if (colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

}  // namespace

Json run_record(const std::map<std::string, double>& seconds) {
  utsname system{};
  const bool known = uname(&system) == 0;
  const auto now =
      std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
  Json record{{"tpm_version", version()}, {"compiler", __VERSION__}};
  record["finished_at_UTC"] = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now));
  record["system"] = known ? fmt::format("{} {}", system.sysname, system.release) : "unknown";
  record["architecture"] = known ? system.machine : "unknown";
  record["processor"] = processor_name();
  record["processors"] = std::thread::hardware_concurrency();
  for (const auto& [part, time] : seconds) record["seconds"][part] = rounded(time, 3);
  return record;
}

}  // namespace tpm::show
