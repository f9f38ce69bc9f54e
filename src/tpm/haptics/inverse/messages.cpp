#include "tpm/haptics/inverse/messages.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <functional>

#include "tpm/files/json.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

/// The names of the protocol, each once: readers and writers use these.
namespace key {
constexpr const char *device = "inverse3", *id = "device_id", *config = "config", *state = "state",
                     *commands = "commands", *configure = "configure", *session = "session",
                     *session_id = "session_id", *force = "set_cursor_force",
                     *place = "set_cursor_position", *position = "position",
                     *cursor_position = "cursor_position", *cursor_velocity = "cursor_velocity",
                     *cursor_force = "current_cursor_force", *gate = "force_gate", *gain = "gain",
                     *damping = "damping", *scalar = "scalar", *vector = "vector",
                     *values = "values", *profile = "profile", *name = "name",
                     *simulated = "simulated_device", *orientation = "orientation",
                     *buttons = "buttons", *version = "project_version", *filters = "filters",
                     *handedness = "handedness", *preset = "preset", *basis = "basis",
                     *permutation = "permutation", *mount = "mount", *rotation = "rotation",
                     *scale = "scale", *gravity = "gravity_compensation", *enabled = "enabled",
                     *factor = "scaling_factor", *torque = "torque_scaling";
}  // namespace key

constexpr const char* kGrips[] = {"wireless_verse_grip", "verse_grip", "custom_verse_grip"};
constexpr const char* kButtons[][2] = {{"a", "button_0"}, {"b", "button_1"}, {"c", "button_2"}};
constexpr const char* kSimulatedWords = "SIMULATED DEVICE";
constexpr std::size_t kMostCharacters = 64;  // of an identifier
constexpr double kMostNumber = 1e6;          // metres, newtons and the like

/// A value with the place where it stands, for messages.
class Part {
 public:
  Part(const Json& json, std::string where) : json_(&json), where_(std::move(where)) {}

  [[nodiscard]] bool has(const char* name) const {
    return json_->is_object() && json_->contains(name) && !json_->at(name).is_null();
  }
  [[nodiscard]] Part at(const char* name) const {
    require_object();
    if (!has(name)) throw bad_input(where_, fmt::format("has no {}", name), "the Inverse protocol");
    return {json_->at(name), fmt::format("{}/{}", where_, name)};
  }
  [[nodiscard]] double number() const {
    require(json_->is_number(), "is no number");
    const auto value = json_->get<double>();
    require(std::isfinite(value) && std::abs(value) <= kMostNumber, "is out of range");
    return value;
  }
  [[nodiscard]] bool flag() const {
    require(json_->is_boolean(), "is neither true nor false");
    return json_->get<bool>();
  }
  [[nodiscard]] std::string text(std::size_t most = kMostCharacters) const {
    require(json_->is_string(), "is no text");
    const auto text = json_->get<std::string>();
    require(text.size() <= most && printable(text, most) == text, "is too long or not printable");
    return text;
  }
  [[nodiscard]] bool is(std::string_view words) const {
    return json_->is_string() && json_->get<std::string>() == words;
  }
  /// What can be shown of a text; empty for anything else.
  [[nodiscard]] std::string words(std::size_t most = kMostCharacters) const {
    return json_->is_string() ? printable(json_->get<std::string>(), most) : std::string();
  }
  [[nodiscard]] Eigen::Vector3d vector() const {
    return {at("x").number(), at("y").number(), at("z").number()};
  }
  [[nodiscard]] Eigen::Quaterniond quaternion() const {
    const Eigen::Quaterniond q(at("w").number(), at("x").number(), at("y").number(),
                               at("z").number());
    require(q.norm() > 0.5 && q.norm() < 2.0, "is no rotation");
    return q.normalized();
  }
  void each(const std::function<void(const Part&)>& see) const {
    require(json_->is_array() && json_->size() <= kMostInverseDevices,
            "is no list of at most 16 devices");
    for (std::size_t i = 0; i < json_->size(); ++i) {
      see({json_->at(i), fmt::format("{}/{}", where_, i)});
    }
  }
  void require_object() const { require(json_->is_object(), "is no object"); }
  void require(bool right, std::string_view what) const {
    if (!right) throw bad_input(where_, what, "the Inverse protocol");
  }

 private:
  const Json* json_;
  std::string where_;
};

Json message_json(std::string_view text, std::size_t most_bytes) {
  if (text.size() > most_bytes) {
    throw bad_input("message", "is too long", fmt::format("at most {} bytes", most_bytes));
  }
  return parse_json(text, "message");
}

