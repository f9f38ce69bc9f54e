#include "tpm/haptics/inverse/web_socket.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <sys/random.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr std::uint8_t kFinal = 0x80, kReserved = 0x70, kOpcode = 0x0F, kMasked = 0x80;
constexpr std::uint8_t kLength16 = 126, kLength64 = 127;
constexpr std::size_t kMostControlBytes = 125;
constexpr std::uint16_t kCloseNone = 1005;  // never sent: the frame has no code
constexpr std::string_view kGuid = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
constexpr std::size_t kKeyCharacters = 24;  // 16 bytes in base64

std::uint8_t byte_at(const std::string& bytes, std::size_t place) {
  return static_cast<std::uint8_t>(bytes[place]);
}

void apply_mask(std::string& payload, const FrameMask& mask) {
  for (std::size_t i = 0; i < payload.size(); ++i) {
    payload[i] = static_cast<char>(byte_at(payload, i) ^ mask[i % mask.size()]);
  }
}

bool is_control(FrameKind kind) {
  return (static_cast<std::uint8_t>(kind) & 0x8U) != 0;
}

/// Codes that may stand in a close frame.
bool may_be_sent(std::uint16_t code) {
  return (code >= 1000 && code <= 1003) || (code >= 1007 && code <= 1014) ||
         (code >= 3000 && code <= 4999);
}

std::string lower(std::string_view text) {
  std::string all(text);
  std::ranges::transform(all, all.begin(), [](unsigned char c) { return std::tolower(c); });
  return all;
}

template <std::size_t N>
std::string base64(const std::array<std::uint8_t, N>& bytes) {
  std::array<unsigned char, 4 * ((N + 2) / 3) + 1> text{};
  const int size = EVP_EncodeBlock(text.data(), bytes.data(), static_cast<int>(N));
  return {reinterpret_cast<const char*>(text.data()), static_cast<std::size_t>(size)};
}

void fill_random(std::uint8_t* bytes, std::size_t size) {
  if (::getrandom(bytes, size, 0) == static_cast<ssize_t>(size)) return;
  throw Error(ExitCode::environment, "random numbers", "the system gives none", "getrandom()");
}

/// 16 bytes in base64, as a client sends them.
bool is_key(std::string_view key) {
  const auto known = [](unsigned char c) { return std::isalnum(c) != 0 || c == '+' || c == '/'; };
  return key.size() == kKeyCharacters && key.ends_with("==") &&
         std::ranges::all_of(key.substr(0, kKeyCharacters - 2), known);
}

/// Length of a sequence of UTF-8 and the range of its second byte (RFC 3629, 4); 0: none begins so.
struct Utf8Sequence {
  std::size_t bytes;
  std::uint8_t least, most;
};

Utf8Sequence sequence_of(std::uint8_t first) {
  if (first < 0x80) return {1, 0, 0};
  if (first < 0xC2) return {0, 0, 0};
  if (first < 0xE0) return {2, 0x80, 0xBF};
  if (first == 0xE0) return {3, 0xA0, 0xBF};
  if (first == 0xED) return {3, 0x80, 0x9F};  // no halves of surrogate pairs
  if (first < 0xF0) return {3, 0x80, 0xBF};
  if (first == 0xF0) return {4, 0x90, 0xBF};
  if (first < 0xF4) return {4, 0x80, 0xBF};
  if (first == 0xF4) return {4, 0x80, 0x8F};
  return {0, 0, 0};
}

}  // namespace

std::string frame_bytes(FrameKind kind, std::string_view payload,
                        const std::optional<FrameMask>& mask, bool final_frame) {
  std::string bytes;
  bytes.reserve(payload.size() + 14);
  bytes.push_back(static_cast<char>((final_frame ? kFinal : 0) | static_cast<std::uint8_t>(kind)));
  const std::uint8_t masked = mask ? kMasked : 0;
  const auto size = static_cast<std::uint64_t>(payload.size());
  int length_bytes = 0;
  if (size < kLength16) {
    bytes.push_back(static_cast<char>(masked | size));
  } else if (size <= 0xFFFF) {
    bytes.push_back(static_cast<char>(masked | kLength16));
    length_bytes = 2;
  } else {
    bytes.push_back(static_cast<char>(masked | kLength64));
    length_bytes = 8;
  }
  for (int i = length_bytes - 1; i >= 0; --i) {
    bytes.push_back(static_cast<char>((size >> (8 * i)) & 0xFF));
  }
  if (!mask) return bytes.append(payload);
  for (const std::uint8_t byte : *mask) bytes.push_back(static_cast<char>(byte));
  std::string covered(payload);
  apply_mask(covered, *mask);
  return bytes.append(covered);
}

