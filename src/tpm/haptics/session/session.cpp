#include "tpm/haptics/session/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/require_exists.hpp"
#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/session/session_keys.hpp"
#include "tpm/haptics/session/session_phases.hpp"
#include "tpm/haptics/session/surface_scene.hpp"
#include "tpm/organ/scene/scene_keys.hpp"
#include "tpm/plan/plan.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

/// The part of a direction that is square to the push.
Eigen::Vector3d slide_of(const SlideKeys& slides, const Eigen::Vector3d& push,
                         const DocumentPlace& place) {
  constexpr double kLeast = 1e-6;
  const Eigen::Vector3d along = vector_of(slides.direction);
  const Eigen::Vector3d square = along - along.dot(push) * push;
  if (along.allFinite() && square.norm() > kLeast * along.norm()) return square.normalized();
  throw bad_input(place.key("direction").where, "has no part across the push",
                  "three numbers that are not all 0 and not along 'push'");
}

void set_tool(HilSession& session, const SessionModelKeys& model, const DocumentPlace& place) {
  const auto only_of_surface = [&](const std::optional<double>& value, const char* key) {
    if (!value || session.model == "surface") return;
    throw bad_input(place.key(key).where, fmt::format("with the kind '{}'", session.model),
                    "none but with the kind 'surface'");
  };
  only_of_surface(model.tool_radius_m, "tool_radius");
  only_of_surface(model.contact_stiffness_N_per_m, "contact_stiffness");
  session.tool_radius_m = model.tool_radius_m.value_or(session.tool_radius_m);
  session.contact_stiffness_N_per_m =
      model.contact_stiffness_N_per_m.value_or(session.contact_stiffness_N_per_m);
}

void require_a_period(const LimitKeys& limits, double period_s, const DocumentPlace& place) {
  if (limits.servo.outside_validity_limit_s >= period_s) return;
  throw bad_input(place.key("outside_validity").where,
                  fmt::format("{} s", shortest(limits.servo.outside_validity_limit_s)),
                  fmt::format("a period of the loop, {} s, or more", shortest(period_s)));
}

/// The places farthest along the push and across, and that where the tissue begins.
/// @param surface_m where it begins
std::vector<Eigen::Vector3d> places_of(const HilSession& session,
                                       const Eigen::Vector3d& surface_m) {
  constexpr double kUnderLoads_m = 0.012;  // where the tissue is damaged
  std::vector<Eigen::Vector3d> places{surface_m};
  for (const SessionPhase& phase : session.phases) {
    const bool pushes =
        phase.kind == SessionPhaseKind::load || phase.kind == SessionPhaseKind::creep;
    std::pair<double, double> depths(phase.from, phase.to);
    if (pushes) depths = {0.0, kUnderLoads_m};
    if (phase.kind == SessionPhaseKind::motion) depths = {0.0, phase.depth_m};
    for (const double depth : {depths.first, depths.second}) {
      for (const double across : {phase.across_from_m, phase.across_to_m}) {
        places.emplace_back(surface_m + depth * session.servo.push + across * session.slide);
      }
    }
  }
  return places;
}

/// Of those places the largest distance from the centre of the workspace, m.
double furthest_of(const HilSession& session, const Eigen::Vector3d& surface_m) {
  double furthest = 0.0;
  for (const auto& at : places_of(session, surface_m)) furthest = std::max(furthest, at.norm());
  return furthest;
}

/// The same along x.
double furthest_along_x(const HilSession& session, const Eigen::Vector3d& surface_m) {
  double furthest = 0.0;
  for (const auto& at : places_of(session, surface_m)) {
    furthest = std::max(furthest, std::abs(at.x()));
  }
  return furthest;
}

/// Largest distance of the hand from the centre of the workspace before the session, m. Without a
/// surface of its own the session has to fit in from wherever the hand is then.
double start_room_m(const HilSession& session, const DeviceLimits& device) {
  if (!session.servo.surface_before_hand_m) return device.reach_m;
  const double before_m = *session.servo.surface_before_hand_m;
  double room_m = device.reach_m - (furthest_of(session, session.servo.surface_m) + before_m);
  const double along_x_m = furthest_along_x(session, before_m * session.servo.push);
  if (device.stop_along_x_m > 0.0 && along_x_m > 0.0) {
    room_m = std::min(room_m, device.stop_along_x_m - along_x_m);
  }
  return room_m;
}

void require_within_reach(const HilSession& session, const DeviceLimits& device,
                          const DocumentPlace& place) {
  const double furthest = furthest_of(session, session.servo.surface_m);
  if (furthest > device.reach_m) {
    throw bad_input(place.where,
                    fmt::format("the tool would go {} m from the centre of the workspace",
                                significant(furthest, 4)),
                    fmt::format("{} m at most ({})", shortest(device.reach_m), device.kind));
  }
  if (start_room_m(session, device) > 0.0) return;
  throw bad_input(place.key("surface_before_hand").where, "leaves no room for the session",
                  "a nearer surface, or shorter ways");
}

