#include "tpm/haptics/loop/real_time.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/utsname.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <fstream>
#include <string_view>
#include <thread>

#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::size_t kBins = 50'000;
constexpr int kPriority = 80;  // below the kernel's own threads of interrupts that matter

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  std::string line;
  while (std::getline(info, line)) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown processor";
}

}  // namespace

std::int64_t now_ns() noexcept {
  timespec now{};
  (void)clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * kSecond_ns + now.tv_nsec;
}

std::string utc_of(std::int64_t instant_ns) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000, kMillisecond_ns = 1'000'000;
  timespec wall{};
  clock_gettime(CLOCK_REALTIME, &wall);
  const std::int64_t now = std::int64_t{wall.tv_sec} * kSecond_ns + wall.tv_nsec;
  const std::int64_t then = now - (now_ns() - instant_ns);
  const auto seconds = static_cast<std::time_t>(then / kSecond_ns);
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  char text[32];
  const std::size_t length = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
  return fmt::format("{}.{:03}Z", std::string_view(text, length),
                     then % kSecond_ns / kMillisecond_ns);
}

void sleep_until_ns(std::int64_t instant_ns) noexcept {
  timespec until{};
  until.tv_sec = instant_ns / kSecond_ns;
  until.tv_nsec = instant_ns % kSecond_ns;
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

std::string become_real_time(RealTimeWish wish) {
  const int memory = mlockall(MCL_CURRENT | MCL_FUTURE) == 0 ? 0 : errno;
  sched_param parameter{};
  parameter.sched_priority = kPriority;
  const int schedule = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
  if (wish == RealTimeWish::enforce && (memory != 0 || schedule != 0)) {
    throw Error(ExitCode::environment, "real time",
                fmt::format("{} was refused: {}", schedule != 0 ? "SCHED_FIFO" : "locked memory",
                            std::strerror(schedule != 0 ? schedule : memory)),
                "rtprio and memlock limits for this user, or --real-time ignore");
  }
  return fmt::format(
      "scheduling: {}; memory: {}",
      schedule == 0 ? fmt::format("SCHED_FIFO, priority {}", kPriority)
                    : fmt::format("SCHED_OTHER, because SCHED_FIFO was refused ({}): other "
                                  "programs can delay a cycle",
                                  std::strerror(schedule)),
      memory == 0 ? "locked"
                  : fmt::format("not locked ({}): a page that is swapped out delays a cycle",
                                std::strerror(memory)));
}

AboveRealTime::AboveRealTime() noexcept {
  sched_param parameter{};
  if (pthread_getschedparam(pthread_self(), &policy_, &parameter) != 0) return;
  priority_ = parameter.sched_priority;
  parameter.sched_priority = kPriority + 1;
  raised_ = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter) == 0;
}

AboveRealTime::~AboveRealTime() {
  if (!raised_) return;
  sched_param parameter{};
  parameter.sched_priority = priority_;
  (void)pthread_setschedparam(pthread_self(), policy_, &parameter);
}

std::string host_line() {
  utsname name{};
  (void)uname(&name);
  return fmt::format("{} {}, {}, {} cores", name.sysname, name.release, processor(),
                     std::thread::hardware_concurrency());
}

TimeHistogram::TimeHistogram() : bins_(kBins, 0) {}

void TimeHistogram::note(std::int64_t ns) noexcept {
  const std::int64_t time = std::max<std::int64_t>(ns, 0);
  const auto bin = static_cast<std::size_t>(time / 1000);
  if (bin < kBins) ++bins_[bin];
  ++count_;
  max_ns_ = std::max(max_ns_, time);
}

double TimeHistogram::quantile_s(double share) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    seen += bins_[bin];
    if (seen >= wanted && seen > 0) return static_cast<double>(bin + 1) * 1e-6;
  }
  return max_s();
}

}  // namespace tpm::haptics