std::string close_payload(std::uint16_t code, std::string_view reason) {
  std::string payload{static_cast<char>(code >> 8U), static_cast<char>(code & 0xFFU)};
  return payload.append(reason.substr(0, kMostControlBytes - 2));
}

std::string_view words_of_close(std::uint16_t code) noexcept {
  switch (code) {
    case kCloseNormal:
      return "normal";
    case kCloseGoingAway:
      return "going away";
    case kCloseProtocolError:
      return "protocol error";
    case 1003:
      return "unsupported data";
    case kCloseBadText:
      return "text that is not UTF-8";
    case kClosePolicy:
      return "policy";
    case kCloseTooBig:
      return "message too big";
    case 1010:
      return "an extension is missing";
    case 1011:
      return "internal error";
    default:
      return "no reason";
  }
}

FrameMask fresh_mask() {
  FrameMask mask{};
  fill_random(mask.data(), mask.size());
  return mask;
}

bool is_utf8(std::string_view text) noexcept {
  for (std::size_t i = 0; i < text.size();) {
    const Utf8Sequence sequence = sequence_of(static_cast<std::uint8_t>(text[i]));
    if (sequence.bytes == 0 || text.size() - i < sequence.bytes) return false;
    for (std::size_t k = 1; k < sequence.bytes; ++k) {
      const auto byte = static_cast<std::uint8_t>(text[i + k]);
      const bool in_range =
          k == 1 ? byte >= sequence.least && byte <= sequence.most : byte >= 0x80 && byte <= 0xBF;
      if (!in_range) return false;
    }
    i += sequence.bytes;
  }
  return true;
}

void WebSocketReader::fail(std::uint16_t code, const char* words) noexcept {
  fault_ = code;
  words_ = words;
  buffer_.clear();
  message_.clear();
  begin_ = 0;
}

bool WebSocketReader::allowed(const Header& h, std::uint8_t first, bool masked) {
  const std::uint8_t opcode = first & kOpcode;
  if ((first & kReserved) != 0) {
    fail(kCloseProtocolError, "reserved bits are set");
  } else if ((opcode > 2 && opcode < 8) || opcode > 10) {
    fail(kCloseProtocolError, "unknown opcode");
  } else if (masked != masked_) {
    fail(kCloseProtocolError, masked_ ? "a frame is not masked" : "a frame is masked");
  } else if (is_control(h.kind) && (!h.final_frame || h.size > kMostControlBytes)) {
    fail(kCloseProtocolError, "a control frame is fragmented or too long");
  } else if (h.kind == FrameKind::continuation && !open_) {
    fail(kCloseProtocolError, "a fragment continues nothing");
  } else if (!is_control(h.kind) && h.kind != FrameKind::continuation && open_) {
    fail(kCloseProtocolError, "a message begins within another");
  } else if (!is_control(h.kind) && h.size > most_bytes_ - message_.size()) {
    fail(kCloseTooBig, "the message is too big");
  } else {
    return true;
  }
  return false;
}

/// Of the next frame, once all of it is there; a length that is refused needs no payload.
std::optional<WebSocketReader::Header> WebSocketReader::header() {
  const std::size_t there = buffer_.size() - begin_;
  if (there < 2) return std::nullopt;
  const std::uint8_t first = byte_at(buffer_, begin_), second = byte_at(buffer_, begin_ + 1);
  Header h;
  h.final_frame = (first & kFinal) != 0;
  h.kind = static_cast<FrameKind>(first & kOpcode);
  const bool masked = (second & kMasked) != 0;
  std::uint64_t size = second & ~kMasked;
  std::size_t place = 2;
  const std::size_t length_bytes = size == kLength16 ? 2 : size == kLength64 ? 8 : 0;
  if (length_bytes > 0) {
    if (there < 2 + length_bytes) return std::nullopt;
    size = 0;
    for (; place < 2 + length_bytes; ++place)
      size = (size << 8U) | byte_at(buffer_, begin_ + place);
    if ((size >> 63U) != 0) {
      fail(kCloseProtocolError, "the highest bit of a length is set");
      return std::nullopt;
    }
    if (size < (length_bytes == 2 ? std::uint64_t{kLength16} : std::uint64_t{0x10000})) {
      fail(kCloseProtocolError, "a length is not written as short as it can be");
      return std::nullopt;
    }
  }
  h.size = size;
  if (!allowed(h, first, masked)) return std::nullopt;
  if (masked) {
    if (there < place + h.mask.size()) return std::nullopt;
    for (std::uint8_t& byte : h.mask) byte = byte_at(buffer_, begin_ + place++);
  }
  h.header_bytes = place;
  if (there - place < h.size) return std::nullopt;
  return h;
}

