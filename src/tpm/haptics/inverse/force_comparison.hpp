#pragma once
#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"

namespace tpm::haptics {

/// Compares the force that a service reports (`current_cursor_force`) with those commanded to it. A
/// filter between program and hand shows as a difference that stays.
///
/// A report agrees if each of its components lies within the range of the commands of the last
/// kLate_s or more, widened by
///
///     kTolerance_N + kTolerance F,    F: size of the largest of these commands.
///
/// A service may thus render late. A difference counts once it has lasted for kLasts_s.
///
/// It is not documented whether the report is the force that is rendered or the last command.
/// Agreement therefore proves nothing, and a difference ends no session: tpm hil serve reports the
/// force of its own tissue, too. A force that is reported where none was commanded is counted by
/// itself: somebody else pushes.
class ForceComparison {
 public:
  static constexpr double kTolerance_N = 0.02, kTolerance = 0.05;
  static constexpr double kLate_s = 0.05, kLasts_s = 0.2;

  /// Begins with a command of zero.
  void begin(std::int64_t at_ns) noexcept;
  void command(const Eigen::Vector3d& force_N, std::int64_t at_ns) noexcept;
  void report(const Eigen::Vector3d& force_N, std::int64_t at_ns) noexcept;
  /// A state came that names no force.
  void no_report() noexcept { ++unnamed_; }
  /// Findings of the comparison, one line each. May be called from any thread.
  [[nodiscard]] std::vector<std::string> findings() const;

 private:
  struct Commands {
    Eigen::Vector3d lowest_N = Eigen::Vector3d::Zero(), highest_N = Eigen::Vector3d::Zero();
    double largest_N = 0.0;
    void begin(const Eigen::Vector3d& force_N) noexcept;
    void add(const Eigen::Vector3d& force_N) noexcept;
  };

  // Commands since `since_ns_`, and those of at least kLate_s before.
  Commands now_, before_;
  std::int64_t since_ns_ = 0;
  Eigen::Vector3d last_N_ = Eigen::Vector3d::Zero();
  bool apart_ = false;
  std::int64_t apart_since_ns_ = 0, counted_until_ns_ = 0;
  // For findings().
  std::atomic<std::uint64_t> named_{0}, unnamed_{0};
  std::atomic<std::int64_t> apart_ns_{0}, unasked_ns_{0};  ///< unasked: nothing was commanded
  std::atomic<double> unasked_N_{0.0};
  std::atomic<double> farthest_N_{0.0}, commanded_N_{0.0}, reported_N_{0.0};
};

}  // namespace tpm::haptics
