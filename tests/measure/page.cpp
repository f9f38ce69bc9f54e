// Prints the measured numbers of reports/haptics/report.md, "The page", as CSV: what the servo
// loop's wake-ups and cycles take on the clock with and without a page and those who ask for it.
//     measure_page SESSION SECONDS ROUNDS
// Cases take turns, so that what else the machine does meets all of them; `least` is the least over
// the rounds.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "program.hpp"
#include "raw_client.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpm/haptics/session/page_server.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::haptics;
using namespace std::chrono_literals;
using test::RawClient;

namespace {

struct Case {
  const char* name;
  bool page = false;
  int browsers = 0;
  bool slow = false, hostile = false;
};

constexpr std::array kCases{
    Case{"no page"},
    Case{"page, nobody asks", true},
    Case{"one client at 25 Hz", true, 1},
    Case{"two clients at 25 Hz", true, 2},
    Case{"two clients and 8 that never finish", true, 2, true},
    Case{"two clients and hostile requests without pause", true, 2, false, true}};

/// Those who ask, on threads of their own, until destroyed.
class Audience {
 public:
  Audience(const Case& of, int port) : port_(port) {
    for (int i = 0; i < of.browsers; ++i) repeat([this] { ask(); }, 40ms);
    if (of.slow) repeat([this] { stall(); }, 0ms);
    if (of.hostile) repeat([this] { annoy(); }, 0ms);
  }
  ~Audience() {
    over_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  Audience(const Audience&) = delete;
  Audience& operator=(const Audience&) = delete;
  [[nodiscard]] long answers() const { return answers_; }

 private:
  void repeat(const std::function<void()>& act, std::chrono::milliseconds pause) {
    threads_.emplace_back([this, act, pause] {
      while (!over_) {
        act();
        std::this_thread::sleep_for(pause);
      }
    });
  }
  [[nodiscard]] std::string host() const {
    return fmt::format("Host: 127.0.0.1:{}\r\n\r\n", port_);
  }
  void ask() {
    const RawClient client(port_);
    client.send("GET /state.json?after=100000 HTTP/1.1\r\n" + host());
    if (client.answer(1.0).starts_with("HTTP/1.1 200")) ++answers_;
  }
  void stall() {
    std::vector<std::unique_ptr<RawClient>> clients;
    for (int i = 0; i < 8; ++i) {
      clients.push_back(std::make_unique<RawClient>(port_));
      clients.back()->send("GET / HTTP/1.1\r\nHost:");
    }
    for (int i = 0; i < 20 && !over_; ++i) std::this_thread::sleep_for(100ms);
  }
  void annoy() {
    const std::array requests{
        "GET /../../etc/passwd HTTP/1.1\r\n" + host(),
        "GET /" + std::string(100'000, 'a') + " HTTP/1.1\r\n" + host(),
        std::string("POST / HTTP/1.1\r\nContent-Length: 1000000000\r\n") + host(),
        std::string("\x16\x03\x01 garbage\r\n\r\n")};
    const RawClient client(port_);
    client.send(requests[static_cast<std::size_t>(annoyed_++) % requests.size()]);
    (void)client.answer(0.2);
    ++answers_;
  }

  int port_;
  std::atomic<bool> over_{false};
  std::atomic<long> answers_{0}, annoyed_{0};
  std::vector<std::thread> threads_;
};

struct Measured {
  ServoOutcome outcome;
  long answers = 0;
};

Measured run(const HilSession& session, const Case& of, double seconds) {
  LiveView view(session, true);
  std::optional<PageServer> server;
  std::optional<Audience> audience;
  if (of.page) server.emplace(view, 0);
  SessionRunOptions options;
  options.real_time = true;
  options.recording = std::filesystem::temp_directory_path() / "tpm_measure_page.tpmrec";
  options.opened = [&](const DeviceIdentity& device, const LoopModel& model) {
    if (!of.page) return;
    view.opened(device, model);
    audience.emplace(of, server->port());
  };
  options.watcher = [&](const ServoRecord& row) {
    if (of.page) view.see(row);
  };
  options.interrupted = [seconds, end_ns = std::int64_t{0}]() mutable {
    if (end_ns == 0) end_ns = now_ns() + static_cast<std::int64_t>(1e9 * seconds);
    return now_ns() > end_ns;
  };
  Measured measured;
  measured.outcome = run_session(session, {}, options).outcome;
  if (audience) measured.answers = audience->answers();
  std::filesystem::remove(options.recording);
  return measured;
}

void measure(HilSession session, double seconds, int rounds) {
  session.servo.most_late = 1001;  // it is to be measured, not stopped
  session.servo.most_missed = 1'000'000;
  session.cycle_timeout_s = 1.0;
  session.plant.watchdog_s = 1e3;
  session.preparation.watchdog_s = 1e3;
  fmt::print(
      "case,round,cause,cycles,missed,dropped,woke_p50_us,woke_p99_us,woke_p999_us,woke_max_us,"
      "step_p50_us,step_p99_us,step_max_us,answers\n");
  std::vector<std::array<double, 2>> least(kCases.size(), {1e9, 1e9});
  std::string scheduling;
  for (int round = 1; round <= rounds; ++round) {
    for (std::size_t k = 0; k < kCases.size(); ++k) {
      const Measured m = run(session, kCases[k], seconds);
      const ServoOutcome& o = m.outcome;
      const auto us = [](double time_s) { return 1e6 * time_s; };
      fmt::print("{},{},{},{},{},{},{:.0f},{:.0f},{:.0f},{:.0f},{:.0f},{:.0f},{:.0f},{}\n",
                 kCases[k].name, round, to_string(o.cause), o.cycles, o.counts.missed,
                 o.dropped_records, us(o.woke_late.quantile_s(0.5)),
                 us(o.woke_late.quantile_s(0.99)), us(o.woke_late.quantile_s(0.999)),
                 us(o.woke_late.max_s()), us(o.busy.quantile_s(0.5)), us(o.busy.quantile_s(0.99)),
                 us(o.busy.max_s()), m.answers);
      std::fflush(stdout);
      least[k][0] = std::min(least[k][0], us(o.woke_late.quantile_s(0.99)));
      least[k][1] = std::min(least[k][1], us(o.busy.quantile_s(0.99)));
      scheduling = o.scheduling;
    }
  }
  fmt::print("least over the rounds: case,woke_p99_us,step_p99_us\n");
  for (std::size_t k = 0; k < kCases.size(); ++k) {
    fmt::print("{},{:.0f},{:.0f}\n", kCases[k].name, least[k][0], least[k][1]);
  }
  fmt::print("{}; {}\n", host_line(), scheduling);
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(argc, argv, 3, 3, "measure_page SESSION SECONDS ROUNDS",
                        [](const auto& words) {
                          measure(read_session(words[0]), std::stod(words[1]), std::stoi(words[2]));
                        });
}