std::optional<WebSocketMessage> WebSocketReader::control(FrameKind kind, std::string payload) {
  WebSocketMessage message{kind, std::move(payload), 0};
  if (kind != FrameKind::close) return message;
  closed_ = true;
  message.close_code = kCloseNone;
  if (message.payload.empty()) return message;
  const std::uint16_t code = message.payload.size() < 2
                                 ? std::uint16_t{0}
                                 : static_cast<std::uint16_t>(byte_at(message.payload, 0) << 8U |
                                                              byte_at(message.payload, 1));
  if (!may_be_sent(code)) {
    fail(kCloseProtocolError, "a close frame has no valid code");
    return std::nullopt;
  }
  message.close_code = code;
  message.payload.erase(0, 2);
  if (is_utf8(message.payload)) return message;
  fail(kCloseBadText, "a reason is not UTF-8");
  return std::nullopt;
}

std::optional<WebSocketMessage> WebSocketReader::data(const Header& h, std::string_view payload) {
  if (h.kind != FrameKind::continuation) open_ = h.kind;
  message_.append(payload);
  if (!h.final_frame) return std::nullopt;
  const FrameKind kind = *open_;
  open_.reset();
  WebSocketMessage message{kind, std::move(message_), 0};
  message_.clear();
  if (kind != FrameKind::text || is_utf8(message.payload)) return message;
  fail(kCloseBadText, "a text is not UTF-8");
  return std::nullopt;
}

std::optional<WebSocketMessage> WebSocketReader::next() {
  while (fault_ == 0 && !closed_) {
    const std::optional<Header> h = header();
    if (!h) break;
    std::string payload = buffer_.substr(begin_ + h->header_bytes, h->size);
    begin_ += h->header_bytes + h->size;
    if (masked_) apply_mask(payload, h->mask);
    std::optional<WebSocketMessage> message =
        is_control(h->kind) ? control(h->kind, std::move(payload)) : data(*h, payload);
    if (message) return message;
  }
  buffer_.erase(0, begin_);
  begin_ = 0;
  return std::nullopt;
}

std::size_t HttpHead::count(std::string_view name) const {
  return static_cast<std::size_t>(
      std::ranges::count_if(fields, [name](const auto& field) { return field.first == name; }));
}

std::string HttpHead::value(std::string_view name) const {
  const auto found =
      std::ranges::find_if(fields, [name](const auto& field) { return field.first == name; });
  return found == fields.end() ? std::string() : found->second;
}

bool HttpHead::lists(std::string_view name, std::string_view word) const {
  for (const auto& [field, text] : fields) {
    if (field != name) continue;
    std::string_view left = text;
    while (!left.empty()) {
      const std::size_t comma = std::min(left.find(','), left.size());
      if (lower(trimmed(left.substr(0, comma))) == word) return true;
      left.remove_prefix(std::min(comma + 1, left.size()));
    }
  }
  return false;
}

std::optional<HttpHead> parse_http_head(std::string_view bytes) {
  const std::size_t end = bytes.find("\r\n\r\n");
  if (end == std::string_view::npos || end > kMostHeadBytes) return std::nullopt;
  std::string_view left = bytes.substr(0, end + 2);
  HttpHead head;
  for (bool first = true; !left.empty(); first = false) {
    const std::size_t line_end = left.find("\r\n");
    const std::string_view line = left.substr(0, line_end);
    left.remove_prefix(line_end + 2);
    const auto odd = [](unsigned char c) { return (c < 0x20 && c != '\t') || c == 0x7F; };
    if (std::ranges::any_of(line, odd)) return std::nullopt;
    if (first) {
      const std::size_t one = line.find(' ');
      const std::size_t two = one == line.npos ? one : line.find(' ', one + 1);
      if (one == line.npos || two == line.npos) return std::nullopt;
      head.start = {std::string(line.substr(0, one)),
                    std::string(line.substr(one + 1, two - one - 1)),
                    std::string(line.substr(two + 1))};
      continue;
    }
    const std::size_t colon = line.find(':');
    const std::string_view name = line.substr(0, colon);
    if (colon == line.npos || name.empty() || name.find_first_of(" \t") != name.npos) {
      return std::nullopt;
    }
    head.fields.emplace_back(lower(name), std::string(trimmed(line.substr(colon + 1))));
  }
  return head;
}

std::optional<std::string> unchunked(std::string_view body) {
  std::string whole;
  while (true) {
    const std::size_t line_end = body.find("\r\n");
    if (line_end == body.npos) return std::nullopt;
    std::size_t size = 0;
    const auto [end, fault] = std::from_chars(body.data(), body.data() + line_end, size, 16);
    // Behind the size there may be an extension, after ';'.
    const bool read = fault == std::errc{} && (end == body.data() + line_end || *end == ';');
    if (!read) return std::nullopt;
    body.remove_prefix(line_end + 2);
    if (size == 0) return whole;
    if (size > body.size() || body.substr(size, 2) != "\r\n") return std::nullopt;
    whole.append(body.substr(0, size));
    body.remove_prefix(size + 2);
  }
}

