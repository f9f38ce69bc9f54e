#pragma once
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <utility>

#include "tpm/haptics/inverse/web_socket.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpm/haptics/serve/inverse_server.hpp"

namespace tpm::haptics {

/// A client, or who may become one.
struct InverseServer::Connection {
  static constexpr int kMostLines = 20;  ///< in the log, except who drives

  enum class Stage { asking, open, leaving, gone };

  explicit Connection(Socket s) : socket(std::move(s)), since_ns(now_ns()) {}

  Socket socket;
  Stage stage = Stage::asking;
  std::int64_t since_ns;  ///< of the stage
  std::int64_t session = 0;
  bool events = false, centred = false, shut = false;
  bool turned_away = false;    ///< beyond the number that is served: told so, and nothing more
  std::int64_t pushed_ns = 0;  ///< its last force as the driver
  std::string head, out;
  WebSocketReader reader{WebSocketSide::server, kMostMessageBytes};
  std::size_t discarded = 0;
  int lines = 0;
  std::set<std::string> told;  ///< said to the log once, however often the client does it

  [[nodiscard]] bool first(const std::string& what) {
    const bool room = told.size() < static_cast<std::size_t>(kMostLines);  // it may name anything
    return room && told.insert(what).second;
  }
  void enter(Stage next) {
    stage = next;
    since_ns = now_ns();
  }
};

}  // namespace tpm::haptics
