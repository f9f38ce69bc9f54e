// tpm hil serve: settings that a client asks for and that this device does not have stay, and the
// log says so once.
#include <fmt/format.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "inverse_clients.hpp"
#include "tpm/haptics/serve/simulated_hand.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;

TEST_CASE("A setting that tpm hil serve does not have stays, with one line for each kind") {
  SimulatedHand hand{SimulatedHandSettings{}};
  std::mutex mutex;
  std::vector<std::string> lines;
  InverseServerSettings settings;
  settings.device.id = "SIMULATED";
  settings.device.simulated = true;
  settings.device.settings.handedness = "right";
  settings.device.settings.preset = "defaults";
  settings.device.settings.filters_named = settings.device.settings.damping_named = true;
  settings.log = [&](const std::string& line) {
    const std::lock_guard<std::mutex> lock(mutex);
    lines.push_back(line);
  };
  const InverseServer server(hand, std::move(settings));
  const auto client = test::client_of(server);
  const auto now = [&server] {
    return parse_inventory(http_exchange(server.port(), "/devices?session=%231", "", test::kSoon_s))
        .devices.at(0)
        .settings;
  };
  const auto lines_after = [&](const std::string& what) {
    const auto count = [&] {
      const std::lock_guard<std::mutex> lock(mutex);
      return lines.size();
    };
    const std::size_t before = count();
    for (int i = 0; i < 3; ++i) {
      (void)test::answer_to(*client, R"({"inverse3":[{"device_id":"SIMULATED",)" + what + "}]}");
    }
    const std::lock_guard<std::mutex> lock(mutex);
    return std::vector<std::string>(lines.begin() + static_cast<std::ptrdiff_t>(before),
                                    lines.end());
  };
  const auto position = [&](const std::string& message) {
    return parse_state(test::answer_to(*client, message), "SIMULATED").position_m;
  };

  const Eigen::Vector3d device_m = position("{}");
  const Eigen::Vector3d centred_m = position(neutral_message("SIMULATED", "test"));
  REQUIRE((device_m - centred_m).norm() > 0.1);
  {
    const std::lock_guard<std::mutex> lock(mutex);
    lines.clear();
  }
  const std::vector<Remark> before = now().lines();
  struct Case {
    const char* asked;
    const char* said;
  };
  for (const Case& c :
       {Case{R"("configure":{"preset":{"preset":"upside_down"}})",
             "client 1: asks for the preset upside_down; it stays arm_front_centered"},
        Case{R"("configure":{"basis":{"permutation":"YXZ"}})",
             "client 1: asks for the basis YXZ; it stays XYZ"},
        Case{R"("configure":{"force_gate":{"gain":0.3}})",
             "client 1: asks for a force gate of 0.3; it stays 0"},
        Case{R"("configure":{"damping":{"scalar":2,"vector":{"x":0,"y":1,"z":0}}})",
             "client 1: asks for a damping of 2, by direction 0 1 0; it stays 0"},
        Case{R"("configure":{"mount":{"position":{"x":1,"y":0,"z":0}}})",
             "client 1: asks for mount, which is not here"},
        Case{R"("commands":{"set_angular_torques":{}})",
             "client 1: asks for set_angular_torques, which is not here"}}) {
    CAPTURE(c.asked);
    const std::vector<std::string> said = lines_after(c.asked);
    REQUIRE(said.size() == 1);
    CHECK(said.front() == c.said);
    CHECK(now().lines() == before);
    CHECK(position("{}") == centred_m);
  }
  // Another name of a preset is no other kind; what is there already is not in vain.
  CHECK(lines_after(R"("configure":{"preset":{"preset":"sideways"}})").empty());
  CHECK(lines_after(R"("configure":{"force_gate":{"gain":0},"damping":{"scalar":0},)"
                    R"("basis":{"permutation":"XYZ"},"preset":{"preset":"defaults"}})")
            .empty());
  CHECK(position("{}") == device_m);
  CHECK(now().preset == "defaults");
}

TEST_CASE("Names that a client invents fill neither the log nor the memory") {
  SimulatedHand hand{SimulatedHandSettings{}};
  std::atomic<int> lines{0};
  InverseServerSettings settings;
  settings.device.id = "SIMULATED";
  settings.device.simulated = true;
  settings.device.settings.handedness = "right";
  settings.log = [&lines](const std::string&) { ++lines; };
  const InverseServer server(hand, std::move(settings));
  const auto client = test::client_of(server);
  for (int i = 0; i < 200; ++i) {
    (void)test::answer_to(
        *client,
        fmt::format(R"({{"inverse3":[{{"device_id":"SIMULATED","configure":{{"name{}":1}}}}]}})",
                    i));
  }
  CHECK(lines <= 20);
  CHECK(lines > 0);
}

}  // namespace
}  // namespace tpm::haptics
