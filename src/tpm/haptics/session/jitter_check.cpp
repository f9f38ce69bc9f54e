#include "tpm/haptics/session/jitter_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/distributions.hpp"
#include "tpm/base/text.hpp"
#include "tpm/haptics/loop/empty_space.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

HilSession idle_session(const HilSession& like, double duration_s) {
  HilSession session;
  session.servo.period_s = like.servo.period_s;
  session.servo.phase_ends = {
      static_cast<std::uint64_t>(std::llround(duration_s / like.servo.period_s))};
  // A check counts what is late to the end.
  session.servo.most_late = 1001;
  session.servo.most_missed = 1'000'000;
  session.plant = like.plant;
  session.plant.period_s = session.servo.period_s;
  session.plant.watchdog_s = like.preparation.watchdog_s;
  session.phases = {{SessionPhaseKind::rest, "communication test", duration_s, 0.0, 0.0, 0.0, 0.0}};
  session.preparation = like.preparation;
  session.cycle_timeout_s = like.cycle_timeout_s;
  return session;
}

std::string ms(double time_s) {
  return significant(1e3 * time_s, 3) + " ms";
}

double longest_stall_s(const JitterCheck& check) {
  return std::max(check.outcome.woke_late.max_s(), check.outcome.busy.max_s());
}

/// Time between two commands with a stall in between.
double silence_s(const JitterCheck& check, double stall_s) {
  return stall_s + 1.0 / check.rate_Hz;
}

double missed_share(const JitterCheck& check) {
  return static_cast<double>(check.outcome.counts.missed) /
         static_cast<double>(std::max<std::uint64_t>(check.outcome.cycles, 1));
}

/// Why a session with these limits would not have come to its end; empty if it would.
std::string fault_of(const JitterCheck& check) {
  constexpr double kMostMissed = 0.01;
  const ServoOutcome& o = check.outcome;
  const double late_s = o.woke_late.quantile_s(0.99);
  if (o.cause != StopCause::finished) {
    return fmt::format("the test ended early: {}{}{}", to_string(o.cause),
                       o.detail.empty() ? "" : ": ", o.detail);
  }
  const double stall_s = longest_stall_s(check);
  if (const double silent_s = silence_s(check, stall_s); silent_s >= check.watchdog_s) {
    return fmt::format(
        "a stall of {} leaves {} without a command, the watchdog cuts the forces after {}",
        ms(stall_s), ms(silent_s), ms(check.watchdog_s));
  }
  if (o.busy.max_s() >= check.cycle_timeout_s) {
    return fmt::format("a cycle took {}, and is given up after {}", ms(o.busy.max_s()),
                       ms(check.cycle_timeout_s));
  }
  if (o.counts.most_consecutive_missed > check.missed_limit) {
    return fmt::format("{} consecutive periods were missed, a session stops after {}",
                       o.counts.most_consecutive_missed, check.missed_limit);
  }
  if (o.counts.most_late > check.late_limit) {
    return fmt::format("{} cycles of 1000 were late, a session stops after {}", o.counts.most_late,
                       check.late_limit);
  }
  if (late_s > 0.5 / check.rate_Hz) {
    return fmt::format("99 % of the cycles are late by up to {} us, more than half a period",
                       significant(1e6 * late_s, 4));
  }
  if (missed_share(check) > kMostMissed) {
    return fmt::format("{} % of the periods were missed",
                       significant(100.0 * missed_share(check), 3));
  }
  const std::optional<double> hour_s = once_an_hour_s(check);
  if (hour_s && silence_s(check, *hour_s) >= check.watchdog_s) {
    return fmt::format(
        "no stall was too long in {} s, but one of {} is extrapolated, not measured, for once an "
        "hour, which leaves {} without a command: the watchdog cuts the forces after {}",
        significant(observed_s(check), 4), ms(*hour_s), ms(silence_s(check, *hour_s)),
        ms(check.watchdog_s));
  }
  return {};
}

