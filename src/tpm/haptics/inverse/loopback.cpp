#include "tpm/haptics/inverse/loopback.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>

#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

using LoopbackClock = std::chrono::steady_clock;

constexpr std::size_t kMostAnswerBytes = 1'048'576;
constexpr const char* kReset = "the connection to the service was reset";

LoopbackClock::time_point after_s(double seconds) {
  return LoopbackClock::now() + std::chrono::duration_cast<LoopbackClock::duration>(
                                    std::chrono::duration<double>(seconds));
}

sockaddr_in loopback_address(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

void set_up(int handle) {
  const int yes = 1;
  (void)::setsockopt(handle, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  (void)::fcntl(handle, F_SETFL, ::fcntl(handle, F_GETFL) | O_NONBLOCK);
}

/// Until the socket can be read or written, or the time is over.
bool ready(int handle, short events, LoopbackClock::time_point until) {
  const auto left =
      std::chrono::duration_cast<std::chrono::nanoseconds>(until - LoopbackClock::now());
  if (left.count() <= 0) return false;
  const timespec time{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
  pollfd wanted{handle, events, 0};
  return ::ppoll(&wanted, 1, &time, nullptr) > 0;
}

bool would_wait() {
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

enum class Sent { all, late, broken };

Sent send_all(int handle, std::string_view bytes, LoopbackClock::time_point until) {
  while (!bytes.empty()) {
    const ssize_t count = ::send(handle, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(count));
    } else if (!would_wait()) {
      return Sent::broken;
    } else if (!ready(handle, POLLOUT, until)) {
      return Sent::late;
    }
  }
  return Sent::all;
}

constexpr ssize_t kNothingYet = -1, kBroken = -2;

/// Appends what is there and returns its size, or one of the two above; 0: the other side is done.
ssize_t append_received(int handle, std::string& bytes) {
  std::array<char, 16'384> block;
  const ssize_t count = ::recv(handle, block.data(), block.size(), 0);
  if (count >= 0) {
    bytes.append(block.data(), static_cast<std::size_t>(count));
    return count;
  }
  return would_wait() ? kNothingYet : kBroken;
}

Error port_fault(int port, std::string_view what) {
  return {ExitCode::environment, fmt::format("port {} of this machine", port), what,
          "a service that is compatible with the Inverse service"};
}

/// Receives until `end` is among the bytes, the other side is done, or the time is over.
std::string received(int handle, std::string_view end, LoopbackClock::time_point until) {
  std::string bytes;
  while (bytes.size() < kMostAnswerBytes) {
    const ssize_t count = append_received(handle, bytes);
    if (count == 0 || count == kBroken) break;
    if (!end.empty() && bytes.find(end) != bytes.npos) break;
    if (count == kNothingYet && !ready(handle, POLLIN, until)) break;
  }
  return bytes;
}

}  // namespace

Socket& Socket::operator=(Socket&& other) noexcept {
  if (this != &other) {
    close();
    handle_ = other.release();
  }
  return *this;
}

void Socket::close() noexcept {
  if (handle_ >= 0) (void)::close(handle_);
  handle_ = -1;
}

int Socket::release() noexcept {
  const int handle = handle_;
  handle_ = -1;
  return handle;
}

Socket connect_to_loopback(int port, double timeout_s) {
  Socket socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!socket.open()) throw port_fault(port, "no socket can be had");
  set_up(socket.handle());
  const sockaddr_in to = loopback_address(port);
  if (::connect(socket.handle(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) {
    return socket;
  }
  int fault = errno;
  if (fault == EINPROGRESS && ready(socket.handle(), POLLOUT, after_s(timeout_s))) {
    socklen_t size = sizeof fault;
    (void)::getsockopt(socket.handle(), SOL_SOCKET, SO_ERROR, &fault, &size);
  }
  if (fault != 0) throw port_fault(port, "nobody answers");
  return socket;
}

Socket listen_on_loopback(int port, std::string_view option) {
  Socket socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const int yes = 1;
  (void)::setsockopt(socket.handle(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const sockaddr_in at = loopback_address(port);
  constexpr int kMostWaiting = 16;
  if (!socket.open() ||
      ::bind(socket.handle(), reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 ||
      ::listen(socket.handle(), kMostWaiting) != 0) {
    throw Error(ExitCode::environment, fmt::format("{} {}", option, port), "the port cannot be had",
                "one that is free, or 0 for any");
  }
  set_up(socket.handle());
  return socket;
}

int port_of(const Socket& listening) {
  sockaddr_in at{};
  socklen_t size = sizeof at;
  (void)::getsockname(listening.handle(), reinterpret_cast<sockaddr*>(&at), &size);
  return ntohs(at.sin_port);
}

Socket accepted(const Socket& listening) {
  Socket socket(::accept4(listening.handle(), nullptr, nullptr, SOCK_CLOEXEC));
  if (socket.open()) set_up(socket.handle());
  return socket;
}

std::string http_exchange(int port, std::string_view target, std::string_view body,
                          double timeout_s) {
  const auto until = after_s(timeout_s);
  const Socket socket = connect_to_loopback(port, timeout_s);
  const std::string request =
      body.empty()
          ? fmt::format("GET {} HTTP/1.1\r\nHost: localhost:{}\r\nConnection: close\r\n\r\n",
                        target, port)
          : fmt::format(
                "POST {} HTTP/1.1\r\nHost: localhost:{}\r\nConnection: close\r\n"
                "Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{}",
                target, port, body.size(), body);
  if (send_all(socket.handle(), request, until) != Sent::all) {
    throw port_fault(port, "does not read");
  }
  const std::string answer = received(socket.handle(), "", until);
  const std::optional<HttpHead> head = parse_http_head(answer);
  if (!head || head->start[1] != "200") {
    throw port_fault(port, fmt::format("answers {} with '{}'", target,
                                       printable(head ? head->start[1] : answer)));
  }
  std::string said = answer.substr(answer.find("\r\n\r\n") + 4);
  if (!head->lists("transfer-encoding", "chunked")) return said;
  if (const std::optional<std::string> whole = unchunked(said)) return *whole;
  throw port_fault(port, fmt::format("answers {} with a part of its chunks", target));
}

WebSocketClient::WebSocketClient(int port, std::string_view target, double timeout_s,
                                 std::size_t most_bytes)
    : socket_(connect_to_loopback(port, timeout_s)), reader_(WebSocketSide::client, most_bytes) {
  const auto until = after_s(timeout_s);
  const std::string key = fresh_web_socket_key();
  if (send_all(socket_.handle(), upgrade_request(port, target, key), until) != Sent::all) {
    throw port_fault(port, "does not read");
  }
  const std::string answer = received(socket_.handle(), "\r\n\r\n", until);
  const std::optional<HttpHead> head = parse_http_head(answer);
  const std::string fault = head ? upgrade_fault(*head, key) : "it answers no HTTP";
  if (!fault.empty()) throw port_fault(port, "no WebSocket: " + fault);
  reader_.feed(std::string_view(answer).substr(answer.find("\r\n\r\n") + 4));
}

bool WebSocketClient::send_frame(FrameKind kind, std::string_view payload,
                                 double timeout_s) noexcept {
  try {
    if (!over_.empty()) return false;
    switch (
        send_all(socket_.handle(), frame_bytes(kind, payload, fresh_mask()), after_s(timeout_s))) {
      case Sent::all:
        return true;
      case Sent::late:
        over_ = "the service does not read";
        break;
      case Sent::broken:
        learn_end();
        break;
    }
  } catch (const std::exception& error) {
    over_ = error.what();
  }
  return false;
}

/// Of a connection that takes nothing more: a close frame may have come before it broke.
void WebSocketClient::learn_end() {
  std::string bytes;
  while (append_received(socket_.handle(), bytes) > 0) {
  }
  reader_.feed(bytes);
  while (const std::optional<WebSocketMessage> message = reader_.next()) {
    if (message->kind == FrameKind::close) take_close(*message);
  }
  if (over_.empty()) over_ = kReset;
}

void WebSocketClient::take_close(const WebSocketMessage& message) {
  constexpr std::size_t kMostReason = 24;  // the words of a fault have 63 characters
  close_code_ = message.close_code;
  const std::string reason = message.payload.empty()
                                 ? std::string(words_of_close(message.close_code))
                                 : printable(message.payload, kMostReason);
  over_ = fmt::format("the service closed with {} ({})", message.close_code, reason);
}

bool WebSocketClient::send(std::string_view text, double timeout_s) noexcept {
  return send_frame(FrameKind::text, text, timeout_s);
}

std::optional<std::string> WebSocketClient::next_text() {
  constexpr double kControl_s = 0.1;
  while (std::optional<WebSocketMessage> message = reader_.next()) {
    switch (message->kind) {
      case FrameKind::text:
        return std::move(message->payload);
      case FrameKind::ping:
        (void)send_frame(FrameKind::pong, message->payload, kControl_s);
        break;
      case FrameKind::close:
        (void)send_frame(FrameKind::close, close_payload(kCloseNormal, ""), kControl_s);
        take_close(*message);  // whether or not it took the answer
        return std::nullopt;
      default:
        break;
    }
  }
  if (reader_.fault() != 0 && over_.empty()) {
    (void)send_frame(FrameKind::close, close_payload(reader_.fault(), reader_.fault_words()),
                     kControl_s);
    over_ = std::string("the service broke the protocol: ") + reader_.fault_words();
  }
  return std::nullopt;
}

std::optional<std::string> WebSocketClient::receive(double timeout_s, bool poll) {
  const auto until = after_s(timeout_s);
  std::string bytes;
  while (over_.empty()) {
    if (std::optional<std::string> text = next_text()) return text;
    if (!over_.empty()) break;
    bytes.clear();
    const ssize_t count = append_received(socket_.handle(), bytes);
    if (count > 0) {
      reader_.feed(bytes);
    } else if (count == 0) {
      over_ = "the service is gone, without a close frame";
    } else if (count == kBroken) {
      over_ = kReset;
    } else if (poll ? LoopbackClock::now() >= until : !ready(socket_.handle(), POLLIN, until)) {
      break;
    }
  }
  return std::nullopt;
}

void WebSocketClient::close() noexcept {
  constexpr double kFarewell_s = 0.02;
  if (send_frame(FrameKind::close, close_payload(kCloseNormal, ""), 0.01)) {
    // Closing a socket with unread bytes resets the connection; the service could then lose the
    // last messages, a zero force among them.
    (void)::shutdown(socket_.handle(), SHUT_WR);
    std::array<char, 4096> unread;
    for (const auto until = after_s(kFarewell_s); LoopbackClock::now() < until;) {
      const ssize_t count = ::recv(socket_.handle(), unread.data(), unread.size(), 0);
      if (count == 0 || (count < 0 && !would_wait())) break;
      if (count < 0 && !ready(socket_.handle(), POLLIN, until)) break;
    }
  }
  socket_.close();
  if (over_.empty()) over_ = "closed";
}

}  // namespace tpm::haptics
