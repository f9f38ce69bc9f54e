#include "tpm/haptics/session/jitter_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/haptics/loop/empty_space.hpp"

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
  return session;
}

std::string ms(double time_s) {
  return significant(1e3 * time_s, 3) + " ms";
}

/// The longest time without a command.
double longest_stall_s(const JitterCheck& check) {
  return std::max(check.outcome.woke_late.max_s(), check.outcome.busy.max_s());
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
    return fmt::format("the test ended early: {}", word_of(o.cause));
  }
  if (const double stall_s = longest_stall_s(check); stall_s >= check.watchdog_s) {
    return fmt::format("a stall of {} is longer than the watchdog of {}, which cuts the forces",
                       ms(stall_s), ms(check.watchdog_s));
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
  return {};
}

/// The highest of the usual rates at which 99 % of the cycles would not be late; 0: none.
double best_rate_Hz(const JitterCheck& check) {
  const double late_s = check.outcome.woke_late.quantile_s(0.99);
  for (const double rate : kSessionRates_Hz) {
    if (late_s <= 0.5 / rate) return rate;
  }
  return 0.0;
}

std::string advice_of(const JitterCheck& check) {
  constexpr double kLongestWatchdog_s = 0.016;
  const double stall_s = longest_stall_s(check);
  const double rate = best_rate_Hz(check);
  std::string can =
      rate > 0.0 ? fmt::format("by its wake-ups this machine can do {} Hz", significant(rate, 4))
                 : std::string(
                       "by its wake-ups this machine can do no rate above "
                       "500 Hz");
  if (stall_s >= kLongestWatchdog_s) {
    return fmt::format(
        "{}; stalls of {} are longer than any watchdog of the device: give the loop a core of its "
        "own, real-time priority and memory that is locked (--real-time enforce says what is "
        "refused), and end other programs",
        can, ms(stall_s));
  }
  if (stall_s >= check.watchdog_s) {
    return fmt::format(
        "{}; \"limits\": {{\"watchdog\": ...}} above {} would ride out the longest stall", can,
        ms(stall_s));
  }
  if (!check.fit) return can + "; a lower \"rate\" or real-time priority would help";
  return fmt::format("{}; its longest stall was {}, the watchdog waits for {}", can, ms(stall_s),
                     ms(check.watchdog_s));
}

}  // namespace

void assess(JitterCheck& check) {
  const std::string fault = fault_of(check);
  check.fit = fault.empty();
  check.verdict =
      check.fit ? fmt::format("fit for {} Hz", significant(check.rate_Hz, 4)) : "not fit: " + fault;
  check.advice = advice_of(check);
}

JitterCheck check_jitter(const DeviceChoice& choice, const HilSession& like, double duration_s,
                         RealTimeWish wish, const std::function<bool()>& interrupted) {
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
  DevicePreparation preparation = session.preparation;
  preparation.period_s = session.servo.period_s;
  preparation.may_move = choice.may_move;
  preparation.take_as_ready = choice.take_as_ready;
  preparation.real_time = true;
  preparation.interrupted = interrupted;
  RealTimeOptions options;
  options.wish = wish;
  constexpr double kGiveUp_s = 0.5;  // long stalls are what is looked for
  options.cycle_timeout_s = kGiveUp_s;
  options.interrupted = interrupted;
  try {
    check.device = device->open();
    options.prepare = [&] { device->prepare(preparation); };
    check.outcome = run_in_real_time(
        device, std::make_shared<EmptySpace>(session.servo.period_s), ServoSettings{session.servo},
        [](const ServoRecord&) {}, options);
  } catch (...) {
    device->stop();
    throw;
  }
  assess(check);
  return check;
}

}  // namespace tpm::haptics
