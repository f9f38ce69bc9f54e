#include "tpm/haptics/session/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/session/loop_maker.hpp"
#include "tpm/haptics/session/session_phases.hpp"
#include "tpm/haptics/session/surface_scene.hpp"
#include "tpm/organ/scene/blocks.hpp"
#include "tpm/plan/plan.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

double in_range(const Json& block, const char* key, Dimension dimension, double usual, double least,
                double most, const DocumentPlace& place) {
  const double value = block.contains(key) ? quantity_at(block, key, dimension, place) : usual;
  if (value >= least && value <= most) return value;
  const std::string_view unit = si_symbol(dimension);
  throw bad_input(place.key(key).where, fmt::format("{} {}", shortest(value), unit),
                  fmt::format("{} to {} {}", shortest(least), shortest(most), unit));
}

double number_in_range(const Json& block, const char* key, double usual, double least, double most,
                       const DocumentPlace& place) {
  const double value = block.value(key, usual);
  if (value >= least && value <= most) return value;
  throw bad_input(place.key(key).where, shortest(value),
                  fmt::format("{} to {}", shortest(least), shortest(most)));
}

Eigen::Vector3d push_of(const Json& session, const DocumentPlace& place) {
  if (!session.contains("push")) return -Eigen::Vector3d::UnitZ();
  const Json& list = session.at("push");
  const Eigen::Vector3d push(list[0].get<double>(), list[1].get<double>(), list[2].get<double>());
  if (push.allFinite() && !push.isZero(0.0)) return push.stableNormalized();
  throw bad_input(place.key("push").where, "has no direction", "three numbers that are not all 0");
}

/// The part of a direction that is square to the push.
Eigen::Vector3d slide_of(const Json& slides, const Eigen::Vector3d& push,
                         const DocumentPlace& place) {
  constexpr double kLeast = 1e-6;
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();
  if (slides.contains("direction")) {
    const Json& list = slides.at("direction");
    along << list[0].get<double>(), list[1].get<double>(), list[2].get<double>();
  }
  const Eigen::Vector3d square = along - along.dot(push) * push;
  if (along.allFinite() && square.norm() > kLeast * along.norm()) return square.normalized();
  throw bad_input(place.key("direction").where, "has no part across the push",
                  "three numbers that are not all 0 and not along 'push'");
}

void parse_tool(HilSession& session, const Json& model, const DocumentPlace& place) {
  for (const char* key : {"tool_radius", "contact_stiffness"}) {
    if (!model.contains(key) || session.model == "surface") continue;
    throw bad_input(place.key(key).where, printable(model.at(key).get<std::string>()),
                    "none but with the kind 'surface'");
  }
  session.tool_radius_m =
      in_range(model, "tool_radius", Dimension::length, session.tool_radius_m, 1e-3, 0.2, place);
  session.contact_stiffness_N_per_m =
      in_range(model, "contact_stiffness", Dimension::stiffness, session.contact_stiffness_N_per_m,
               100.0, 1e6, place);
}

void parse_limits(HilSession& session, const Json& limits, const DeviceLimits& device,
                  const DocumentPlace& place) {
  SessionServo& servo = session.servo;
  constexpr double kLongest_s = 60.0, kLeastSlew_N_per_s = 1.0, kMostOutside_s = 2.0;
  servo.force_limit_N =
      in_range(limits, "force", Dimension::force, servo.force_limit_N, 1e-3, device.force_N, place);
  servo.slew_limit_N_per_s = number_in_range(limits, "slew_N_per_s", servo.slew_limit_N_per_s,
                                             kLeastSlew_N_per_s, device.slew_N_per_s, place);
  servo.ramp_in_s = in_range(limits, "ramp_in", Dimension::time, servo.ramp_in_s,
                             device.least_ramp_in_s, kLongest_s, place);
  servo.most_damping_N_s_per_m =
      number_in_range(limits, "damping_N_s_per_m", servo.most_damping_N_s_per_m, 0.0,
                      device.damping_N_s_per_m, place);
  servo.outside_validity_limit_s =
      in_range(limits, "outside_validity", Dimension::time, servo.outside_validity_limit_s,
               servo.period_s, kMostOutside_s, place);
  servo.most_late = limits.value("late_cycles", servo.most_late);
  session.preparation.watchdog_s =
      in_range(limits, "watchdog", Dimension::time, 0.008, 0.004, 0.016, place);
  // The device is asked for no more than the session, whatever it could.
  session.preparation.max_force_N = servo.force_limit_N;
  session.cycle_timeout_s =
      in_range(limits, "cycle_timeout", Dimension::time, 0.008, 0.002, 1.0, place);
}

