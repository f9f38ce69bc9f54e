#include "tpm/haptics/jitter_check.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/core/text.hpp"

namespace tpm {
namespace {

/// Nothing there: no force at any depth.
class EmptySpace final : public ContactModel {
 public:
  explicit EmptySpace(double period_s) : period_s_(period_s) {}
  void reset() noexcept override {}
  ContactAnswer step(const Eigen::Vector3d&) noexcept override { return {}; }
  [[nodiscard]] double period_s() const noexcept override { return period_s_; }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return Eigen::Matrix3d::Identity();
  }
  [[nodiscard]] Eigen::Matrix3d relaxed_stiffness() const noexcept override {
    return Eigen::Matrix3d::Identity();
  }
  [[nodiscard]] Eigen::Index spheres() const noexcept override { return 0; }
  void displacements(Eigen::Ref<Eigen::Matrix3Xd>) const noexcept override {}

 private:
  double period_s_;
};

HilSession idle_session(double rate_Hz, double duration_s) {
  HilSession session;
  session.servo.period_s = 1.0 / rate_Hz;
  session.servo.phase_ends = {static_cast<std::uint64_t>(std::llround(duration_s * rate_Hz))};
  // A check counts what is late to the end.
  session.servo.most_late = 1001;
  session.servo.most_missed = 1'000'000;
  session.plant.period_s = session.servo.period_s;
  session.phases = {{SessionPhaseKind::rest, "communication test", duration_s, 0.0, 0.0, 0.0, 0.0}};
  session.preparation.watchdog_s = 0.016;
  return session;
}

void judge(JitterCheck& check) {
  const ServoOutcome& o = check.outcome;
  const double half_period_s = 0.5 / check.rate_Hz;
  const double late_s = o.woke_late.quantile_s(0.99);
  const double missed = static_cast<double>(o.counts.missed) /
                        static_cast<double>(std::max<std::uint64_t>(o.cycles, 1));
  constexpr double kMostMissed = 0.01;
  if (o.cause != StopCause::finished) {
    check.verdict = fmt::format("not fit: the test ended early: {}", word_of(o.cause));
  } else if (late_s > half_period_s) {
    check.verdict =
        fmt::format("not fit: 99 % of the cycles are late by up to {} us, more than half a period",
                    significant(1e6 * late_s, 4));
  } else if (missed > kMostMissed) {
    check.verdict =
        fmt::format("not fit: {} % of the periods were missed", significant(100.0 * missed, 3));
  } else {
    check.fit = true;
    check.verdict = fmt::format("fit for {} Hz", significant(check.rate_Hz, 4));
  }
}

}  // namespace

JitterCheck check_jitter(const DeviceChoice& choice, double rate_Hz, double duration_s,
                         RealTimeWish wish, const std::function<bool()>& interrupted) {
  const HilSession session = idle_session(rate_Hz, duration_s);
  const std::shared_ptr<HapticDevice> device = make_device(choice, session);
  JitterCheck check;
  check.rate_Hz = rate_Hz;
  check.duration_s = duration_s;
  DevicePreparation preparation = session.preparation;
  preparation.may_move = choice.may_move;
  preparation.take_as_ready = choice.take_as_ready;
  preparation.interrupted = interrupted;
  RealTimeOptions options;
  options.wish = wish;
  constexpr double kGiveUp_s = 0.5;  // long stalls are what is looked for
  options.hang_limit_s = kGiveUp_s;
  options.interrupted = interrupted;
  try {
    check.device = device->open();
    device->prepare(preparation);
    check.outcome = run_in_real_time(
        device, std::make_shared<EmptySpace>(session.servo.period_s), session.servo,
        [](const ServoRecord&) {}, options);
  } catch (...) {
    device->stop();
    throw;
  }
  judge(check);
  return check;
}

}  // namespace tpm
