#pragma once
#include <memory>
#include <string>

#include "tpm/haptics/session/live_view.hpp"

namespace tpm::haptics {

/// Serves the page of a session on 127.0.0.1, to be read only, from threads of its own which give
/// way to all others. What it takes from strangers is bounded: connections, bytes, time.
class PageServer {
 public:
  /// @param view must live as long as this
  /// @param port 0: one that is free
  /// Throws Error(environment) if the port is taken, or the page is not installed.
  PageServer(const LiveView& view, int port);
  /// Cuts whatever connection is left.
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  [[nodiscard]] int port() const noexcept;
  /// For people and browsers: "http://127.0.0.1:8080/"
  [[nodiscard]] std::string address() const;

 private:
  class Service;
  std::unique_ptr<Service> service_;
};

}  // namespace tpm::haptics
