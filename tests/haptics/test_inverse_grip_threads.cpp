// tpm hil serve: the simulated grip and the status of the device, as clients of the Inverse service
// look for them in the first message.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <memory>
#include <thread>

#include "grip_presses.hpp"
#include "inverse_clients.hpp"
#include "tpm/files/json.hpp"
#include "tpm/haptics/serve/simulated_hand.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::WithinAbs;
using namespace std::chrono_literals;
using files::Json;

/// A simulated hand without a loop: the test moves its time.
struct ServedGrip {
  ServedGrip() {
    (void)hand.open();
    hand.prepare({});
    hand.enable_forces();
    InverseServerSettings settings;
    settings.device.id = "SIMULATED";
    settings.device.simulated = true;
    settings.device.settings.handedness = "right";
    server = std::make_unique<InverseServer>(hand, std::move(settings));
  }
  [[nodiscard]] std::unique_ptr<WebSocketClient> client(Json* first = nullptr) const {
    std::string text;
    auto one = test::client_of(*server, &text);
    if (first != nullptr) *first = Json::parse(text);
    return one;
  }

  SimulatedHand hand{SimulatedHandSettings{}};
  std::unique_ptr<InverseServer> server;  ///< ends first
};

InverseState grip_after(WebSocketClient& client, const std::string& message) {
  return parse_state(test::answer_to(client, message), "SIMULATED");
}

TEST_CASE("The first message has a device that is ready and a grip, both of them simulated") {
  const ServedGrip served;
  Json first;
  const auto client = served.client(&first);
  const Json status = first.at("inverse3").at(0).at("status");
  for (const char* name : {"calibrated", "ready", "power_supply", "started"}) {
    CAPTURE(name);
    CHECK(status.at(name) == true);
  }
  CHECK(status.at("in_use") == false);
  CHECK(status.at("simulated_device") == "SIMULATED DEVICE");
  const Json grip = first.at("wireless_verse_grip").at(0);
  CHECK(grip.at("device_id") == "SIMULATED_GRIP");
  CHECK(grip.at("status").at("simulated_device") == "SIMULATED DEVICE");
  CHECK(grip.at("state").at("orientation").size() == 4);
  CHECK(grip.at("state").at("buttons") == Json::parse(R"({"a": false, "b": false, "c": false})"));
  // Each later message has them, too.
  const Json later = Json::parse(
      test::answer_to(*client, force_message(InverseFormat::values, "SIMULATED", {1, 0, 0})));
  CHECK(later.at("wireless_verse_grip").at(0).at("state").contains("orientation"));
  CHECK(later.at("inverse3").at(0).at("status").at("in_use") == true);
}

TEST_CASE("Buttons of the simulated grip are those that a client presses, until it leaves") {
  const ServedGrip served;
  const auto reader = served.client();
  auto presser = served.client();
  CHECK(grip_after(*presser, test::press_message(0b101U)).buttons == 0b101U);
  CHECK(grip_after(*reader, "{}").buttons == 0b101U);
  CHECK(grip_after(*presser, test::press_message(0b010U)).buttons == 0b010U);
  presser.reset();
  std::uint32_t buttons = 0b010U;
  for (int i = 0; i < 6000 && buttons != 0; ++i) {
    buttons = grip_after(*reader, "{}").buttons;
    std::this_thread::sleep_for(10ms);
  }
  CHECK(buttons == 0);
}

TEST_CASE("The simulated grip leans with the hand") {
  ServedGrip served;
  const auto client = served.client();
  CHECK(grip_after(*client, neutral_message("SIMULATED", "test")).grip.w() == 1.0);
  (void)grip_after(*client, R"({"inverse3":[{"device_id":"SIMULATED","commands":{)"
                            R"("set_cursor_position":{"position":{"x":0.02,"y":0,"z":0}}}}]})");
  for (int ms = 0; ms < 2000; ++ms) served.hand.advance(1e-3);
  const InverseState state = grip_after(*client, "{}");
  CHECK_THAT(state.position_m.x(), WithinAbs(0.02, 1e-3));
  const Eigen::Quaterniond leaning(Eigen::AngleAxisd(
      SimulatedHand::kLean_rad_per_m * state.position_m.x(), Eigen::Vector3d::UnitY()));
  CHECK_THAT(state.grip.angularDistance(leaning), WithinAbs(0.0, 1e-6));
}

}  // namespace
}  // namespace tpm::haptics
