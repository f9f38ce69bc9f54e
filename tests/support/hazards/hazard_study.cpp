#include "hazards/hazard_study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hil_scenes.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

using test::with;

enum class FaultKind {
  none,
  read,
  write,
  status,
  forces_off,
  not_a_number,
  frozen,
  jump,
  stall,
  signal,
  record
};
enum class Doubt { none, for_good, alternating, not_finite, tenfold };

/// What goes wrong, from a period of the session on, for so many periods.
struct Fault {
  FaultKind kind = FaultKind::none;
  std::uint64_t at = 0, periods = std::numeric_limits<std::uint64_t>::max();
  int error = 0;  ///< of the vendor's library
  ForcesOff off = ForcesOff::none;

  [[nodiscard]] bool due(std::uint64_t period) const noexcept {
    return kind != FaultKind::none && period >= at && period - at < periods;
  }
};

struct Hazard {
  std::string name, setting;
  Json session;
  Fault fault;
  Doubt doubt = Doubt::none;
};

/// The simulated device, with a fault.
class FaultyDevice final : public VirtualOmega7 {
 public:
  FaultyDevice(const HilSession& session, const Fault& fault)
      : VirtualOmega7(session.plant, session.operator_script()), fault_(fault) {}

  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override {
    constexpr double kJump_m = 0.05;
    if (begun_) ++period_;
    const bool due = begun_ && fault_.due(period_ - 1);
    if (due && fault_.kind == FaultKind::read) return DeviceAnswer::failed;
    Eigen::Vector3d at_m;
    const DeviceAnswer answer = VirtualOmega7::read(at_m);
    if (due && fault_.kind == FaultKind::not_a_number) at_m.z() = std::nan("");
    if (due && fault_.kind == FaultKind::frozen) at_m = last_m_;
    if (due && fault_.kind == FaultKind::jump) at_m.z() -= kJump_m;
    if (due && fault_.kind == FaultKind::forces_off) cut_forces();
    position_m = last_m_ = at_m;
    return answer;
  }
  DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept override {
    if (due(FaultKind::write)) return DeviceAnswer::failed;
    return VirtualOmega7::write(force_N);
  }
  DeviceStatus status() noexcept override {
    DeviceStatus status = VirtualOmega7::status();
    status.failed = due(FaultKind::status);
    if (status.failed || due(FaultKind::read) || due(FaultKind::write)) {
      status.error = fault_.error;
    }
    if (due(FaultKind::forces_off)) status.forces_off = fault_.off;
    return status;
  }
  void begin() noexcept override {
    begun_ = true;
    VirtualOmega7::begin();
  }

 private:
  [[nodiscard]] bool due(FaultKind kind) const noexcept {
    return begun_ && fault_.kind == kind && period_ > 0 && fault_.due(period_ - 1);
  }

  Fault fault_;
  std::uint64_t period_ = 0;
  bool begun_ = false;
  Eigen::Vector3d last_m_ = Eigen::Vector3d::Zero();
};

/// A model whose forces are outside its validity, from a period on.
class DoubtfulModel final : public ContactModel {
 public:
  DoubtfulModel(ContactModel& model, Doubt doubt, std::uint64_t at)
      : model_(model), doubt_(doubt), at_(at) {}

  void reset() noexcept override {
    steps_ = 0;
    model_.reset();
  }
  ContactAnswer step(const ToolPose& tool) noexcept override {
    constexpr double kWrong = 10.0;
    ContactAnswer answer = model_.step(tool.displacement_m);
    if (steps_++ < at_) return answer;
    if (doubt_ == Doubt::not_finite) answer.force_N.setConstant(std::nan(""));
    const bool wrong = doubt_ == Doubt::for_good || doubt_ == Doubt::tenfold ||
                       (doubt_ == Doubt::alternating && steps_ % 2 == 0);
    if (!wrong) return answer;
    answer.force_N *= kWrong;
    answer.valid = doubt_ == Doubt::tenfold;
    return answer;
  }
  [[nodiscard]] double period_s() const noexcept override { return model_.period_s(); }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return model_.instantaneous_stiffness();
  }
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override {
    return model_.equilibrium_stiffness();
  }
  [[nodiscard]] Eigen::Index spheres() const noexcept override { return model_.spheres(); }
  void displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept override {
    model_.displacements(all);
  }

 private:
  ContactModel& model_;
  Doubt doubt_;
  std::uint64_t at_, steps_ = 0;
};

