// Prints the measured numbers of reports/haptics/report.md, "What a cycle takes", as CSV:
//     measure_hil_step SESSION... [ROUNDS]
// A whole cycle (simulated device with its operator, model, contact, passivity, limits,
// row into the log) in virtual time, on the first 12 s of each session. Each cycle's time is the
// least of ROUNDS equal runs (default 5), so that what else the machine does falls out; p50, p99
// and the largest are of those.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/files/row_log.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpm/haptics/session/session_run.hpp"

using namespace tpm;
using namespace tpm::haptics;

namespace {

double quantile(std::vector<double> times, double share) {
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(times.size() - 1));
  std::nth_element(times.begin(), times.begin() + place, times.end());
  return times[static_cast<std::size_t>(place)];
}

/// Time of each cycle, us, of one run; the model starts at rest.
std::vector<double> times_of(const HilSession& session, ContactModel& model,
                             const ServoSettings& settings, std::size_t cycles,
                             const std::filesystem::path& path) {
  VirtualOmega7 device(session.plant, session.operator_script());
  (void)device.open();
  device.prepare(session.preparation);
  device.enable_forces();
  ServoStep step(device, model, settings);
  RowLogWriter log(path, "{}", sizeof(ServoRecord));
  std::vector<double> times;
  times.reserve(cycles);
  ServoRecord row;
  for (std::size_t i = 0; i < cycles; ++i) {
    const std::int64_t begin = now_ns();
    const StopCause cause = step.cycle(0, row);
    log.append(&row);
    device.advance(settings.period_s);
    times.push_back(1e-3 * static_cast<double>(now_ns() - begin));
    if (cause != StopCause::none) break;
  }
  return times;
}

void measure(const std::string& file, int rounds) {
  constexpr double kLongest_s = 12.0;
  const HilSession session = read_session(file);
  const LoopModel loop = make_loop_model(session);
  const ServoSettings settings =
      loop_settings(session, loop, check_rendering(session, *loop.model, loop, "virtual"), true);
  const auto cycles =
      static_cast<std::size_t>(std::min(kLongest_s, session.duration_s()) / settings.period_s);
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / fmt::format("measure_hil_step_{}.rows", now_ns());
  std::vector<double> least;
  for (int round = 0; round < rounds; ++round) {
    const std::vector<double> times = times_of(session, *loop.model, settings, cycles, path);
    if (least.empty()) least = times;
    for (std::size_t i = 0; i < times.size(); ++i) least[i] = std::min(least[i], times[i]);
  }
  std::filesystem::remove(path);
  fmt::print("{},\"{}\",{:.0f},{},{:.2f},{:.2f},{:.2f}\n", file, loop.name, 1.0 / settings.period_s,
             least.size(), quantile(least, 0.5), quantile(least, 0.99), quantile(least, 1.0));
  (void)std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> files(argv + 1, argv + argc);
  int rounds = 5;
  if (!files.empty() && files.back().find_first_not_of("0123456789") == std::string::npos) {
    rounds = std::stoi(files.back());
    files.pop_back();
  }
  if (files.empty() || rounds < 1) {
    fmt::print(stderr, "measure_hil_step SESSION... [ROUNDS]\n");
    return 2;
  }
  try {
    fmt::print("session,model,rate_Hz,cycles,p50_us,p99_us,largest_us\n");
    for (const std::string& file : files) measure(file, rounds);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "measure_hil_step: {}\n", error.what());
    return 3;
  }
}