/// The rate that was kept, the time, and the bound that follows from it.
std::string kept_words(const JitterCheck& check) {
  std::string words = fmt::format("kept {} Hz for {} s", significant(check.rate_Hz, 4),
                                  significant(observed_s(check), 4));
  if (const std::string bound = stall_bound(check); !bound.empty()) {
    words += "; stalls beyond the watchdog: " + bound;
  }
  if (const auto hour_s = once_an_hour_s(check)) {
    return words + fmt::format("; extrapolated, not measured: {} once an hour", ms(*hour_s));
  }
  return words + "; too short to extrapolate";
}

/// The highest of the usual rates at which 99 % of the cycles would not be late; 0: none.
double best_rate_Hz(const JitterCheck& check) {
  const double late_s = check.outcome.woke_late.quantile_s(0.99);
  for (const double rate : kSessionRates_Hz) {
    if (late_s <= 0.5 / rate) return rate;
  }
  return 0.0;
}

/// The device ended the test, whatever the machine can do.
bool device_ended(StopCause cause) {
  static constexpr StopCause kOfDevice[] = {
      StopCause::communication, StopCause::unplugged,
      StopCause::velocity,      StopCause::button,
      StopCause::software,      StopCause::dead_man,
      StopCause::forces_off,    StopCause::position_not_finite,
      StopCause::position_jump};
  return std::ranges::find(kOfDevice, cause) != std::end(kOfDevice);
}

std::string advice_of(const JitterCheck& check) {
  constexpr double kLongestWatchdog_s = 0.016;
  if (check.outcome.woke_late.count() == 0) {
    return "no wake-up was counted, so nothing is known of what this machine can do";
  }
  const double stall_s = longest_stall_s(check);
  const double rate = best_rate_Hz(check);
  std::string can =
      rate > 0.0 ? fmt::format("by its wake-ups this machine can do {} Hz", significant(rate, 4))
                 : std::string(
                       "by its wake-ups this machine can do no rate above "
                       "500 Hz");
  if (device_ended(check.outcome.cause)) return can + "; the device ended the test, not the time";
  if (hung(check)) {
    return fmt::format(
        "{}; a cycle did not end within {}: a call of the device hung, or the machine", can,
        ms(check.cycle_timeout_s));
  }
  if (silence_s(check, stall_s) >= kLongestWatchdog_s) {
    return fmt::format(
        "{}; stalls of {} are longer than any watchdog of the device: give the loop a core of its "
        "own, real-time priority and memory that is locked (--real-time enforce says what is "
        "refused), and end other programs",
        can, ms(stall_s));
  }
  if (const double silent_s = silence_s(check, stall_s); silent_s >= check.watchdog_s) {
    return fmt::format(
        "{}; \"limits\": {{\"watchdog\": ...}} above {} would ride out the longest stall", can,
        ms(silent_s));
  }
  if (!check.timing_kept) return can + "; a lower \"rate\" or real-time priority would help";
  return fmt::format("{}; its longest stall was {}, the watchdog waits for {}", can, ms(stall_s),
                     ms(check.watchdog_s));
}

}  // namespace

bool hung(const JitterCheck& check) {
  return check.outcome.cause == StopCause::cycle_timeout;
}

std::uint64_t stalls_beyond_watchdog(const JitterCheck& check) {
  constexpr double kRounding_us = 1e-3;
  const TimeHistogram& late = check.outcome.woke_late;
  const double allowed_us = 1e6 * (check.watchdog_s - 1.0 / check.rate_Hz);
  const auto edge = static_cast<std::size_t>(std::max(0.0, std::ceil(allowed_us - kRounding_us)));
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < std::min(edge, late.bins().size()); ++i) below += late.bins()[i];
  return late.count() - below;
}

double observed_s(const JitterCheck& check) {
  return static_cast<double>(check.outcome.cycles) / check.rate_Hz;
}

std::optional<double> most_stalls_per_s(const JitterCheck& check) {
  constexpr double kShare = 0.95, kOfNone = 3.0;
  if (hung(check) || check.outcome.cycles == 0 || check.outcome.woke_late.count() == 0) {
    return std::nullopt;
  }
  const auto stalls = static_cast<double>(stalls_beyond_watchdog(check));
  const double most =
      stalls == 0.0 ? kOfNone : 0.5 * chi_squared_quantile(kShare, 2.0 * (stalls + 1.0));
  return most / observed_s(check);
}

