#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tpm::haptics {

/// Opcodes of frames (RFC 6455, 5.2).
enum class FrameKind : std::uint8_t {
  continuation = 0,
  text = 1,
  binary = 2,
  close = 8,
  ping = 9,
  pong = 10
};

enum class WebSocketSide { client, server };

/// Status codes of a close frame (RFC 6455, 7.4.1).
inline constexpr std::uint16_t kCloseNormal = 1000, kCloseGoingAway = 1001,
                               kCloseProtocolError = 1002, kCloseBadText = 1007,
                               kClosePolicy = 1008, kCloseTooBig = 1009;

/// Meaning of a status code of RFC 6455; "no reason" for a code that it does not list.
[[nodiscard]] std::string_view words_of_close(std::uint16_t code) noexcept;

using FrameMask = std::array<std::uint8_t, 4>;

/// The bytes of one frame. A client masks each frame, a server none.
[[nodiscard]] std::string frame_bytes(FrameKind kind, std::string_view payload,
                                      const std::optional<FrameMask>& mask = std::nullopt,
                                      bool final_frame = true);
/// Payload of a close frame.
[[nodiscard]] std::string close_payload(std::uint16_t code, std::string_view reason);
/// Four unpredictable bytes of the system's random source.
[[nodiscard]] FrameMask fresh_mask();

[[nodiscard]] bool is_utf8(std::string_view text) noexcept;

/// A whole message, or a control frame.
struct WebSocketMessage {
  FrameKind kind = FrameKind::text;
  std::string payload;           ///< of a close frame its reason
  std::uint16_t close_code = 0;  ///< of a close frame; 1005: it named none
};

/// Takes bytes as they come and returns whole messages. What breaks the protocol is a fault, after
/// which nothing more is read; memory stays below `most_bytes`, a header and what was fed last.
class WebSocketReader {
 public:
  /// @param side of the reader: a server takes masked frames only, a client none that are masked
  /// @param most_bytes of a message
  WebSocketReader(WebSocketSide side, std::size_t most_bytes)
      : masked_(side == WebSocketSide::server), most_bytes_(most_bytes) {}

  void feed(std::string_view bytes) { buffer_.append(bytes); }
  /// The next message, if it is complete. None after a fault or a close frame.
  [[nodiscard]] std::optional<WebSocketMessage> next();
  /// Code that the connection is to be closed with; 0: no fault.
  [[nodiscard]] std::uint16_t fault() const noexcept { return fault_; }
  [[nodiscard]] const char* fault_words() const noexcept { return words_; }
  /// True between the first byte of a message and its last.
  [[nodiscard]] bool amid() const noexcept { return !buffer_.empty() || open_.has_value(); }

 private:
  struct Header {
    bool final_frame = false;
    FrameKind kind = FrameKind::text;
    std::size_t size = 0, header_bytes = 0;
    FrameMask mask{};
  };
  [[nodiscard]] std::optional<Header> header();
  [[nodiscard]] bool allowed(const Header& header, std::uint8_t first, bool masked);
  [[nodiscard]] std::optional<WebSocketMessage> control(FrameKind kind, std::string payload);
  [[nodiscard]] std::optional<WebSocketMessage> data(const Header& header,
                                                     std::string_view payload);
  void fail(std::uint16_t code, const char* words) noexcept;

  bool masked_;
  std::size_t most_bytes_;
  std::string buffer_, message_;
  std::size_t begin_ = 0;          ///< of what has not been read yet
  std::optional<FrameKind> open_;  ///< kind of the message whose fragments are coming
  std::uint16_t fault_ = 0;
  const char* words_ = "";
  bool closed_ = false;
};

/// First line and header fields of a request or an answer. Names are in lower case.
struct HttpHead {
  std::array<std::string, 3> start;  ///< the words of the first line
  std::vector<std::pair<std::string, std::string>> fields;

  [[nodiscard]] std::size_t count(std::string_view name) const;
  [[nodiscard]] std::string value(std::string_view name) const;  ///< of the first; else empty
  /// True if a comma-separated list holds a word, whatever its case.
  [[nodiscard]] bool lists(std::string_view name, std::string_view word) const;
};

/// Largest head that is read.
inline constexpr std::size_t kMostHeadBytes = 8192;

/// A head up to and with its empty line; empty for anything else.
[[nodiscard]] std::optional<HttpHead> parse_http_head(std::string_view bytes);

/// A body that came in chunks (RFC 9112, 7.1), as it was; empty: it is not whole.
[[nodiscard]] std::optional<std::string> unchunked(std::string_view body);

/// Sec-WebSocket-Accept of a key (RFC 6455, 4.2.2).
[[nodiscard]] std::string web_socket_accept(std::string_view key);
/// A key of 16 bytes, in base64.
[[nodiscard]] std::string fresh_web_socket_key();
[[nodiscard]] std::string upgrade_request(int port, std::string_view target, std::string_view key);
/// Empty if the answer upgrades the connection of that key; otherwise what is wrong with it.
[[nodiscard]] std::string upgrade_fault(const HttpHead& answer, std::string_view key);

/// Answer of a server to a request for an upgrade.
struct UpgradeAnswer {
  bool upgraded = false;
  std::string bytes;  ///< a whole answer
  std::string why;    ///< it is refused; else empty
};
/// Upgrades what RFC 6455 4.2.1 asks for. The name in Host is one of this machine's, so that a page
/// whose name was made to point here is refused. A request without Origin is a program; one with an
/// Origin is a page and has to come from this machine and one of these ports.
[[nodiscard]] UpgradeAnswer answer_upgrade(const HttpHead& request, int port,
                                           const std::vector<int>& page_ports);
/// A page of this machine at this port.
[[nodiscard]] bool is_origin_of(std::string_view origin, int port);
/// True if a Host is a name of this machine: 127.0.0.1 or localhost, in any case, with this port or
/// none. One without a port stands for port 80 (RFC 9110, 7.2) and is accepted all the same: the
/// check is there for names that were made to point here, and a browser sends such a Host to port
/// 80 only.
[[nodiscard]] bool names_this_host(std::string_view host, int port);
/// The same of the field of a request, which has to be there once.
[[nodiscard]] bool names_this_host(const HttpHead& request, int port);
/// A whole answer that closes the connection.
[[nodiscard]] std::string http_answer(std::string_view status, std::string_view type,
                                      std::string_view body, std::string_view more_fields = "");

}  // namespace tpm::haptics
