// Messages of the Inverse service in both formats: those of its public description, and what is
// refused.
#include <catch2/catch.hpp>
#include <string>

#include "tpm/files/json.hpp"
#include "tpm/haptics/inverse/messages.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using files::Json;

/// An inventory as the public description shows it, written here by hand.
constexpr const char* kInventory = R"({
  "session_id": 7,
  "inverse3": [{
    "device_id": "049D",
    "config": {
      "type": "inverse3", "port": "COM12",
      "device_info": {"major_version": 7, "minor_version": 4, "id": "049D", "uuid": "u"},
      "gravity_compensation": {"enabled": true, "scaling_factor": 0.8},
      "handedness": "left", "streaming_mode": "USB", "torque_scaling": {"enabled": true},
      "home_return": {"enabled": false}, "preset": "defaults", "basis": {"permutation": "XYZ"},
      "mount": {"position": {"x": 0, "y": 0, "z": 0}, "rotation": {"w": 1, "x": 0, "y": 0, "z": 0},
                "scale": {"x": 1, "y": 1, "z": 1}},
      "filters": {"force_gate": {"gain": 0.3}, "damping": {"scalar": 0.1}}},
    "state": {
      "cursor_position": {"x": 0.01, "y": -0.12, "z": 0.15},
      "cursor_velocity": {"x": 0.0, "y": 0.5, "z": 0.0},
      "current_cursor_force": {"x": 0.0, "y": 0.0, "z": 1.5},
      "transform": {"position": {"x": 0, "y": 0, "z": 0}}},
    "status": {}}],
  "wireless_verse_grip": [{"device_id": "61548", "state": {
    "orientation": {"w": 0.0, "x": 1.0, "y": 0.0, "z": 0.0},
    "buttons": {"a": true, "b": false, "c": true}}}]
})";

std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST_CASE("An inventory of the public description is read") {
  const InverseInventory all = parse_inventory(kInventory);
  CHECK(all.session == 7);
  REQUIRE(all.devices.size() == 1);
  const InverseDeviceEntry& d = all.devices[0];
  CHECK(d.id == "049D");
  CHECK(d.firmware == "7.4");
  CHECK_FALSE(d.simulated);
  CHECK(d.settings.handedness == "left");
  CHECK(d.settings.filters_named);
  CHECK(d.settings.force_gate_gain == 0.3);
  CHECK(d.settings.damping == 0.1);
  CHECK(d.settings.gravity_compensation);
  CHECK(d.settings.gravity_scaling == 0.8);
  CHECK(d.settings.true_to_scale());
  CHECK(d.state.position_m == Eigen::Vector3d(0.01, -0.12, 0.15));
  CHECK(d.state.force_N.z() == 1.5);
  CHECK(d.state.workspace_scale == Eigen::Vector3d::Ones());
  CHECK(d.state.has_grip);
  CHECK(d.state.buttons == 0b101U);
  CHECK(d.state.grip.x() == 1.0);
  CHECK_THAT(d.settings.lines().back(), Contains("torque scaling on"));
  std::string silent = kInventory;
  silent.replace(silent.find("torque_scaling"), 14, "unnamed_things");
  CHECK_THAT(parse_inventory(silent).devices.at(0).settings.lines().back(),
             Contains("torque scaling not named"));
}

