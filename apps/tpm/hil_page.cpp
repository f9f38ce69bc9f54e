// The page of tpm hil run: when it begins, and when it ends.
#include "hil_page.hpp"

#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cstdio>
#include <system_error>
#include <thread>

#include "command.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace {

double page_time_s(const std::string& text, const char* option) {
  constexpr double kLongest_s = 3600.0;
  const double time_s = option_quantity(text, Dimension::time, option);
  if (time_s >= 0.0 && time_s <= kLongest_s) return time_s;
  throw Error(ExitCode::usage, option, text, "0 to 3600 s");
}

/// Until done() or the time is over.
void linger(double seconds, const std::function<bool()>& done) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < until && !done()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

}  // namespace

int port_of_option(const std::string& text, const char* option) {
  constexpr int kLeast = 1024, kMost = 65535;
  int port = -1;
  const auto [stop, status] = std::from_chars(text.data(), text.data() + text.size(), port);
  const bool whole = status == std::errc{} && stop == text.data() + text.size();
  if (whole && (port == 0 || (port >= kLeast && port <= kMost))) return port;
  throw Error(ExitCode::usage, option, whole ? text : fmt::format("'{}'", printable(text)),
              "0 for a port that is free, or 1024 to 65535");
}

HilPage::HilPage(const HilSession& session, bool real_time, const PageOptions& options)
    : view_(session, real_time),
      wait_s_(page_time_s(options.wait, "--page-wait")),
      keep_s_(page_time_s(options.keep, "--page-keep")),
      server_(view_, port_of_option(options.port, "--page")) {
  tell_user("page: {}\n", server_.address());
}

void HilPage::show(SessionRunOptions& options) {
  options.opened = [this, interrupted = options.interrupted](const DeviceIdentity& device,
                                                             const LoopModel& model) {
    view_.opened(device, model);
    linger(wait_s_, [&] { return view_.watched() || interrupted(); });
  };
}

void HilPage::end(const ServoOutcome& outcome, const std::function<bool()>& interrupted) {
  view_.ended(outcome);
  if (view_.watched()) linger(keep_s_, interrupted);
}

}  // namespace tpm::app
