#include "tpm/haptics/session/live_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/text.hpp"
#include "tpm/haptics/loop/servo_counts.hpp"
#include "tpm/haptics/session/recording.hpp"

namespace tpm::haptics {
namespace {

constexpr std::size_t kMostPoints = 500;  // 20 s
constexpr double kWindow_s = 1.0;         // over which the rate is counted
constexpr std::size_t kLateOf = 1000;     // cycles of which late ones are counted
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::uint64_t cycles_in(double time_s, const HilSession& session) {
  return static_cast<std::uint64_t>(std::max(1.0, std::round(time_s / session.servo.period_s)));
}

std::int64_t nanoseconds(float seconds) {
  return static_cast<std::int64_t>(1e9 * static_cast<double>(seconds));
}

Json phases_json(const HilSession& session) {
  Json phases = Json::array();
  double from_s = 0.0;
  for (const SessionPhase& phase : session.phases) {
    phases.push_back({{"name", phase.name},
                      {"instruction", instruction_of(phase)},
                      {"start_s", from_s},
                      {"end_s", phase.end_s}});
    from_s = phase.end_s;
  }
  return phases;
}

Json shape_json(const TissueShape& shape) {
  std::vector<std::int32_t> rest_um;
  for (const double x_m : shape.rest_m.reshaped()) {
    rest_um.push_back(static_cast<std::int32_t>(std::lround(1e6 * x_m)));
  }
  std::vector<std::uint32_t> ends;
  for (const auto& [a, b] : shape.bonds) ends.insert(ends.end(), {a, b});
  Json tool;  // null: along the push only
  if (shape.to_model) {
    const Eigen::Vector3d& start = shape.tool_start_m;
    tool = {{"radius_m", shape.tool_radius_m}, {"start_m", {start.x(), start.y(), start.z()}}};
  }
  return {{"spheres", shape.rest_m.cols()},
          {"tool", tool},
          {"rest_um", rest_um},
          {"radius_m", shape.radius_m},
          {"contact", shape.contact},
          {"push", {shape.push.x(), shape.push.y(), shape.push.z()}},
          {"bonds", ends},
          {"shown", shape.field ? fmt::format("all spheres as the model in the loop places them, "
                                              "recomputed every {} ms from the recorded motion",
                                              significant(1e3 * kDrawnEvery_s, 3))
                                : std::string("the contact sphere as recorded; the others are "
                                              "fixed")}};
}

}  // namespace

std::string instruction_of(const SessionPhase& phase) {
  const auto mm = [](double depth_m) { return significant(1e3 * depth_m, 4); };
  switch (phase.kind) {
    case SessionPhaseKind::approach:
      return "Bring the tool down until it touches";
    case SessionPhaseKind::indent:
      return fmt::format("Push in to {} mm at {} mm/s", mm(phase.to), mm(phase.rate_m_per_s));
    case SessionPhaseKind::hold:
      return fmt::format("Hold the tool at {} mm", mm(phase.to));
    case SessionPhaseKind::slide:
      return fmt::format("Slide from {} to {} mm aside at {} mm/s, {} mm deep",
                         mm(phase.across_from_m), mm(phase.across_to_m), mm(phase.rate_m_per_s),
                         mm(phase.to));
    case SessionPhaseKind::release:
      return fmt::format("Draw back to {} mm above the surface at {} mm/s", mm(-phase.to),
                         mm(phase.rate_m_per_s));
    case SessionPhaseKind::rest:
      return "Stay clear of the tissue and let it recover";
    case SessionPhaseKind::load:
      return fmt::format("Raise your push to {} N", significant(phase.to, 4));
    case SessionPhaseKind::motion:
      return "Follow the depth that is shown: the motion of a recording";
    case SessionPhaseKind::creep:
      break;
  }
  return fmt::format("Keep pushing with {} N while the tissue creeps", significant(phase.to, 4));
}

std::string instruction_of(const ServoRecord& waiting) {
  if ((waiting.flags & kOutOfReach) != 0) {
    const Eigen::Map<const Eigen::Vector3d> at_m(waiting.position_m);
    return fmt::format("Bring the tool to the middle of the workspace: it is {} mm away",
                       significant(1e3 * at_m.norm(), 3));
  }
  if ((waiting.flags & kInTissue) != 0) {
    return fmt::format("Draw the tool back, out of the tissue: it is {} mm {} the surface",
                       significant(1e3 * std::abs(waiting.tool_depth_m), 3),
                       waiting.tool_depth_m < 0.0 ? "above" : "below");
  }
  if ((waiting.flags & kMoving) != 0) return "Hold the tool still";
  if ((waiting.flags & kUnconfirmed) != 0) return "Press a button of the device, or Enter";
  return "The session begins";
}

LiveView::LiveView(const HilSession& session, bool real_time)
    : session_(session), real_time_(real_time), script_(session.operator_script()) {
  state_.served_Hz = 1.0 / session_.servo.period_s;
}

void LiveView::opened(const DeviceIdentity& device, const LoopModel& model) {
  const Json json{{"title", session_.title},
                  {"simulated_device", !device.hardware},
                  {"device", to_json(device)},
                  {"time", real_time_ ? "real" : "virtual"},
                  {"model", model.name},
                  {"rate_Hz", 1.0 / session_.servo.period_s},
                  {"force_limit_N", session_.servo.force_limit_N},
                  {"slew_limit_N_per_s", session_.servo.slew_limit_N_per_s},
                  {"point_every_s", kDrawnEvery_s},
                  {"most_points", kMostPoints},
                  {"phases", phases_json(session_)},
                  {"tissue", shape_json(model.shape)}};
  std::string text = json.dump();
  const std::lock_guard<std::mutex> lock(mutex_);
  scene_ = std::move(text);
  shape_ = model.shape;
  displacement_m_ = Eigen::Matrix3Xd::Zero(3, shape_.rest_m.cols());
}

void LiveView::count(const ServoRecord& row) {
  add_to(state_.counts, row);
  const auto missed = static_cast<std::uint64_t>(row.missed);
  if (row.stop != StopCause::finished) count_late(row.missed);
  const std::uint64_t expected = state_.begun ? state_.last.cycle + 1 + missed : missed;
  if (row.cycle > expected) state_.lost += row.cycle - expected;
  late_.note(nanoseconds(row.woke_late_s));
  busy_.note(nanoseconds(row.busy_s));
  ++window_served_;
  const std::uint64_t lived = row.cycle + 1 - window_from_;
  if (lived >= cycles_in(kWindow_s, session_)) {
    state_.served_Hz = static_cast<double>(window_served_) /
                       (static_cast<double>(lived) * session_.servo.period_s);
    window_from_ = row.cycle + 1;
    window_served_ = 0;
    take_times();
  }
}

/// As the loop does (servo_step.cpp): of all cycles but the one at which the session is over.
void LiveView::count_late(int missed) {
  ServoCounts& counts = state_.counts;
  counts.most_consecutive_missed = std::max(counts.most_consecutive_missed, missed);
  late_last_.push_back(missed > 0);
  late_now_ += missed > 0 ? 1 : 0;
  if (late_last_.size() > kLateOf) {
    late_now_ -= late_last_.front() ? 1 : 0;
    late_last_.pop_front();
  }
  counts.most_late = std::max(counts.most_late, late_now_);
}

void LiveView::take_times() {
  constexpr double kHalf = 0.5, kMost = 0.99;
  state_.late_p99_s = late_.quantile_s(kMost);
  state_.late_max_s = late_.max_s();
  state_.busy_p50_s = busy_.quantile_s(kHalf);
  state_.busy_p99_s = busy_.quantile_s(kMost);
  state_.busy_max_s = busy_.max_s();
}

void LiveView::take_shape(const ServoRecord& row) {
  if (shape_.rest_m.cols() == 0 || !std::isfinite(row.surface_depth_m)) return;
  const Eigen::Map<const Eigen::Vector3d> at_m(row.position_m);
  const Eigen::Vector3d moved =
      shape_.to_model ? Eigen::Vector3d(*shape_.to_model * (at_m - session_.servo.surface_m))
                      : Eigen::Vector3d(shape_.push * row.surface_depth_m);
  if (shape_.field) {
    (void)shape_.field->step(moved);
    shape_.field->displacements(displacement_m_);
  }
  if (!shape_.to_model) {
    displacement_m_.col(static_cast<Eigen::Index>(shape_.contact)) = moved;
  }
  state_.displacement_um.clear();
  for (const double x_m : displacement_m_.reshaped()) {
    state_.displacement_um.push_back(static_cast<std::int32_t>(std::lround(1e6 * x_m)));
  }
}

/// The tool from where the surface is at rest, in the coordinates of the scene.
Eigen::Vector3d LiveView::tool_of(const ServoRecord& row) const {
  if (!shape_.to_model) return row.tool_depth_m * shape_.push;
  const Eigen::Map<const Eigen::Vector3d> at_m(row.position_m);
  return *shape_.to_model * (at_m - session_.servo.surface_m);
}

void LiveView::take_point(const ServoRecord& row) {
  const OperatorAim aim = script_.at(state_.time_s);
  state_.target_m = aim.aim == OperatorPiece::Aim::place ? aim.value : kNone;
  state_.target_N = aim.aim == OperatorPiece::Aim::force ? aim.value : kNone;
  state_.points.push_back({state_.time_s, state_.target_m, state_.target_N, row.tool_depth_m,
                           row.model_force_N, state_.commanded_N, least_N_, most_N_});
  if (state_.points.size() > kMostPoints) {
    state_.points.pop_front();
    ++state_.first_point;
  }
  least_N_ = most_N_ = state_.commanded_N;
}

void LiveView::see(const ServoRecord& row) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (row.phase < 0) {
    state_.last.tool_depth_m = row.tool_depth_m;
    state_.tool_m = tool_of(row);
    state_.place = instruction_of(row);
    state_.cause = row.stop;
    return;
  }
  if (!state_.begun && session_.servo.surface_before_hand_m) {
    session_.servo.surface_m = Eigen::Map<const Eigen::Vector3d>(row.position_m) +
                               *session_.servo.surface_before_hand_m * session_.servo.push;
  }
  state_.place.clear();
  count(row);
  state_.time_s = static_cast<double>(row.cycle) * session_.servo.period_s;
  state_.begun = true;
  if (row.stop != StopCause::none) {  // holds what was known when the cycle was given up
    state_.last.cycle = row.cycle;
    state_.cause = row.stop;
    take_times();
    return;
  }
  state_.last = row;
  state_.tool_m = tool_of(row);
  state_.least_J = std::min(state_.least_J, row.observed_J);
  state_.commanded_N = -session_.servo.push.dot(Eigen::Map<const Eigen::Vector3d>(row.commanded_N));
  state_.hand_N =
      shape_.to_model
          ? Eigen::Vector3d(*shape_.to_model * Eigen::Map<const Eigen::Vector3d>(row.commanded_N))
          : Eigen::Vector3d(-state_.commanded_N * shape_.push);
  least_N_ = std::min(least_N_, state_.commanded_N);
  most_N_ = std::max(most_N_, state_.commanded_N);
  if (row.cycle >= next_point_) {
    take_point(row);
    take_shape(row);
    next_point_ = row.cycle + cycles_in(kDrawnEvery_s, session_);
  }
}