/// The paper's star: pressed to 4 mm within a second, held for one, released, left alone.
Json star_session() {
  return Json::parse(R"({
    "title": "hazard",
    "model": {"kind": "element", "scene": {
      "organ": {"kind": "star", "spacing": "30 mm"},
      "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e4 Pa s"}}},
    "indentations": {"depths": ["4 mm"], "rates": ["4 mm/s"], "hold": "1 s", "rest": "0.5 s"},
    "start": {"limit": "2 s"}})");
}

/// A period in which the tool of star_session() is held in the tissue.
constexpr std::uint64_t kHeld = 1900;

std::vector<Hazard> starts() {
  const Json star = star_session();
  const Json resting = with(star, "/virtual_device", {{"arm_set_point", "8 mm"}});
  std::vector<Hazard> list;
  list.push_back(
      {"start inside the tissue", "resting hand 8 mm below the surface", resting, {}, {}});
  list.push_back({"start inside the tissue",
                  "resting hand 60 mm below the surface",
                  with(star, "/virtual_device", {{"arm_set_point", "60 mm"}}),
                  {},
                  {}});
  list.push_back({"start outside the workspace",
                  "resting hand 90 mm above the surface",
                  with(star, "/virtual_device", {{"arm_set_point", "-90 mm"}}),
                  {},
                  {}});
  Json before = with(resting, "/surface_before_hand", "5 mm");
  list.push_back({"resting hand", "surface placed 5 mm before it", before, {}, {}});
  list.push_back({"surface out of reach",
                  "0.5 m away",
                  with(star, "/surface", {"0 m", "0 m", "-0.5 m"}),
                  {},
                  {}});
  list.push_back(
      {"too deep", "indentation of 10 m", with(star, "/indentations/depths", {"10 m"}), {}, {}});
  list.push_back({"limit above the device's",
                  "force 100 N",
                  with(star, "/limits", {{"force", "100 N"}}),
                  {},
                  {}});
  list.push_back({"limit above the device's",
                  "rise 1e9 N/s",
                  with(star, "/limits", {{"slew_N_per_s", 1e9}}),
                  {},
                  {}});
  list.push_back({"limit above the device's",
                  "damping 1e4 N s/m",
                  with(star, "/limits", {{"damping_N_s_per_m", 1e4}}),
                  {},
                  {}});
  list.push_back({"limit below the device's",
                  "ramp-in 0 s",
                  with(star, "/limits", {{"ramp_in", "0 s"}}),
                  {},
                  {}});
  return list;
}

/// The star with all its moduli, E1 = E2 = E'.
Json with_moduli(Json session, const char* modulus) {
  for (const char* name : {"E1", "E2", "Eprime"}) {
    session["model"]["scene"]["material"][name] = modulus;
  }
  return session;
}

