// Declared in tpm/haptics/inverse/inverse_device.hpp.
// Start of a session on an Inverse3: finds the service, chooses its device, neutralises its
// settings of forces and reads them back.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <ctime>

#include "tpm/haptics/inverse/inverse_device.hpp"
#include "tpm/haptics/inverse/service_terms.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr std::string_view kProfile = "org.tpmkit:tpm-hil";
/// A client that has ended is gone within this time, and one that is silent drives no more.
constexpr double kUntilFree_s = 2.5;
constexpr double kMounted_m = 1e-6;

/// "3 devices: 049D, 0A14, 1B20".
std::string devices_there(const InverseInventory& inventory) {
  const std::size_t count = inventory.devices.size();
  std::vector<std::string> ids;
  for (const InverseDeviceEntry& entry : inventory.devices) ids.push_back(printable(entry.id));
  return count == 0
             ? "no device"
             : fmt::format("{} device{}: {}", count, count == 1 ? "" : "s", fmt::join(ids, ", "));
}

/// Throws Error(environment) with the port.
InverseInventory inventory_from(const std::string& text, int port) {
  try {
    return parse_inventory(text);
  } catch (const Error& error) {
    throw service_fault(
        fmt::format("127.0.0.1:{}: the inventory cannot be read: {}", port, error.reason()),
        "a service that is compatible with the Inverse service");
  }
}

std::unique_ptr<WebSocketClient> events_of(const InverseAddress& address) {
  try {
    return std::make_unique<WebSocketClient>(address.events_port, "/", kPatience_s,
                                             kMostMessageBytes);
  } catch (const Error& error) {
    throw service_fault(fmt::format("no events are heard: {}", error.reason()),
                        "the events port of the service: --inverse-events-port");
  }
}

/// Empty: none is told there.
std::string version_at(int port, const char* target) {
  try {
    return parse_version(http_exchange(port, target, "", kPatience_s));
  } catch (const Error&) {
    return {};
  }
}

/// Throws Error(environment) if none is told.
std::string told_version(const InverseAddress& address) {
  std::string version = version_at(address.port, "/version");
  if (version.empty()) version = version_at(address.port, "/3.0/version");
  if (version.empty()) version = version_at(address.old_http_port, "/3.0/version");
  if (!version.empty()) return version;
  throw service_fault(
      fmt::format("no version is told on ports {} and {}", address.port, address.old_http_port),
      "GET /version or /3.0/version");
}

}  // namespace

