// Messages of the Inverse service in both formats: those of its public description, and what is
// refused.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "grip_presses.hpp"
#include "refusal.hpp"
#include "tpm/files/json.hpp"
#include "tpm/haptics/inverse/messages.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using files::Json;
using test::refusal_of;

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
  CHECK_THAT(d.settings.lines().back().text, Contains("torque scaling on"));
  std::string silent = kInventory;
  silent.replace(silent.find("torque_scaling"), 14, "unnamed_things");
  CHECK_THAT(parse_inventory(silent).devices.at(0).settings.lines().back().text,
             Contains("torque scaling not named"));
}

TEST_CASE("A force is written and read in both formats, told by the version") {
  CHECK(format_of_version("3.5.0.0") == InverseFormat::vector);
  CHECK(format_of_version("3.12") == InverseFormat::vector);
  CHECK(format_of_version("3.1.1.0") == InverseFormat::values);
  for (const char* other : {"3.0.7", "2.9", "4.0", "", "3", "three.five"}) {
    CHECK_THAT(refusal_of([&] { (void)format_of_version(other); }), Contains("3.1 or later"));
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
  CHECK(parse_command(test::press_message(0b110U), "a").buttons == 0b110U);
  CHECK(parse_command(test::press_message(0), "a").buttons == 0U);
  // Another grip, or a command that is none here, presses nothing.
  for (const char* other :
       {R"({"wireless_verse_grip":[{"device_id":"61548","commands":{"set_buttons":{"a":true}}}]})",
        R"({"wireless_verse_grip":[{"device_id":"SIMULATED_GRIP","commands":{"vibrate":{}}}]})",
        R"({"wireless_verse_grip":[{}]})"}) {
    CHECK_FALSE(parse_command(other, "a").buttons);
  }
}

TEST_CASE("What a server writes, a client reads as it was") {
  InverseInventory all = parse_inventory(kInventory);
  all.devices[0].simulated = true;
  const std::string text = inventory_message(all);
  CHECK_THAT(text, Contains("SIMULATED DEVICE") && Contains("SIMULATED_GRIP"));
  all.devices[0].simulated = false;  // hardware says of itself what it is
  CHECK_FALSE(Contains("SIMULATED").match(inventory_message(all)));
  all.devices[0].simulated = true;
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
    return refusal_of([&] { (void)parse_command(text, "a"); });
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
  CHECK_THAT(refusal_of([] { (void)parse_state(R"({"inverse3": []})", "a"); }),
             Contains("not that of device 'a'"));
  CHECK_THAT(refusal_of([] {
               (void)parse_inventory(R"({"inverse3": [{"device_id": "a", "config":
                           {"handedness": "both"}, "state": {}}]})");
             }),
             Contains("neither left nor right"));
  CHECK(parse_inventory(R"({"session_id": 1})").devices.empty());
}

/// kInventory with one piece of text in place of another.
std::string inventory_with(const std::string& before, const std::string& after) {
  std::string text = kInventory;
  text.replace(text.find(before), before.size(), after);
  return text;
}

const InverseDeviceEntry& only(const InverseInventory& all) {
  REQUIRE(all.devices.size() == 1);
  return all.devices.front();
}

