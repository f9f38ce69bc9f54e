// --device inverse3 beside other devices and other clients, and how connections end.
#include <fmt/format.h>
#include <sys/socket.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "inverse_clients.hpp"
#include "inverse_sessions.hpp"
#include "temp_folder.hpp"
#include "tpm/haptics/serve/simulated_hand.hpp"
#include "tpm/haptics/session/identify_run.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using namespace std::chrono_literals;
using namespace test::inverse_sessions;
using test::StandInFaults;
using test::StandInInverse;

TEST_CASE("A device is chosen by its id or place; a wrong one is refused with those there are",
          "[untimed]") {
  StandInFaults f;
  f.devices = {"049D", "0A14"};
  CHECK_THAT(refusal(f), Contains("the service has 2 devices: 049D, 0A14; expected --serial with "
                                  "one of these, or --index with its place from 0 on"));
  CHECK(refusal(f, "049D").empty());
  CHECK(refusal(f, "049d").empty());
  CHECK_THAT(refusal(f, "4711"), Contains("'4711' is not there: the service has 2 devices: 049D, "
                                          "0A14; expected --serial with one of these"));
  const auto at = [&f](int index) {
    StandInInverse service(PlantSettings{}, {}, false, f);
    InverseAddress address = service.address();
    address.index = index;
    InverseDevice device(address, limits_of("inverse3"));
    return refusal_of([&] { (void)device.open(); });
  };
  CHECK(at(0).empty());
  CHECK_THAT(at(1), Contains("is not that of device '0A14'"));  // the stand-in has states of one
  CHECK_THAT(at(2), Contains("there is no device 2: the service has 2 devices: 049D, 0A14; "
                             "expected --index from 0 to 1"));
  f.devices = {"049D"};
  CHECK_THAT(refusal(f, "0A14"), Contains("the service has 1 device: 049D"));
}

TEST_CASE("A simulated device that another client drives is refused, hardware is named",
          "[untimed]") {
  StandInFaults f;
  f.in_use = true;
  CHECK_THAT(refusal(f), Contains("another client drives the device 049D (status in_use); expected "
                                  "a device that nobody drives: end that client"));
  f.simulated = false;
  StandInInverse service(PlantSettings{}, {}, false, f);
  InverseDevice device(service.address(), limits_of("inverse3"));
  CHECK(device.open().hardware);
  REQUIRE(device.findings().size() == 1);
  CHECK(device.findings().front().code == "in_use");
  CHECK_THAT(device.findings().front().text,
             Contains("another client may use the device 049D (status in_use true, control mode "
                      "'force'): end it, or its forces add to those of this session"));
}

/// tpm hil serve without a tissue; the test moves its time.
struct ServedBeside {
  ServedBeside() {
    (void)hand.open();
    hand.prepare({});
    hand.enable_forces();
    server = std::make_unique<InverseServer>(hand, test::neutral_server());
  }
  [[nodiscard]] InverseAddress address() const {
    return {server->port(), server->events_port(), server->port(), ""};
  }

  SimulatedHand hand{SimulatedHandSettings{}};
  std::unique_ptr<InverseServer> server;  ///< ends first
};

const std::string kPushOfOne = force_message(InverseFormat::vector, "SIMULATED", {0.0, 0.0, 1.0});

TEST_CASE(
    "A session on tpm hil serve waits for another client to leave, and refuses one that stays",
    "[untimed]") {
  const ServedBeside served;
  auto first = test::client_of(*served.server);
  std::atomic<bool> done{false};
  std::thread drives([&] {
    while (!done && first->send(kPushOfOne)) {
      (void)first->receive(test::kSoon_s);
      std::this_thread::sleep_for(5ms);
    }
  });
  // From when it drives on: a client that has sent nothing yet drives nothing.
  const auto looker = test::client_of(*served.server);
  while (test::answer_to(*looker, "{}").find(R"("in_use":true)") == std::string::npos) {
    std::this_thread::sleep_for(5ms);
  }
  InverseDevice refused(served.address(), limits_of("inverse3"));
  const std::string said = refusal_of([&] { (void)refused.open(); });
  done = true;
  drives.join();
  CHECK_THAT(said, Contains("another client drives the device SIMULATED"));
  first.reset();
  InverseDevice device(served.address(), limits_of("inverse3"));
  CHECK(refusal_of([&] { (void)device.open(); }).empty());
}

TEST_CASE("A client that pushes while the session commands nothing is told") {
  ServedBeside served;
  InverseDevice device(served.address(), limits_of("inverse3"));
  (void)device.open();
  device.prepare({});
  device.enable_forces();
  const auto other = test::client_of(*served.server);
  Eigen::Vector3d at_m;
  constexpr int kMostPeriods = 20'000;  // a machine that stalls makes gaps in the push
  for (int i = 0; i < kMostPeriods && device.findings().empty(); ++i) {
    (void)test::answer_to(*other, kPushOfOne);
    served.hand.advance(1e-3);
    REQUIRE(device.read(at_m) == DeviceAnswer::ok);
    REQUIRE(device.write(Eigen::Vector3d::Zero()) == DeviceAnswer::ok);
  }
  REQUIRE(device.findings().size() == 1);
  CHECK_THAT(device.findings().front().text,
             Contains("the service reported up to 1 N where nothing was "
                      "commanded") &&
                 Contains("another client pushes"));
  CHECK_FALSE(device.status().failed);  // it is told, and ends nothing
}

