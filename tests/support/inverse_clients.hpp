// Clients of tpm hil serve in the tests: they wait for what is sent to them.
#pragma once

#include <catch2/catch.hpp>
#include <memory>
#include <string>

#include "tpm/haptics/serve/inverse_server.hpp"

namespace tpm::test {

constexpr double kSoon_s = 60.0;  // on a machine that is busy, too

/// Settings of a server whose device is simulated and has neutral settings.
inline haptics::InverseServerSettings neutral_server() {
  haptics::InverseServerSettings settings;
  settings.events_port = 0;
  settings.device.id = "SIMULATED";
  settings.device.simulated = true;
  settings.device.settings.handedness = "right";
  settings.device.settings.preset = "defaults";
  settings.device.settings.filters_named = settings.device.settings.damping_named = true;
  settings.device.settings.gravity_named = settings.device.settings.gravity_compensation = true;
  settings.device.settings.gravity_scaling = 1.0;
  return settings;
}

/// @param first what the server sends unasked, if wanted
inline std::unique_ptr<haptics::WebSocketClient> client_of(const haptics::InverseServer& server,
                                                           std::string* first = nullptr) {
  auto client = std::make_unique<haptics::WebSocketClient>(server.port(), "/", kSoon_s,
                                                           haptics::kMostInventoryBytes);
  const auto text = client->receive(kSoon_s);
  REQUIRE(text);
  if (first != nullptr) *first = *text;
  return client;
}

inline std::string answer_to(haptics::WebSocketClient& client, const std::string& message) {
  REQUIRE(client.send(message));
  const auto text = client.receive(kSoon_s);
  REQUIRE(text);
  return *text;
}

}  // namespace tpm::test