TEST_CASE("What an inventory leaves out, or says to be null, is as if it had no such setting") {
  const auto settings = [](const std::string& config) {
    return only(parse_inventory(
                    R"({"inverse3": [{"device_id": "a", "config": {"handedness": "right")" +
                    config + R"(}, "state": {"cursor_position": {"x": 0, "y": 0, "z": 0}}}]})"))
        .settings;
  };
  const InverseSettings bare = settings("");
  const std::vector<Remark> said = bare.lines();
  CHECK_THAT(said.at(0).text, Contains("force gate not named"));
  CHECK_THAT(said.at(1).text, Contains("damping not named"));
  CHECK_THAT(said.at(2).text, Contains("preset '', basis XYZ"));
  CHECK_THAT(said.at(4).text, Contains("gravity compensation not named; torque scaling not named"));
  CHECK(bare.true_to_scale());
  CHECK(bare.carried() == 0.0);
  CHECK(settings(R"(, "preset": null, "mount": null, "filters": null, "torque_scaling": null)")
            .lines() == said);
  // One filter without the other, and damping by direction only.
  const InverseSettings gate = settings(R"(, "filters": {"force_gate": {"gain": 0.25}})");
  CHECK(gate.filters_named);
  CHECK_FALSE(gate.damping_named);
  CHECK(gate.force_gate_gain == 0.25);
  const InverseSettings damping =
      settings(R"(, "filters": {"damping": {"vector": {"x": 0, "y": 2, "z": 0}}})");
  CHECK_FALSE(damping.filters_named);
  CHECK(damping.damping_named);
  CHECK(damping.damping == 0.0);
  CHECK(damping.directional_damping.y() == 2.0);
  // A mount of parts; gravity without a factor, or off with one.
  const InverseSettings mount = settings(R"(, "mount": {"scale": {"x": 1, "y": 1, "z": 2}})");
  CHECK(mount.mount_position_m.isZero());
  CHECK_FALSE(mount.true_to_scale());
  CHECK(settings(R"(, "gravity_compensation": {"enabled": true})").carried() == 0.0);
  CHECK(
      settings(R"(, "gravity_compensation": {"enabled": false, "scaling_factor": 1})").carried() ==
      0.0);
  CHECK_THAT(settings(R"(, "torque_scaling": {"enabled": false})").lines().back().text,
             Contains("torque scaling off"));
}

TEST_CASE("An inventory whose values are of another kind is refused with their place") {
  const auto refusal = [](const std::string& before, const std::string& after) {
    const std::string text = inventory_with(before, after);
    return refusal_of([&] { (void)parse_inventory(text); });
  };
  const std::string config = "inventory/inverse3/0/config/";
  CHECK_THAT(refusal(R"("049D")", R"("")"), Contains("inverse3/0/device_id: is empty"));
  CHECK_THAT(refusal(R"("049D")", "\"" + std::string(65, 'x') + "\""), Contains("is too long"));
  CHECK_THAT(refusal(R"("049D")", R"("a\u0007b")"), Contains("not printable"));
  CHECK_THAT(refusal(R"("left")", "1"), Contains(config + "handedness: is no text"));
  CHECK_THAT(refusal(R"("handedness": "left",)", ""), Contains("config: has no handedness"));
  CHECK_THAT(refusal(R"({"permutation": "XYZ"})", "{}"), Contains("basis: has no permutation"));
  CHECK_THAT(refusal(R"({"enabled": true, "scaling_factor": 0.8})", R"({"enabled": 1})"),
             Contains("gravity_compensation/enabled: is neither true nor false"));
  CHECK_THAT(refusal(R"({"gain": 0.3})", "0.3"), Contains("filters/force_gate: is no object"));
  CHECK_THAT(refusal(R"({"gain": 0.3})", R"({"gain": true})"), Contains("gain: is no number"));
  CHECK_THAT(refusal(R"({"w": 1, "x": 0, "y": 0, "z": 0})", R"({"w": 0, "x": 0, "y": 0, "z": 0})"),
             Contains("mount/rotation: is no rotation"));
  CHECK_THAT(refusal(R"({"w": 1, "x": 0, "y": 0, "z": 0})", R"({"w": 2, "x": 0, "y": 0, "z": 0})"),
             Contains("is no rotation"));
  CHECK_THAT(refusal(R"("x": 0.01)", R"("x": 1000001)"), Contains("cursor_position/x: is out of"));
  CHECK_THAT(refusal("cursor_position", "position"), Contains("state: has no cursor_position"));
  CHECK_THAT(refusal(R"("a": true)", R"("a": "down")"), Contains("neither true nor false"));
  CHECK_THAT(refusal(R"({"w": 0.0, "x": 1.0,)", R"({"w": 0.0,)"), Contains("has no x"));
  CHECK_THAT(refusal_of([] { (void)parse_inventory(std::string(kMostInventoryBytes + 1, ' ')); }),
             Contains("too long"));
  CHECK_THAT(refusal_of([] { (void)parse_inventory("7"); }), Contains("inventory: is no object"));
  CHECK_THAT(refusal_of([] { (void)parse_inventory(R"({"data": []})"); }),
             Contains("inventory/data: is no object"));
  // The largest number that is one, and a rotation that is not quite of length 1.
  CHECK(only(parse_inventory(inventory_with(R"("x": 0.01)", R"("x": -1000000)")))
            .state.position_m.x() == -1e6);
  const InverseInventory long_turn = parse_inventory(inventory_with(
      R"({"w": 1, "x": 0, "y": 0, "z": 0})", R"({"w": 0, "x": 1.5, "y": 0, "z": 0})"));
  CHECK(only(long_turn).settings.mount_rotation.x() == 1.0);
}