void LiveView::ended(const ServoOutcome& outcome) {
  const std::lock_guard<std::mutex> lock(mutex_);
  state_.over = true;
  state_.cause = outcome.cause;
  state_.detail = outcome.detail;
}

std::string LiveView::scene_json() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return scene_;
}

Json LiveView::trace_json(const State& s, std::uint64_t after) {
  const std::uint64_t end = s.first_point + s.points.size();
  const std::uint64_t first = std::clamp(after, s.first_point, end);
  Json trace{{"first", first}};
  const auto column = [&](const char* name, double Point::*member) {
    std::vector<double> values;
    for (std::uint64_t i = first; i < end; ++i) {
      values.push_back(s.points[static_cast<std::size_t>(i - s.first_point)].*member);
    }
    trace[name] = std::move(values);
  };
  column("time_s", &Point::time_s);
  column("target_depth_m", &Point::target_m);
  column("target_force_N", &Point::target_N);
  column("tool_depth_m", &Point::tool_m);
  column("model_force_N", &Point::model_N);
  column("commanded_N", &Point::commanded_N);
  column("least_commanded_N", &Point::least_N);
  column("most_commanded_N", &Point::most_N);
  return trace;
}

std::string LiveView::state_json(std::uint64_t after) const {
  watched_ = true;
  State s;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    s = state_;
  }
  const ServoRecord& row = s.last;
  const Json json{
      {"begun", s.begun},
      {"place", s.place},
      {"over", s.over},
      {"cause", to_string(s.cause)},
      {"detail", s.detail},
      {"time_s", s.time_s},
      {"cycle", row.cycle},
      {"phase", row.phase},
      {"target_depth_m", s.target_m},
      {"target_force_N", s.target_N},
      {"tool_depth_m", row.tool_depth_m},
      {"surface_depth_m", row.surface_depth_m},
      {"tool_m", {s.tool_m.x(), s.tool_m.y(), s.tool_m.z()}},
      {"touching", (row.flags & kTouching) != 0},
      {"model_force_N", row.model_force_N},
      {"model_error_N", row.model_error_N},
      {"commanded_N", s.commanded_N},
      {"hand_N", {s.hand_N.x(), s.hand_N.y(), s.hand_N.z()}},
      {"flags",
       {{"force_limited", (row.flags & kForceLimited) != 0},
        {"slipped", (row.flags & kSlipping) != 0},
        {"ramping_in", (row.flags & kRampingIn) != 0},
        {"damped", (row.flags & kDamped) != 0},
        {"beyond_model", (row.flags & kBeyondModel) != 0}}},
      {"energy",
       {{"observed_J", row.observed_J}, {"least_observed_J", s.least_J}, {"leak_J", row.leak_J}}},
      {"loop",
       {{"served_Hz", s.served_Hz},
        {"woke_late_p99_s", s.late_p99_s},
        {"woke_late_max_s", s.late_max_s},
        {"busy_p50_s", s.busy_p50_s},
        {"busy_p99_s", s.busy_p99_s},
        {"busy_max_s", s.busy_max_s},
        {"lost_records", s.lost}}},
      {"counts", to_json(s.counts)},
      {"displacement_um", s.displacement_um},
      {"trace", trace_json(s, after)}};
  return json.dump();
}

}  // namespace tpm::haptics