/// What has to be before the session begins.
void parse_start(SessionServo& servo, const Json& json, const DeviceLimits& device,
                 const DocumentPlace& place) {
  StartGateSettings gate;
  gate.reach_m = device.reach_m;
  const Json start = json.value("start", Json::object());
  const DocumentPlace at = place.key("start");
  constexpr double kMostClearance_m = 0.05, kLeastRest_s = 0.1, kMostRest_s = 5.0;
  constexpr double kLeastLimit_s = 1.0, kMostLimit_s = 3600.0;
  gate.clearance_m =
      in_range(start, "clearance", Dimension::length, gate.clearance_m, 1e-4, kMostClearance_m, at);
  gate.rest_time_s =
      in_range(start, "at_rest", Dimension::time, gate.rest_time_s, kLeastRest_s, kMostRest_s, at);
  gate.limit_s =
      in_range(start, "limit", Dimension::time, gate.limit_s, kLeastLimit_s, kMostLimit_s, at);
  gate.confirm = start.value("confirm", false);
  servo.gate = gate;
  if (!json.contains("surface_before_hand")) return;
  if (json.contains("surface")) {
    throw bad_input(place.key("surface_before_hand").where, "the surface is already given",
                    "'surface' or 'surface_before_hand'");
  }
  constexpr double kNearest_m = 1e-3, kFurthest_m = 0.05;
  servo.surface_before_hand_m =
      in_range(json, "surface_before_hand", Dimension::length, 0.0, kNearest_m, kFurthest_m, place);
}

DeviceMounting parse_mounting(const Json& json, const DocumentPlace& place) {
  DeviceMounting mounting;
  if (json.contains("effector_mass_kg")) {
    mounting.effector_mass_kg = json.at("effector_mass_kg").get<double>();
  }
  const auto angle = [&](const char* key, double most_rad) -> std::optional<double> {
    if (!json.contains(key)) return std::nullopt;
    return in_range(json, key, Dimension::angle, 0.0, -most_rad, most_rad, place);
  };
  mounting.angle_rad = angle("angle", 2.0 * std::numbers::pi);
  mounting.base_angle_x_rad = angle("base_angle_x", std::numbers::pi);
  mounting.base_angle_z_rad = angle("base_angle_z", std::numbers::pi);
  return mounting;
}

/// How far the tool goes beyond the place where the tissue begins, m: along the push and across.
double furthest_of(const HilSession& session, const Eigen::Vector3d& surface_m) {
  constexpr double kUnderLoads_m = 0.012;  // where the tissue is damaged
  double furthest = surface_m.norm();
  for (const SessionPhase& phase : session.phases) {
    const bool pushes =
        phase.kind == SessionPhaseKind::load || phase.kind == SessionPhaseKind::creep;
    std::pair<double, double> depths(phase.from, phase.to);
    if (pushes) depths = {0.0, kUnderLoads_m};
    if (phase.kind == SessionPhaseKind::motion) depths = {0.0, phase.depth_m};
    for (const double depth : {depths.first, depths.second}) {
      for (const double across : {phase.across_from_m, phase.across_to_m}) {
        const Eigen::Vector3d at = surface_m + depth * session.servo.push + across * session.slide;
        furthest = std::max(furthest, at.norm());
      }
    }
  }
  return furthest;
}

void require_within_reach(HilSession& session, const DeviceLimits& device,
                          const DocumentPlace& place) {
  const bool before_hand = session.servo.surface_before_hand_m.has_value();
  const double furthest = furthest_of(session, session.servo.surface_m);
  if (furthest > device.reach_m) {
    throw bad_input(place.where,
                    fmt::format("the tool would go {} m from the centre of the workspace",
                                significant(furthest, 4)),
                    fmt::format("{} m at most ({})", shortest(device.reach_m), device.kind));
  }
  // Wherever the hand is then, the session has to fit in from there.
  if (before_hand) {
    session.servo.gate->reach_m -= furthest + *session.servo.surface_before_hand_m;
    if (!(session.servo.gate->reach_m > 0.0)) {
      throw bad_input(place.key("surface_before_hand").where, "leaves no room for the session",
                      "a nearer surface, or shorter ways");
    }
  }
}