Eigen::Vector3d vector_or_zero(const Part& state, const char* name) {
  return state.has(name) ? state.at(name).vector() : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

InverseState state_of(const Part& state) {
  InverseState read;
  read.position_m = state.at(key::cursor_position).vector();
  read.velocity_m_per_s = vector_or_zero(state, key::cursor_velocity);
  read.force_N = vector_or_zero(state, key::cursor_force);
  if (!state.has("transform")) return read;
  const Part workspace = state.at("transform");
  read.workspace_position_m = vector_or_zero(workspace, key::position);
  if (workspace.has(key::rotation)) {
    read.workspace_rotation = workspace.at(key::rotation).quaternion();
  }
  if (workspace.has(key::scale)) read.workspace_scale = workspace.at(key::scale).vector();
  return read;
}

/// Of the first grip that a message lists.
void add_grip(InverseState& state, const Part& message) {
  for (const char* kind : kGrips) {
    if (!message.has(kind)) continue;
    message.at(kind).each([&](const Part& grip) {
      if (state.has_grip || !grip.has(key::state)) return;
      const Part said = grip.at(key::state);
      state.has_grip = true;
      if (said.has(key::orientation)) state.grip = said.at(key::orientation).quaternion();
      if (!said.has(key::buttons)) return;
      const Part pressed = said.at(key::buttons);
      for (std::uint32_t i = 0; i < std::size(kButtons); ++i) {
        for (const char* name : kButtons[i]) {
          if (pressed.has(name) && pressed.at(name).flag()) state.buttons |= 1U << i;
        }
      }
    });
  }
}

InverseSettings settings_of(const Part& config) {
  InverseSettings s;
  s.handedness = config.at(key::handedness).text();
  config.at(key::handedness)
      .require(s.handedness == "left" || s.handedness == "right", "is neither left nor right");
  if (config.has(key::preset)) s.preset = config.at(key::preset).text();
  if (config.has(key::basis)) s.basis = config.at(key::basis).at(key::permutation).text();
  if (config.has(key::mount)) {
    const Part mount = config.at(key::mount);
    s.mount_position_m = vector_or_zero(mount, key::position);
    if (mount.has(key::rotation)) s.mount_rotation = mount.at(key::rotation).quaternion();
    if (mount.has(key::scale)) s.mount_scale = mount.at(key::scale).vector();
  }
  if (config.has(key::filters)) {
    const Part filters = config.at(key::filters);
    if (filters.has(key::gate)) s.force_gate_gain = filters.at(key::gate).at(key::gain).number();
    s.damping_named = filters.has(key::damping);
    if (s.damping_named) {
      const Part damping = filters.at(key::damping);
      if (damping.has(key::scalar)) s.damping = damping.at(key::scalar).number();
      s.directional_damping = vector_or_zero(damping, key::vector);
    }
    s.filters_named = filters.has(key::gate);
  }
  s.gravity_named = config.has(key::gravity);
  if (s.gravity_named) {
    const Part gravity = config.at(key::gravity);
    s.gravity_compensation = gravity.at(key::enabled).flag();
    if (gravity.has(key::factor)) s.gravity_scaling = gravity.at(key::factor).number();
  }
  if (config.has(key::torque)) s.torque_scaling = config.at(key::torque).at(key::enabled).flag();
  return s;
}

InverseDeviceEntry entry_of(const Part& part) {
  InverseDeviceEntry entry;
  entry.id = part.at(key::id).text();
  part.at(key::id).require(!entry.id.empty(), "is empty");
  const Part config = part.at(key::config);
  if (config.has("type")) entry.type = config.at("type").text();
  if (config.has("device_info")) {
    const Part info = config.at("device_info");
    if (info.has("major_version") && info.has("minor_version")) {
      entry.firmware = fmt::format("{:.0f}.{:.0f}", info.at("major_version").number(),
                                   info.at("minor_version").number());
    }
  }
  // Anything else than these words is no word of a simulation: hardware keeps its guards.
  entry.simulated = config.has(key::simulated) && config.at(key::simulated).is(kSimulatedWords);
  entry.settings = settings_of(config);
  entry.state = state_of(part.at(key::state));
  return entry;
}

std::string vector_text(const Eigen::Vector3d& v) {
  return fmt::format(R"({{"x":{},"y":{},"z":{}}})", v.x(), v.y(), v.z());
}

std::string quaternion_text(const Eigen::Quaterniond& q) {
  return fmt::format(R"({{"w":{},"x":{},"y":{},"z":{}}})", q.w(), q.x(), q.y(), q.z());
}

std::string json_text(std::string_view text) {
  return Json(std::string(text)).dump();
}

std::string state_text(const InverseState& state) {
  return fmt::format(
      R"({{"cursor_position":{},"cursor_velocity":{},"current_cursor_force":{},"control_domain":)"
      R"("cartesian","control_mode":"force"}})",
      vector_text(state.position_m), vector_text(state.velocity_m_per_s),
      vector_text(state.force_N));
}

std::string grips_text(const InverseState& state) {
  if (!state.has_grip) return {};
  std::string pressed;
  for (std::uint32_t i = 0; i < std::size(kButtons); ++i) {
    pressed += fmt::format(R"({}"{}":{})", i == 0 ? "" : ",", kButtons[i][0],
                           (state.buttons >> i & 1U) != 0);
  }
  return fmt::format(
      R"(,"{}":[{{"device_id":"grip","state":{{"orientation":{},"buttons":{{{}}}}}}}])", kGrips[0],
      quaternion_text(state.grip), pressed);
}

std::string session_text(std::string_view profile) {
  if (profile.empty()) return {};
  return fmt::format(R"("session":{{"configure":{{"profile":{{"name":{}}}}}}},)",
                     json_text(profile));
}

std::string config_text(const InverseDeviceEntry& d) {
  const InverseSettings& s = d.settings;
  return fmt::format(
      R"({{"type":{},{}"device_info":{{"major_version":0,"minor_version":0,"id":{}}},)"
      R"("gravity_compensation":{{"enabled":{},"scaling_factor":{}}},"handedness":{},)"
      R"("torque_scaling":{{"enabled":{}}},"preset":{},"basis":{{"permutation":{}}},)"
      R"("mount":{{"position":{},"rotation":{},"scale":{}}},)"
      R"("filters":{{"force_gate":{{"gain":{}}},"damping":{{"scalar":{},"vector":{}}}}}}})",
      json_text(d.type),
      d.simulated ? fmt::format(R"("{}":"{}",)", key::simulated, kSimulatedWords) : std::string(),
      json_text(d.id), s.gravity_compensation, s.gravity_scaling, json_text(s.handedness),
      s.torque_scaling.value_or(false), json_text(s.preset), json_text(s.basis),
      vector_text(s.mount_position_m), quaternion_text(s.mount_rotation),
      vector_text(s.mount_scale), s.force_gate_gain, s.damping, vector_text(s.directional_damping));
}

std::string status_text(bool simulated) {
  return simulated ? fmt::format(R"({{"{}":"{}"}})", key::simulated, kSimulatedWords) : "{}";
}

}  // namespace

