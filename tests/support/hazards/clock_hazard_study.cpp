#include "hazards/clock_hazard_study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {
namespace {

constexpr int kMostTries = 10;
constexpr int kMostTriesUntimed = 3;  // where no time counts: a stall of the machine may end all
constexpr double kStopBound_s = 0.010;
constexpr std::uint64_t kHeldAt = 1800;  // a period in which the tool is held in the tissue

enum class ClockFaultKind { read_hangs, model_hangs, slow_calls, interrupted, record };

struct ClockHazard {
  const char* name;
  std::string setting;
  ClockFaultKind kind;
  std::uint64_t at;  ///< period of the session from which on; 0: while it waits
  double lasts_s;    ///< of the call that hangs, or of each slow one
  StopCause expected;
  double bound_s;
  /// Of a cycle, after which it is given up: long, so that something else has to notice.
  double cycle_timeout_s = 0.008;
};

/// When the fault began and when the forces went off; read by the thread that started the session.
struct Moments {
  std::atomic<std::int64_t> fault_ns{0}, off_ns{0};
  std::atomic<int> under_way{0};  ///< calls that hang
  std::atomic<bool> off{false};   ///< forces were switched off, with or without a fault

  void begin_fault() noexcept {
    std::int64_t none = 0;
    fault_ns.compare_exchange_strong(none, now_ns());
  }
  void forces_off() noexcept {
    off = true;
    std::int64_t none = 0;
    if (fault_ns != 0) off_ns.compare_exchange_strong(none, now_ns());
  }
};

void hang(Moments& moments, double seconds) noexcept {
  ++moments.under_way;
  moments.begin_fault();
  sleep_until_ns(now_ns() + std::llround(seconds * 1e9));
  --moments.under_way;
}

/// The simulated device, whose calls take time.
class SlowDevice final : public VirtualOmega7 {
 public:
  SlowDevice(const HilSession& session, const ClockHazard& hazard, std::shared_ptr<Moments> moments)
      : VirtualOmega7(session.plant, session.operator_script()),
        hazard_(hazard),
        moments_(std::move(moments)) {}

  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override {
    if (begun_) ++period_;
    const bool once = hazard_.kind == ClockFaultKind::read_hangs && period_ == hazard_.at;
    const bool ever = hazard_.kind == ClockFaultKind::slow_calls && period_ >= hazard_.at;
    if (once || ever) hang(*moments_, hazard_.lasts_s);
    return VirtualOmega7::read(position_m);
  }
  void begin() noexcept override {
    begun_ = true;
    VirtualOmega7::begin();
  }
  void stop() noexcept override {
    VirtualOmega7::stop();
    moments_->forces_off();
  }
  void cut_forces() noexcept override {
    VirtualOmega7::cut_forces();
    moments_->forces_off();
  }

 private:
  ClockHazard hazard_;
  std::shared_ptr<Moments> moments_;
  std::uint64_t period_ = 0;
  bool begun_ = false;
};

/// A model that does not come back from a step for a while.
class SlowModel final : public ContactModel {
 public:
  SlowModel(std::shared_ptr<ContactModel> model, const ClockHazard& hazard,
            std::shared_ptr<Moments> moments)
      : model_(std::move(model)), hazard_(hazard), moments_(std::move(moments)) {}

  void reset() noexcept override { model_->reset(); }
  ContactAnswer step(const ToolPose& tool) noexcept override {
    if (++steps_ == hazard_.at && hazard_.kind == ClockFaultKind::model_hangs) {
      hang(*moments_, hazard_.lasts_s);
    }
    return model_->step(tool);
  }
  [[nodiscard]] double period_s() const noexcept override { return model_->period_s(); }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return model_->instantaneous_stiffness();
  }
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override {
    return model_->equilibrium_stiffness();
  }
  [[nodiscard]] Eigen::Index spheres() const noexcept override { return model_->spheres(); }
  void displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept override {
    model_->displacements(all);
  }

 private:
  std::shared_ptr<ContactModel> model_;
  ClockHazard hazard_;
  std::shared_ptr<Moments> moments_;
  std::uint64_t steps_ = 0;
};

/// The paper's star: pressed to 4 mm within half a second, held for half of one, released.
Json short_star_session() {
  return Json::parse(R"({
    "title": "hazard on the clock",
    "model": {"kind": "element", "scene": {
      "organ": {"kind": "star", "spacing": "30 mm"},
      "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e4 Pa s"}}},
    "indentations": {"depths": ["4 mm"], "rates": ["8 mm/s"], "hold": "0.5 s", "rest": "0.1 s"},
    "start": {"limit": "5 s"}})");
}

std::vector<ClockHazard> clock_hazards() {
  std::vector<ClockHazard> list;
  const auto finished = StopCause::finished;
  for (const int ms : {2, 5, 20, 50, 500}) {
    const double lasts_s = 1e-3 * ms;
    const bool short_one = ms < 8;
    for (const auto& [name, kind] :
         {std::pair{"a call of the device hangs", ClockFaultKind::read_hangs},
          std::pair{"the model hangs", ClockFaultKind::model_hangs}}) {
      list.push_back({name, fmt::format("for {} ms", ms), kind, kHeldAt, lasts_s,
                      short_one ? finished : StopCause::cycle_timeout,
                      short_one ? 0.0 : kStopBound_s});
    }
  }
  constexpr double kPatient_s = 5.0;
  for (const int ms : {20, 100}) {
    list.push_back({"nobody notices a stall but the device's watchdog (8 ms)",
                    fmt::format("of {} ms", ms), ClockFaultKind::model_hangs, kHeldAt, 1e-3 * ms,
                    ms > 50 ? StopCause::overrun_storm : StopCause::watchdog,
                    1e-3 * ms + kStopBound_s, kPatient_s});
  }
  list.push_back({"every call of the device is slow", "1.5 ms at 1 kHz", ClockFaultKind::slow_calls,
                  kHeldAt, 1.5e-3, StopCause::overrun_storm, 0.5, kPatient_s});
  for (const auto& [at, phase] :
       {std::pair{0, "while the session waits for the operator"},
        std::pair{1300, "during the indentation"}, std::pair{1800, "during the hold"},
        std::pair{2300, "during the release"}}) {
    list.push_back({"interrupted", phase, ClockFaultKind::interrupted,
                    static_cast<std::uint64_t>(at), 0.0, StopCause::signal, kStopBound_s});
  }
  list.push_back({"full disk", "the recording cannot be written", ClockFaultKind::record, kHeldAt,
                  0.0, StopCause::exception, kStopBound_s});
  return list;
}

