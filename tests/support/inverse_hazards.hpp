#pragma once
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "raw_client.hpp"
#include "stand_in_inverse.hpp"
#include "tpm/haptics/inverse/inverse_device.hpp"
#include "tpm/haptics/serve/simulated_hand.hpp"
#include "tpmkit/error.hpp"

namespace tpm::test {

/// Outcome of one hazard of --device inverse3 on the stand-in service, or of tpm hil serve.
struct InverseHazardRow {
  std::string hazard;
  std::string expected;    ///< word of the fault, or part of the line that refuses
  std::string ended;       ///< what it was
  double after_s = 0.0;    ///< from the fault to the end; of one that is refused the time of that
  double bound_s = 0.0;    ///< for that
  double largest_N = 0.0;  ///< that reached the service, or was rendered
  double most_N = 0.0;     ///< for that
  int tries = 0;           ///< until a row was within: other programs can stall the machine
  /// Holds on a machine that stalls, too.
  [[nodiscard]] bool as_expected() const {
    return ended.find(expected) != ended.npos && largest_N <= most_N + 1e-9;
  }
  [[nodiscard]] bool within() const { return as_expected() && after_s <= bound_s; }
};

namespace inverse_hazards {

constexpr double kAsked_N = 1.0, kLimit_N = 3.0;
constexpr int kMostTries = 10;

inline double since_s(std::int64_t from_ns) {
  return static_cast<double>(now_ns() - from_ns) * 1e-9;
}

/// A service that a session must not begin on.
inline InverseHazardRow refused(const char* hazard, const char* expected,
                                const StandInFaults& faults, bool dead = false) {
  InverseHazardRow row{hazard, expected, "opened", 0.0, 5.0, 0.0, 0.0, 1};
  auto service = std::make_unique<StandInInverse>(PlantSettings{}, OperatorScript{}, true, faults);
  const InverseAddress address = service->address();
  if (dead) service.reset();
  const std::int64_t began_ns = now_ns();
  InverseDevice device(address, limits_of("inverse3"));
  try {
    (void)device.open();
  } catch (const Error& error) {
    row.ended = error.what();
  }
  row.after_s = since_s(began_ns);
  if (service) row.largest_N = service->largest_N();
  return row;
}

/// A service that goes wrong in a loop of 1 kHz which asks for 1 N.
inline InverseHazardRow ended(const char* hazard, const char* expected, double bound_s,
                              double watchdog_s, const StandInFaults& faults,
                              const std::function<void(StandInInverse&)>& act, bool loop_hangs) {
  InverseHazardRow row{hazard, expected, "", 0.0, bound_s, 0.0, kLimit_N, 0};
  do {
    ++row.tries;
    StandInInverse service(PlantSettings{}, {}, true, faults);
    InverseDevice device(service.address(), limits_of("inverse3"));
    (void)device.open();
    DevicePreparation preparation;
    preparation.real_time = true;
    preparation.watchdog_s = watchdog_s;
    preparation.max_force_N = kLimit_N;
    device.prepare(preparation);
    device.enable_forces();
    std::int64_t fault_ns = 0;
    row.ended = "goes on";
    constexpr int kBegins = 200, kLasts = 2000;
    // A loop that hangs is there for longer than the watchdog waits.
    const int lasts = kLasts + static_cast<int>(2e3 * watchdog_s);
    for (int i = 0; i < lasts; ++i) {
      Eigen::Vector3d at_m;
      if (i == kBegins || (fault_ns == 0 && faults.from > 0 && service.forces() >= faults.from)) {
        if (fault_ns == 0) fault_ns = now_ns();
        if (act && i == kBegins) act(service);
      }
      const bool hung = loop_hangs && fault_ns != 0;
      if (!hung) (void)device.read(at_m);
      if (!hung) (void)device.write({0.0, 0.0, kAsked_N});
      const DeviceStatus status = device.status();
      if (status.failed || status.forces_off != ForcesOff::none) {
        row.ended =
            fmt::format("{}: {}", status.failed ? "communication" : to_string(status.forces_off),
                        status.error_text);
        break;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    row.after_s = fault_ns == 0 ? 1e9 : since_s(fault_ns);
    device.stop();
    row.largest_N = service.largest_N();
  } while (!row.within() && row.tries < kMostTries);
  return row;
}

/// A client of tpm hil serve. @param act says what became of it
inline InverseHazardRow served(
    const char* hazard, const char* expected, double bound_s, double most_N,
    const std::function<std::string(WebSocketClient&, int port, double& after_s)>& act) {
  InverseHazardRow row{hazard, expected, "", 0.0, bound_s, 0.0, most_N, 0};
  do {
    ++row.tries;
    SimulatedHandSettings hand_settings;
    hand_settings.force_limit_N = kLimit_N;
    SimulatedHand hand(hand_settings);
    (void)hand.open();
    DevicePreparation preparation;
    preparation.max_force_N = kLimit_N;
    hand.prepare(preparation);
    hand.enable_forces();
    InverseServerSettings settings;
    settings.device.id = "SIMULATED";
    settings.device.simulated = true;
    settings.device.settings.handedness = "right";
    const InverseServer server(hand, std::move(settings));
    std::atomic<bool> done{false};
    std::thread loop([&] {  // what moves the hand, every millisecond
      while (!done) {
        (void)hand.write(Eigen::Vector3d::Zero());
        hand.advance(1e-3);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    });
    try {
      WebSocketClient client(server.port(), "/", 5.0, kMostInventoryBytes);
      (void)client.receive(5.0);
      row.ended = act(client, server.port(), row.after_s);
    } catch (const Error& error) {
      row.ended = error.what();
    }
    done = true;
    loop.join();
    row.largest_N = hand.largest_N();
  } while (!row.within() && row.tries < kMostTries);
  return row;
}

/// The force that the hand renders, in answer to a message.
inline double answered_N(WebSocketClient& client, const std::string& message) {
  if (!client.send(message)) return -1.0;
  const auto text = client.receive(5.0);
  return text ? parse_state(*text, "SIMULATED").force_N.norm() : -1.0;
}

inline std::string push_message(double newtons) {
  return force_message(InverseFormat::vector, "SIMULATED", {0.0, 0.0, newtons});
}

/// Pushes until the hand renders it.
inline void push_until(WebSocketClient& client, double asked_N, double rendered_N) {
  for (int i = 0; i < 2000 && answered_N(client, push_message(asked_N)) < rendered_N; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// Time until the hand renders nothing; the client only probes, which takes back a force of its
/// own.
inline double to_zero_s(WebSocketClient& client) {
  const std::int64_t from_ns = now_ns();
  while (answered_N(client, probe_message("SIMULATED")) > 0.0 && since_s(from_ns) < 5.0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return since_s(from_ns);
}

}  // namespace inverse_hazards

/// Each hazard of the device, measured; a row that other programs have pushed out of its bounds is
/// tried again, up to 10 times.
/// @param watchdog_s of the loop; with a long one a machine that stalls ends nothing
/// @param scheduling_s that the threads may come late, in the bounds
inline std::vector<InverseHazardRow> inverse_hazard_rows(double watchdog_s, double scheduling_s) {
  using namespace inverse_hazards;
  using How = StandInFaults::How;
  std::vector<InverseHazardRow> rows;
  StandInFaults f;
  f.version = "4.0.0.0";
  rows.push_back(refused("wrong version: 4.0", "of version '4.0.0.0'", f));
  f.version = "2.9.0.0";
  rows.push_back(refused("wrong version: 2.9", "of version '2.9.0.0'", f));
  f = {};
  rows.push_back(refused("nobody listens", "nobody answers", f, true));
  f.no_inventory = true;
  rows.push_back(refused("a dead service that accepts", "the service is silent", f));
  f = {};
  f.keeps = {"force_gate"};
  rows.push_back(refused("the service gates forces", "force gate of the service stays at 0.3", f));
  f = {};
  f.names_no_filters = true;
  rows.push_back(
      refused("the service does not say whether", "does not say what its force gate", f));
  f = {};
  f.scale = 2.0;
  rows.push_back(refused("the service scales coordinates", "scales coordinates", f));
  const auto failing = [](How how) {
    StandInFaults faults;
    faults.from = 100;
    faults.how = how;
    return faults;
  };
  // A state is at most a period old when the fault comes.
  const double silent_s = watchdog_s + scheduling_s;
  rows.push_back(ended("the service falls silent", "communication", silent_s, watchdog_s,
                       failing(How::silence), {}, false));
  rows.push_back(ended("the service closes", "communication", silent_s, watchdog_s,
                       failing(How::close), {}, false));
  rows.push_back(ended("the service sends garbage", "no state", silent_s, watchdog_s,
                       failing(How::garbage), {}, false));
  rows.push_back(ended("the service answers for another device", "no state", silent_s, watchdog_s,
                       failing(How::other_device), {}, false));
  const auto telling = [](const InverseEvent& event) {
    return [event](StandInInverse& service) { service.tell(event); };
  };
  rows.push_back(ended("event: busy", "device-busy", scheduling_s, watchdog_s, {},
                       telling({"device-busy", "warning", "049D", "", "taken"}), false));
  rows.push_back(ended("event: unplugged", "device-disconnected", scheduling_s, watchdog_s, {},
                       telling({"device-disconnected", "warning", "049D", "", "lost"}), false));
  rows.push_back(ended(
      "event: the device brakes", "ebrake_triggered", scheduling_s, watchdog_s, {},
      telling({"device-safety-triggered", "error", "049D", "ebrake_triggered", "brake"}), false));
  rows.push_back(ended("the loop hangs", "no command in the watchdog's time", silent_s, watchdog_s,
                       {}, {}, true));
  rows.push_back(served("client: falls silent", "zero", kDriverSilence_s + scheduling_s, kLimit_N,
                        [](WebSocketClient& client, int port, double& after_s) {
                          // Who pushes says nothing more; another client looks.
                          WebSocketClient reader(port, "/", 5.0, kMostInventoryBytes);
                          (void)reader.receive(5.0);
                          push_until(client, 2.0, 2.0);
                          after_s = to_zero_s(reader);
                          return std::string("zero");
                        }));
  rows.push_back(served("client: asks for 1000 N", "limited", 5.0, kLimit_N,
                        [](WebSocketClient& client, int /*port*/, double& after_s) {
                          push_until(client, 1e3, kLimit_N);
                          const double size_N = answered_N(client, push_message(1e3));
                          after_s = 0.0;
                          return std::string(size_N > 0.0 ? "limited" : "no force");
                        }));
  rows.push_back(served("client: sends garbage while it pushes", "zero", scheduling_s, kLimit_N,
                        [](WebSocketClient& client, int /*port*/, double& after_s) {
                          push_until(client, 2.0, 2.0);
                          (void)answered_N(client, R"({"inverse3": [)");
                          after_s = to_zero_s(client);
                          return std::string("zero");
                        }));
  rows.push_back(served("client: a page of a foreign origin", "403 Forbidden", 5.0, 0.0,
                        [](WebSocketClient& /*client*/, int port, double& after_s) {
                          const std::int64_t from_ns = now_ns();
                          const RawClient raw(port);
                          raw.send(fmt::format(
                              "GET / HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nOrigin: "
                              "http://evil.example\r\nUpgrade: websocket\r\nConnection: "
                              "Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                              "Sec-WebSocket-Version: 13\r\n\r\n",
                              port));
                          const std::string answer = raw.answer();
                          after_s = since_s(from_ns);
                          return answer.substr(0, answer.find("\r\n"));
                        }));
  return rows;
}

inline std::string inverse_hazard_table(const std::vector<InverseHazardRow>& rows) {
  std::string text =
      "| hazard | ended | after / ms | bound / ms | largest force / N | limit / N | tries |\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n";
  for (const InverseHazardRow& row : rows) {
    text += fmt::format("| {} | {} | {:.1f} | {:.0f} | {:.3g} | {:.3g} | {}{} |\n", row.hazard,
                        row.ended, 1e3 * row.after_s, 1e3 * row.bound_s, row.largest_N, row.most_N,
                        row.tries, row.within() ? "" : ", **not within**");
  }
  return text;
}

}  // namespace tpm::test
