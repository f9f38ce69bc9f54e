// Declared in tpm/haptics/inverse/messages.hpp.
// Messages that client and server of the Inverse protocol write.
#include <fmt/format.h>

#include "tpm/files/json.hpp"
#include "tpm/haptics/inverse/message_keys.hpp"
#include "tpm/haptics/inverse/messages.hpp"

namespace tpm::haptics {
namespace {

namespace key = inverse_key;

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
      R"("cartesian","{}":"{}"}})",
      vector_text(state.position_m), vector_text(state.velocity_m_per_s),
      vector_text(state.force_N), key::mode, state.driven ? "force" : "idle");
}

std::string pressed_text(std::uint32_t buttons) {
  std::string pressed;
  for (std::uint32_t i = 0; i < std::size(key::button_names); ++i) {
    pressed += fmt::format(R"({}"{}":{})", i == 0 ? "" : ",", key::button_names[i][0],
                           (buttons >> i & 1U) != 0);
  }
  return "{" + pressed + "}";
}

/// A simulated device has no power supply that could fail: it is ready from the first message on.
std::string status_text(bool simulated, bool driven) {
  if (!simulated) return "{}";
  return fmt::format(
      R"({{"{}":"{}","calibrated":true,"{}":{},"power_supply":true,"ready":true,"started":true}})",
      key::simulated, key::simulated_words, key::in_use, driven);
}

std::string grips_text(const InverseState& state, bool simulated) {
  if (!state.has_grip) return {};
  const std::string status =
      simulated ? fmt::format(R"({{"{}":"{}"}})", key::simulated, key::simulated_words) : "{}";
  return fmt::format(
      R"(,"{}":[{{"device_id":"{}","state":{{"orientation":{},"buttons":{}}},"status":{}}}])",
      key::grips[0], simulated ? kSimulatedGrip : "grip", quaternion_text(state.grip),
      pressed_text(state.buttons), status);
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
      d.simulated ? fmt::format(R"("{}":"{}",)", key::simulated, key::simulated_words)
                  : std::string(),
      json_text(d.id), s.gravity_compensation, s.gravity_scaling, json_text(s.handedness),
      s.torque_scaling.value_or(false), json_text(s.preset), json_text(s.basis),
      vector_text(s.mount_position_m), quaternion_text(s.mount_rotation),
      vector_text(s.mount_scale), s.force_gate_gain, s.damping, vector_text(s.directional_damping));
}

}  // namespace

std::string force_message(InverseFormat format, std::string_view device_id,
                          const Eigen::Vector3d& force_N, std::string_view profile) {
  return fmt::format(
      R"({{{}"inverse3":[{{"device_id":{},"commands":{{"set_cursor_force":{{"{}":{}}}}}}}]}})",
      session_text(profile), json_text(device_id), to_string(format), vector_text(force_N));
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
  if (s.torque_scaling.value_or(false)) {  // the device's, too: no message sets it
    all.push_back(
        {fmt::format("/inverse3/{}/config/{}", device_id, key::torque), R"({"enabled":false})"});
  }
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
  if (s.preset.empty() && (turned || !s.true_to_scale() || !s.mount_position_m.isZero(0.0))) {
    of_session(key::mount,
               fmt::format(R"({{"transform":{{"position":{},"rotation":{},"scale":{}}}}})",
                           vector_text(Eigen::Vector3d::Zero()),
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
                           state_text(d.state), status_text(d.simulated, d.state.driven));
    if (grips.empty()) grips = grips_text(d.state, d.simulated);
  }
  return fmt::format(R"({{"session_id":{},"inverse3":[{}]{}}})", inventory.session, devices, grips);
}

std::string state_message(std::int64_t session, std::string_view device_id,
                          const InverseState& state, bool simulated) {
  return fmt::format(
      R"({{"session_id":{},"inverse3":[{{"device_id":{},"state":{},"status":{}}}]{}}})", session,
      json_text(device_id), state_text(state), status_text(simulated, state.driven),
      grips_text(state, simulated));
}

std::string version_message(std::string_view version, bool simulated) {
  return fmt::format(R"({{"project_name":"tpm hil serve, compatible with the Inverse service",)"
                     R"("{}":{}{}}})",
                     key::version, json_text(version),
                     simulated ? fmt::format(R"(,"{}":"{}")", key::simulated, key::simulated_words)
                               : std::string());
}

std::string event_message(const InverseEvent& event) {
  return fmt::format(
      R"({{"name":{},"category":"device","level":{},"data":{{"device_id":{},"safety_type":{}}},)"
      R"("message":{}}})",
      json_text(event.name), json_text(event.level), json_text(event.device_id),
      json_text(event.safety_type), json_text(event.message));
}

}  // namespace tpm::haptics
