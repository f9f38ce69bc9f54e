// tpm hil serve: what clients of the Inverse service receive, and that none of them gets in the
// way.
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "hil_scenes.hpp"
#include "inverse_clients.hpp"
#include "raw_client.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpm/haptics/serve/serve.hpp"
#include "tpm/haptics/serve/simulated_hand.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using namespace std::chrono_literals;
using files::Json;

using test::kSoon_s;

/// A server with a hand that notes what it is asked, and no tissue.
class NotingHand final : public ServedHand {
 public:
  InverseState state() noexcept override {
    InverseState state;
    state.position_m = {0.01, 0.02, 0.03};
    state.force_N = force_N;
    return state;
  }
  void push(const Eigen::Vector3d& wanted_N) noexcept override {
    force_N = wanted_N;
    ++pushes;
  }
  void move_to(const std::optional<Eigen::Vector3d>& position_m) noexcept override {
    goal_m = position_m;
  }
  void let_go() noexcept override { force_N.setZero(); }

  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> goal_m;
  std::atomic<int> pushes{0};
};

class Served {
 public:
  Served() {
    InverseServerSettings settings;
    settings.events_port = 0;
    settings.device.id = "049D";
    settings.device.type = "inverse3";
    settings.device.simulated = true;
    settings.device.settings.handedness = "right";
    settings.device.settings.filters_named = true;
    settings.page = "<p>SIMULATED DEVICE</p>";
    settings.log = [this](const std::string& line) {
      const std::lock_guard<std::mutex> lock(mutex_);
      lines_.push_back(line);
    };
    server = std::make_unique<InverseServer>(hand, std::move(settings));
  }
  [[nodiscard]] std::unique_ptr<WebSocketClient> client(std::string* inventory = nullptr) const {
    return test::client_of(*server, inventory);
  }
  [[nodiscard]] std::vector<std::string> lines() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return lines_;
  }

  NotingHand hand;

 private:
  std::mutex mutex_;
  std::vector<std::string> lines_;

 public:
  std::unique_ptr<InverseServer> server;  ///< ends first: its thread writes lines
};

InverseState state_after(WebSocketClient& client, const std::string& message) {
  return parse_state(test::answer_to(client, message), "049D");
}

std::string push_of(double newtons, InverseFormat format = InverseFormat::vector) {
  return force_message(format, "049D", {0.0, 0.0, newtons});
}

bool silent(WebSocketClient& client) {
  return !client.receive(0.05) && client.over().empty();
}

TEST_CASE("An inventory comes first, then exactly one state for each message, in both formats") {
  Served served;
  std::string inventory;
  const auto client = served.client(&inventory);
  const Json first = Json::parse(inventory);
  CHECK(first.at("inverse3")[0].at("config").at("handedness") == "right");
  CHECK(first.at("inverse3")[0].at("config").at("simulated_device") == "SIMULATED DEVICE");
  CHECK(parse_inventory(inventory).devices.at(0).state.position_m.isApprox(
      Eigen::Vector3d(0.01, -0.10, 0.18)));
  CHECK(silent(*client));
  for (const InverseFormat format : {InverseFormat::vector, InverseFormat::values}) {
    CHECK(state_after(*client, push_of(1.5, format)).force_N.z() == 1.5);
    CHECK(silent(*client));
  }
  REQUIRE(client->send(push_of(0.25)));
  const Json state = Json::parse(*client->receive(kSoon_s)).at("inverse3")[0];
  CHECK_FALSE(state.contains("config"));
  CHECK(state.at("state").contains("cursor_velocity"));
  CHECK(state.at("state").at("current_cursor_force").at("z") == 0.25);
  // Coordinates around the middle of the workspace, for who asks for them.
  CHECK(state_after(*client, neutral_message("049D", "who")).position_m ==
        Eigen::Vector3d(0.01, 0.02, 0.03));
}