TEST_CASE("A force is written and read in both formats, told by the version") {
  CHECK(format_of_version("3.5.0.0") == InverseFormat::vector);
  CHECK(format_of_version("3.12") == InverseFormat::vector);
  CHECK(format_of_version("3.1.1.0") == InverseFormat::values);
  for (const char* other : {"3.0.7", "2.9", "4.0", "", "3", "three.five"}) {
    CHECK_THAT(error_of([&] { (void)format_of_version(other); }), Contains("3.1 or later"));
  }
  CHECK(parse_version(R"({"project_version": "3.5.0.0"})") == "3.5.0.0");
  CHECK(parse_version(R"({"ok": true, "data": {"project_version": "3.5.1"}})") == "3.5.1");

  const Eigen::Vector3d force(0.25, -1e-7, 1.5);
  CHECK(Json::parse(force_message(InverseFormat::vector, "049D", {0, 0, 1.5})) ==
        Json::parse(R"({"inverse3": [{"device_id": "049D", "commands": {"set_cursor_force":
                        {"vector": {"x": 0, "y": 0, "z": 1.5}}}}]})"));
  CHECK(Json::parse(force_message(InverseFormat::values, "049D", {0, 0, 1.5}, "p")) ==
        Json::parse(R"({"session": {"configure": {"profile": {"name": "p"}}},
                        "inverse3": [{"device_id": "049D", "commands": {"set_cursor_force":
                        {"values": {"x": 0, "y": 0, "z": 1.5}}}}]})"));
  for (const InverseFormat format : {InverseFormat::vector, InverseFormat::values}) {
    const InverseCommand read = parse_command(force_message(format, "A1", force, "who"), "A1");
    REQUIRE(read.force_N);
    CHECK(*read.force_N == force);  // to the bit: numbers are written in full
    CHECK(read.profile == "who");
    CHECK_FALSE(parse_command(force_message(format, "B2", force), "A1").force_N);
  }
}

TEST_CASE("Forces of one message add up, and other commands are read") {
  const InverseCommand sum = parse_command(
      R"({"inverse3": [
        {"device_id": "a", "commands": {"set_cursor_force": {"vector": {"x": 1, "y": 0, "z": 0}}}},
        {"device_id": "a", "commands": {"set_cursor_force": {"values": {"x": 2, "y": 0, "z": 1}},
          "set_cursor_position": {"position": {"x": 0, "y": 0.1, "z": 0}}}}]})",
      "a");
  CHECK(*sum.force_N == Eigen::Vector3d(3.0, 0.0, 1.0));
  CHECK(*sum.position_m == Eigen::Vector3d(0.0, 0.1, 0.0));
  const InverseCommand neutral = parse_command(neutral_message("a", "p"), "a");
  CHECK_FALSE(neutral.force_N);
  CHECK(neutral.force_gate_gain == 0.0);
  CHECK(neutral.damping == 0.0);
  CHECK(neutral.preset == kCentredPreset);
  CHECK_FALSE(parse_command("{}", "a").force_N);
}

TEST_CASE("What a server writes, a client reads as it was") {
  InverseInventory all = parse_inventory(kInventory);
  all.devices[0].simulated = true;
  const std::string text = inventory_message(all);
  CHECK_THAT(text, Contains("SIMULATED DEVICE"));
  const InverseInventory again = parse_inventory(text);
  CHECK(again.session == all.session);
  const InverseDeviceEntry &before = all.devices[0], &after = again.devices.at(0);
  CHECK(after.simulated);
  CHECK(after.settings.lines() == before.settings.lines());
  CHECK(after.state.position_m == before.state.position_m);
  CHECK(after.state.buttons == before.state.buttons);
  const InverseState state = parse_state(state_message(7, "049D", before.state, true), "049D");
  CHECK(state.position_m == before.state.position_m);
  CHECK(state.velocity_m_per_s == before.state.velocity_m_per_s);
  CHECK(state.force_N == before.state.force_N);
  CHECK(state.grip.coeffs() == before.state.grip.coeffs());
  const InverseEvent event = parse_event(
      event_message({"device-safety-triggered", "error", "049D", "ebrake_triggered", "brake"}));
  CHECK(event.name == "device-safety-triggered");
  CHECK(event.safety_type == "ebrake_triggered");
  CHECK(event.device_id == "049D");
}

