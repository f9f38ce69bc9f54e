#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>

#include "tpm/base/namespaces.hpp"

namespace tpm::haptics {

/// Lines about who drives a served device. Each change has a line, whatever else a client has said.
/// Clients that come and go in quick succession do not fill the log: after kMost changes there is a
/// line each kAgain_ns, about the newest change and how many were left out.
class DriverLog {
 public:
  static constexpr int kMost = 20;
  static constexpr std::int64_t kAgain_ns = 1'000'000'000;

  /// @param session that drives from now on; 0: the one that drove does so no more
  void change(std::int64_t session) {
    if (session != 0) last_ = session;
    driven_ = session != 0;
    ++changes_;
  }
  /// A line that is due; empty: none is.
  [[nodiscard]] std::string line(std::int64_t now_ns) {
    if (changes_ == 0) return {};
    const std::int64_t earned = (now_ns - since_ns_) / kAgain_ns;
    if (earned > 0) {
      left_ = static_cast<int>(std::min<std::int64_t>(kMost, left_ + earned));
      since_ns_ += earned * kAgain_ns;
    }
    if (left_ == 0) return {};
    --left_;
    const std::uint64_t left_out = changes_ - 1;
    changes_ = 0;
    return fmt::format(
        "client {}: drives{}{}", last_, driven_ ? "" : " no more",
        left_out == 0 ? std::string() : fmt::format(" ({} earlier changes left out)", left_out));
  }

 private:
  std::int64_t last_ = 0;
  bool driven_ = false;
  std::uint64_t changes_ = 0;  ///< since the last line
  int left_ = kMost;           ///< lines
  std::int64_t since_ns_ = 0;  ///< from when the next one is earned
};

}  // namespace tpm::haptics