void parse_plant(PlantSettings& plant, const Json& block, const DocumentPlace& place) {
  plant.mass_kg = block.value("mass_kg", plant.mass_kg);
  plant.damping_N_s_per_m = block.value("damping_N_s_per_m", plant.damping_N_s_per_m);
  plant.encoder_step_m =
      in_range(block, "encoder_step", Dimension::length, plant.encoder_step_m, 0.0, 1e-3, place);
  plant.delay_periods = block.value("delay_periods", plant.delay_periods);
  plant.motor_limit_N =
      in_range(block, "motor_limit", Dimension::force, plant.motor_limit_N, 1e-3, 1e3, place);
  plant.least_watchdog_s =
      in_range(block, "least_watchdog", Dimension::time, 0.0, 0.0, 10.0, place);
  plant.arm.mass_kg = block.value("arm_mass_kg", plant.arm.mass_kg);
  plant.arm.damping_N_s_per_m = block.value("arm_damping_N_s_per_m", plant.arm.damping_N_s_per_m);
  plant.arm.stiffness_N_per_m = in_range(block, "arm_stiffness", Dimension::stiffness,
                                         plant.arm.stiffness_N_per_m, 0.0, 1e5, place);
  if (block.contains("arm_set_point")) {
    plant.arm_set_point_m =
        in_range(block, "arm_set_point", Dimension::length, 0.0, -0.1, 0.1, place);
  }
  plant.arm.correction_per_s = block.value("correction_per_s", plant.arm.correction_per_s);
}

std::string parse_model(const Json& model, const DocumentPlace& place) {
  std::string kind = model.value("kind", std::string(kPlannedModel));
  if (kind == kPlannedModel) return kind;
  const Formulation* formulation = find_formulation(kind);
  if (formulation != nullptr && for_sessions(*formulation)) return std::string(formulation->name());
  refuse_formulation(kind, "model", place.key("kind").where,
                     fmt::format("{}, {}", kPlannedModel, formulations_that(for_sessions)));
}

/// The scene, or the law, from the block or from a file that it names.
void parse_tissue_of(HilSession& session, const Json& model, const DocumentPlace& place,
                     const std::filesystem::path& folder) {
  const bool by_law = session.model == "law";
  const char* key = by_law ? "law" : "scene";
  const char* other = by_law ? "scene" : "law";
  const DocumentPlace at = place.key(key);
  if (model.contains(other)) {
    throw bad_input(place.key(other).where,
                    fmt::format("is not for the kind '{}'", model.value("kind", "planned")),
                    fmt::format("'{}'", key));
  }
  if (!model.contains(key)) {
    throw bad_input(place.where, fmt::format("no key '{}'", key),
                    by_law ? "a law, or a file with one (tpm fit writes law.json)"
                           : "a scene, or a file with one");
  }
  const Json& tissue = model.at(key);
  const std::filesystem::path file =
      tissue.is_string() ? folder / tissue.get<std::string>() : std::filesystem::path();
  const std::string where = tissue.is_string() ? file.string() : at.where;
  if (by_law) {
    session.law = law_from_json(tissue.is_string() ? read_json(file) : tissue, where);
  } else {
    session.scene_place = where;
    session.scene = with_mesh_listed(tissue.is_string() ? read_json(file) : tissue, where,
                                     tissue.is_string() ? file.parent_path() : folder);
  }
}

void parse_contact_of(HilSession& session, const Json& model, const DocumentPlace& place) {
  if (!model.contains("contact")) return;
  const DocumentPlace at = place.key("contact");
  if (session.law || session.model == "surface" || session.model == "element") {
    throw bad_input(at.where, fmt::format("is not for the kind '{}'", session.model),
                    "a kind that moves spheres of a scene, such as planned or zone");
  }
  session.contact = model.at("contact");
  session.contact_place = at.where;
}

