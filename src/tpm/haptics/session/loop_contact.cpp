#include "tpm/haptics/session/loop_contact.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/haptics/device/device_file.hpp"
#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/loop/triple_buffer.hpp"
#include "tpm/haptics/session/session_keys.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/session/surface_scene.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {

/// The two ends of a step that the caller's loop holds: where the tool is, and the force on it.
class CallersDevice final : public HapticDevice {
 public:
  const DeviceIdentity& open() override { return identity_; }
  void prepare(const DevicePreparation& /*preparation*/) override {}
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override {
    position_m = position_m_;
    return DeviceAnswer::ok;
  }
  DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept override {
    force_N_ = force_N;
    return DeviceAnswer::ok;
  }
  DeviceStatus status() noexcept override { return {}; }
  void stop() noexcept override { force_N_.setZero(); }
  void cut_forces() noexcept override { force_N_.setZero(); }

  void move_to(const Eigen::Vector3d& position_m) noexcept { position_m_ = position_m; }
  [[nodiscard]] const Eigen::Vector3d& force_N() const noexcept { return force_N_; }

 private:
  DeviceIdentity identity_;
  Eigen::Vector3d position_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_N_ = Eigen::Vector3d::Zero();
};

namespace {

/// A kind of device that replays a recording: nothing for a loop that reads its own.
constexpr const char* kReplayed = "replay";

/// A session around a law: as deep as the law was fitted to.
Json session_around(const Json& law, const LoopContactOptions& options, const std::string& where) {
  const LawFile file = law_from_json(law, where);
  const double deepest_m = file.fitted_to.value_or(file.spec.reference);
  constexpr double kRate_m_per_s = 4e-3;
  return {{"title", where},
          {"model", {{"kind", "law"}, {"law", law}}},
          {"indentations",
           {{"depths", {fmt::format("{} m", deepest_m)}},
            {"rates", {fmt::format("{} m/s", kRate_m_per_s)}},
            {"hold", fmt::format("{} s", options.longest_s)}}}};
}

/// Of the caller, not of the file: they are named so. 0 is the rate of the file.
void require_options(const LoopContactOptions& options) {
  const double rate_Hz = options.rate_Hz;
  if (rate_Hz != 0.0 && !(rate_Hz >= kLeastRate_Hz && rate_Hz <= kMostRate_Hz)) {
    throw Error(ExitCode::usage, "rate_Hz", shortest(rate_Hz),
                fmt::format("{} to {} Hz, or 0 for that of the file", kLeastRate_Hz, kMostRate_Hz));
  }
  if (!(options.longest_s > 0.0) || !std::isfinite(options.longest_s)) {
    throw Error(ExitCode::usage, "longest_s", shortest(options.longest_s), "seconds above 0");
  }
}

/// Throws Error(usage) for a device that cannot be that of a loop of the caller's own, or that only
/// a file could describe.
void require_device(const LoopContactOptions& options) {
  std::vector<std::string> kinds = device_kinds();
  std::erase(kinds, kReplayed);
  const bool known = std::ranges::find(kinds, options.device) != kinds.end();
  if (options.device.empty() || known) return;
  if (options.device != kReplayed && !options.device_file.empty()) return;
  throw Error(
      ExitCode::usage, "device", "'" + printable(options.device) + "'",
      fmt::format("one of {}, or another with its limits in device_file", fmt::join(kinds, ", ")));
}

/// Limits of the caller's device. What was measured on a simulated one says nothing of motors.
DeviceLimits limits_that_apply(const LoopContactOptions& options) {
  require_device(options);
  if (options.device_file.empty()) {
    return limits_of(options.device.empty() ? "omega7" : std::string_view(options.device));
  }
  const DeviceFile file = read_device_file(options.device_file);
  DeviceLimits limits = limits_of_motors(file, options.device);
  if (file.simulated && limits.hardware()) limits.measured_delay_s.reset();
  return limits;
}

HilSession session_of(const std::filesystem::path& file, const LoopContactOptions& options) {
  require_options(options);
  Json json = read_json(file);
  if (!json.is_object() || (!json.contains("model") && !json.contains("law"))) {
    throw bad_input(file.string(), "is neither a session nor a law",
                    "a key 'model' (schemas/hil.schema.json) or 'law' (schemas/law.schema.json)");
  }
  if (!json.contains("model")) json = session_around(json, options, file.string());
  if (options.rate_Hz != 0.0) json["rate"] = fmt::format("{} Hz", options.rate_Hz);
  HilSession session =
      parse_session(json, file.string(), file.parent_path(), limits_that_apply(options));
  follow_surface(session);
  return session;
}

/// The session without its end, and without its start if nobody waits for one.
HilSession endless(HilSession session, const LoopContactOptions& options) {
  // The state of spring-pots is kept for the length of the session only.
  const bool forgets = session.law && session.law->spec.fractional != Fractional::none;
  session.servo.phase_ends = {forgets ? session.servo.phase_ends.back()
                                      : std::numeric_limits<std::uint64_t>::max()};
  if (!options.start_gate) session.servo.gate.reset();
  return session;
}

}  // namespace

