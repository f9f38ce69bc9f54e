#pragma once
#include <functional>
#include <string>

#include "tpm/haptics/serve/inverse_server.hpp"
#include "tpm/haptics/session/rendering_check.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {

struct ServeOptions {
  int port = 10001, events_port = 10020;  ///< 0: one that is free
  double duration_s = 0.0;                ///< 0: until interrupted
  bool poll = false;                      ///< the server's thread never sleeps
  RealTimeWish wish = RealTimeWish::ignore;
  std::function<bool()> interrupted;
  std::function<void(const std::string&)> log;  ///< a line, from the server's thread
  /// Called when clients can come.
  std::function<void(const InverseServer&, const DeviceIdentity&, const LoopModel&)> opened;
  std::function<void(const ServoRecord&)> watcher;  ///< as that of a session
};

struct ServeRun {
  ServoOutcome outcome;
  RenderingCheck rendering;
  InverseServer::Counts counts;
  double largest_force_N = 0.0;  ///< of tissue and client together, that the device rendered
};

/// Serves the tissue of a session, in real time, on a simulated device that is compatible with the
/// Inverse service. The hand follows the phases of the session, then stays where they end, and goes
/// where a client or the page at the server's address moves it. No hardware moves and no person
/// holds anything, so the session's supervision only counts; its force limit stays.
/// Throws as run_session().
[[nodiscard]] ServeRun serve_session(const HilSession& session, const ServeOptions& options);

/// Text of an answer, and the same as JSON.
[[nodiscard]] std::string serve_text(const HilSession& session, const ServeRun& run);
[[nodiscard]] Json serve_json(const HilSession& session, const ServeRun& run);

}  // namespace tpm::haptics