TEST_CASE("Sixteen devices are read and no more; an answer over HTTP has its data within") {
  const auto of = [](int count) {
    const std::string entry =
        R"({"device_id":"a","config":{"handedness":"left"},"state":{"cursor_position":{"x":0,"y":0,"z":0}}})";
    std::string all = entry;
    for (int i = 1; i < count; ++i) all += "," + entry;
    return parse_inventory(R"({"ok": true, "data": {"inverse3": [)" + all + "]}}").devices.size();
  };
  CHECK(of(16) == 16);
  CHECK_THAT(refusal_of([&] { (void)of(17); }), Contains("no list of at most 16 devices"));
}

TEST_CASE("The first grip of a message counts, of any kind, with buttons by either name") {
  const auto state = [](const std::string& grips) {
    return parse_state(R"({"inverse3": [{"device_id": "other"}, {"device_id": "a", "state":
                           {"cursor_position": {"x": 0, "y": 0, "z": 0},
                            "transform": {"scale": {"x": 2, "y": 2, "z": 2}}}}])" +
                           grips + "}",
                       "a");
  };
  CHECK_FALSE(state("").has_grip);
  CHECK(state("").workspace_scale.x() == 2.0);
  CHECK_FALSE(state(R"(, "verse_grip": [])").has_grip);
  CHECK_FALSE(state(R"(, "verse_grip": [{"device_id": "g"}])").has_grip);
  const InverseState old = state(
      R"(, "verse_grip": [{"state": {"buttons": {"button_0": false, "button_1": true, "button_2": null}}},
                          {"state": {"buttons": {"button_0": true}}}],
          "custom_verse_grip": [{"state": {"buttons": {"a": true}}}])");
  CHECK(old.has_grip);
  CHECK(old.buttons == 0b010U);
  CHECK(old.grip.w() == 1.0);
  const InverseState turned = state(
      R"(, "custom_verse_grip": [{"state": {"orientation": {"w": 0, "x": 0, "y": 0, "z": -0.9}}}])");
  CHECK(turned.grip.z() == -1.0);
  CHECK(turned.buttons == 0);
  CHECK_THAT(refusal_of([&] { (void)state(R"(, "verse_grip": 1)"); }),
             Contains("state/verse_grip"));
  CHECK_THAT(refusal_of([] { (void)parse_state("{}", "a"); }), Contains("state: has no inverse3"));
}