TEST_CASE("A connection that ends is no unplugged device, and says how it ended", "[untimed]") {
  struct Case {
    int code;
    const char* reason;
    const char* words;
  };
  for (const Case& c :
       {Case{1001, "the server ends", "the service closed with 1001 (the server ends)"},
        Case{1001, "", "the service closed with 1001 (going away)"},
        Case{1002, "", "the service closed with 1002 (protocol error)"},
        Case{1009, "", "the service closed with 1009 (message too big)"},
        Case{1011, "", "the service closed with 1011 (internal error)"},
        Case{4711, "a reason\nof many words, which does not fit", "the service closed with 4711 ("},
        Case{0, "", "the service is gone, without a close frame"}}) {
    CAPTURE(c.code, c.reason);
    StandInFaults f;
    f.how = StandInFaults::How::close;
    f.from = 20;
    f.close_code = c.code;
    f.close_reason = c.reason;
    StandInInverse service(PlantSettings{}, {}, false, f);
    InverseDevice device(service.address(), limits_of("inverse3"));
    (void)device.open();
    device.prepare({});
    device.enable_forces();
    DeviceAnswer answer = DeviceAnswer::ok;
    for (int i = 0; i < 40 && answer == DeviceAnswer::ok; ++i) answer = device.write({0, 0, 0.1});
    CHECK(answer == DeviceAnswer::failed);
    const DeviceStatus status = device.status();
    CHECK(status.failed);
    CHECK(status.forces_off == ForcesOff::none);  // of the device nothing is known
    CHECK_THAT(status.error_text, Contains(c.words));
    CHECK(std::string_view(status.error_text).find('\n') == std::string_view::npos);
  }
}

/// Words of a client whose service breaks the connection in this way.
std::string ending_after(bool reads, bool says_goodbye, bool resets) {
  const Socket listening = listen_on_loopback(0);
  std::thread service([&] {
    Socket socket;
    while (!socket.open()) socket = accepted(listening);
    std::string head;
    char block[4096];
    while (head.find("\r\n\r\n") == head.npos) {
      const ssize_t count = ::recv(socket.handle(), block, sizeof block, 0);
      if (count > 0) head.append(block, static_cast<std::size_t>(count));
    }
    const auto answer = [&socket](const std::string& bytes) {
      (void)::send(socket.handle(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    };
    answer(answer_upgrade(*parse_http_head(head), port_of(listening), {}).bytes);
    if (says_goodbye) answer(frame_bytes(FrameKind::close, close_payload(1011, "no more")));
    const linger at_once{1, 0};
    if (resets) {
      (void)::setsockopt(socket.handle(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    }
    socket.close();
  });
  std::string words;
  try {
    WebSocketClient client(port_of(listening), "/", test::kSoon_s, 1000);
    service.join();  // what it did has arrived: both ends are of this machine
    if (reads) {
      (void)client.receive(test::kSoon_s);
    } else {
      while (client.send("a force")) std::this_thread::sleep_for(1ms);
    }
    words = client.over();
  } catch (const Error& error) {
    words = error.what();
  }
  if (service.joinable()) service.join();
  return words;
}

TEST_CASE("A client that only sends learns why its service closed, too") {
  for (const bool reads : {true, false}) {
    CAPTURE(reads);
    CHECK(ending_after(reads, true, true) == "the service closed with 1011 (no more)");
    CHECK(ending_after(reads, true, false) == "the service closed with 1011 (no more)");
  }
  CHECK(ending_after(true, false, false) == "the service is gone, without a close frame");
}

TEST_CASE("Before the check of a second pushes, the session says so, and then why it ended",
          "[heavy]") {
  const test::TempFolder folder;
  const HilSession session = test::parsed(inverse_session());
  PlantSettings free = plant_of(session, 2);
  free.arm = {1e-9, 0.0, 0.0, 0.0};  // nobody holds it
  const std::string file = folder / "inverse.json";
  {
    StandInInverse service(free, {}, false);
    DeviceIdentifyOptions options;
    options.duration_s = 8.0;
    const IdentifyRun identified = run_identification(choice_of(service), session, options);
    REQUIRE(identified.found.delay_largest_s);
    std::ofstream(file) << to_text(device_file_json(identified, "2026-11-29"));
  }
  for (const bool interrupted : {true, false}) {
    CAPTURE(interrupted);
    StandInFaults f;
    if (!interrupted) {
      f.how = StandInFaults::How::silence;
      f.from = 50;  // of zero: it waits for a handle at rest
    }
    StandInInverse service(free, {}, true, f);
    DeviceChoice choice = choice_of(service);
    choice.file = file;
    SessionRunOptions options;
    options.real_time = true;
    options.recording = folder / fmt::format("checked{}.tpmrec", interrupted);
    int told = 0, sent = -1;
    double most_N = 0.0;
    options.checking = [&](double newtons) {
      ++told;
      most_N = newtons;
      sent = service.forces();
    };
    options.interrupted = [&] { return interrupted && told > 0; };
    const std::string said = refusal_of([&] { (void)run_session(session, choice, options); });
    CAPTURE(said);
    CHECK(told == 1);
    CHECK(sent == 0);  // not even a force of zero
    CHECK(most_N > 0.0);
    CHECK(most_N <= 0.3);
    CHECK_THAT(said, Contains("the check of a second before the session"));
    // Neither is a handle at rest what is missing, nor is the device unplugged.
    CHECK_FALSE(Contains("at rest").match(said));
    CHECK_FALSE(Contains("unplugged").match(said));
    CHECK(Contains("was interrupted").match(said) == interrupted);
  }
}

}  // namespace
}  // namespace tpm::haptics