std::string_view word_of(InverseFormat format) {
  return format == InverseFormat::vector ? key::vector : key::values;
}

std::string parse_version(std::string_view text) {
  const Json json = message_json(text, kMostMessageBytes);
  const Part said(json, "version");
  return (said.has("data") ? said.at("data") : said).at(key::version).text();
}

InverseFormat format_of_version(std::string_view version) {
  int major = 0, minor = 0;
  const char* end = version.data() + version.size();
  const auto first = std::from_chars(version.data(), end, major);
  const bool known = first.ec == std::errc{} && first.ptr != end && *first.ptr == '.' &&
                     std::from_chars(first.ptr + 1, end, minor).ec == std::errc{};
  if (!known || major != 3 || minor < 1) {
    throw Error(ExitCode::environment, "Inverse service",
                fmt::format("is of version '{}'", printable(version)), "3.1 or later, before 4");
  }
  constexpr int kFirstWithVector = 5;
  return minor >= kFirstWithVector ? InverseFormat::vector : InverseFormat::values;
}

bool InverseSettings::true_to_scale() const {
  return mount_scale.isApprox(Eigen::Vector3d::Ones(), 1e-9);
}

std::vector<std::string> InverseSettings::lines() const {
  const auto triple = [](const Eigen::Vector3d& v) {
    return fmt::format("{} {} {}", v.x(), v.y(), v.z());
  };
  return {
      fmt::format("the service says: force gate {}",
                  filters_named ? fmt::format("{}", force_gate_gain) : "not named"),
      damping_named ? fmt::format("the service says: damping {}, by direction {}", damping,
                                  triple(directional_damping))
                    : "the service says: damping not named",
      fmt::format("the service says: preset '{}', basis {}", preset, basis),
      fmt::format(
          "the service says: mount at {} m, turned by {} rad, scale {}", triple(mount_position_m),
          mount_rotation.angularDistance(Eigen::Quaterniond::Identity()), triple(mount_scale)),
      fmt::format("the service says: gravity compensation {}; torque scaling {}",
                  gravity_named ? fmt::format("{}, factor {}", gravity_compensation ? "on" : "off",
                                              gravity_scaling)
                                : "not named",
                  !torque_scaling   ? "not named"
                  : *torque_scaling ? "on"
                                    : "off")};
}

