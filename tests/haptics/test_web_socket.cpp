// The WebSocket codec against the examples of RFC 6455, byte by byte, and against what breaks it.
#include <catch2/catch.hpp>
#include <string>

#include "tpm/haptics/inverse/web_socket.hpp"

namespace tpm::haptics {
namespace {

TEST_CASE("A body in chunks is put together, and a part of one is none") {
  CHECK(unchunked("2\r\n{}\r\n0\r\n\r\n") == "{}");
  CHECK(unchunked("3;name=value\r\n[1,\r\nA\r\n0123456789\r\n0\r\n\r\n") == "[1,0123456789");
  CHECK(unchunked("0\r\n\r\n") == "");
  for (const char* part :
       {"", "2\r\n{", "2\r\n{}", "2\r\n{}\r\n", "2\r\n{}xx0\r\n\r\n", "x\r\n", "-1\r\n",
        "ffffffffffffffff\r\n{}\r\n", "fffffffffffffffff\r\n{}\r\n", " 2\r\n{}\r\n0\r\n\r\n"}) {
    CAPTURE(part);
    CHECK_FALSE(unchunked(part));
  }
}

using namespace std::string_literals;

constexpr FrameMask kMask = {0x37, 0xFA, 0x21, 0x3D};  // of the RFC's examples
constexpr std::size_t kMost = 70'000;

/// What a reader makes of bytes that come in pieces of this size.
struct Reading {
  std::vector<WebSocketMessage> messages;
  std::uint16_t fault = 0;
};

Reading reading(WebSocketSide side, const std::string& bytes, std::size_t piece,
                std::size_t most = kMost) {
  WebSocketReader reader(side, most);
  Reading all;
  for (std::size_t i = 0; i < bytes.size(); i += piece) {
    reader.feed(std::string_view(bytes).substr(i, piece));
    while (const auto message = reader.next()) all.messages.push_back(*message);
  }
  all.fault = reader.fault();
  return all;
}

/// The same in one piece and byte by byte.
Reading read_in_pieces(WebSocketSide side, const std::string& bytes, std::size_t most = kMost) {
  const Reading whole = reading(side, bytes, bytes.size(), most);
  const Reading single = reading(side, bytes, 1, most);
  REQUIRE(whole.messages.size() == single.messages.size());
  for (std::size_t i = 0; i < whole.messages.size(); ++i) {
    CHECK(whole.messages[i].kind == single.messages[i].kind);
    CHECK(whole.messages[i].payload == single.messages[i].payload);
  }
  CHECK(whole.fault == single.fault);
  return whole;
}

std::uint16_t fault_of(WebSocketSide side, const std::string& bytes, std::size_t most = kMost) {
  return read_in_pieces(side, bytes, most).fault;
}

TEST_CASE("Frames have the bytes of the examples of RFC 6455, section 5.7") {
  CHECK(frame_bytes(FrameKind::text, "Hello") == "\x81\x05Hello");
  CHECK(frame_bytes(FrameKind::text, "Hello", kMask) ==
        "\x81\x85\x37\xfa\x21\x3d\x7f\x9f\x4d\x51\x58");
  CHECK(frame_bytes(FrameKind::text, "Hel", std::nullopt, false) == "\x01\x03Hel");
  CHECK(frame_bytes(FrameKind::continuation, "lo") == "\x80\x02lo");
  CHECK(frame_bytes(FrameKind::ping, "Hello") == "\x89\x05Hello");
  CHECK(frame_bytes(FrameKind::pong, "Hello", kMask) ==
        "\x8a\x85\x37\xfa\x21\x3d\x7f\x9f\x4d\x51\x58");
  const std::string k256(256, 'x'), k64(65'536, 'y');
  CHECK(frame_bytes(FrameKind::binary, k256) == "\x82\x7e\x01\x00"s + k256);
  CHECK(frame_bytes(FrameKind::binary, k64) == "\x82\x7f\x00\x00\x00\x00\x00\x01\x00\x00"s + k64);
  CHECK(frame_bytes(FrameKind::text, std::string(125, 'a')).size() == 127);
  CHECK(frame_bytes(FrameKind::text, std::string(126, 'a')).size() == 130);
}

TEST_CASE("A reader takes the examples of RFC 6455, whatever the pieces") {
  const auto client = [](const std::string& bytes) {
    return read_in_pieces(WebSocketSide::client, bytes).messages;
  };
  const auto one = client("\x81\x05Hello");
  REQUIRE(one.size() == 1);
  CHECK(one[0].payload == "Hello");
  const auto masked =
      read_in_pieces(WebSocketSide::server, "\x81\x85\x37\xfa\x21\x3d\x7f\x9f\x4d\x51\x58")
          .messages;
  REQUIRE(masked.size() == 1);
  CHECK(masked[0].payload == "Hello");
  // A ping between two fragments comes first.
  const auto pieces = client("\x01\x03Hel\x89\x05Hello\x80\x02lo"s);
  REQUIRE(pieces.size() == 2);
  CHECK(pieces[0].kind == FrameKind::ping);
  CHECK(pieces[1].kind == FrameKind::text);
  CHECK(pieces[1].payload == "Hello");
  for (const std::size_t size : {std::size_t{0}, std::size_t{125}, std::size_t{126},
                                 std::size_t{256}, std::size_t{65'535}, std::size_t{65'536}}) {
    const std::string payload(size, 'z');
    const auto big =
        reading(WebSocketSide::server, frame_bytes(FrameKind::binary, payload, kMask), 1000)
            .messages;
    REQUIRE(big.size() == 1);
    CHECK(big[0].kind == FrameKind::binary);
    CHECK(big[0].payload == payload);
  }
}

TEST_CASE("What breaks RFC 6455 is closed with the code that it names") {
  using enum WebSocketSide;
  CHECK(fault_of(server, "\x81\x05Hello") == kCloseProtocolError);  // not masked
  CHECK(fault_of(client, frame_bytes(FrameKind::text, "a", kMask)) == kCloseProtocolError);
  CHECK(fault_of(client, "\xc1\x01"s + "a") == kCloseProtocolError);  // a reserved bit
  CHECK(fault_of(client, "\x83\x00"s) == kCloseProtocolError);        // opcode 3
  CHECK(fault_of(client, "\x8b\x00"s) == kCloseProtocolError);        // opcode 11
  CHECK(fault_of(client, "\x80\x01"s + "a") == kCloseProtocolError);  // continues nothing
  CHECK(fault_of(client, "\x01\x01"s + "a" + "\x81\x01"s + "b") == kCloseProtocolError);
  CHECK(fault_of(client, "\x09\x00"s) == kCloseProtocolError);  // half a ping
  CHECK(fault_of(client, "\x89\x7e\x00\x7e"s + std::string(126, 'a')) == kCloseProtocolError);
  CHECK(fault_of(client, "\x81\x7e\x00\x05Hello"s) == kCloseProtocolError);  // a long length
  CHECK(fault_of(client, "\x81\x7f\x00\x00\x00\x00\x00\x00\x00\x05Hello"s) == kCloseProtocolError);
  CHECK(fault_of(client, "\x81\x7f\xff\xff\xff\xff\xff\xff\xff\xff"s) == kCloseProtocolError);
  CHECK(fault_of(client, "\x81\x02\xc3\x28"s) == kCloseBadText);
  CHECK(fault_of(client, "\x88\x01"s + "a") == kCloseProtocolError);    // half a code
  CHECK(fault_of(client, "\x88\x02\x03\xed"s) == kCloseProtocolError);  // 1005 is never sent
  CHECK(fault_of(client, "\x88\x03\x03\xe8\xff"s) == kCloseBadText);
  // Half a character at the end of a fragment is none at the end of the message.
  CHECK(fault_of(client, "\x01\x01\xc3\x80\x01\xa9"s) == 0);
  CHECK(fault_of(client, "\x01\x01\xc3\x80\x01\x28"s) == kCloseBadText);
}

TEST_CASE("A message that is too big is refused by its header, in one piece or in fragments") {
  using enum WebSocketSide;
  const std::string header = "\x81\xfe\x03\xe9"s;  // 1001 bytes, of which none has come
  CHECK(fault_of(server, header, 1000) == kCloseTooBig);
  CHECK(fault_of(server, "\x81\xff\x00\x00\x00\x00\x00\x2d\xc6\xc0"s, 65'536) == kCloseTooBig);
  const std::string six(600, 'a');
  CHECK(fault_of(server,
                 frame_bytes(FrameKind::text, six, kMask, false) +
                     frame_bytes(FrameKind::continuation, six, kMask),
                 1000) == kCloseTooBig);
  CHECK(fault_of(server, frame_bytes(FrameKind::text, std::string(1000, 'a'), kMask), 1000) == 0);
}

TEST_CASE("A close frame gives its code and reason, and ends the reading") {
  const Reading all = read_in_pieces(
      WebSocketSide::client,
      frame_bytes(FrameKind::close, close_payload(kCloseTooBig, "too big")) + "\x81\x01"s + "a");
  REQUIRE(all.messages.size() == 1);
  CHECK(all.messages[0].kind == FrameKind::close);
  CHECK(all.messages[0].close_code == kCloseTooBig);
  CHECK(all.messages[0].payload == "too big");
  CHECK(read_in_pieces(WebSocketSide::client, "\x88\x00"s).messages[0].close_code == 1005);
  CHECK(close_payload(kCloseNormal, std::string(300, 'a')).size() == 125);
}

TEST_CASE("Text is UTF-8 by RFC 3629") {
  for (const char* good : {"", "a", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x98\x80", "\xed\x9f\xbf",
                           "\xf4\x8f\xbf\xbf"}) {
    CHECK(is_utf8(good));
  }
  for (const char* bad :
       {"\x80", "\xc0\x80", "\xc1\xbf", "\xe0\x80\x80", "\xed\xa0\x80", "\xc3", "\xe2\x82",
        "\xf0\x80\x80\x80", "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xff", "\xc3\xa9\xbf"}) {
    CHECK_FALSE(is_utf8(bad));
  }
}

/// A request of a client, with fields changed or left out.
HttpHead request(const std::string& name = "", const std::optional<std::string>& value = "") {
  HttpHead head = *parse_http_head(upgrade_request(4711, "/", "dGhlIHNhbXBsZSBub25jZQ=="));
  if (name.empty()) return head;
  std::erase_if(head.fields, [&](const auto& field) { return field.first == name; });
  if (value) head.fields.emplace_back(name, *value);
  return head;
}

std::string status_of(const HttpHead& head) {
  return answer_upgrade(head, 4711, {4711, 8080}).bytes.substr(9, 3);
}

TEST_CASE("The handshake is that of RFC 6455, sections 1.3 and 4") {
  CHECK(web_socket_accept("dGhlIHNhbXBsZSBub25jZQ==") == "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
  CHECK(answer_upgrade(request(), 4711, {}).bytes ==
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n\r\n");
  CHECK(fresh_web_socket_key().size() == 24);
  CHECK(fresh_web_socket_key() != fresh_web_socket_key());
  CHECK(fresh_mask() != fresh_mask());
}

TEST_CASE("An upgrade is refused to other hosts, foreign pages, and what is no handshake") {
  CHECK(status_of(request()) == "101");
  CHECK(status_of(request("host", "127.0.0.1:4711")) == "101");
  CHECK(status_of(request("host", "evil.example:4711")) == "403");
  CHECK(status_of(request("host", "localhost:80")) == "403");
  // Names have no case, and a browser sends one without a port to port 80 only.
  for (const char* own : {"LocalHost:4711", "localhost", "127.0.0.1"}) {
    CAPTURE(own);
    CHECK(status_of(request("host", own)) == "101");
  }
  for (const char* other : {"localhost:", "localhost:47110", "localhost:4711:4711", "local",
                            "evil.example", "localhost.evil.example", ""}) {
    CAPTURE(other);
    CHECK(status_of(request("host", other)) == "403");
  }
  CHECK(status_of(request("host", std::nullopt)) == "403");
  CHECK(status_of(request("origin", "http://localhost:8080")) == "101");
  CHECK(status_of(request("origin", "http://127.0.0.1:4711")) == "101");
  CHECK(status_of(request("origin", "http://evil.example")) == "403");
  CHECK(status_of(request("origin", "null")) == "403");
  CHECK(status_of(request("origin", "http://localhost:8081")) == "403");
  CHECK(status_of(request("upgrade", "h2c")) == "400");
  CHECK(status_of(request("connection", "keep-alive")) == "400");
  CHECK(status_of(request("connection", "keep-alive, Upgrade")) == "101");
  CHECK(status_of(request("sec-websocket-version", "8")) == "426");
  CHECK(status_of(request("sec-websocket-key", "short")) == "400");
  CHECK(status_of(request("sec-websocket-key", std::nullopt)) == "400");
  HttpHead twice = request();
  twice.fields.emplace_back("host", "localhost:4711");
  CHECK(status_of(twice) == "403");
  HttpHead post = request();
  post.start[0] = "POST";
  CHECK(status_of(post) == "400");
}

TEST_CASE("A client takes no answer that is not the one to its key") {
  const std::string key = "dGhlIHNhbXBsZSBub25jZQ==";
  const auto fault = [&](const std::string& bytes) {
    return upgrade_fault(*parse_http_head(bytes), key);
  };
  const std::string good = answer_upgrade(request(), 4711, {}).bytes;
  CHECK(fault(good).empty());
  CHECK_FALSE(fault("HTTP/1.1 200 OK\r\n\r\n").empty());
  CHECK_FALSE(fault("HTTP/1.1 101 S\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                    "Sec-WebSocket-Accept: AAAA\r\n\r\n")
                  .empty());
  std::string extended = good;
  extended.insert(extended.size() - 2, "Sec-WebSocket-Extensions: permessage-deflate\r\n");
  CHECK_FALSE(fault(extended).empty());
}

TEST_CASE("A head is parsed or refused as a whole") {
  CHECK(parse_http_head("GET / HTTP/1.1\r\nHost:  a \r\nX-y: 1\r\n\r\nrest")->value("host") == "a");
  for (const char* bad :
       {"", "GET / HTTP/1.1\r\n", "GET /\r\n\r\n", "GET / HTTP/1.1\r\nno colon\r\n\r\n",
        "GET / HTTP/1.1\r\n: empty\r\n\r\n", "GET / HTTP/1.1\r\nA b: c\r\n\r\n",
        "GET / HTTP/1.1\r\na: \x01\r\n\r\n"}) {
    CHECK_FALSE(parse_http_head(bad));
  }
  CHECK_FALSE(parse_http_head("GET / HTTP/1.1\r\na: " + std::string(9000, 'b') + "\r\n\r\n"));
}

}  // namespace
}  // namespace tpm::haptics