/// What a session goes through, and what it leaves.
struct ClockRun {
  ServoOutcome outcome;
  double largest_N = 0.0;
  bool forces_off = false;
  std::optional<double> to_zero_s;  ///< nothing of one that ended before its fault
};

ClockRun run_once(const ClockHazard& hazard, HilSession session) {
  session.cycle_timeout_s = hazard.cycle_timeout_s;
  LoopModel loop = make_loop_model(session);
  const RenderingCheck rendering = check_rendering(session, *loop.model, loop, "virtual");
  const ServoSettings servo = loop_settings(session, loop, rendering, true);
  auto moments = std::make_shared<Moments>();
  const auto device = std::make_shared<SlowDevice>(session, hazard, moments);
  const auto model = std::make_shared<SlowModel>(std::move(loop.model), hazard, moments);
  device->open();
  ClockRun run;
  std::atomic<std::uint64_t> seen{0};
  const RecordSink sink = [&](const ServoRecord& row) {
    const Eigen::Map<const Eigen::Vector3d> force_N(row.commanded_N);
    run.largest_N = std::max(run.largest_N, force_N.norm());
    if (row.phase >= 0) seen = row.cycle;
    if (hazard.kind != ClockFaultKind::record || row.phase < 0 || row.cycle < hazard.at) return;
    moments->begin_fault();
    throw Error(ExitCode::environment, "recording", "cannot be written");
  };
  RealTimeOptions options;
  options.cycle_timeout_s = session.cycle_timeout_s;
  options.prepare = [&] {
    DevicePreparation preparation = session.preparation;
    preparation.period_s = session.servo.period_s;
    preparation.real_time = true;
    device->prepare(preparation);
  };
  options.interrupted = [&] {
    if (hazard.kind != ClockFaultKind::interrupted || seen < hazard.at) return false;
    moments->begin_fault();
    return true;
  };
  run.outcome = run_in_real_time(device, model, servo, sink, options);
  run.forces_off = moments->off;
  if (moments->fault_ns != 0 && moments->off_ns != 0) {
    run.to_zero_s = 1e-9 * static_cast<double>(moments->off_ns - moments->fault_ns);
  }
  // A thread that was left behind in a call still uses what belongs to this run.
  while (moments->under_way > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return run;
}

ClockHazardRow clock_row_of(const ClockHazard& hazard, const HilSession& session, bool in_time,
                            int most_tries, std::string& scheduling) {
  ClockHazardRow row;
  row.hazard = hazard.name;
  row.setting = hazard.setting;
  row.expected = hazard.expected;
  row.bound_s = hazard.bound_s;
  row.lasts_s = hazard.lasts_s;
  const auto done = [&] {
    return row.tries == most_tries ||
           (in_time ? row.within : row.tries > 0 && row.cause == row.expected && row.by_fault);
  };
  while (!done()) {
    ++row.tries;
    const ClockRun run = run_once(hazard, session);
    scheduling = run.outcome.scheduling;
    row.cause = run.outcome.cause;
    row.consecutive_missed = run.outcome.counts.most_consecutive_missed;
    // Of all tries, unless it has to be felt in this one.
    row.largest_force_N = in_time ? run.largest_N : std::max(row.largest_force_N, run.largest_N);
    const bool finished = row.expected == StopCause::finished;
    row.to_zero_s = finished ? 0.0 : run.to_zero_s.value_or(1e9);
    row.by_fault = finished || run.to_zero_s.has_value();
    row.forces_off = row.forces_off && run.forces_off;
    const bool counted =
        !finished || row.consecutive_missed + 2 >= std::lround(1e3 * hazard.lasts_s);
    const bool felt = hazard.at == 0 || row.largest_force_N > 0.0;  // it came in the tissue
    row.within = row.cause == row.expected && row.to_zero_s <= row.bound_s && counted && felt &&
                 row.largest_force_N <= session.servo.force_limit_N;
  }
  return row;
}

}  // namespace

bool ClockHazardStudy::safe() const {
  return std::all_of(rows.begin(), rows.end(),
                     [](const ClockHazardRow& row) { return row.within; });
}

ClockHazardStudy study_hazards_on_the_clock(bool in_time) {
  const HilSession session = parse_session(short_star_session(), "session", {});
  ClockHazardStudy study;
  study.most_tries = in_time ? kMostTries : kMostTriesUntimed;
  study.force_limit_N = session.servo.force_limit_N;
  for (const ClockHazard& hazard : clock_hazards()) {
    study.rows.push_back(
        clock_row_of(hazard, session, in_time, study.most_tries, study.scheduling));
  }
  return study;
}

}  // namespace tpm::haptics
