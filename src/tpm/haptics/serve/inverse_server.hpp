#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tpm/haptics/inverse/loopback.hpp"
#include "tpm/haptics/inverse/messages.hpp"
#include "tpm/haptics/serve/driver_log.hpp"

namespace tpm::haptics {

/// Device that a server shows and moves, around the middle of the workspace. The server calls these
/// from its thread.
class ServedHand {
 public:
  virtual ~ServedHand() = default;
  [[nodiscard]] virtual InverseState state() noexcept = 0;
  /// The driver's force, N; it lasts until the next, or kDriverSilence_s.
  virtual void push(const Eigen::Vector3d& force_N) noexcept = 0;
  /// The hand goes there, m; empty: back to its script.
  virtual void move_to(const std::optional<Eigen::Vector3d>& position_m) noexcept = 0;
  /// Nobody drives any more.
  virtual void let_go() noexcept = 0;
  /// Buttons of the grip, a, b, c, until the next; a hand without a grip has none.
  virtual void press(std::uint32_t /*buttons*/) noexcept {}
};

/// After which a silent driver's force is zero.
inline constexpr double kDriverSilence_s = 0.1;

struct InverseServerSettings {
  int port = 0;                     ///< 0: one that is free
  int events_port = -1;             ///< the same of the events; -1: none
  std::string version = "3.5.0.0";  ///< that the server is compatible with
  /// Middle of the workspace in the coordinates of a client that has not asked for kCentredPreset.
  Eigen::Vector3d centre_m = Eigen::Vector3d(0.0, -0.12, 0.15);
  InverseDeviceEntry device;  ///< of the inventory, SIMULATED DEVICE if it is marked so
  std::string page;           ///< HTML at "/"; empty: none
  bool poll = false;          ///< looks again and again in place of sleeping, for latency
  std::function<void(const std::string&)> log;  ///< a line; from the server's thread
};

/// A server that is compatible with the Inverse service, on 127.0.0.1: an inventory first, then
/// exactly one state for each message. The first client that asks for a force drives until it
/// leaves, or asks for nothing in two seconds; others read. A setting that this device does not
/// have stays, and the log says so. What strangers can take is bounded: connections, bytes, lines
/// that each connection adds to the log, lines about who drives (DriverLog).
class InverseServer {
 public:
  /// @param hand must live as long as this. Throws Error(environment) if the port is taken.
  InverseServer(ServedHand& hand, InverseServerSettings settings);
  ~InverseServer();
  InverseServer(const InverseServer&) = delete;
  InverseServer& operator=(const InverseServer&) = delete;

  [[nodiscard]] int port() const noexcept { return port_; }
  [[nodiscard]] int events_port() const noexcept { return events_port_; }
  /// Sends an event to all who listen; from any thread.
  void tell(const InverseEvent& event);

  struct Counts {
    std::uint64_t connections = 0, refused = 0, messages = 0, states = 0, unreadable = 0,
                  closed_for_fault = 0;
  };
  [[nodiscard]] Counts counts() const noexcept;

  static constexpr std::size_t kMostConnections = 8;

 private:
  struct Connection;
  void serve();
  void accept_new(const Socket& listening, bool events);
  void send_events();
  void look_at(Connection& c);
  void take_bytes(Connection& c);
  void take_head(Connection& c);
  void answer_http(Connection& c, const HttpHead& head);
  void take_messages(Connection& c);
  void take_text(Connection& c, const std::string& text);
  void obey(Connection& c, const InverseCommand& command);
  void set(Connection& c, const InverseCommand& command);
  void move(Connection& c, const Eigen::Vector3d& position_m);
  void fault(Connection& c, std::uint16_t code, const std::string& why);
  void release(Connection& c);
  void drive(std::int64_t session);
  void tell_driver();
  void end_of(Connection& c);
  void send(Connection& c, std::string_view bytes);
  void flush(Connection& c);
  void say(Connection& c, const std::string& line);
  [[nodiscard]] InverseState state_for(const Connection& c) const;
  /// @param c null: of nobody in particular
  [[nodiscard]] InverseInventory inventory(const Connection* c) const;

  ServedHand& hand_;
  InverseServerSettings settings_;
  Socket listening_, events_;
  int port_ = 0, events_port_ = -1;
  std::vector<std::unique_ptr<Connection>> connections_;
  bool full_ = false;  ///< a connection was refused since there was room
  int times_full_ = 0;
  std::int64_t next_session_ = 1, driver_ = 0, mover_ = 0,
               presser_ = 0;  ///< sessions; 0: none
  DriverLog driver_log_;
  std::atomic<std::uint64_t> connected_{0}, refused_{0}, messages_{0}, states_{0}, unreadable_{0},
      closed_for_fault_{0};
  std::atomic<bool> ending_{false};
  std::mutex mutex_;                  ///< of to_tell_
  std::vector<std::string> to_tell_;  ///< frames
  std::thread thread_;
};

}  // namespace tpm::haptics