std::string web_socket_accept(std::string_view key) {
  const std::string text = std::string(key).append(kGuid);
  std::array<std::uint8_t, 20> digest{};
  if (EVP_Digest(text.data(), text.size(), digest.data(), nullptr, EVP_sha1(), nullptr) != 1) {
    throw Error(ExitCode::environment, "SHA-1", "is not offered by OpenSSL", "a library that does");
  }
  return base64(digest);
}

std::string fresh_web_socket_key() {
  std::array<std::uint8_t, 16> bytes{};
  fill_random(bytes.data(), bytes.size());
  return base64(bytes);
}

std::string upgrade_request(int port, std::string_view target, std::string_view key) {
  return fmt::format(
      "GET {} HTTP/1.1\r\nHost: localhost:{}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Key: {}\r\nSec-WebSocket-Version: 13\r\n\r\n",
      target, port, key);
}

std::string upgrade_fault(const HttpHead& answer, std::string_view key) {
  if (!answer.start[0].starts_with("HTTP/1.1") || answer.start[1] != "101") {
    return fmt::format("it answers '{}' in place of an upgrade", printable(answer.start[1]));
  }
  if (!answer.lists("upgrade", "websocket") || !answer.lists("connection", "upgrade")) {
    return "its answer does not upgrade the connection";
  }
  if (answer.value("sec-websocket-accept") != web_socket_accept(key)) {
    return "its Sec-WebSocket-Accept is not that of the key";
  }
  if (answer.count("sec-websocket-extensions") + answer.count("sec-websocket-protocol") > 0) {
    return "it chose an extension or a protocol that nobody offered";
  }
  return {};
}

std::string http_answer(std::string_view status, std::string_view type, std::string_view body,
                        std::string_view more_fields) {
  return fmt::format(
      "HTTP/1.1 {}\r\nConnection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: "
      "nosniff\r\n{}Content-Type: {}\r\nContent-Length: {}\r\n\r\n{}",
      status, more_fields, type, body.size(), body);
}

bool is_origin_of(std::string_view origin, int port) {
  return origin == fmt::format("http://127.0.0.1:{}", port) ||
         origin == fmt::format("http://localhost:{}", port);
}

bool names_this_host(std::string_view host, int port) {
  const std::size_t colon = host.find(':');
  const std::string name = lower(host.substr(0, colon));
  return (name == "127.0.0.1" || name == "localhost") &&
         (colon == host.npos || host.substr(colon + 1) == std::to_string(port));
}

bool names_this_host(const HttpHead& request, int port) {
  return request.count("host") == 1 && names_this_host(request.value("host"), port);
}

UpgradeAnswer answer_upgrade(const HttpHead& request, int port,
                             const std::vector<int>& page_ports) {
  const auto refused = [](std::string_view status, std::string_view why,
                          std::string_view more = "") {
    return UpgradeAnswer{false, http_answer(status, "text/plain", fmt::format("{}\n", why), more),
                         std::string(why)};
  };
  if (!names_this_host(request, port)) return refused("403 Forbidden", "Host is not this machine");
  if (request.start[0] != "GET" || request.start[2] != "HTTP/1.1") {
    return refused("400 Bad Request", "an upgrade is a GET of HTTP/1.1");
  }
  const std::string origin = request.value("origin");
  const bool own_page =
      std::ranges::any_of(page_ports, [&origin](int page) { return is_origin_of(origin, page); });
  if (request.count("origin") > 1 || (request.count("origin") == 1 && !own_page)) {
    return refused("403 Forbidden", "Origin is a page of somebody else");
  }
  if (!request.lists("upgrade", "websocket") || !request.lists("connection", "upgrade")) {
    return refused("400 Bad Request", "no upgrade to websocket");
  }
  if (request.value("sec-websocket-version") != "13") {
    return refused("426 Upgrade Required", "the version is not 13",
                   "Sec-WebSocket-Version: 13\r\n");
  }
  const std::string key = request.value("sec-websocket-key");
  if (request.count("sec-websocket-key") != 1 || !is_key(key)) {
    return refused("400 Bad Request", "Sec-WebSocket-Key is not one of 16 bytes");
  }
  return {true,
          fmt::format("HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: "
                      "Upgrade\r\nSec-WebSocket-Accept: {}\r\n\r\n",
                      web_socket_accept(key)),
          {}};
}

}  // namespace tpm::haptics