std::vector<Hazard> renderings() {
  const Json star = star_session();
  std::vector<Hazard> list;
  const auto add = [&](const char* name, std::string setting, Json session) {
    list.push_back({name, std::move(setting), std::move(session), {}, {}});
  };
  for (const int delay : {0, 1, 2, 5, 10, 20, 50}) {
    add("delay", fmt::format("{} periods", delay),
        with(star, "/virtual_device", {{"delay_periods", delay}}));
  }
  for (const char* modulus : {"1 kPa", "10 kPa", "100 kPa", "1 MPa", "10 MPa", "100 MPa"}) {
    add("stiffness", fmt::format("E1 = E2 = E' = {}", modulus), with_moduli(star, modulus));
  }
  // tau = eta1 / (E1 + E2)
  for (const auto& [tau, eta1] : {std::pair{"10 us", "0.24 Pa s"}, std::pair{"1 ms", "24 Pa s"},
                                  std::pair{"100 ms", "2400 Pa s"}, std::pair{"10 s", "2.4e5 Pa s"},
                                  std::pair{"1000 s", "2.4e7 Pa s"}}) {
    add("relaxation time", tau, with(star, "/model/scene/material/eta1", eta1));
  }
  add("stiffness and delay", "200 kPa, 5 periods",
      with_moduli(with(star, "/virtual_device", {{"delay_periods", 5}}), "200 kPa"));
  for (const auto& [modulus, slew] : {std::pair{"12 kPa", 1.0}, std::pair{"370 kPa", 20.0}}) {
    add("rise limited below a step of the encoder", fmt::format("{} N/s, {}", slew, modulus),
        with_moduli(with(star, "/limits", {{"slew_N_per_s", slew}}), modulus));
  }
  return list;
}

std::vector<Hazard> motions() {
  const Json star = star_session();
  std::vector<Hazard> list;
  for (const char* rate : {"0.1 m/s", "0.3 m/s", "1 m/s"}) {
    list.push_back(
        {"fast hand",
         fmt::format("{} into the tissue, to 10 mm", rate),
         with(with(star, "/indentations/rates", {rate}), "/indentations/depths", {"10 mm"}),
         {},
         {}});
  }
  list.push_back({"heavy push",
                  "arm of 2000 N/m",
                  with(star, "/virtual_device", {{"arm_stiffness", "2000 N/m"}}),
                  {},
                  {}});
  list.push_back(
      {"slack hand",
       "arm without stiffness and damping",
       with(star, "/virtual_device", {{"arm_stiffness", "1 N/m"}, {"arm_damping_N_s_per_m", 0.0}}),
       {},
       {}});
  Json slide = Json::parse(R"({
    "title": "hazard",
    "model": {"kind": "surface", "scene": {
      "organ": {"kind": "liver", "count": 60},
      "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e4 Pa s"},
      "anchors": [{"kind": "far_side", "fraction": 0.3}]}},
    "slides": {"depths": ["4 mm"], "press": "10 mm/s", "direction": [0, 1, -3],
               "distance": "60 mm", "rate": "60 mm/s", "rest": "0.2 s"},
    "start": {"limit": "2 s"}})");
  list.push_back({"sliding off", "60 mm over a liver of 60 spheres", slide, {}, {}});
  return list;
}

