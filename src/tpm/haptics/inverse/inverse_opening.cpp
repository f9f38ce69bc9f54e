// Declared in tpm/haptics/inverse/inverse_device.hpp.
// How a session on an Inverse3 begins: the service is found, its device chosen, what acts on a
// force made neutral and read back.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "tpm/haptics/inverse/inverse_device.hpp"
#include "tpm/haptics/inverse/service_terms.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr std::string_view kProfile = "org.tpmkit:tpm-hil";

}  // namespace

InverseInventory inverse_inventory(const InverseAddress& address) {
  WebSocketClient service(address.port, "/", kPatience_s, kMostInventoryBytes);
  const std::optional<std::string> text = service.receive(kPatience_s);
  if (!text) {
    throw service_fault(service.over().empty() ? "the service is silent" : service.over(),
                        "a service that begins with its inventory");
  }
  return parse_inventory(*text);
}

std::string InverseDevice::take_text(double timeout_s) {
  std::optional<std::string> text = service_->receive(timeout_s);
  if (text) return std::move(*text);
  throw service_fault(service_->over().empty() ? "the service is silent" : service_->over(),
                      "a service that answers each message");
}

/// The device that is meant, of those in the inventory.
void InverseDevice::choose(const InverseInventory& inventory) {
  std::vector<std::string> ids;
  const InverseDeviceEntry* meant = nullptr;
  for (const InverseDeviceEntry& entry : inventory.devices) {
    ids.push_back(entry.id);
    if (address_.device_id.empty() ? inventory.devices.size() == 1
                                   : entry.id == address_.device_id) {
      meant = &entry;
    }
  }
  if (meant == nullptr) {
    throw service_fault(fmt::format("the service has {} such devices{}", ids.size(),
                                    ids.empty() ? "" : fmt::format(": {}", fmt::join(ids, ", "))),
                        "one device, or --inverse-id with one of them");
  }
  session_ = inventory.session;
  device_ = *meant;
}

/// What the service says of its devices now, as this session sees them.
InverseInventory InverseDevice::read_back() {
  if (format_ == InverseFormat::vector) {
    return parse_inventory(http_exchange(
        address_.port, fmt::format("/devices?session=%23{}", session_), "", kPatience_s));
  }
  return parse_inventory(http_exchange(address_.old_http_port, "/3.0/devices", "", kPatience_s));
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
      // What the service says below counts, not what it answers here.
    }
  }
  if (!requests.empty()) learn_settings();
  require_neutral();
}

/// What acts on a force or a coordinate, as the service says now.
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

void InverseDevice::identify() {
  identity_ = {};
  identity_.kind = std::string(limits_.kind);
  identity_.name = device_.type.empty() ? "Inverse3" : device_.type;
  identity_.serial = device_.id;
  identity_.firmware = device_.firmware;
  identity_.library = fmt::format("service on port {}", address_.port);
  identity_.library_version = fmt::format("service {}, format '{}'", version_, word_of(format_));
  identity_.link = DeviceLink::network;
  identity_.left_handed = device_.settings.handedness == "left";
  identity_.hardware = !device_.simulated;
  identity_.assumptions = device_.settings.lines();
  if (events_ == nullptr) {
    identity_.assumptions.push_back("events of the service are not heard: its version has none");
  }
  identity_.assumptions.push_back(
      fmt::format("at most {} N ({})", limits_.force_N, limits_.known_by("force_N")));
  identity_.assumptions.push_back(fmt::format("{} mm from the middle of the workspace ({})",
                                              1e3 * limits_.reach_m, limits_.known_by("reach_m")));
  identity_.assumptions.push_back(fmt::format("at most {} N/m ({})", limits_.stiffness_N_per_m,
                                              limits_.known_by("stiffness_N_per_m")));
}

const DeviceIdentity& InverseDevice::open() {
  const auto version_at = [](int port, const char* target) -> std::string {
    try {
      return parse_version(http_exchange(port, target, "", kPatience_s));
    } catch (const Error&) {
      return {};
    }
  };
  // The WebSocket first: where nobody listens at all, its message says so.
  service_ =
      std::make_unique<WebSocketClient>(address_.port, "/", kPatience_s, kMostInventoryBytes);
  version_ = version_at(address_.port, "/version");
  if (version_.empty()) version_ = version_at(address_.port, "/3.0/version");
  if (version_.empty()) version_ = version_at(address_.old_http_port, "/3.0/version");
  if (version_.empty()) {
    throw service_fault(
        fmt::format("no version is told on ports {} and {}", address_.port, address_.old_http_port),
        "GET /version or /3.0/version");
  }
  format_ = format_of_version(version_);
  choose(parse_inventory(take_text(kPatience_s)));
  if (format_ == InverseFormat::vector) {
    events_ = std::make_unique<WebSocketClient>(address_.events_port, "/", kPatience_s,
                                                kMostMessageBytes);
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
  identify();
  return identity_;
}

}  // namespace tpm::haptics