TEST_CASE("A message that is none is refused with the place in it") {
  const auto command = [](const std::string& text) {
    return error_of([&] { (void)parse_command(text, "a"); });
  };
  CHECK_THAT(command(R"({"inverse3": [)"), Contains("message"));
  CHECK_THAT(command("[]"), Contains("command: is no object"));
  CHECK_THAT(command(R"({"inverse3": {}})"), Contains("command/inverse3: is no list"));
  CHECK_THAT(command(R"({"inverse3": [{}]})"), Contains("command/inverse3/0: has no device_id"));
  const std::string force =
      R"({"inverse3":[{"device_id":"a","commands":{"set_cursor_force":{"vector":)";
  CHECK_THAT(command(force + R"({"x":1e400,"y":0,"z":0}}}}]})"), Contains("message"));
  CHECK_THAT(command(force + R"({"x":NaN,"y":0,"z":0}}}}]})"), Contains("message"));
  CHECK_THAT(command(force + R"({"x":"1","y":0,"z":0}}}}]})"), Contains("vector/x: is no number"));
  CHECK_THAT(command(force + R"({"x":1e300,"y":0,"z":0}}}}]})"), Contains("out of range"));
  CHECK_THAT(command(force + R"({"x":1,"y":0}}}}]})"), Contains("has no z"));
  CHECK_THAT(command(std::string(kMostMessageBytes + 1, ' ')), Contains("too long"));
  CHECK_THAT(command(std::string(60'000, '[')), Contains("message"));
  CHECK_THAT(error_of([] { (void)parse_state(R"({"inverse3": []})", "a"); }),
             Contains("not that of device 'a'"));
  CHECK_THAT(error_of([] {
               (void)parse_inventory(R"({"inverse3": [{"device_id": "a", "config":
                           {"handedness": "both"}, "state": {}}]})");
             }),
             Contains("neither left nor right"));
  CHECK(parse_inventory(R"({"session_id": 1})").devices.empty());
}

TEST_CASE("What is not neutral is asked for over HTTP, each setting once and nothing else") {
  const auto asked = [](const InverseSettings& settings,
                        InverseFormat format = InverseFormat::vector) {
    return neutral_requests(format, "049D", 7, settings, 1.0);
  };
  InverseSettings neutral;
  neutral.gravity_named = neutral.gravity_compensation = true;
  neutral.gravity_scaling = 1.0;
  neutral.preset = kCentredPreset;
  CHECK(asked(neutral).empty());

  InverseSettings s = neutral;
  s.damping = 0.2;
  REQUIRE(asked(s).size() == 1);
  CHECK(asked(s)[0].target == "/inverse3/049D/config/damping?session=%237");
  CHECK(Json::parse(asked(s)[0].body) ==
        Json::parse(R"({"scalar": 0, "vector": {"x": 0, "y": 0, "z": 0}})"));
  s = neutral;
  s.directional_damping.y() = 0.1;  // the scalar is 0
  CHECK(asked(s).size() == 1);

  s = neutral;
  s.basis = "XZY";
  REQUIRE(asked(s).size() == 1);
  CHECK(asked(s)[0].target == "/inverse3/049D/config/basis?session=%237");
  CHECK(Json::parse(asked(s)[0].body) == Json::parse(R"({"permutation": "XYZ"})"));

  // A mount is set only where no preset stands for it; its position stays.
  s = neutral;
  s.mount_scale = {2.0, 2.0, 2.0};
  CHECK(asked(s).empty());
  s.preset.clear();
  s.mount_position_m = {0.0, 0.1, 0.0};
  s.mount_rotation = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX());
  REQUIRE(asked(s).size() == 1);
  CHECK(asked(s)[0].target == "/inverse3/049D/config/mount?session=%237");
  const Json transform = Json::parse(asked(s)[0].body).at("transform");
  CHECK(transform.at("position") == Json::parse(R"({"x": 0, "y": 0.1, "z": 0})"));
  CHECK(transform.at("rotation") == Json::parse(R"({"w": 1, "x": 0, "y": 0, "z": 0})"));
  CHECK(transform.at("scale") == Json::parse(R"({"x": 1, "y": 1, "z": 1})"));

  // Before 3.5 no setting of a session can be set over HTTP.
  s.damping = s.force_gate_gain = 0.3;
  s.basis = "XZY";
  CHECK(asked(s).size() == 4);
  CHECK(asked(s, InverseFormat::values).empty());
}

}  // namespace
}  // namespace tpm::haptics
