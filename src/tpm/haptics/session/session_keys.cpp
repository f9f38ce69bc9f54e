#include "tpm/haptics/session/session_keys.hpp"

#include <fmt/format.h>

#include <numbers>

#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/session/loop_maker.hpp"
#include "tpm/organ/scene/experiment_blocks.hpp"

namespace tpm::haptics {
namespace {

/// Both ends included.
constexpr Range from_to(double least, double most) {
  return {.least = least, .most = most};
}

/// The simulated device has the limits of this one.
DeviceLimits usual_limits() {
  return limits_of("omega7");
}

/// planned, or a formulation for sessions that the program links.
ValueType<std::string> model_type() {
  const auto form = [] {
    Form words{.type = Form::Type::word, .name = "model"};
    words.words.emplace_back(kPlannedModel);
    for (const Formulation* f : linked_formulations()) {
      if (!for_sessions(*f)) continue;
      words.words.emplace_back(f->name());
      if (!f->also().empty()) words.words.emplace_back(f->also());
    }
    return shared(std::move(words));
  };
  return {shared({.type = Form::Type::later, .made = form}),
          [](const Json& value, const DocumentPlace&) {
            const auto word = value.get<std::string>();
            const Formulation* found = word == kPlannedModel ? nullptr : find_formulation(word);
            return found == nullptr ? word : std::string(found->name());
          },
          [](const std::string& word) { return Json(word); }};
}

/// A name of a file, or what it would hold, which another reader reads.
ValueType<Json> file_or_object(std::string sentence) {
  ValueType<Json> type = any(std::move(sentence));
  Form object{.type = Form::Type::map, .item = any("").form};
  type.form = shared({.type = Form::Type::either,
                      .sentence = type.form->sentence,
                      .forms = {text(1).form, shared(std::move(object))}});
  return type;
}

/// One sphere, or a patch of them.
ValueType<Json> contact_type() {
  ValueType<Json> type = any("");
  Form form = *contact_kinds().form();
  form.name = "moved_spheres";
  form.sentence = "the spheres that the tool moves, without turning";
  std::erase_if(form.kinds, [](const KindForm& kind) {
    return kind.word != to_string(ContactKind::sphere) &&
           kind.word != to_string(ContactKind::patch);
  });
  for (KindForm& kind : form.kinds) {
    std::erase_if(kind.keys, [](const KeyForm& key) { return key.name == "share"; });
  }
  type.form = shared(std::move(form));
  return type;
}

const Block<SessionModelKeys>& model_block() {
  using K = SessionModelKeys;
  static const Block<K> block(
      "session_model", "what is stepped in the loop",
      {key("kind", &K::kind, model_type(),
           "planned: the cheapest model that tpm plan finds accurate and fast enough; law: one "
           "contact that answers by a law of the family; or a formulation for sessions (tpm "
           "simulate "
           "--list-formulations)"),
       with_default(
           key("tool_radius", &K::tool_radius_m, quantity(Dimension::length, from_to(1e-3, 0.2)),
               "of the ball of the kind surface"),
           "10 mm"),
       with_default(key("contact_stiffness", &K::contact_stiffness_N_per_m,
                        quantity(Dimension::stiffness, from_to(100.0, 1e6)),
                        "of the overlap of that ball and a sphere"),
                    "10000 N/m"),
       key("contact", &K::contact, contact_type(),
           "which spheres the tool moves; default the organ's contact sphere against its normal; "
           "not "
           "for element, surface and law, and a patch only for planned, linear and curves"),
       with_default(key("tolerance", &K::tolerance, text(),
                        "of a planned model, in parts of the peak force: \"1%\", \"0.01\", or "
                        "\"jnd\", what a hand can feel"),
                    "1%"),
       key("law", &K::law, file_or_object(""),
           "of the kind law: a law, or the name of a file with one, relative to this file"),
       with_example(
           key("scene", &K::scene, file_or_object(""),
               "a scene with organ, material and what holds it, or the name of a file with "
               "one, relative to this file; its tissue is the reference that a recording is "
               "verified against"),
           {{"organ", {{"kind", "liver"}}}})});
  return block;
}

const Block<StartGateSettings>& start_block() {
  using K = StartGateSettings;
  static const Block<K> block(
      "start",
      "what has to be before forces and phases begin: the tool in free air, inside the workspace "
      "and "
      "at rest",
      {key("clearance", &K::clearance_m, quantity(Dimension::length, from_to(1e-4, 0.05)),
           "least distance above the surface"),
       key("at_rest", &K::rest_time_s, quantity(Dimension::time, from_to(0.1, 5.0)),
           "for how long the tool has to be at rest"),
       key("limit", &K::limit_s, quantity(Dimension::time, from_to(1.0, 3600.0)),
           "after which the session is given up"),
       key("confirm", &K::confirm, flag(),
           "the operator also has to press a button of the device, or Enter where tpm runs in a "
           "terminal")});
  return block;
}

const Block<DeviceMounting>& mounting_block() {
  using K = DeviceMounting;
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const ValueType<double> base = quantity(Dimension::angle, from_to(-kTurn / 2.0, kTurn / 2.0));
  static const Block<K> block(
      "mounting",
      "how the device stands and what is mounted on it, for its compensation of gravity; not known "
      "of the simulated one",
      {key("effector_mass_kg", &K::effector_mass_kg, number(from_to(0.0, 1.0)),
           "of a tool on the handle"),
       key("angle", &K::angle_rad, quantity(Dimension::angle, from_to(-kTurn, kTurn)),
           "of the device about the vertical, -360 deg to 360 deg"),
       key("base_angle_x", &K::base_angle_x_rad, base, "of its base about x, -180 deg to 180 deg"),
       key("base_angle_z", &K::base_angle_z_rad, base,
           "of its base about z, -180 deg to 180 deg")});
  return block;
}

const Block<LimitKeys>& limits_block() {
  using K = LimitKeys;
  using S = SessionServo;
  const DeviceLimits device = usual_limits();
  const auto of_servo = [](const Key<S>& key) { return within(&K::servo, key); };
  static const Block<K> block(
      "session_limits", "where the loop cuts, slips or stops",
      {of_servo(key("force", &S::force_limit_N,
                    quantity(Dimension::force, from_to(1e-3, device.force_N)),
                    "sent to the device")),
       of_servo(
           key("slew_N_per_s", &S::slew_limit_N_per_s, number(from_to(1.0, device.slew_N_per_s)),
               "rise of the force, above which the model's tool slips; falls are not limited")),
       of_servo(key("ramp_in", &S::ramp_in_s,
                    quantity(Dimension::time, from_to(device.least_ramp_in_s, 60.0)),
                    "the limit of the force grows to its value over this time")),
       of_servo(key("damping_N_s_per_m", &S::most_damping_N_s_per_m,
                    number(from_to(0.0, device.damping_N_s_per_m)),
                    "the most that the passivity controller adds; 0: it only observes")),
       of_servo(key("outside_validity", &S::outside_validity_limit_s,
                    quantity(Dimension::time, {.least = 0.0, .most = 2.0, .above = true}),
                    "for how long forces may be outside the validity of the model, where they are "
                    "faded out, before the session stops; a period or more")),
       of_servo(key("late_cycles", &S::most_late, whole<int>(1, 1000),
                    "of the last 1000 that stop the session")),
       key("watchdog", &K::watchdog_s, quantity(Dimension::time, from_to(0.004, 0.016)),
           "the device cuts its forces without a command for so long"),
       key("cycle_timeout", &K::cycle_timeout_s, quantity(Dimension::time, from_to(0.002, 1.0)),
           "a cycle that takes longer ends the session")});
  return block;
}

template <class K>
Key<K> rest_key() {
  return key("rest", &K::rest_s, quantity(Dimension::time, kAboveZero), "in the air after each");
}

std::vector<Key<TouchKeys>> touch_keys(ProtocolKind kind,
                                       std::initializer_list<ProtocolKeyName> renamed) {
  std::vector<Key<TouchKeys>> keys;
  for (const Key<ProtocolLists>& one : protocol_list_keys(kind, renamed)) {
    keys.push_back(within(&TouchKeys::protocol, one));
  }
  keys.push_back(rest_key<TouchKeys>());
  return keys;
}

const Block<TouchKeys>& indentations_block() {
  static const Block<TouchKeys> block(
      "indentations", "each depth at each rate, held, released at the same rate, and left alone",
      touch_keys(ProtocolKind::ramp_hold, {{"depth", "depths"}, {"rate", "rates"}}),
      {{"a hold above 0: a session holds every depth before the release",
        [](const TouchKeys& keys) -> std::optional<Fault> {
          for (const double hold : keys.protocol.holds_s) {
            if (!(hold > 0.0)) return Fault{"hold", "0 s"};
          }
          return std::nullopt;
        }}});
  return block;
}

const Block<TouchKeys>& creep_block() {
  static const Block<TouchKeys> block(
      "session_creep", "each load held by the operator: the device cannot",
      touch_keys(ProtocolKind::creep, {{"load", "loads"}, {"duration", "hold"}}));
  return block;
}

const Block<SlideKeys>& slides_block() {
  using K = SlideKeys;
  static const Block<K> block(
      "slides",
      "with the kind surface: pressed to each depth, slid over the surface and back, released, and "
      "left alone",
      {required(key("depths", &K::depths_m,
                    list(quantity(Dimension::length, kAboveZero), {.fewest = 1, .one_too = true}),
                    "how deep")),
       key("press", &K::press_m_per_s, quantity(Dimension::speed, kAboveZero),
           "speed along the push, in and out"),
       with_default(key("direction", &K::direction, direction(),
                        "in the coordinates of the device; its part across the push counts"),
                    {1, 0, 0}),
       required(key("distance", &K::distance_m, quantity(Dimension::length, kAboveZero),
                    "there, and the same back")),
       required(key("rate", &K::rate_m_per_s, quantity(Dimension::speed, kAboveZero),
                    "speed of the slide")),
       rest_key<K>()});
  return block;
}

const Block<VirtualDeviceKeys>& virtual_device_block() {
  using K = VirtualDeviceKeys;
  using P = PlantSettings;
  using A = ArmSettings;
  const auto of_plant = [](const Key<P>& key) { return within(&K::plant, key); };
  const auto of_arm = [&](const Key<A>& key) { return of_plant(within(&P::arm, key)); };
  Key<K> damping = of_plant(key("damping_N_s_per_m", &P::damping_N_s_per_m, number(kZeroOrMore),
                                "friction of the device"));
  damping.read = [read = damping.read](K& into, const Json& value, const DocumentPlace& place) {
    read(into, value, place);
    into.damping_N_s_per_m = into.plant.damping_N_s_per_m;
  };
  static const Block<K> block(
      "virtual_device",
      "numbers of the simulated device and its operator, where they differ from what is assumed",
      {of_plant(key("mass_kg", &P::mass_kg, number(kAboveZero), "moved by the hand")), damping,
       of_plant(key("encoder_step", &P::encoder_step_m,
                    quantity(Dimension::length, from_to(0.0, 1e-3)), "0: positions as they are")),
       of_plant(key("delay_periods", &P::delay_periods, whole<int>(0, 1000),
                    "from a command to its force")),
       of_plant(key("motor_limit", &P::motor_limit_N,
                    quantity(Dimension::force, from_to(1e-3, 1e3)), "of the length of the force")),
       of_plant(key("least_watchdog", &P::least_watchdog_s,
                    quantity(Dimension::time, from_to(0.0, 10.0)),
                    "the simulated watchdog waits at least so long: for machines that stall longer "
                    "than an Omega.7 forgives")),
       of_plant(key("arm_set_point", &P::arm_set_point_m,
                    quantity(Dimension::length, from_to(-0.1, 0.1)),
                    "depth at which the simulated operator means to hold the tool, in place of "
                    "following the phases")),
       of_arm(key("arm_mass_kg", &A::mass_kg, number(kZeroOrMore), "of the operator's arm")),
       of_arm(key("arm_damping_N_s_per_m", &A::damping_N_s_per_m, number(kZeroOrMore),
                  "of the operator's arm")),
       of_arm(key("arm_stiffness", &A::stiffness_N_per_m,
                  quantity(Dimension::stiffness, from_to(0.0, 1e5)), "of the operator's arm")),
       of_arm(key("correction_per_s", &A::correction_per_s, number(kZeroOrMore),
                  "rate at which a wrong depth is corrected"))});
  return block;
}

std::optional<Fault> surface_fault(const SessionKeys& keys) {
  if (!keys.surface_m || !keys.surface_before_hand_m) return std::nullopt;
  return Fault{"surface_before_hand", "the surface is already given"};
}

std::optional<Fault> nothing_done(const SessionKeys& keys) {
  if (keys.indentations || keys.slides || keys.creep || keys.motion) return std::nullopt;
  return Fault{"", "nothing is done in it"};
}

}  // namespace

const Block<MotionKeys>& motion_block() {
  using K = MotionKeys;
  static const Block<K> block(
      "motion",
      "with the kind law: the motion of a recording of an indentation depth, by the name of its "
      "file "
      "relative to this file, or the motion itself; depths from the contact point on",
      {key("recording", &K::recording, text(1), "a delimited file with a time and a depth"),
       key("name", &K::name, text(), "of the recording that the depths come from"),
       key("initial_hold_s", &K::initial_hold_s, number(kZeroOrMore),
           "for which the first depth is held before the motion, if it is in contact"),
       key("spacing_s", &K::spacing_s, number(kAboveZero), "of the depths"),
       key("depths_m", &K::depths_m, list(number(), {.fewest = 2}), "evenly spaced in time"),
       key("measured_N", &K::measured_N, list(number(), {.fewest = 2}),
           "what the recording says at the same instants, the law's offset taken off")},
      {{"depths_m with name and spacing_s", [](const K& keys) -> std::optional<Fault> {
          if (keys.depths_m.empty() || (keys.name && keys.spacing_s)) return std::nullopt;
          return Fault{keys.name ? "spacing_s" : "name", "is missing"};
        }}});
  return block;
}

const Block<SessionKeys>& session_block() {
  using K = SessionKeys;
  static const Block<K> block(
      "session", "",
      {key("title", &K::title, text(), "what the session is"),
       key("description", &K::description, text(), "what else is to be said of it"),
       required(key("model", &K::model, model_block().type(), "what is stepped in the loop")),
       key("rate", &K::rate_Hz,
           quantity(Dimension::frequency, from_to(kLeastRate_Hz, kMostRate_Hz)),
           "of the servo loop"),
       with_default(
           key("push", &K::push, direction(), "into the tissue, in the coordinates of the device"),
           {0, 0, -1}),
       key("surface", &K::surface_m, point_type(),
           "where the tissue begins, in the coordinates of the device; default the origin"),
       key("surface_before_hand", &K::surface_before_hand_m,
           quantity(Dimension::length, from_to(1e-3, 0.05)),
           "instead of 'surface': the tissue begins so far before the tool, along the push, when "
           "the "
           "session begins"),
       key("start", &K::start, start_block().type(), "what has to be before the session begins"),
       key("mounting", &K::mounting, mounting_block().type(), "how the device stands"),
       key("limits", &K::limits, limits_block().type(), "where the loop cuts, slips or stops"),
       with_example(key("indentations", &K::indentations, indentations_block().type(),
                        "depths at rates, held"),
                    {{"depths", {"4 mm"}}, {"rates", {"4 mm/s"}}, {"hold", "5 s"}}),
       key("slides", &K::slides, slides_block().type(), "with the kind surface"),
       key("creep", &K::creep, creep_block().type(), "loads held by the operator"),
       key("motion", &K::motion, motion_block().type(), "with the kind law"),
       key("virtual_device", &K::virtual_device, virtual_device_block().type(),
           "numbers of the simulated device and its operator")},
      {{"'surface' or 'surface_before_hand'", surface_fault},
       {"indentations, slides, creep or motion", nothing_done}});
  return block;
}

const FileKind& session_kind() {
  static const FileKind kind{"hil", "A session of tpm hil",
                             "What is rendered, what the operator does, and where the loop stops. "
                             "Quantities are texts of a "
                             "number and a unit, such as \"4 mm/s\"",
                             session_block().form()};
  return kind;
}

}  // namespace tpm::haptics
