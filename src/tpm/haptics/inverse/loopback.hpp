#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "tpm/haptics/inverse/web_socket.hpp"

namespace tpm::haptics {

/// A socket, closed at the end of its life.
class Socket {
 public:
  explicit Socket(int handle = -1) noexcept : handle_(handle) {}
  Socket(Socket&& other) noexcept : handle_(other.release()) {}
  Socket& operator=(Socket&& other) noexcept;
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() { close(); }

  [[nodiscard]] int handle() const noexcept { return handle_; }
  [[nodiscard]] bool open() const noexcept { return handle_ >= 0; }
  void close() noexcept;
  int release() noexcept;

 private:
  int handle_;
};

/// A connection to a port of this machine, 127.0.0.1, that does not wait and does not collect small
/// pieces (TCP_NODELAY). Throws Error(environment) with the port.
[[nodiscard]] Socket connect_to_loopback(int port, double timeout_s);
/// Listens on 127.0.0.1 only. @param port 0: one that is free @param option names it in a message
/// Throws Error(environment).
[[nodiscard]] Socket listen_on_loopback(int port, std::string_view option = "--port");
[[nodiscard]] int port_of(const Socket& listening);
/// The next connection, set up as that of connect_to_loopback(); not open if there is none.
[[nodiscard]] Socket accepted(const Socket& listening);

/// Body of an answer with status 200. Throws Error(environment) with port, target and what came.
/// @param body empty: GET, else POST of this JSON
[[nodiscard]] std::string http_exchange(int port, std::string_view target, std::string_view body,
                                        double timeout_s);

/// The client's side of a WebSocket over loopback. One thread uses it.
class WebSocketClient {
 public:
  /// Connects and upgrades. Throws Error(environment).
  WebSocketClient(int port, std::string_view target, double timeout_s, std::size_t most_bytes);

  /// Sends a text. False if the connection is over, or nobody has read for `timeout_s`.
  bool send(std::string_view text, double timeout_s = 0.1) noexcept;
  /// The next text, if one comes within the time; pings are answered on the way.
  /// @param poll looks again and again in place of sleeping
  [[nodiscard]] std::optional<std::string> receive(double timeout_s, bool poll = false);
  /// Why the connection is over; empty: it is not.
  [[nodiscard]] const std::string& over() const noexcept { return over_; }
  /// Of a close frame that came; 0: none.
  [[nodiscard]] std::uint16_t close_code() const noexcept { return close_code_; }
  /// Says goodbye; waits for nobody.
  void close() noexcept;

 private:
  bool send_frame(FrameKind kind, std::string_view payload, double timeout_s) noexcept;
  /// Takes a text from what has been read; handles control frames.
  [[nodiscard]] std::optional<std::string> next_text();
  void learn_end();
  void take_close(const WebSocketMessage& message);

  Socket socket_;
  WebSocketReader reader_;
  std::string over_;
  std::uint16_t close_code_ = 0;
};

}  // namespace tpm::haptics