TEST_CASE("Garbage is answered by one state, no force and one line in the log") {
  Served served;
  const auto client = served.client();
  const std::string nan =
      R"({"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":{"vector":{"x":1e400,"y":0,"z":0}}}}]})";
  for (const std::string& garbage :
       {std::string(R"({"inverse3": [)"), nan, std::string(), std::string(60'000, '[')}) {
    CHECK(state_after(*client, push_of(2.0)).force_N.z() == 2.0);
    const std::size_t before = served.lines().size();
    CHECK(state_after(*client, garbage).force_N.norm() == 0.0);
    CHECK(silent(*client));
    CHECK(served.lines().size() == before + 1);
  }
  CHECK(served.server->counts().unreadable == 4);
  for (int i = 0; i < 200; ++i) (void)state_after(*client, "x");
  CHECK(served.lines().size() < 30);  // the log of one client has an end
}

TEST_CASE("A flood of 50 by 50 is answered by as many states") {
  Served served;
  const auto client = served.client();
  for (int round = 0; round < 50; ++round) {
    for (int i = 0; i < 50; ++i) REQUIRE(client->send(push_of(i)));
    for (int i = 0; i < 50; ++i) {
      const auto text = client->receive(kSoon_s);
      REQUIRE(text);
      CHECK(parse_state(*text, "049D").force_N.z() == i);
    }
  }
  CHECK(silent(*client));
  CHECK(served.server->counts().states == 2500);
}

TEST_CASE("One client drives, a second reads only until the first has left") {
  Served served;
  auto first = served.client();
  const auto second = served.client();
  CHECK(state_after(*first, push_of(1.0)).force_N.z() == 1.0);
  CHECK(state_after(*second, push_of(3.0)).force_N.z() == 1.0);
  CHECK(served.hand.pushes == 1);
  first.reset();
  double newtons = 0.0;
  for (int i = 0; i < 6000 && newtons == 0.0; ++i) {
    newtons = state_after(*second, push_of(3.0)).force_N.z();
    std::this_thread::sleep_for(10ms);
  }
  CHECK(newtons == 3.0);
}

TEST_CASE("A client drives as long as it asks for a force", "[untimed]") {
  Served served;
  const auto first = served.client(), second = served.client();
  // A force of zero drives nothing.
  (void)state_after(*first, push_of(0.0));
  CHECK(state_after(*second, push_of(2.0)).force_N.z() == 2.0);
  CHECK(state_after(*first, push_of(3.0)).force_N.z() == 2.0);
  // The driver falls silent and stays: after two seconds another may.
  double newtons = 0.0;
  for (int i = 0; i < 6000 && newtons != 3.0; ++i) {
    newtons = state_after(*first, push_of(3.0)).force_N.z();
    std::this_thread::sleep_for(10ms);
  }
  CHECK(newtons == 3.0);
}

TEST_CASE("What a client does wrong makes one line in the log, and moves nothing") {
  Served served;
  const auto client = served.client();
  const auto lines_after = [&](const std::string& message) {
    const std::size_t before = served.lines().size();
    for (int i = 0; i < 3; ++i) (void)state_after(*client, message);
    const std::vector<std::string> now = served.lines();
    return std::vector<std::string>(now.begin() + static_cast<std::ptrdiff_t>(before), now.end());
  };
  const auto said = [](const char* id, const char* what) {
    return fmt::format(R"({{"inverse3":[{{"device_id":"{}","commands":{}}}]}})", id, what);
  };
  const auto moved = [&](const char* id, double metres) {
    return said(
        id, fmt::format(R"({{"set_cursor_position":{{"vector":{{"x":0,"y":0,"z":{}}}}}}})", metres)
                .c_str());
  };
  std::vector<std::string> lines = lines_after(said("ABCD", "{}"));
  REQUIRE(lines.size() == 1);
  CHECK_THAT(lines.front(), Contains("a device that is not here"));
  lines = lines_after(moved("049D", 2.0));
  REQUIRE(lines.size() == 1);
  CHECK_THAT(lines.front(), Contains("asks for a place 2 m away"));
  CHECK_FALSE(served.hand.goal_m);
  // The second one does not move what the first one moves.
  const auto first = served.client();
  (void)state_after(*first, moved("049D", 0.1));
  lines = lines_after(moved("049D", 0.2));
  REQUIRE(lines.size() == 1);
  CHECK_THAT(lines.front(), Contains("does not move the hand"));
  // Commands are applied once and forgotten: a message without a force has none.
  CHECK(state_after(*client, push_of(2.0)).force_N.z() == 2.0);
  CHECK(state_after(*client, said("049D", R"({"probe_position":{}})")).force_N.z() == 0.0);
  // Two entries of one device are two sources, which add up; those of another device are nothing.
  const std::string one = R"({"device_id":"049D","commands":{"set_cursor_force":{"vector":)"
                          R"({"x":0,"y":0,"z":1}}}})";
  const std::string other = R"({"device_id":"ABCD","commands":{"set_cursor_force":{"vector":)"
                            R"({"x":0,"y":0,"z":9}}}})";
  const std::string both = fmt::format(R"({{"inverse3":[{},{},{}]}})", one, other, one);
  CHECK(state_after(*client, both).force_N.z() == 2.0);
}

TEST_CASE("A message of 3 MB is closed with 1009, and all others go on") {
  Served served;
  const auto other = served.client();
  const auto client = served.client();
  (void)state_after(*client, push_of(1.0));
  std::thread sender([&] { (void)client->send(std::string(3'000'000, '['), kSoon_s); });
  (void)state_after(*other, "{}");
  sender.join();
  CHECK_FALSE(client->receive(kSoon_s));
  CHECK(client->close_code() == kCloseTooBig);
  CHECK(state_after(*other, push_of(2.0)).force_N.z() == 2.0);  // who is free to drive now
  const auto third = served.client();
  (void)state_after(*third, "{}");
}

TEST_CASE("A client that does not read is closed, and connections are counted") {
  Served served;
  // Its receive buffer is small: one of 30 MB, as the kernel would make it, may keep even what this
  // client sends from arriving.
  const test::RawClient deaf(served.server->port(), 4096);
  deaf.send(upgrade_request(served.server->port(), "/", fresh_web_socket_key()));
  std::string hundred;
  for (std::uint8_t i = 0; i < 100; ++i) {
    hundred += frame_bytes(FrameKind::text, "{}", FrameMask{i, 1, 2, 3});
  }
  for (int i = 0; i < 2000 && served.server->counts().closed_for_fault == 0; ++i) {
    deaf.send(hundred);
  }
  for (int i = 0; i < 6000 && served.server->counts().closed_for_fault == 0; ++i) {
    std::this_thread::sleep_for(10ms);
  }
  CHECK(served.server->counts().closed_for_fault == 1);
  std::vector<std::unique_ptr<WebSocketClient>> all;
  for (std::size_t i = 0; i + 1 < InverseServer::kMostConnections; ++i) {
    all.push_back(served.client());
  }
  all.push_back(served.client());
  CHECK_THROWS_WITH(served.client(), Contains("it answers '503' in place of an upgrade"));
  CHECK(served.server->counts().refused == 1);  // the ninth
  // On the port of events as well.
  CHECK_THROWS_WITH(WebSocketClient(served.server->events_port(), "/", kSoon_s, kMostMessageBytes),
                    Contains("it answers '503' in place of an upgrade"));
  const test::RawClient raw(served.server->port());
  CHECK_THAT(raw.answer(kSoon_s), Contains("HTTP/1.1 503 Service Unavailable") &&
                                      Contains("\r\n\r\n8 connections are open\n"));
  CHECK_THROWS_AS(served.client(), Error);
  CHECK(std::ranges::count_if(served.lines(), [](const std::string& line) {
          return line.starts_with("8 connections are open");
        }) == 1);
  (void)state_after(*all.front(), "{}");
}

TEST_CASE("The server answers programs and its own page on this machine, and nobody else",
          "[untimed]") {
  Served served;
  const int port = served.server->port();
  const auto answer = [port](const std::string& fields,
                             const std::string& first = "GET / HTTP/1.1") {
    const test::RawClient raw(port);
    raw.send(first + "\r\n" + fields + "\r\n");
    return raw.answer();
  };
  const std::string host = fmt::format("Host: 127.0.0.1:{}\r\n", port);
  const std::string upgrade =
      "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
      "Sec-WebSocket-Version: 13\r\n";
  CHECK_THAT(answer(upgrade + "Host: evil.example\r\n"), Contains("403 Forbidden"));
  CHECK_THAT(answer(host + upgrade + "Origin: http://evil.example\r\n"), Contains("403 Forbidden"));
  CHECK_THAT(answer("Host: evil.example\r\n"), Contains("403 Forbidden"));
  CHECK_THAT(answer(host + "Origin: http://evil.example\r\n", "GET /devices HTTP/1.1"),
             Contains("403 Forbidden"));
  CHECK_THAT(answer(host), Contains("SIMULATED DEVICE"));
  CHECK_THAT(answer(host, "POST / HTTP/1.1"), Contains("405 "));
  CHECK_THAT(answer(host, "GET /etc/passwd HTTP/1.1"), Contains("404 "));
  CHECK_THAT(answer(host + "Transfer-Encoding: chunked\r\n", "POST /devices HTTP/1.1"),
             Contains("501 Not Implemented") &&
                 Contains("\r\n\r\na body in chunks (Transfer-Encoding) is not read\n"));
  CHECK_THAT(answer("\x01\x02\r\n"), Contains("400 "));
  CHECK_THAT(http_exchange(port, "/version", "", kSoon_s), Contains("SIMULATED DEVICE"));
  CHECK(parse_version(http_exchange(port, "/3.0/version", "", kSoon_s)) == "3.5.0.0");
  CHECK(parse_inventory(http_exchange(port, "/devices", "", kSoon_s)).devices.at(0).simulated);
  const test::RawClient dumb(port);  // asks for nothing
  CHECK(dumb.answer(5.0).empty());
  // Each that was refused stands in the log once.
  const std::vector<std::string> lines = served.lines();
  CHECK(std::ranges::count_if(lines, [](const std::string& line) {
          return line.find("refused: ") != std::string::npos;
        }) == 6);
}

TEST_CASE("A port that is taken is named with its option") {
  NotingHand hand;
  const Socket taken = listen_on_loopback(0);
  InverseServerSettings settings;
  settings.events_port = port_of(taken);
  CHECK_THROWS_WITH(InverseServer(hand, settings),
                    Contains(fmt::format("--events-port {}", port_of(taken))));
  settings.port = port_of(taken);
  settings.events_port = 0;
  CHECK_THROWS_WITH(InverseServer(hand, settings),
                    Contains(fmt::format("--port {}", port_of(taken))));
}

TEST_CASE("Sockets listen on this machine only, and send small pieces without waiting") {
  const Socket listening = listen_on_loopback(0);
  sockaddr_in address{};
  socklen_t size = sizeof address;
  REQUIRE(getsockname(listening.handle(), reinterpret_cast<sockaddr*>(&address), &size) == 0);
  CHECK(address.sin_addr.s_addr == htonl(INADDR_LOOPBACK));
  const Socket client = connect_to_loopback(port_of(listening), kSoon_s);
  const Socket server = accepted(listening);
  for (const Socket* socket : {&client, &server}) {
    int without_delay = 0;
    size = sizeof without_delay;
    REQUIRE(getsockopt(socket->handle(), IPPROTO_TCP, TCP_NODELAY, &without_delay, &size) == 0);
    CHECK(without_delay != 0);
  }
}

TEST_CASE("Events reach those who listen, and their words are nothing to the hand") {
  Served served;
  WebSocketClient events(served.server->events_port(), "/", kSoon_s, kMostMessageBytes);
  REQUIRE(events.send(push_of(3.0)));
  CHECK(silent(events));
  CHECK(served.hand.pushes == 0);
  served.server->tell({"device-busy", "warning", "049D", "", "taken"});
  const auto text = events.receive(kSoon_s);
  REQUIRE(text);
  CHECK(parse_event(*text).name == "device-busy");
}

/// What a client sees of a served session while `act` is at work.
ServeRun with_session(const Json& json, double duration_s,
                      const std::function<void(WebSocketClient&)>& act) {
  const HilSession session = test::parsed(json);
  std::thread worker;
  std::atomic<bool> done{false};
  ServeOptions options;
  options.port = options.events_port = 0;
  options.duration_s = duration_s;
  options.interrupted = [&done] { return done.load(); };
  options.opened = [&](const InverseServer& server, const DeviceIdentity& identity,
                       const LoopModel&) {
    CHECK_FALSE(identity.hardware);
    worker = std::thread([&, port = server.port()] {
      WebSocketClient client(port, "/", kSoon_s, kMostInventoryBytes);
      (void)client.receive(kSoon_s);
      act(client);
      done = true;
    });
  };
  ServeRun run = serve_session(session, options);
  worker.join();
  return run;
}

InverseState served_state(WebSocketClient& client, const std::string& message) {
  REQUIRE(client.send(message));
  return parse_state(client.receive(kSoon_s).value(), "SIMULATED");
}

std::string served_push(const Eigen::Vector3d& force_N) {
  return force_message(InverseFormat::vector, "SIMULATED", force_N);
}

/// Until the state is as wanted, or for a minute.
InverseState when(WebSocketClient& client, const std::string& message,
                  const std::function<bool(const InverseState&)>& wanted) {
  InverseState state;
  for (int i = 0; i < 60'000; ++i) {
    state = served_state(client, message);
    if (wanted(state)) break;
    std::this_thread::sleep_for(1ms);
  }
  return state;
}

TEST_CASE("A client's force moves the simulated hand, never above the limit, and ends in silence") {
  Json json = test::short_session();
  json["limits"]["force"] = "3 N";
  double silent_N = 1.0, moved_m = 0.0, strong_N = 0.0;
  const ServeRun run = with_session(json, 600.0, [&](WebSocketClient& client) {
    const double before_m = served_state(client, "{}").position_m.x();
    const auto pushed = [&](const InverseState& s) { return s.position_m.x() > before_m + 5e-3; };
    moved_m = when(client, served_push({2.0, 0.0, 0.0}), pushed).position_m.x() - before_m;
    std::this_thread::sleep_for(500ms);
    const std::string probe =
        R"({"inverse3":[{"device_id":"SIMULATED","commands":{"probe_position":{}}}]})";
    const auto silent = [](const InverseState& s) { return s.force_N.x() == 0.0; };
    silent_N = std::abs(when(client, probe, silent).force_N.x());
    strong_N = when(client, served_push({1e3, 0.0, 0.0}), [](const InverseState& s) {
                 return s.force_N.norm() > 2.99;
               }).force_N.norm();
  });
  CHECK(moved_m > 5e-3);
  CHECK(silent_N == 0.0);
  CHECK_THAT(strong_N, WithinAbs(3.0, 1e-9));
  CHECK(run.largest_force_N <= 3.0 + 1e-9);
  CHECK(run.outcome.cause == StopCause::signal);
  CHECK_THAT(serve_text(test::parsed(json), run), Contains("SIMULATED DEVICE"));
  CHECK(serve_json(test::parsed(json), run).at("states") == run.counts.states);
}

TEST_CASE("A hand that a client moves into the tissue meets its force") {
  double tissue_N = 0.0, depth_m = 0.0;
  const ServeRun run = with_session(test::short_session(), 600.0, [&](WebSocketClient& client) {
    (void)served_state(client, neutral_message("SIMULATED", "test"));
    const std::string down =
        R"({"inverse3":[{"device_id":"SIMULATED","commands":{"set_cursor_position":{"position":{"x":0,"y":0,"z":-0.010}}}}]})";
    const InverseState deep =
        when(client, down, [](const InverseState& s) { return s.force_N.z() > 0.3; });
    tissue_N = deep.force_N.z();
    depth_m = -deep.position_m.z();
  });
  CHECK(tissue_N > 0.3);
  CHECK(depth_m > 1e-3);
  CHECK(run.outcome.cause == StopCause::signal);
}

TEST_CASE("The example client in Python is served in both formats, and names a simulated device") {
  const std::string format = GENERATE("vector", "values");
  const test::TempFolder folder;
  const std::string output = folder / "output", listed = folder / "listed";
  Json json = test::short_session();
  json["limits"]["force"] = "3 N";
  int status = -1, listing = -1;
  std::thread worker;
  std::atomic<bool> done{false};
  ServeOptions options;
  options.port = options.events_port = 0;
  options.duration_s = 600.0;
  options.interrupted = [&done] { return done.load(); };
  options.opened = [&](const InverseServer& server, const DeviceIdentity&, const LoopModel&) {
    worker = std::thread([&, port = server.port(), server_events = server.events_port()] {
      listing = std::system(fmt::format("'" TPM_TEST_PROGRAM "' hil devices --inverse-port {} "
                                        "--inverse-events-port {} >{}",
                                        port, server_events, listed)
                                .c_str());
      status = std::system(fmt::format("python3 {}/examples/inverse_client.py --port {} "
                                       "--messages 300 --format {} >{} 2>&1",
                                       TPM_TEST_SOURCE_DIR, port, format, output)
                               .c_str());
      done = true;
    });
  };
  const ServeRun run = serve_session(test::parsed(json), options);
  worker.join();
  const std::string said = files::read_file(output);
  INFO(said);
  CHECK(status == 0);
  CHECK_THAT(said, Contains("SIMULATED DEVICE") && Contains("'x': 0.5"));
  CHECK(run.counts.states == 300);
  CHECK(listing == 0);
  CHECK_THAT(files::read_file(listed), Contains("inverse3") && Contains("SIMULATED DEVICE") &&
                                           Contains("--device inverse3 --serial SIMULATED\n"));
  CHECK_FALSE(Contains("no session begins").match(files::read_file(listed)));
}

}  // namespace
}  // namespace tpm::haptics