struct LoopContact::Stepped {
  Stepped(ContactModel& model, const ServoSettings& settings)
      : step(device, model, settings), surface_m(settings.surface_m) {}
  CallersDevice device;
  ServoStep step;
  Eigen::Vector3d surface_m;
  bool begun = false;
  TripleBuffer<LoopContactState> newest;
  StopCause cause = StopCause::none;
  // Of step_at(): periods of the contact, counted by the caller's clock.
  bool timed = false;
  double begun_s = 0.0, last_s = 0.0, periods = 0.0;
  double usual = 0.0;  ///< interval of the caller's loop, mean of the last calls, periods
  int intervals = 0;   ///< of which it is the mean
  int still = 0;       ///< calls in a row whose time is that of the call before
  // Of both: what ServoStep does not judge of a loop that is too slow.
  double late = 0.0;    ///< of the last thousand calls, while the contact waits to begin
  double behind = 0.0;  ///< periods by which the tissue is behind, ServoStep::kMostSteps a call

  /// Periods to live through in a call `since` periods after the one before it and `ahead` of the
  /// tissue. One a call as long as that keeps within kOff of the clock: intervals that vary about
  /// the right mean do not make a period missed now and one too many then.
  double due(double since, double ahead) noexcept {
    constexpr double kFast = 0.75, kSlow = 1.5, kOff = 1.25, kLongest = 2.0, kMost = 1e6;
    constexpr int kCalls = 50;
    if (since == 0.0) return 0.0;
    intervals = std::min(intervals + 1, kCalls);
    usual += (std::min(since, kLongest) - usual) / intervals;
    double lived = 1.0;
    // Of a faster loop the call nearest to the end of a period.
    if (usual < kFast) lived = ahead + 0.5 * since >= 1.0 ? 1.0 : 0.0;
    if (usual >= kSlow) lived = std::max(0.0, std::round(ahead));
    if (ahead - lived > kOff) lived = std::round(ahead);
    if (ahead - lived < -kOff) lived = 0.0;
    return std::min(lived, kMost);
  }

  /// True if a loop whose call came after `missed` periods is too slow to go on.
  bool is_too_slow(int missed, int most_late) noexcept {
    constexpr double kCalls = 1000.0, kMostBehind = 1000.0;
    if (!begun) {
      late += (missed > 0 ? 1.0 : 0.0) - late / kCalls;
      return late > most_late;
    }
    behind = std::max(0.0, behind + 1.0 + missed - ServoStep::kMostSteps);
    return behind > kMostBehind;
  }
};

LoopContact::LoopContact(const std::filesystem::path& file, const LoopContactOptions& options)
    : session_(session_of(file, options)), loop_(make_loop_model(session_)) {
  const DeviceLimits limits = limits_that_apply(options);
  if (options.accept_unstable && limits.hardware()) {
    throw Error(ExitCode::usage, "accept_unstable", "is not for the device '" + limits.kind + "'",
                "the device 'virtual', where nothing has motors");
  }
  require_within(session_, limits);
  rendering_ = check_rendering(session_, *loop_.model, loop_, limits);
  if (const auto unmet = rendering_.unmet(options.accept_unstable)) {
    std::string expected(remedy(*unmet));
    if (*unmet == RenderingCondition::stability || *unmet == RenderingCondition::delay) {
      expected =
          "a device file with a measured delay (tpm hil identify), a softer tissue or a higher "
          "rate; the device 'virtual' where nothing has motors";
    }
    throw Error(ExitCode::answer_is_no, fmt::format("{}: {}", file.string(), to_string(*unmet)),
                rendering_.refusal(options.accept_unstable), expected);
  }
  settings_ = loop_settings(endless(on_device(session_, limits), options), loop_, rendering_, true);
  displacement_m_ = Eigen::Matrix3Xd::Zero(3, spheres());
  reset();
}