std::vector<Hazard> faults() {
  const Json star = star_session();
  std::vector<Hazard> list;
  const auto add = [&](const char* name, std::string setting, const Fault& fault) {
    list.push_back({name, std::move(setting), star, fault, {}});
  };
  for (const int periods : {5, 7, 20, 50, 100, 500}) {
    add("stall", fmt::format("{} ms in the tissue", periods),
        {FaultKind::stall, kHeld, static_cast<std::uint64_t>(periods), 0, {}});
  }
  struct VendorError {
    int error;
    const char* words;
  };
  for (const VendorError& e : {VendorError{2, "communication"}, VendorError{3, "controller busy"},
                               VendorError{5, "no device"}, VendorError{6, "not available"},
                               VendorError{7, "timeout"}, VendorError{9, "expert mode disabled"},
                               VendorError{11, "out of memory"}, VendorError{19, "not enabled"}}) {
    add("error of reading", fmt::format("{} ({})", e.error, e.words),
        {FaultKind::read, kHeld, 1'000'000, e.error, {}});
    add("error of writing", fmt::format("{} ({})", e.error, e.words),
        {FaultKind::write, kHeld, 1'000'000, e.error, {}});
    add("error of asking for the status", fmt::format("{} ({})", e.error, e.words),
        {FaultKind::status, kHeld, 1'000'000, e.error, {}});
  }
  for (const ForcesOff off :
       {ForcesOff::button, ForcesOff::velocity, ForcesOff::watchdog, ForcesOff::software,
        ForcesOff::unplugged, ForcesOff::dead_man, ForcesOff::unknown}) {
    add("forces cut by the device", std::string(to_string(off)),
        {FaultKind::forces_off, kHeld, 1'000'000, 0, off});
  }
  add("position not a number", "for one period", {FaultKind::not_a_number, kHeld, 1, 0, {}});
  add("position frozen", "for 100 ms of the press", {FaultKind::frozen, 700, 100, 0, {}});
  add("position jumps", "50 mm into the tissue, for 20 ms", {FaultKind::jump, kHeld, 20, 0, {}});
  add("position jumps", "50 mm into the tissue, for good",
      {FaultKind::jump, kHeld, 1'000'000, 0, {}});
  struct When {
    std::uint64_t at;
    const char* phase;
  };
  add("signal", "while the session waits for the operator", {FaultKind::signal, 0, 1, 0, {}});
  for (const When& when : {When{100, "approach"}, When{900, "indentation"}, When{kHeld, "hold"},
                           When{2800, "release"}, When{3600, "rest"}}) {
    add("signal", fmt::format("during the {}", when.phase), {FaultKind::signal, when.at, 1, 0, {}});
  }
  add("full disk", "the recording cannot be written", {FaultKind::record, kHeld, 1, 0, {}});
  for (const auto& [doubt, setting] :
       {std::pair{Doubt::for_good, "tenfold and outside validity, for good"},
        std::pair{Doubt::alternating, "tenfold and outside validity, every second period"},
        std::pair{Doubt::tenfold, "tenfold and within validity"},
        std::pair{Doubt::not_finite, "not a number"}}) {
    list.push_back(
        {"force of the model", setting, star, {FaultKind::none, kHeld, 0, 0, {}}, doubt});
  }
  return list;
}

const std::vector<Hazard>& hazards() {
  static const std::vector<Hazard> all = [] {
    std::vector<Hazard> list;
    for (auto* part : {&starts, &renderings, &motions, &faults}) {
      const std::vector<Hazard> some = part();
      list.insert(list.end(), some.begin(), some.end());
    }
    return list;
  }();
  return all;
}

/// Follows the rows of a session.
class Follower {
 public:
  Follower(const Hazard& hazard, double period_s) : period_s_(period_s) {
    const bool injected = hazard.fault.kind != FaultKind::none || hazard.doubt != Doubt::none;
    if (injected) onset_ = hazard.fault.at;
  }
  void see(const ServoRecord& row) {
    const Eigen::Map<const Eigen::Vector3d> force_N(row.commanded_N);
    const double size_N = force_N.norm();
    largest_N_ = std::max(largest_N_, size_N);
    largest_rise_N_ = std::max(largest_rise_N_, size_N - before_N_);
    before_N_ = size_N;
    damped_ = damped_ || (row.flags & kDamped) != 0;
    if (row.phase < 0) return;
    if (onset_ == kNever && (row.flags & kTouching) != 0) onset_ = row.cycle;
    last_ = row.cycle;
    if (row.cycle < onset_) return;
    if (row.cycle == onset_) at_onset_m_ = row.tool_depth_m;
    travel_m_ = std::max(travel_m_, std::abs(row.tool_depth_m - at_onset_m_));
  }
  void fill(HazardRow& row) const {
    row.largest_force_N = largest_N_;
    row.largest_rise_N = largest_rise_N_;
    row.damped = damped_;
    if (row.cause == StopCause::finished || last_ < onset_) return;
    row.to_zero_s = static_cast<double>(last_ - onset_) * period_s_;
    row.travel_m = travel_m_;
  }

 private:
  double period_s_;
  double largest_N_ = 0.0, largest_rise_N_ = 0.0, before_N_ = 0.0, travel_m_ = 0.0;
  static constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t onset_ = kNever, last_ = 0;
  double at_onset_m_ = 0.0;
  bool damped_ = false;
};

