// Numbers of docs/haptics.md are those of the code.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <string>

#include "tpm/files/file.hpp"
#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/inverse/force_comparison.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpm/haptics/serve/driver_log.hpp"
#include "tpm/haptics/serve/inverse_server.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;

/// The page with its lines joined.
std::string haptics_page() {
  std::string page = files::read_file(TPM_TEST_SOURCE_DIR "/docs/haptics.md");
  for (std::size_t at = 0; (at = page.find('\n', at)) != std::string::npos;) {
    std::size_t end = at;
    while (end < page.size() && (page[end] == '\n' || page[end] == ' ')) ++end;
    page.replace(at, end - at, " ");
  }
  return page;
}

TEST_CASE("The page about haptic devices states the limits that the code has") {
  const std::string page = haptics_page();
  const auto ms = [](double seconds) { return fmt::format("{:g} ms", 1e3 * seconds); };
  CHECK_THAT(page, Contains("only late states for " + ms(ServoStep::kMostStale_s)));
  CHECK_THAT(page, Contains(ms(kDriverSilence_s) + " after its last command"));
  CHECK_THAT(page, Contains("commands of the last " + ms(ForceComparison::kLate_s)));
  CHECK_THAT(
      page, Contains(fmt::format("more than {:g} N plus {:g} % that lasts for {:g} s",
                                 ForceComparison::kTolerance_N, 100.0 * ForceComparison::kTolerance,
                                 ForceComparison::kLasts_s)));
  CHECK_THAT(page, Contains(fmt::format("stays within {:g} mm of the centre",
                                        1e3 * limits_of("virtual").reach_m)));
  CHECK_THAT(page, Contains(fmt::format("of {:g} mm diameter and {:g} mm length",
                                        2e3 * kOmega7Workspace.radius_m,
                                        2e3 * kOmega7Workspace.half_length_m)));
  CHECK_THAT(page, Contains(fmt::format("A message has at most {} KiB", kMostMessageBytes / 1024)));
  CHECK_THAT(page,
             Contains(fmt::format("At most {} clients connect", InverseServer::kMostConnections)));
  CHECK_THAT(page, Contains(fmt::format("After {} such changes", DriverLog::kMost)));
}

}  // namespace
}  // namespace tpm::haptics