LoopContact::~LoopContact() = default;

void LoopContact::reset() {
  loop_.model->reset();
  stepped_ = std::make_unique<Stepped>(*loop_.model, settings_);
  if (loop_.shape.field) loop_.shape.field->reset();
  displacement_m_.setZero();
  drawn_ = 0;
  drawn_at_m_.setZero();
}

StopCause LoopContact::step(const Eigen::Vector3d& position_m, Eigen::Vector3d& force_N,
                            int missed) noexcept {
  Stepped& s = *stepped_;
  force_N.setZero();
  if (s.cause != StopCause::none) return s.cause;
  s.device.move_to(position_m);
  missed = std::max(0, missed);
  LoopContactState state;
  s.cause = s.step.cycle(missed, state.row);
  if (s.cause == StopCause::none && s.is_too_slow(missed, settings_.most_late)) {
    s.cause = state.row.stop = StopCause::overrun_storm;
    std::fill_n(state.row.commanded_N, 3, 0.0);
    s.step.stop(s.cause);
  }
  if (s.cause == StopCause::none) force_N = s.device.force_N();
  if (!s.begun && state.row.phase >= 0) {
    s.begun = true;
    if (settings_.surface_before_hand_m) {
      s.surface_m = position_m + *settings_.surface_before_hand_m * settings_.push;
    }
  }
  state.surface_m = s.surface_m;
  state.time_s = static_cast<double>(s.step.cycles()) * settings_.period_s;
  state.missed = s.step.counts().missed;
  s.newest.write(state);
  return s.cause;
}

StopCause LoopContact::step_at(double time_s, const Eigen::Vector3d& position_m,
                               Eigen::Vector3d& force_N) noexcept {
  Stepped& s = *stepped_;
  force_N.setZero();
  if (!(std::abs(time_s) <= kMostTime_s) || (s.timed && time_s < s.last_s)) return kBadTime;
  s.still = s.timed && time_s == s.last_s ? s.still + 1 : 0;
  if (s.still > kMostStill) {
    s.still = kMostStill;
    return kBadTime;
  }
  const double since = (time_s - s.last_s) / settings_.period_s;
  s.last_s = time_s;
  if (!s.timed) {
    s.timed = true;
    s.begun_s = time_s;
    return step(position_m, force_N, 0);
  }
  const double lived = s.due(since, (time_s - s.begun_s) / settings_.period_s - s.periods);
  s.periods += lived;
  if (lived > 0.0) return step(position_m, force_N, static_cast<int>(lived) - 1);
  if (s.cause == StopCause::none) force_N = s.device.force_N();
  return s.cause;
}

LoopContactState LoopContact::state() noexcept {
  (void)stepped_->newest.refresh();
  return stepped_->newest.latest();
}

void LoopContact::positions(Eigen::Ref<Eigen::Matrix3Xd> all) noexcept {
  constexpr std::uint64_t kMostPending = 25;  // a second
  const LoopContactState newest = state();
  const TissueShape& shape = loop_.shape;
  const Eigen::Map<const Eigen::Vector3d> at_m(newest.row.position_m);
  const bool waits = newest.row.phase < 0 || newest.time_s == 0.0;
  Eigen::Vector3d moved = drawn_at_m_;
  if (!waits && at_m.allFinite() && std::isfinite(newest.row.surface_depth_m)) {
    moved = shape.to_model ? Eigen::Vector3d(*shape.to_model * (at_m - newest.surface_m))
                           : Eigen::Vector3d(shape.push * newest.row.surface_depth_m);
  }
  const auto lived = static_cast<std::uint64_t>(newest.time_s / kDrawnEvery_s);
  const std::uint64_t due = lived > drawn_ ? std::min(lived - drawn_, kMostPending) : 0;
  if (shape.field && due > 0) {
    for (std::uint64_t i = 1; i <= due; ++i) {
      const double part = static_cast<double>(i) / static_cast<double>(due);
      (void)shape.field->step(drawn_at_m_ + part * (moved - drawn_at_m_));
    }
    shape.field->displacements(displacement_m_);
    drawn_at_m_ = moved;
  }
  drawn_ = std::max(drawn_, lived);
  if (!shape.to_model && displacement_m_.cols() > 0) {
    displacement_m_.col(static_cast<Eigen::Index>(shape.contact)) = moved;
  }
  all = shape.rest_m + displacement_m_;
}

}  // namespace tpm::haptics