/// The loop in virtual time, with stalls, signals and records that cannot be kept.
void serve(ServoStep& step, FaultyDevice& device, const Fault& fault, double period_s,
           Follower& follower) {
  ServoRecord row;
  StopCause cause = StopCause::none;
  constexpr int kWaited = 100;
  for (int i = 0; cause == StopCause::none; ++i) {
    const bool while_waiting = fault.at == 0 && i == kWaited;
    const bool due = while_waiting || (fault.at > 0 && step.cycles() == fault.at && row.phase >= 0);
    int missed = 0;
    if (due && fault.kind == FaultKind::stall) {
      missed = static_cast<int>(fault.periods);
      device.advance(missed * period_s);
    }
    if (due && (fault.kind == FaultKind::signal || fault.kind == FaultKind::record)) {
      step.stop(fault.kind == FaultKind::signal ? StopCause::signal : StopCause::exception);
      ServoRecord last = row;
      last.cycle = step.cycles();
      std::fill_n(last.commanded_N, 3, 0.0);
      follower.see(last);
      return;
    }
    cause = step.cycle(missed, row);
    follower.see(row);
    device.advance(period_s);
  }
}

bool is_within(const HazardRow& row, const Hazard& hazard, const HazardBounds& b) {
  if (!row.refused.empty()) return !row.passive;
  const bool force = row.largest_force_N <= b.force_N * (1.0 + 1e-12);
  const bool rise = row.largest_rise_N <= b.rise_N * (1.0 + 1e-9);
  if (row.cause == StopCause::finished) return force && rise && row.delivered_J <= b.delivered_J;
  const bool injected = hazard.fault.kind != FaultKind::none;
  const double stall_s = hazard.fault.kind == FaultKind::stall
                             ? 1e-3 * static_cast<double>(hazard.fault.periods)
                             : 0.0;
  const double limit_s = injected ? b.fault_to_zero_s + stall_s : b.to_zero_s;
  return force && rise && row.delivered_J <= b.delivered_stopped_J && row.travel_m <= b.travel_m &&
         row.to_zero_s <= limit_s * (1.0 + 1e-9);
}

HazardRow row_of(const Hazard& hazard, bool unchecked, const HazardBounds& bounds) {
  HazardRow row;
  row.hazard = hazard.name;
  row.setting = hazard.setting;
  row.unchecked = unchecked;
  const auto run = [&] {
    const HilSession session = parse_session(hazard.session, "session", {});
    const LoopModel model = make_loop_model(session);
    const RenderingCheck rendering = check_rendering(session, *model.model, model, "virtual");
    row.passive = rendering.passive() && rendering.within_device() && rendering.follows_encoder();
    if (!rendering.acceptable() && !unchecked) {
      row.refused = rendering.verdict();
      row.refused_by_check = true;
      return;
    }
    const ServoSettings servo = loop_settings(session, model, rendering, true);
    FaultyDevice device(session, hazard.fault);
    device.open();
    device.prepare(session.preparation);
    device.enable_forces();
    DoubtfulModel doubtful(
        *model.model, hazard.doubt,
        hazard.doubt == Doubt::none ? std::numeric_limits<std::uint64_t>::max() : hazard.fault.at);
    ServoStep step(device, doubtful, servo);
    Follower follower(hazard, servo.period_s);
    serve(step, device, hazard.fault, servo.period_s, follower);
    row.cause = step.cause();
    row.delivered_J = step.energy().most_delivered_J();
    follower.fill(row);
  };
  try {
    run();
  } catch (const Error& error) {
    if (error.code() != ExitCode::bad_input) throw;
    row.refused = error.what();
  }
  row.within = is_within(row, hazard, bounds);
  return row;
}

}  // namespace

bool HazardStudy::safe() const {
  return std::all_of(rows.begin(), rows.end(), [](const HazardRow& row) { return row.within; });
}

HazardStudy study_hazards() {
  HazardStudy study;
  for (const Hazard& hazard : hazards()) {
    study.rows.push_back(row_of(hazard, false, study.bounds));
    if (study.rows.back().refused_by_check)
      study.rows.push_back(row_of(hazard, true, study.bounds));
  }
  return study;
}

}  // namespace tpm::haptics