/// Refuses what else than the hand would press on the tissue.
void require_hand_alone(const Json& scene, const DocumentPlace& place) {
  const SceneKeys keys = scene_block().made(scene, place);
  if (keys.contacts) {
    throw bad_input(place.key("contacts").where,
                    "the hand is the only contact of a session, and its motion the protocol",
                    "no contacts; a patch or another place is 'contact' of the model");
  }
  if (keys.loads) {
    throw bad_input(place.key("loads").where, "a session starts from the tissue without loads",
                    "a scene without them");
  }
}

/// The scene, or the law, from the block or from a file that it names.
void set_tissue(HilSession& session, const SessionModelKeys& model, const DocumentPlace& place,
                const std::filesystem::path& folder) {
  const bool by_law = session.model == "law";
  const char* key = by_law ? "law" : "scene";
  const char* other = by_law ? "scene" : "law";
  const DocumentPlace at = place.key(key);
  const Json& tissue = by_law ? model.law : model.scene;
  if (!(by_law ? model.scene : model.law).is_null()) {
    throw bad_input(place.key(other).where, fmt::format("is not for the kind '{}'", session.model),
                    fmt::format("'{}'", key));
  }
  if (tissue.is_null()) {
    throw bad_input(place.where, fmt::format("no key '{}'", key),
                    by_law ? "a law, or a file with one (tpm fit writes law.json)"
                           : "a scene, or a file with one");
  }
  const std::filesystem::path file =
      tissue.is_string() ? folder / tissue.get<std::string>() : std::filesystem::path();
  const DocumentPlace where = tissue.is_string() ? DocumentPlace{file.string()} : at;
  if (by_law) {
    session.law = law_from_json(tissue.is_string() ? read_json(file) : tissue, where);
  } else {
    session.scene_place = where;
    session.scene =
        with_mesh_listed(without_schema_key(tissue.is_string() ? read_json(file) : tissue), where,
                         tissue.is_string() ? file.parent_path() : folder);
    require_hand_alone(session.scene, where);
  }
}

void set_contact(HilSession& session, const SessionModelKeys& model, const DocumentPlace& place) {
  if (model.contact.is_null()) return;
  const DocumentPlace at = place.key("contact");
  if (session.law || session.model == "surface" || session.model == "element") {
    throw bad_input(at.where, fmt::format("is not for the kind '{}'", session.model),
                    "a kind that moves spheres of a scene, such as planned or curves");
  }
  session.contact = model.contact;
  session.contact_place = at;
}

void set_tolerance_of(HilSession& session, const SessionModelKeys& model,
                      const DocumentPlace& place) {
  if (!model.tolerance) return;
  const DocumentPlace at = place.key("tolerance");
  if (session.model != kPlannedModel) {
    throw bad_input(at.where, printable(*model.tolerance), "none but with the kind 'planned'");
  }
  PlanRequest unused;
  if (!try_set_tolerance(unused, *model.tolerance)) {
    throw bad_input(at.where, "'" + printable(*model.tolerance) + "'",
                    "a share of the peak such as 1% or 0.01, 1e-6 to 0.5, or jnd");
  }
  session.tolerance = *model.tolerance;
}

void set_model(HilSession& session, const SessionModelKeys& model, const DocumentPlace& place,
               const std::filesystem::path& folder) {
  session.model = model.kind;
  set_tolerance_of(session, model, place);
  set_tool(session, model, place);
  set_tissue(session, model, place, folder);
  set_contact(session, model, place);
}