std::string stall_bound(const JitterCheck& check) {
  constexpr double kHour_s = 3600.0, kDigits3 = 100.0;
  const auto most = most_stalls_per_s(check);
  if (!most) return {};
  const double hourly = kHour_s * *most;
  return fmt::format("fewer than {} an hour with 95 % ({} {} s)",
                     hourly < kDigits3 ? significant(hourly, 3) : fmt::format("{:.0f}", hourly),
                     stalls_beyond_watchdog(check) == 0 ? "3/T of" : "Poisson, in",
                     significant(observed_s(check), 3));
}

std::optional<double> once_an_hour_s(const JitterCheck& check) {
  constexpr double kHour_s = 3600.0, kShare = 1e-3, kFurther = 1e-4;
  const TimeHistogram& late = check.outcome.woke_late;
  if (hung(check) || late.count() < kFewestToExtrapolate) return std::nullopt;
  const double at_s = late.quantile_s(1.0 - kShare), further_s = late.quantile_s(1.0 - kFurther);
  const double slope_s = (further_s - at_s) / std::log(kShare / kFurther);
  const double tail_s =
      further_s + slope_s * std::max(0.0, std::log(kFurther * kHour_s * check.rate_Hz));
  return std::max(tail_s, late.max_s());
}

void assess(JitterCheck& check) {
  const std::string fault = fault_of(check);
  check.timing_kept = fault.empty();
  check.timing = check.timing_kept ? kept_words(check) : "not kept: " + fault;
  check.advice = advice_of(check);
}

JitterCheck check_jitter(const DeviceChoice& choice, const HilSession& like, double duration_s,
                         RealTimeWish wish, const std::function<bool()>& interrupted,
                         const FindingTold& noticed) {
  const DeviceLimits limits = limits_of(choice);
  HilSession session = idle_session(like, duration_s);
  if (choice.kind == "virtual") forgive_stalls(session);  // they are what is looked for
  const std::shared_ptr<HapticDevice> device = make_device(choice, session);
  JitterCheck check;
  check.rate_Hz = 1.0 / like.servo.period_s;
  check.duration_s = duration_s;
  check.watchdog_s = like.preparation.watchdog_s;
  check.cycle_timeout_s = like.cycle_timeout_s;
  check.late_limit = like.servo.most_late;
  check.missed_limit = like.servo.most_missed;
  DevicePreparation preparation = preparation_for(session, choice, true, interrupted);
  preparation.max_force_N = std::min(preparation.max_force_N, limits.force_N);
  RealTimeOptions options = real_time_options(session, wish, interrupted);
  try {
    check.device = device->open();
    require_same_device(choice, check.device);
    FindingNotices notices(*device, noticed);
    notices.look();
    options.idle = [&notices] { notices.look(); };
    options.prepare = [&] { device->prepare(preparation); };
    check.outcome = run_in_real_time(
        device, std::make_shared<EmptySpace>(session.servo.period_s), ServoSettings{session.servo},
        [](const ServoRecord&) {}, options);
    check.findings = device->findings();
    notices.look();
  } catch (...) {
    device->stop();
    throw;
  }
  assess(check);
  return check;
}

SessionVerdict ask_session_gate(const HilSession& session, const DeviceChoice& device,
                                RealTimeWish wish, const std::function<bool()>& interrupted,
                                const PlanningTold& told) {
  SessionRunOptions options;
  options.real_time = true;
  options.wish = wish;
  options.interrupted = interrupted;
  options.planning = told;
  SessionVerdict verdict;
  verdict.title = session.title;
  try {
    AdmittedSession admitted = admit_session(session, device, options);
    verdict.accepted = true;
    verdict.words = admitted.rendering.verdict();
    verdict.rendering = std::move(admitted.rendering);
    verdict.on_hardware = std::move(admitted.on_hardware);
    verdict.hardware_kind = std::move(admitted.hardware_kind);
  } catch (const Error& refusal) {
    if (refusal.code() != ExitCode::answer_is_no) throw;
    verdict.words = refusal.what();
  }
  return verdict;
}

}  // namespace tpm::haptics
