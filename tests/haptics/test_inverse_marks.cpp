// What an inventory says of a device beside its settings: that it is simulated, or in use; and what
// a message asks for that nobody reads.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <string>

#include "tpm/haptics/inverse/messages.hpp"

namespace tpm::haptics {
namespace {

/// An inventory of one device with more in its config, its status and its state.
InverseDeviceEntry marked_device(const std::string& config, const std::string& status,
                                 const std::string& state = "") {
  return parse_inventory(fmt::format(R"({{"inverse3": [{{"device_id": "049D",
               "config": {{"handedness": "left"{}}}, "status": {{"ready": true{}}},
               "state": {{"cursor_position": {{"x": 0, "y": 0, "z": 0}}{}}}}}]}})",
                                     config, status, state))
      .devices.at(0);
}

TEST_CASE("A device is simulated if it says so anywhere and nowhere otherwise, else hardware") {
  for (const char* yes : {"true", R"("SIMULATED DEVICE")"}) {
    const std::string mark = fmt::format(R"(, "simulated_device": {})", yes);
    CAPTURE(yes);
    CHECK(marked_device(mark, "").simulated);
    CHECK(marked_device("", mark).simulated);
    CHECK(marked_device("", "", mark).simulated);
    CHECK(marked_device(mark, mark, mark).simulated);
    for (const char* no : {"false", "1", R"("true")", R"("simulated")", R"("")", "[]", "{}"}) {
      const std::string other = fmt::format(R"(, "simulated_device": {})", no);
      CAPTURE(no);
      CHECK_FALSE(marked_device(other, "").simulated);
      CHECK_FALSE(marked_device("", other).simulated);
      CHECK_FALSE(marked_device(mark, other).simulated);
      CHECK_FALSE(marked_device(other, mark).simulated);
      CHECK_FALSE(marked_device(mark, "", other).simulated);
    }
  }
  CHECK_FALSE(marked_device("", "").simulated);
  CHECK(marked_device(R"(, "simulated_device": null)", R"(, "simulated_device": true)").simulated);
}

TEST_CASE("An inventory says whether a device is in use, and what commands it") {
  CHECK_FALSE(marked_device("", "").in_use);
  CHECK(marked_device("", "").control_mode.empty());
  CHECK(marked_device("", R"(, "in_use": true)").in_use);
  for (const char* no : {"false", "1", R"("true")", "null"}) {
    CAPTURE(no);
    CHECK_FALSE(marked_device("", fmt::format(R"(, "in_use": {})", no)).in_use);
  }
  CHECK(marked_device("", "", R"(, "control_mode": "force")").control_mode == "force");
  CHECK(marked_device("", "", R"(, "control_mode": 7)").control_mode.empty());
  // What the server here writes: a device that nobody drives is idle.
  for (const bool driven : {false, true}) {
    InverseInventory all;
    all.devices.resize(1);
    all.devices[0].id = "SIMULATED";
    all.devices[0].simulated = true;
    all.devices[0].settings.handedness = "right";
    all.devices[0].state.driven = driven;
    const InverseDeviceEntry read = parse_inventory(inventory_message(all)).devices.at(0);
    CHECK(read.in_use == driven);
    CHECK(read.control_mode == (driven ? "force" : "idle"));
    CHECK(read.simulated);
  }
}

TEST_CASE("What a message asks for that nobody reads is named, shortened and not without end") {
  const auto unread = [](const std::string& parts) {
    return parse_command(R"({"inverse3": [{"device_id": "a", )" + parts + "}]}", "a").unread;
  };
  CHECK(parse_command(neutral_message("a", "p"), "a").unread.empty());
  CHECK(parse_command(force_message(InverseFormat::values, "a", {1, 0, 0}), "a").unread.empty());
  CHECK(unread(R"("configure": {"mount": {}, "preset": {"preset": "x"}},
                  "commands": {"set_angular_torques": {}, "probe_position": {}})") ==
        std::vector<std::string>{"set_angular_torques", "mount"});
  CHECK(unread(R"("configure": 7, "commands": [])").empty());
  std::string many;
  for (int i = 0; i < 100; ++i) many += fmt::format(R"({}"k{}": 1)", i == 0 ? "" : ",", i);
  CHECK(unread(R"("commands": {)" + many + "}").size() == 16);
  CHECK(unread(R"("commands": {")" + std::string(5000, 'k') + R"(": 1})").at(0).size() < 60);
  // Of another device nothing is read.
  CHECK(parse_command(R"({"inverse3": [{"device_id": "b", "commands": {"x": 1}}]})", "a")
            .unread.empty());
  const InverseCommand set = parse_command(
      R"({"inverse3": [{"device_id": "a", "configure": {"basis": {"permutation": "YXZ"},
          "damping": {"vector": {"x": 0, "y": 2, "z": 0}}}}]})",
      "a");
  CHECK(set.basis == "YXZ");
  CHECK_FALSE(set.damping);
  CHECK(set.directional_damping.y() == 2.0);
}

}  // namespace
}  // namespace tpm::haptics
