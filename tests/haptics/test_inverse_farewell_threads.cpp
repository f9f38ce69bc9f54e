// How the client of an Inverse service leaves.
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <catch2/catch.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tpm/haptics/inverse/loopback.hpp"

namespace tpm::haptics {
namespace {

using namespace std::chrono_literals;

/// What a service reads of a client that sends a text and closes while a state waits unread.
struct Farewell {
  std::vector<WebSocketMessage> messages;
  ssize_t end = 1;  ///< of recv(): 0 is an orderly end, -1 a reset connection
};

Farewell farewell_of_a_client() {
  const Socket listening = listen_on_loopback(0);
  Farewell seen;
  std::thread service([&] {
    pollfd wanted{listening.handle(), POLLIN, 0};
    (void)::poll(&wanted, 1, 5000);
    const Socket socket = accepted(listening);
    std::string bytes;
    std::array<char, 4096> block;
    const auto receive = [&] {
      pollfd more{socket.handle(), POLLIN, 0};
      (void)::poll(&more, 1, 5000);
      return ::recv(socket.handle(), block.data(), block.size(), 0);
    };
    while (bytes.find("\r\n\r\n") == bytes.npos) {
      const ssize_t count = receive();
      if (count <= 0) return;
      bytes.append(block.data(), static_cast<std::size_t>(count));
    }
    const HttpHead head = *parse_http_head(bytes);
    const auto answer = [&socket](const std::string& sent) {
      (void)::send(socket.handle(), sent.data(), sent.size(), MSG_NOSIGNAL);
    };
    answer(answer_upgrade(head, port_of(listening), {}).bytes);
    std::this_thread::sleep_for(10ms);  // the client takes the handshake alone
    answer(frame_bytes(FrameKind::text, "a state"));
    WebSocketReader reader(WebSocketSide::server, 1000);
    while ((seen.end = receive()) > 0) {
      reader.feed(std::string_view(block.data(), static_cast<std::size_t>(seen.end)));
      while (auto message = reader.next()) seen.messages.push_back(*message);
    }
  });
  WebSocketClient client(port_of(listening), "/", 5.0, 1000);
  std::this_thread::sleep_for(50ms);  // the state has come, and nobody reads it
  (void)client.send("zero force");
  client.close();
  service.join();
  return seen;
}

TEST_CASE("A client that closes loses no message, whatever it has not read") {
  const Farewell seen = farewell_of_a_client();
  CHECK(seen.end == 0);
  REQUIRE(seen.messages.size() == 2);
  CHECK(seen.messages[0].payload == "zero force");
  CHECK(seen.messages[1].kind == FrameKind::close);
}

}  // namespace
}  // namespace tpm::haptics