std::string inverse_events_fault(const InverseAddress& address) {
  if (format_of_version(told_version(address)) != InverseFormat::vector) return {};
  try {
    (void)events_of(address);
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

InverseInventory inverse_inventory(const InverseAddress& address) {
  WebSocketClient service(address.port, "/", kPatience_s, kMostInventoryBytes);
  const std::optional<std::string> text = service.receive(kPatience_s);
  if (!text) {
    throw service_fault(service.over().empty() ? "the service is silent" : service.over(),
                        "a service that begins with its inventory");
  }
  return inventory_from(*text, address.port);
}

std::string InverseDevice::take_text(double timeout_s) {
  std::optional<std::string> text = service_->receive(timeout_s);
  if (text) return std::move(*text);
  throw silence();
}

/// Of a service that answers nothing more before a session, with what its events say.
Error InverseDevice::silence() {
  hear_last_events();
  const DeviceStatus said = status();
  if (said.forces_off != ForcesOff::none) {
    return service_fault(fmt::format("the service says {}", said.error_text),
                         "a device that is plugged in and free");
  }
  return service_fault(service_->over().empty() ? "the service is silent" : service_->over(),
                       "a service that answers each message");
}

/// The device that is meant, of those in the inventory.
void InverseDevice::choose(const InverseInventory& inventory) {
  const std::vector<InverseDeviceEntry>& all = inventory.devices;
  const std::string there = fmt::format("the service has {}", devices_there(inventory));
  auto meant = all.end();
  if (all.empty()) throw service_fault(there, "one that is plugged in");
  if (!address_.device_id.empty()) {
    meant = std::ranges::find_if(
        all, [this](const auto& entry) { return same_id(entry.id, address_.device_id); });
    if (meant == all.end()) {
      throw service_fault(
          fmt::format("'{}' is not there: {}", printable(address_.device_id), there),
          "--serial with one of these");
    }
  } else if (address_.index) {
    const int count = static_cast<int>(all.size());
    if (*address_.index < 0 || *address_.index >= count) {
      throw service_fault(fmt::format("there is no device {}: {}", *address_.index, there),
                          fmt::format("--index from 0 to {}", count - 1));
    }
    meant = all.begin() + *address_.index;
  } else if (all.size() > 1) {
    throw service_fault(there, "--serial with one of these, or --index with its place from 0 on");
  } else {
    meant = all.begin();
  }
  session_ = inventory.session;
  device_ = *meant;
}

/// Of a simulated device it is documented what `in_use` says: a second client would only read. A
/// client that has just ended gets the time to be gone.
void InverseDevice::look_for_other_clients() {
  const std::int64_t until_ns = now_ns() + static_cast<std::int64_t>(kUntilFree_s * 1e9);
  while (device_.simulated && device_.in_use) {
    if (now_ns() > until_ns) {
      throw service_fault(
          fmt::format("another client drives the device {} (status in_use)", printable(device_.id)),
          "a device that nobody drives: end that client");
    }
    constexpr timespec kLook{0, 20'000'000};
    (void)::nanosleep(&kLook, nullptr);
    const InverseInventory now = read_back();
    const auto found = std::ranges::find(now.devices, device_.id, &InverseDeviceEntry::id);
    device_.in_use = found != now.devices.end() && found->in_use;
  }
  const bool commanded = !device_.control_mode.empty() && device_.control_mode != "idle";
  if (device_.simulated || !(device_.in_use || commanded)) return;
  noticed_.push_back(
      {"in_use",
       fmt::format("another client may use the device {} (status in_use {}, control mode "
                   "'{}'): end it, or its forces add to those of this session",
                   printable(device_.id), device_.in_use, printable(device_.control_mode))});
}

/// The service's current report on its devices, as this session sees them.
InverseInventory InverseDevice::read_back() {
  if (format_ == InverseFormat::vector) {
    return inventory_from(
        http_exchange(address_.port, fmt::format("/devices?session=%23{}", session_), "",
                      kPatience_s),
        address_.port);
  }
  return inventory_from(http_exchange(address_.old_http_port, "/3.0/devices", "", kPatience_s),
                        address_.old_http_port);
}

void InverseDevice::make_neutral() {
  while (service_->receive(0.0)) {
    // States that nobody has asked for answer nothing.
  }
  if (!service_->send(neutral_message(device_.id, kProfile))) (void)take_text(0.0);
  device_.state = parse_state(take_text(kPatience_s), device_.id);
  learn_settings();
  const std::vector<InverseRequest> requests =
      neutral_requests(format_, device_.id, session_, device_.settings, address_.gravity_carried);
  for (const InverseRequest& request : requests) {
    try {
      (void)http_exchange(format_ == InverseFormat::vector ? address_.port : address_.old_http_port,
                          request.target, request.body, kPatience_s);
    } catch (const Error&) {
      // The next report of the service counts, not its answer here.
    }
  }
  if (!requests.empty()) learn_settings();
  require_neutral();
}

/// Reads the service's current settings of forces and coordinates.
void InverseDevice::learn_settings() {
  const InverseInventory now = read_back();
  const auto found = std::ranges::find(now.devices, device_.id, &InverseDeviceEntry::id);
  if (found == now.devices.end()) {
    throw service_fault("the settings cannot be read back: the device is not listed", "");
  }
  device_.settings = found->settings;
}

void InverseDevice::require_neutral() const {
  const InverseSettings& s = device_.settings;
  if (!s.preset.empty() && s.preset != kCentredPreset) {
    throw service_fault(
        fmt::format("the preset of the service stays at '{}'", printable(s.preset)),
        fmt::format("'{}': positions count from the middle of the workspace", kCentredPreset));
  }
  if (s.basis != "XYZ") {
    throw service_fault(fmt::format("the service exchanges axes: basis {}", printable(s.basis)),
                        "basis XYZ");
  }
  const double turned_rad = angle_rad(s.mount_rotation);
  if (!(turned_rad < kTurned_rad)) {
    throw service_fault(fmt::format("the service turns coordinates: a mount by {} rad", turned_rad),
                        "a mount that is not turned");
  }
  if (s.preset.empty() && !(s.mount_position_m.norm() < kMounted_m)) {
    throw service_fault(
        fmt::format("the service moves coordinates: a mount by {} m", s.mount_position_m.norm()),
        "a mount at 0 0 0");
  }
  if (s.torque_scaling.value_or(false)) {
    throw service_fault("the torque scaling of the service stays on",
                        "a service whose torque scaling can be switched off");
  }
  if (!s.filters_named || !s.damping_named) {
    throw service_fault(
        fmt::format("the service of version {} does not say what its {} does to a force", version_,
                    s.filters_named ? "damping" : "force gate"),
        "a service that lists both filters: install version 3.5 or later");
  }
  if (s.force_gate_gain != 0.0) {
    throw service_fault(
        fmt::format("the force gate of the service stays at {}", s.force_gate_gain),
        "a service whose force gate can be set to 0: it changes forces on their way to the hand");
  }
  if (s.gravity_named && s.carried() != address_.gravity_carried) {
    throw service_fault(
        fmt::format("the service stays at carrying {} of the device's weight", s.carried()),
        fmt::format("{}, or --inverse-gravity with what it keeps", address_.gravity_carried));
  }
  if (s.damping != 0.0 || !s.directional_damping.isZero()) {
    throw service_fault(fmt::format("the damping of the service stays at {}, by direction {}",
                                    s.damping, fmt::join(s.directional_damping, " ")),
                        "a service whose damping can be set to 0");
  }
}

/// Notes settings that stay unknown or are not this session's to change.
void InverseDevice::notice_settings() {
  const InverseSettings& s = device_.settings;
  if (!s.gravity_named) {
    noticed_.push_back({"gravity_not_reported",
                        "the service does not name gravity compensation: it is unknown how much of "
                        "the device's weight the hand carries"});
  }
  if (!s.preset.empty() && !(s.mount_position_m.norm() < kMounted_m)) {
    noticed_.push_back({"mount_beside_preset",
                        fmt::format("the service names a mount at {} m beside the preset "
                                    "'{}': taken as that of the preset",
                                    fmt::join(s.mount_position_m, " "), printable(s.preset))});
  }
}

void InverseDevice::identify() {
  identity_ = {};
  identity_.kind = std::string(limits_.kind);
  identity_.name = device_.type.empty() ? "Inverse3" : device_.type;
  identity_.serial = device_.id;
  identity_.firmware = device_.firmware;
  identity_.library = fmt::format("service on port {}", address_.port);
  identity_.library_version = fmt::format("service {}, format '{}'", version_, to_string(format_));
  identity_.link = DeviceLink::network;
  identity_.left_handed = device_.settings.handedness == "left";
  identity_.hardware = !device_.simulated;
  identity_.assumptions = device_.settings.lines();
  if (events_ == nullptr) {
    identity_.assumptions.push_back(
        {"events_not_heard", "events of the service are not heard: its version has none"});
  }
  const auto add = [&](const char* code, std::string text) {
    identity_.assumptions.push_back({code, std::move(text)});
  };
  add("limit_force",
      fmt::format("at most {} N ({})", limits_.force_N, limits_.known_by("force_N")));
  add("limit_workspace", fmt::format("{} mm from the middle of the workspace ({})",
                                     1e3 * limits_.reach_m, limits_.known_by("reach_m")));
  add("limit_stiffness", fmt::format("at most {} N/m ({})", limits_.stiffness_N_per_m,
                                     limits_.known_by("stiffness_N_per_m")));
}

const DeviceIdentity& InverseDevice::open() {
  // The WebSocket first: where nobody listens at all, its message says so.
  service_ =
      std::make_unique<WebSocketClient>(address_.port, "/", kPatience_s, kMostInventoryBytes);
  version_ = told_version(address_);
  format_ = format_of_version(version_);
  noticed_.clear();
  choose(inventory_from(take_text(kPatience_s), address_.port));
  look_for_other_clients();
  if (format_ == InverseFormat::vector) {
    events_ = events_of(address_);
  }
  make_neutral();
  if (!device_.settings.true_to_scale() || !is_scaled_as_device(device_.state)) {
    throw service_fault("the service scales coordinates", "a mount and a workspace of scale 1");
  }
  if (!is_turned_as_device(device_.state)) {
    throw service_fault(fmt::format("the service turns coordinates: a workspace by {} rad",
                                    angle_rad(device_.state.workspace_rotation)),
                        "a workspace that is not turned");
  }
  notice_settings();
  identify();
  return identity_;
}

}  // namespace tpm::haptics