std::string parse_tolerance(const Json& model, std::string_view kind, const DocumentPlace& place) {
  std::string text = model.value("tolerance", std::string("1%"));
  const DocumentPlace at = place.key("tolerance");
  if (model.contains("tolerance") && kind != kPlannedModel) {
    throw bad_input(at.where, printable(text), "none but with the kind 'planned'");
  }
  try {
    PlanRequest request;
    set_tolerance(request, text);
  } catch (const Error&) {
    throw bad_input(at.where, "'" + printable(text) + "'",
                    "a share of the peak such as 1% or 0.01, 1e-6 to 0.5, or jnd");
  }
  return text;
}

std::vector<std::uint64_t> ends_of(const std::vector<SessionPhase>& phases, double period_s) {
  std::vector<std::uint64_t> ends;
  ends.reserve(phases.size());
  for (const SessionPhase& phase : phases) {
    ends.push_back(static_cast<std::uint64_t>(std::llround(phase.end_s / period_s)));
  }
  return ends;
}

}  // namespace

std::string_view word_of(SessionPhaseKind kind) {
  static constexpr auto kNames = std::to_array<Word<SessionPhaseKind>>({
      {SessionPhaseKind::approach, "approach"},
      {SessionPhaseKind::indent, "indent"},
      {SessionPhaseKind::hold, "hold"},
      {SessionPhaseKind::slide, "slide"},
      {SessionPhaseKind::release, "release"},
      {SessionPhaseKind::rest, "rest"},
      {SessionPhaseKind::load, "load"},
      {SessionPhaseKind::creep, "creep"},
  });
  return word_for(kNames, kind, "motion");
}

double deepest_asked_m(const HilSession& session, double under_loads_m) {
  double deepest = 0.0;
  for (const SessionPhase& phase : session.phases) {
    deepest = std::max(deepest, phase.depth_m);
    if (phase.kind == SessionPhaseKind::load) deepest = std::max(deepest, under_loads_m);
  }
  return deepest;
}

OperatorScript HilSession::operator_script() const {
  std::vector<OperatorPiece> pieces;
  double start_s = 0.0;
  for (const SessionPhase& phase : phases) {
    const bool pushes =
        phase.kind == SessionPhaseKind::load || phase.kind == SessionPhaseKind::creep;
    const auto aim = pushes ? OperatorPiece::Aim::force : OperatorPiece::Aim::place;
    const std::size_t parts = std::max<std::size_t>(phase.surface_m.size(), 2) - 1;
    const auto at = [parts](std::size_t i, double from, double to) {
      return i == parts ? to
                        : from + static_cast<double>(i) / static_cast<double>(parts) * (to - from);
    };
    const auto place = [&](std::size_t i) {
      return at(i, phase.from, phase.to) + (phase.surface_m.empty() ? 0.0 : phase.surface_m[i]);
    };
    for (std::size_t i = 0; i < parts; ++i) {
      pieces.push_back({aim, at(i + 1, start_s, phase.end_s), place(i), place(i + 1),
                        at(i, phase.across_from_m, phase.across_to_m) * slide,
                        at(i + 1, phase.across_from_m, phase.across_to_m) * slide});
    }
    start_s = phase.end_s;
  }
  return OperatorScript(std::move(pieces));
}