void set_surface(HilSession& session, const SessionKeys& keys, const DeviceLimits& device,
                 const DocumentPlace& place) {
  session.servo.surface_before_hand_m = keys.surface_before_hand_m;
  if (!keys.surface_m) return;
  session.servo.surface_m = vector_of(*keys.surface_m);
  if (session.servo.surface_m.norm() <= device.reach_m) return;
  throw bad_input(
      place.key("surface").where, "out of the device's reach",
      fmt::format("{} m from the centre of the workspace at most", shortest(device.reach_m)));
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

std::string_view to_string(SessionPhaseKind kind) {
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
                         const std::filesystem::path& folder, const DeviceLimits& device) {
  const Json json = checked(written, session_kind(), where);
  const DocumentPlace place{std::string(where)};
  SessionKeys keys = session_block().made(json, place);
  HilSession session;
  session.title = keys.title;
  set_model(session, keys.model, place.key("model"), folder);
  session.servo = keys.limits.servo;
  session.servo.period_s = 1.0 / keys.rate_Hz;
  require_a_period(keys.limits, session.servo.period_s, place.key("limits"));
  Json with_motion = json;
  if (session.law) {
    if (keys.motion && keys.motion->recording) {
      const Json motion = embedded_motion(folder / *keys.motion->recording, *session.law,
                                          session.servo.period_s, place.key("motion"));
      keys.motion = motion_block().read(with_motion["motion"] = motion, place.key("motion"));
    }
  } else if (keys.motion) {
    throw bad_input(place.key("motion").where, "is for the model 'law' only",
                    "\"model\": {\"kind\": \"law\", ...}: the law knows where contact began");
  }
  session.text = to_text(with_motion);
  if (keys.push) session.servo.push = vector_of(*keys.push).stableNormalized();
  if (keys.slides) {
    const DocumentPlace slides = place.key("slides");
    if (session.model != "surface") {
      throw bad_input(slides.where, "the model does not follow a tool across its push",
                      "\"model\": {\"kind\": \"surface\", ...}");
    }
    session.slide = slide_of(*keys.slides, session.servo.push, slides);
  }
  set_surface(session, keys, device, place);
  session.preparation.watchdog_s = keys.limits.watchdog_s;
  // The device is asked for no more than the session, whatever it could.
  session.preparation.max_force_N = session.servo.force_limit_N;
  session.cycle_timeout_s = keys.limits.cycle_timeout_s;
  session.servo.gate = keys.start;
  session.preparation.mounting = keys.mounting;
  session.phases = phases_of(keys, place);
  if (keys.motion) session.measured_N = keys.motion->measured_N;
  if (session.servo.surface_before_hand_m) {
    session.phases.front().from = -*session.servo.surface_before_hand_m;
  }
  require_within_reach(session, device, place);
  session.servo.gate->reach_m = start_room_m(session, device);
  session.servo.phase_ends = ends_of(session.phases, session.servo.period_s);
  session.plant = keys.virtual_device.plant;
  session.plant.period_s = session.servo.period_s;
  session.plant.watchdog_s = session.preparation.watchdog_s;
  session.plant.push = session.servo.push;
  session.plant.origin_m = session.servo.surface_m;
  session.stated_friction_N_s_per_m = keys.virtual_device.damping_N_s_per_m;
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
  if (servo.surface_before_hand_m) {  // the start gate keeps room for it, if there is any
    if (start_room_m(session, limits) > 0.0) return;
    const double before_m = *servo.surface_before_hand_m;
    const double from_hand_m = furthest_of(session, servo.surface_m) + before_m;
    if (from_hand_m >= limits.reach_m) {
      refuse("furthest place", fmt::format("{:.3g} m from the hand at the start", from_hand_m),
             shortest(limits.reach_m) + " m from the centre");
    }
    refuse("furthest place",
           fmt::format("{:.3g} m from the hand at the start along x",
                       furthest_along_x(session, before_m * servo.push)),
           shortest(limits.stop_along_x_m) + " m, where the mechanism has its stop");
  }
  const double furthest_m = furthest_of(session, servo.surface_m);
  if (furthest_m > limits.reach_m) {
    refuse("furthest place", fmt::format("{:.3g} m from the centre", furthest_m),
           shortest(limits.reach_m) + " m");
  }
  const double along_x_m = furthest_along_x(session, servo.surface_m);
  if (limits.stop_along_x_m > 0.0 && along_x_m > limits.stop_along_x_m) {
    refuse("furthest place", fmt::format("{:.3g} m from the centre along x", along_x_m),
           shortest(limits.stop_along_x_m) + " m, where the mechanism has its stop");
  }
}

HilSession on_device(HilSession session, const DeviceLimits& limits) {
  if (session.servo.gate) session.servo.gate->reach_m = start_room_m(session, limits);
  return session;
}

HilSession read_session(const std::filesystem::path& file, const SessionChanges& changes,
                        const DeviceLimits& device) {
  Json json = checked(read_json(file), session_kind(), file.string());
  if (!changes.law.empty()) {
    json["model"] = {{"kind", "law"}, {"law", files::to_json(read_law(changes.law))}};
  }
  if (!changes.motion.empty()) {
    if (session_block().made(json, {file.string()}).model.kind != "law") {
      throw Error(ExitCode::usage, "--replay-motion", "the session feels no law",
                  "--law FILE beside it: the law knows the depth at which contact began");
    }
    require_exists(changes.motion);
    for (const char* key : {"indentations", "slides", "creep"}) json.erase(key);
    // Named on a command line: beside the caller, not beside the session.
    json["motion"] = {{"recording", std::filesystem::absolute(changes.motion).string()}};
  }
  HilSession session = parse_session(json, file.string(), file.parent_path(), device);
  follow_surface(session);
  return session;
}

}  // namespace tpm::haptics