InverseInventory parse_inventory(std::string_view text) {
  const Json json = message_json(text, kMostInventoryBytes);
  const Part whole(json, "inventory");
  const Part message = whole.has("data") ? whole.at("data") : whole;
  message.require_object();
  InverseInventory inventory;
  if (message.has(key::session_id)) {
    inventory.session = static_cast<std::int64_t>(message.at(key::session_id).number());
  }
  if (!message.has(key::device)) return inventory;
  message.at(key::device).each([&inventory, &message](const Part& part) {
    inventory.devices.push_back(entry_of(part));
    add_grip(inventory.devices.back().state, message);
  });
  return inventory;
}

InverseState parse_state(std::string_view text, std::string_view device_id) {
  const Json json = message_json(text, kMostInventoryBytes);
  const Part message(json, "state");
  std::optional<InverseState> state;
  message.at(key::device).each([&](const Part& part) {
    if (part.at(key::id).text() == device_id) state = state_of(part.at(key::state));
  });
  if (!state) {
    throw bad_input("state", fmt::format("is not that of device '{}'", printable(device_id)),
                    "the device of the inventory");
  }
  add_grip(*state, message);
  return *state;
}

InverseCommand parse_command(std::string_view text, std::string_view device_id) {
  const Json json = message_json(text, kMostMessageBytes);
  const Part message(json, "command");
  message.require_object();
  InverseCommand command;
  if (message.has(key::session)) {
    const Part session = message.at(key::session);
    if (session.has(key::configure) && session.at(key::configure).has(key::profile)) {
      command.profile = session.at(key::configure).at(key::profile).at(key::name).text();
    }
  }
  if (!message.has(key::device)) return command;
  message.at(key::device).each([&](const Part& part) {
    if (part.at(key::id).text() != device_id) {
      command.of_another_device = true;
      return;
    }
    if (part.has(key::commands)) {
      const Part said = part.at(key::commands);
      if (said.has(key::force)) {
        const Part force = said.at(key::force);
        const Eigen::Vector3d asked =
            force.at(force.has(key::vector) ? key::vector : key::values).vector();
        command.force_N = command.force_N.value_or(Eigen::Vector3d::Zero()) + asked;
      }
      if (said.has(key::place)) {
        const Part place = said.at(key::place);
        const char* form = place.has(key::position) ? key::position
                           : place.has(key::vector) ? key::vector
                                                    : key::values;
        command.position_m = place.at(form).vector();
      }
    }
    if (!part.has(key::configure)) return;
    const Part set = part.at(key::configure);
    if (set.has(key::gate)) command.force_gate_gain = set.at(key::gate).at(key::gain).number();
    if (set.has(key::damping) && set.at(key::damping).has(key::scalar)) {
      command.damping = set.at(key::damping).at(key::scalar).number();
    }
    if (set.has(key::preset)) command.preset = set.at(key::preset).at(key::preset).text();
  });
  return command;
}

InverseEvent parse_event(std::string_view text) {
  const Json json = message_json(text, kMostMessageBytes);
  const Part event(json, "event");
  constexpr std::size_t kMostWords = 1000;
  InverseEvent read;
  read.name = event.at(key::name).text();
  if (event.has("level")) read.level = event.at("level").words();
  if (event.has("message")) read.message = event.at("message").words(kMostWords);
  if (!event.has("data")) return read;
  const Part data = event.at("data");
  if (data.has(key::id)) read.device_id = data.at(key::id).words();
  if (data.has("safety_type")) read.safety_type = data.at("safety_type").words();
  return read;
}

std::string force_message(InverseFormat format, std::string_view device_id,
                          const Eigen::Vector3d& force_N, std::string_view profile) {
  return fmt::format(
      R"({{{}"inverse3":[{{"device_id":{},"commands":{{"set_cursor_force":{{"{}":{}}}}}}}]}})",
      session_text(profile), json_text(device_id), word_of(format), vector_text(force_N));
}

