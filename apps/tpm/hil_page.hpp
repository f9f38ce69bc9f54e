#pragma once
#include <memory>
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/session/live_view.hpp"
#include "tpm/haptics/session/page_server.hpp"
#include "tpm/haptics/session/session_run.hpp"

namespace tpm::app {

/// A port to listen on: 0 for one that is free, or 1024 to 65535. Throws Error(usage) naming the
/// option.
[[nodiscard]] int port_of_option(const std::string& text, const char* option);

/// Options of a session with a page.
struct PageOptions {
  std::string port;  ///< empty: no page
  std::string wait = "60 s", keep = "2 s";
};

/// The page of a session, from before it begins until a little after its end.
class HilPage {
 public:
  /// Says the address on standard error. Throws Error.
  HilPage(const HilSession& session, bool real_time, const PageOptions& options);

  /// Makes a session show itself here, and wait for somebody to look.
  void show(SessionRunOptions& options);
  void see(const ServoRecord& row) { view_.see(row); }
  /// Keeps the page for those who look.
  /// @param interrupted as in SessionRunOptions
  void end(const ServoOutcome& outcome, const std::function<bool()>& interrupted);

 private:
  LiveView view_;
  double wait_s_, keep_s_;
  PageServer server_;
};

}  // namespace tpm::app