HilSession parse_session(const Json& written, std::string_view where,
                         const std::filesystem::path& folder) {
  const Json json = checked(written, "hil", where);
  const DocumentPlace place{std::string(where)};
  const DeviceLimits& device = limits_of("omega7");  // the simulated one has the same
  HilSession session;
  session.title = json.value("title", std::string("session"));
  session.model = parse_model(json.at("model"), place.key("model"));
  session.tolerance = parse_tolerance(json.at("model"), session.model, place.key("model"));
  parse_tool(session, json.at("model"), place.key("model"));
  parse_tissue_of(session, json.at("model"), place.key("model"), folder);
  parse_contact_of(session, json.at("model"), place.key("model"));
  constexpr double kSlowest_Hz = 500.0, kUsual_Hz = 1000.0, kFastest_Hz = 4000.0;
  session.servo.period_s = 1.0 / in_range(json, "rate", Dimension::frequency, kUsual_Hz,
                                          kSlowest_Hz, kFastest_Hz, place);
  Json with_motion = json;
  if (session.law) {
    embed_motion(with_motion, *session.law, session.servo.period_s, folder, place);
  } else if (json.contains("motion")) {
    throw bad_input(place.key("motion").where, "is for the model 'law' only",
                    "\"model\": {\"kind\": \"law\", ...}: the law knows where contact began");
  }
  session.text = to_text(with_motion);
  session.servo.push = push_of(json, place);
  if (json.contains("slides")) {
    const DocumentPlace slides = place.key("slides");
    if (session.model != "surface") {
      throw bad_input(slides.where, "the model does not follow a tool across its push",
                      "\"model\": {\"kind\": \"surface\", ...}");
    }
    session.slide = slide_of(json.at("slides"), session.servo.push, slides);
  }
  if (json.contains("surface")) {
    session.servo.surface_m = parse_point(json.at("surface"), place.key("surface"));
    if (!(session.servo.surface_m.norm() <= device.reach_m)) {
      throw bad_input(
          place.key("surface").where, "out of the device's reach",
          fmt::format("{} m from the centre of the workspace at most", shortest(device.reach_m)));
    }
  }
  parse_limits(session, json.value("limits", Json::object()), device, place.key("limits"));
  parse_start(session.servo, json, device, place);
  session.preparation.mounting =
      parse_mounting(json.value("mounting", Json::object()), place.key("mounting"));
  session.phases = parse_phases(with_motion, place);
  if (with_motion.contains("motion")) {
    session.measured_N = with_motion.at("motion").value("measured_N", std::vector<double>());
  }
  if (session.servo.surface_before_hand_m) {
    session.phases.front().from = -*session.servo.surface_before_hand_m;
  }
  require_within_reach(session, device, place);
  session.servo.phase_ends = ends_of(session.phases, session.servo.period_s);
  session.plant.period_s = session.servo.period_s;
  session.plant.watchdog_s = session.preparation.watchdog_s;
  session.plant.push = session.servo.push;
  session.plant.origin_m = session.servo.surface_m;
  parse_plant(session.plant, json.value("virtual_device", Json::object()),
              place.key("virtual_device"));
  if (json.contains("virtual_device") && json.at("virtual_device").contains("damping_N_s_per_m")) {
    session.stated_friction_N_s_per_m = session.plant.damping_N_s_per_m;
  }
  return session;
}

void require_within(const HilSession& session, const DeviceLimits& limits) {
  const auto refuse = [&](const char* key, std::string_view what, const std::string& most) {
    throw Error(ExitCode::answer_is_no, fmt::format("device '{}'", limits.kind),
                fmt::format("the session's {} is {}", key, what), "at most " + most);
  };
  const SessionServo& servo = session.servo;
  if (servo.force_limit_N > limits.force_N) {
    refuse("limits/force", shortest(servo.force_limit_N) + " N", shortest(limits.force_N) + " N");
  }
  if (servo.slew_limit_N_per_s > limits.slew_N_per_s) {
    refuse("limits/slew_N_per_s", shortest(servo.slew_limit_N_per_s),
           shortest(limits.slew_N_per_s));
  }
  if (servo.most_damping_N_s_per_m > limits.damping_N_s_per_m) {
    refuse("limits/damping_N_s_per_m", shortest(servo.most_damping_N_s_per_m),
           shortest(limits.damping_N_s_per_m));
  }
  const double furthest_m = furthest_of(session, session.servo.surface_m);
  if (!servo.surface_before_hand_m && furthest_m > limits.reach_m) {
    refuse("furthest place", fmt::format("{:.3g} m from the centre", furthest_m),
           shortest(limits.reach_m) + " m");
  }
}

HilSession read_session(const std::filesystem::path& file, const SessionChanges& changes) {
  Json json = checked(read_json(file), "hil", file.string());
  if (!changes.law.empty()) {
    json["model"] = {{"kind", "law"}, {"law", files::to_json(read_law(changes.law))}};
  }
  if (!changes.motion.empty()) {
    if (json.at("model").value("kind", "") != "law") {
      throw Error(ExitCode::usage, "--replay-motion", "the session feels no law",
                  "--law FILE beside it: the law knows the depth at which contact began");
    }
    for (const char* key : {"indentations", "slides", "creep"}) json.erase(key);
    // Named on a command line: beside the caller, not beside the session.
    json["motion"] = {{"recording", std::filesystem::absolute(changes.motion).string()}};
  }
  HilSession session = parse_session(json, file.string(), file.parent_path());
  follow_surface(session);
  return session;
}

}  // namespace tpm::haptics