std::string neutral_message(std::string_view device_id, std::string_view profile) {
  return fmt::format(R"({{{}"inverse3":[{{"device_id":{},"configure":{{"preset":{{"preset":"{}"}},)"
                     R"("force_gate":{{"gain":0}},"damping":{{"scalar":0,"vector":{}}}}},)"
                     R"("commands":{{"probe_position":{{}}}}}}]}})",
                     session_text(profile), json_text(device_id), kCentredPreset,
                     vector_text(Eigen::Vector3d::Zero()));
}

std::string probe_message(std::string_view device_id) {
  return fmt::format(R"({{"inverse3":[{{"device_id":{},"commands":{{"probe_position":{{}}}}}}]}})",
                     json_text(device_id));
}

std::vector<InverseRequest> neutral_requests(InverseFormat format, std::string_view device_id,
                                             std::int64_t session, const InverseSettings& settings,
                                             double carried) {
  const InverseSettings& s = settings;
  std::vector<InverseRequest> all;
  if (s.gravity_named && s.carried() != carried) {
    // Before 3.5 under other names, and none of them in the device's path.
    if (format == InverseFormat::values) {
      all.push_back({"/gravity_compensation",
                     fmt::format(R"({{"device_id":{},"enable":{},"gravity_scaling_factor":{}}})",
                                 json_text(device_id), carried > 0.0, carried)});
    } else {
      all.push_back(
          {fmt::format("/inverse3/{}/config/gravity_compensation", device_id),
           fmt::format(R"({{"enabled":{},"scaling_factor":{}}})", carried > 0.0, carried)});
    }
  }
  if (format == InverseFormat::values) return all;
  const auto of_session = [&](const char* name, std::string body) {
    all.push_back({fmt::format("/inverse3/{}/config/{}?session=%23{}", device_id, name, session),
                   std::move(body)});
  };
  if (!s.preset.empty() && s.preset != kCentredPreset) {
    of_session(key::preset, fmt::format(R"({{"preset":"{}"}})", kCentredPreset));
  }
  if (s.basis != "XYZ") of_session(key::basis, R"({"permutation":"XYZ"})");
  const bool turned = s.mount_rotation.angularDistance(Eigen::Quaterniond::Identity()) != 0.0;
  // A mount beside a preset is ambiguous to the service.
  if (s.preset.empty() && (turned || !s.true_to_scale())) {
    of_session(key::mount,
               fmt::format(R"({{"transform":{{"position":{},"rotation":{},"scale":{}}}}})",
                           vector_text(s.mount_position_m),
                           quaternion_text(Eigen::Quaterniond::Identity()),
                           vector_text(Eigen::Vector3d::Ones())));
  }
  if (s.force_gate_gain != 0.0) of_session(key::gate, R"({"gain":0})");
  if (s.damping != 0.0 || !s.directional_damping.isZero()) {
    of_session(key::damping,
               fmt::format(R"({{"scalar":0,"vector":{}}})", vector_text(Eigen::Vector3d::Zero())));
  }
  return all;
}

std::string inventory_message(const InverseInventory& inventory) {
  std::string devices, grips;
  for (const InverseDeviceEntry& d : inventory.devices) {
    devices += fmt::format(R"({}{{"device_id":{},"config":{},"state":{},"status":{}}})",
                           devices.empty() ? "" : ",", json_text(d.id), config_text(d),
                           state_text(d.state), status_text(d.simulated));
    if (grips.empty()) grips = grips_text(d.state);
  }
  return fmt::format(R"({{"session_id":{},"inverse3":[{}]{}}})", inventory.session, devices, grips);
}

std::string state_message(std::int64_t session, std::string_view device_id,
                          const InverseState& state, bool simulated) {
  return fmt::format(
      R"({{"session_id":{},"inverse3":[{{"device_id":{},"state":{},"status":{}}}]{}}})", session,
      json_text(device_id), state_text(state), status_text(simulated), grips_text(state));
}

std::string version_message(std::string_view version, bool simulated) {
  return fmt::format(
      R"({{"project_name":"tpm hil serve, compatible with the Inverse service",)"
      R"("{}":{}{}}})",
      key::version, json_text(version),
      simulated ? fmt::format(R"(,"{}":"{}")", key::simulated, kSimulatedWords) : std::string());
}

std::string event_message(const InverseEvent& event) {
  return fmt::format(
      R"({{"name":{},"category":"device","level":{},"data":{{"device_id":{},"safety_type":{}}},)"
      R"("message":{}}})",
      json_text(event.name), json_text(event.level), json_text(event.device_id),
      json_text(event.safety_type), json_text(event.message));
}

}  // namespace tpm::haptics
