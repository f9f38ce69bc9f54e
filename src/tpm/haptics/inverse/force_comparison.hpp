#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/loop/published.hpp"
#include "tpmkit/device.hpp"

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
  void no_report() noexcept;
  /// Findings of the comparison: force_not_reported, force_without_command, force_differs. May be
  /// called from any thread.
  [[nodiscard]] std::vector<DeviceFinding> findings() const;

 private:
  void compare(const Eigen::Vector3d& force_N, std::int64_t at_ns) noexcept;

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
  struct Totals {
    std::uint64_t named = 0, unnamed = 0;       ///< states with a force and without
    std::int64_t apart_ns = 0, unasked_ns = 0;  ///< unasked: nothing was commanded
    double unasked_N = 0.0;
    double farthest_N = 0.0, commanded_N = 0.0, reported_N = 0.0;  ///< of the largest difference
  };
  Totals totals_;
  Published<Totals> published_;  ///< for findings()
};

}  // namespace tpm::haptics
