#include "tpm/haptics/inverse/messages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <initializer_list>

#include "tpm/files/json.hpp"
#include "tpm/haptics/inverse/message_keys.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

namespace key = inverse_key;

constexpr std::size_t kMostCharacters = 64;  // of an identifier
constexpr double kMostNumber = 1e6;          // metres, newtons and the like
constexpr std::size_t kMostUnread = 16;      // names in a message

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
    auto text = json_->get<std::string>();
    require(text.size() <= most && printable(text, most) == text, "is too long or not printable");
    return text;
  }
  [[nodiscard]] bool is(std::string_view words) const {
    return json_->is_string() && json_->get<std::string>() == words;
  }
  [[nodiscard]] bool is_true() const { return json_->is_boolean() && json_->get<bool>(); }
  /// Adds names of an object that are not in a list, shortened.
  void add_others(std::vector<std::string>& others,
                  std::initializer_list<std::string_view> known) const {
    if (!json_->is_object()) return;
    for (const auto& [name, value] : json_->items()) {
      if (others.size() == kMostUnread) return;
      if (std::ranges::find(known, name) == known.end()) others.push_back(printable(name, 40));
    }
  }
  /// Printable part of a text; empty for anything else.
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
  read.force_named = state.has(key::cursor_force);
  if (!state.has("transform")) return read;
  const Part workspace = state.at("transform");
  read.workspace_position_m = vector_or_zero(workspace, key::position);
  if (workspace.has(key::rotation)) {
    read.workspace_rotation = workspace.at(key::rotation).quaternion();
  }
  if (workspace.has(key::scale)) read.workspace_scale = workspace.at(key::scale).vector();
  return read;
}

std::uint32_t buttons_of(const Part& said) {
  std::uint32_t buttons = 0;
  for (std::uint32_t i = 0; i < std::size(key::button_names); ++i) {
    for (const char* name : key::button_names[i]) {
      if (said.has(name) && said.at(name).flag()) buttons |= 1U << i;
    }
  }
  return buttons;
}

/// Of the first grip that a message lists.
void add_grip(InverseState& state, const Part& message) {
  for (const char* kind : key::grips) {
    if (!message.has(kind)) continue;
    message.at(kind).each([&](const Part& grip) {
      if (state.has_grip || !grip.has(key::state)) return;
      const Part said = grip.at(key::state);
      state.has_grip = true;
      if (said.has(key::orientation)) state.grip = said.at(key::orientation).quaternion();
      if (!said.has(key::buttons)) return;
      state.buttons = buttons_of(said.at(key::buttons));
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

/// True if a device says that it is simulated. Any other word than these is none of a simulation:
/// hardware keeps its guards.
bool says_simulated(const Part& part) {
  bool said = false;
  for (const char* place : {key::config, key::status, key::state}) {
    if (!part.has(place) || !part.at(place).has(key::simulated)) continue;
    const Part word = part.at(place).at(key::simulated);
    if (!word.is_true() && !word.is(key::simulated_words)) return false;
    said = true;
  }
  return said;
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
  entry.simulated = says_simulated(part);
  if (part.has(key::status) && part.at(key::status).has(key::in_use)) {
    entry.in_use = part.at(key::status).at(key::in_use).is_true();
  }
  entry.settings = settings_of(config);
  entry.state = state_of(part.at(key::state));
  if (part.at(key::state).has(key::mode)) {
    entry.control_mode = part.at(key::state).at(key::mode).words();
  }
  return entry;
}

}  // namespace

std::string_view to_string(InverseFormat format) {
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

std::vector<Remark> InverseSettings::lines() const {
  const auto triple = [](const Eigen::Vector3d& v) {
    return fmt::format("{} {} {}", v.x(), v.y(), v.z());
  };
  return {
      {"service_force_gate",
       fmt::format("the service says: force gate {}",
                   filters_named ? fmt::format("{}", force_gate_gain) : "not named")},
      {"service_damping", damping_named
                              ? fmt::format("the service says: damping {}, by direction {}",
                                            damping, triple(directional_damping))
                              : "the service says: damping not named"},
      {"service_preset", fmt::format("the service says: preset '{}', basis {}", preset, basis)},
      {"service_mount", fmt::format("the service says: mount at {} m, turned by {} rad, scale {}",
                                    triple(mount_position_m),
                                    mount_rotation.angularDistance(Eigen::Quaterniond::Identity()),
                                    triple(mount_scale))},
      {"service_gravity",
       fmt::format("the service says: gravity compensation {}; torque scaling {}",
                   gravity_named ? fmt::format("{}, factor {}", gravity_compensation ? "on" : "off",
                                               gravity_scaling)
                                 : "not named",
                   !torque_scaling   ? "not named"
                   : *torque_scaling ? "on"
                                     : "off")}};
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

bool lists_device(std::string_view text, std::string_view device_id) {
  try {
    const Json json = message_json(text, kMostInventoryBytes);
    const Part message(json, "state");
    bool listed = !message.has(key::device);
    if (listed) return true;
    message.at(key::device).each([&](const Part& part) {
      listed = listed || part.at(key::id).is(device_id);
    });
    return listed;
  } catch (const Error&) {
    return true;  // it is no such message
  }
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
  if (message.has(key::grips[0])) {
    message.at(key::grips[0]).each([&](const Part& grip) {
      if (!grip.has(key::id) || !grip.at(key::id).is(kSimulatedGrip)) return;
      if (!grip.has(key::commands)) return;
      const Part said = grip.at(key::commands);
      if (said.has(key::set_buttons)) command.buttons = buttons_of(said.at(key::set_buttons));
    });
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
      said.add_others(command.unread, {key::force, key::place, key::probe});
    }
    if (!part.has(key::configure)) return;
    const Part set = part.at(key::configure);
    set.add_others(command.unread, {key::gate, key::damping, key::preset, key::basis});
    if (set.has(key::gate)) command.force_gate_gain = set.at(key::gate).at(key::gain).number();
    if (set.has(key::damping)) {
      const Part damping = set.at(key::damping);
      if (damping.has(key::scalar)) command.damping = damping.at(key::scalar).number();
      command.directional_damping = vector_or_zero(damping, key::vector);
    }
    if (set.has(key::preset)) command.preset = set.at(key::preset).at(key::preset).text();
    if (set.has(key::basis)) command.basis = set.at(key::basis).at(key::permutation).text();
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

}  // namespace tpm::haptics