TEST_CASE("A place is read in each form; what a client may not say is refused with its place") {
  const auto said = [](const std::string& entry) {
    return parse_command(R"({"inverse3": [{"device_id": "a", )" + entry + "}]}", "a");
  };
  const auto refusal = [&](const std::string& entry) {
    return refusal_of([&] { (void)said(entry); });
  };
  for (const char* form : {"position", "vector", "values"}) {
    const InverseCommand command = said(std::string(R"("commands": {"set_cursor_position": {")") +
                                        form + R"(": {"x": 0, "y": 0, "z": 0.2}}})");
    REQUIRE(command.position_m);
    CHECK(command.position_m->z() == 0.2);
    CHECK_FALSE(command.force_N);
  }
  CHECK_THAT(refusal(R"("commands": {"set_cursor_position": {}})"),
             Contains("commands/set_cursor_position: has no values"));
  CHECK_THAT(refusal(R"("commands": {"set_cursor_force": {}})"),
             Contains("commands/set_cursor_force: has no values"));
  CHECK_THAT(refusal(R"("commands": {"set_cursor_force": {"vector": [1, 0, 0]}})"),
             Contains("set_cursor_force/vector: is no object"));
  CHECK_THAT(refusal(R"("configure": {"force_gate": {}})"),
             Contains("configure/force_gate: has no gain"));
  CHECK_THAT(refusal(R"("configure": {"preset": {"preset": 1}})"), Contains("preset: is no text"));
  CHECK_THAT(refusal(R"("configure": {"damping": {"vector": {}}})"),
             Contains("configure/damping/vector: has no x"));
  // Null and unknown are nothing.
  CHECK_FALSE(said(R"("commands": {"set_cursor_force": null, "set_joint_torques": {}})").force_N);
  CHECK_FALSE(said(R"("configure": {"damping": {}})").damping);
  const InverseCommand set =
      said(R"("configure": {"damping": {"scalar": 0.5}, "force_gate": {"gain": 0.1}})");
  CHECK(set.damping == 0.5);
  CHECK(set.force_gate_gain == 0.1);
  CHECK(set.preset.empty());
  CHECK_FALSE(set.of_another_device);
  // Some of a message may be for another device.
  const InverseCommand both = parse_command(
      R"({"inverse3": [{"device_id": "b", "commands": {"set_cursor_force": 7}}, {"device_id": "a"}]})",
      "a");
  CHECK(both.of_another_device);
  CHECK_FALSE(both.force_N);
  // A program registers with a name.
  const auto session = [](const std::string& text) {
    return parse_command(R"({"session": )" + text + "}", "a").profile;
  };
  CHECK(session("{}").empty());
  CHECK(session(R"({"configure": {}})").empty());
  CHECK(session(R"({"configure": {"profile": {"name": "a"}}})") == "a");
  CHECK_THAT(refusal_of([&] { (void)session(R"({"configure": {"profile": {}}})"); }),
             Contains("session/configure/profile: has no name"));
}

TEST_CASE("Only a device that says SIMULATED DEVICE is simulated") {
  InverseInventory inventory;
  inventory.devices.emplace_back();
  inventory.devices.front().id = "049D";
  inventory.devices.front().settings.handedness = "right";
  inventory.devices.front().simulated = true;
  const std::string text = inventory_message(inventory);
  CHECK(parse_inventory(text).devices.at(0).simulated);
  const std::string words = "\"SIMULATED DEVICE\"";
  for (const char* other : {"false", "\"true\"", "\"no\"", "0"}) {
    CAPTURE(other);
    std::string changed = text;
    changed.replace(changed.find(words), words.size(), other);
    CHECK_FALSE(parse_inventory(changed).devices.at(0).simulated);
  }
}

