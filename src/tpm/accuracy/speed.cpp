#include "tpm/accuracy/speed.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <ctime>

#include "tpm/accuracy/runner.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {
namespace {

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The same additions and multiplications on every machine and in every version, on numbers that
/// stay in the first cache. Never change it: ratios of different days would not compare.
void calibration_loop() {
  constexpr int kRounds = 12'000;
  std::array<double, 1024> x{};
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 1.0 / static_cast<double>(i + 1);
  for (int round = 0; round < kRounds; ++round) {
    const double factor = 0.5 + 1e-5 * round;
    for (std::size_t i = 1; i < x.size(); ++i) x[i] = 0.5 * (x[i] + factor * x[i - 1]);
  }
  const volatile double kept = x.back();  // else the loop could be left out
  static_cast<void>(kept);
}

double seconds_of(const std::function<void()>& work, long times) {
  const double start = processor_s();
  for (long i = 0; i < times; ++i) work();
  return (processor_s() - start) / static_cast<double>(times);
}

}  // namespace

std::vector<SpeedWork> chosen_speed_works(const std::vector<std::string>& names) {
  if (names.empty()) return speed_works();
  std::vector<SpeedWork> chosen;
  for (const std::string& name : names) {
    const auto& all = speed_works();
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const SpeedWork& w) { return w.name == name; });
    if (found == all.end()) {
      throw unknown_word("--append-to", "no work", name, mapped<std::string>(all, &SpeedWork::name))
          .with_code(ExitCode::usage);
    }
    chosen.push_back(*found);
  }
  return chosen;
}

std::vector<SpeedRow> measure_speed(const std::vector<SpeedWork>& works,
                                    const SpeedOptions& options,
                                    const std::function<void()>& done) {
  std::vector<SpeedRow> rows;
  for (const SpeedWork& work : works) {
    const std::function<void()> run = work.prepare();
    const double once_s = seconds_of(run, 1);  // and what is slow the first time is over
    SpeedRow row;
    row.work = work.name;
    row.repeats = options.repeats;
    row.times_per_repeat =
        std::max(1L, static_cast<long>(options.least_s / std::max(once_s, 1e-9)));
    std::vector<double> taken;
    std::vector<double> calibration;
    std::vector<double> ratio;
    for (int i = 0; i < options.repeats; ++i) {
      calibration.push_back(seconds_of(calibration_loop, 1));
      taken.push_back(seconds_of(run, row.times_per_repeat));
      ratio.push_back(taken.back() / calibration.back());
      done();
    }
    for (auto* list : {&taken, &calibration, &ratio}) std::sort(list->begin(), list->end());
    row.median_s = quantile_of_sorted(taken, 0.5);
    row.lower_quartile_s = quantile_of_sorted(taken, 0.25);
    row.upper_quartile_s = quantile_of_sorted(taken, 0.75);
    row.least_s = taken.front();
    row.calibration_s = quantile_of_sorted(calibration, 0.5);
    row.ratio = quantile_of_sorted(ratio, 0.5);
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace tpm::accuracy
