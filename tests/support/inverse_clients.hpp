// Clients of tpm hil serve in the tests: they wait for what is sent to them.
#pragma once

#include <catch2/catch.hpp>
#include <memory>
#include <string>

#include "tpm/haptics/serve/inverse_server.hpp"

namespace tpm::test {

constexpr double kSoon_s = 60.0;  // on a machine that is busy, too

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