TEST_CASE("Versions and events are read with what they leave out") {
  const auto no_version = [](const std::string& text) {
    return refusal_of([&] { (void)parse_version(text); });
  };
  CHECK_THAT(no_version("{}"), Contains("version: has no project_version"));
  CHECK_THAT(no_version(R"({"project_version": 3.5})"), Contains("project_version: is no text"));
  CHECK_THAT(no_version(R"({"data": "3.5"})"), Contains("version/data: is no object"));
  for (const char* other : {"3.", "3.x", "3:5", " 3.5", "-3.5", "3.-5", "3.99999999999"}) {
    CHECK_THROWS_AS(format_of_version(other), Error);
  }
  CHECK(to_string(format_of_version("3.4.9")) == "values");
  CHECK(to_string(format_of_version("3.5")) == "vector");
  for (const bool simulated : {false, true}) {
    const std::string text = version_message("3.5.0.0", simulated);
    CHECK(parse_version(text) == "3.5.0.0");
    CHECK((text.find("SIMULATED DEVICE") != std::string::npos) == simulated);
    const Json state = Json::parse(state_message(1, "a", {}, simulated));
    CHECK(state.at("inverse3").at(0).at("status").empty() != simulated);
  }
  const InverseEvent bare = parse_event(R"({"name": "device-disconnected"})");
  CHECK(bare.level.empty());
  CHECK(bare.device_id.empty());
  CHECK(parse_event(R"({"name": "n", "data": {}})").safety_type.empty());
  const auto with_words = [](std::size_t count) {
    return parse_event(R"({"name": "n", "message": ")" + std::string(count, 'w') + "\"}").message;
  };
  CHECK(with_words(1000).size() == 1000);
  CHECK(with_words(5000).size() < 1100);  // shortened: what it is called decides
  const InverseEvent odd = parse_event(
      R"({"name": "n", "level": 3, "message": "a\nb", "data": {"device_id": 7, "safety_type": []}})");
  CHECK(odd.level.empty());
  CHECK_FALSE(odd.message.empty());
  CHECK(odd.device_id.empty());
  CHECK(odd.safety_type.empty());
  CHECK_THAT(refusal_of([] { (void)parse_event(R"({"level": "error"})"); }),
             Contains("event: has no name"));
  // Quotes do not end a text.
  CHECK(parse_event(event_message({"n", "l", R"(a"b\c)", "s", "m"})).device_id == R"(a"b\c)");
  CHECK(parse_command(force_message(InverseFormat::vector, R"(a"b)", {1, 0, 0}), R"(a"b)").force_N);
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

  // A mount is set only where no preset stands for it, its position too.
  s = neutral;
  s.mount_scale = {2.0, 2.0, 2.0};
  CHECK(asked(s).empty());
  s.preset.clear();
  s.mount_position_m = {0.0, 0.1, 0.0};
  s.mount_rotation = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX());
  REQUIRE(asked(s).size() == 1);
  CHECK(asked(s)[0].target == "/inverse3/049D/config/mount?session=%237");
  const Json transform = Json::parse(asked(s)[0].body).at("transform");
  CHECK(transform.at("position") == Json::parse(R"({"x": 0, "y": 0, "z": 0})"));
  CHECK(transform.at("rotation") == Json::parse(R"({"w": 1, "x": 0, "y": 0, "z": 0})"));
  CHECK(transform.at("scale") == Json::parse(R"({"x": 1, "y": 1, "z": 1})"));

  // Before 3.5 no setting of a session can be set over HTTP.
  s.damping = s.force_gate_gain = 0.3;
  s.basis = "XZY";
  CHECK(asked(s).size() == 4);
  CHECK(asked(s, InverseFormat::values).empty());

  // Another preset is replaced. The weight that is carried is a setting of the device, in each
  // version.
  s = neutral;
  s.preset = "defaults";
  REQUIRE(asked(s).size() == 1);
  CHECK(asked(s)[0].target == "/inverse3/049D/config/preset?session=%237");
  CHECK(Json::parse(asked(s)[0].body) == Json::parse(R"({"preset": "arm_front_centered"})"));
  s = neutral;
  s.gravity_scaling = 0.8;
  REQUIRE(asked(s).size() == 1);
  CHECK(asked(s)[0].target == "/inverse3/049D/config/gravity_compensation");
  CHECK(Json::parse(asked(s)[0].body) == Json::parse(R"({"enabled": true, "scaling_factor": 1})"));
  REQUIRE(asked(s, InverseFormat::values).size() == 1);
  CHECK(asked(s, InverseFormat::values)[0].target == "/gravity_compensation");
  CHECK(Json::parse(asked(s, InverseFormat::values)[0].body) ==
        Json::parse(R"({"device_id": "049D", "enable": true, "gravity_scaling_factor": 1})"));
  const std::vector<InverseRequest> off =
      neutral_requests(InverseFormat::values, "049D", 7, s, 0.0);
  REQUIRE(off.size() == 1);
  CHECK(Json::parse(off[0].body).at("enable") == false);
  s.gravity_named = false;  // nothing to set
  CHECK(asked(s).empty());
  const Json probe = Json::parse(probe_message("049D")).at("inverse3").at(0);
  CHECK(probe.at("device_id") == "049D");
  CHECK(probe.at("commands") == Json::parse(R"({"probe_position": {}})"));
}

}  // namespace
}  // namespace tpm::haptics
