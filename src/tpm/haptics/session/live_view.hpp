#pragma once
#include <atomic>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "tpm/haptics/session/session.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {

/// Contents of the page of a session (docs/haptics.md). One thread feeds it with records, in real
/// time the one that writes them and never the servo thread; any number may ask.
class LiveView {
 public:
  LiveView(const HilSession& session, bool real_time);

  void opened(const DeviceIdentity& device, const LoopModel& model);
  void see(const ServoRecord& row);
  void ended(const ServoOutcome& outcome);

  /// Fixed part: session, phases, device, tissue at rest. An empty object before opened().
  [[nodiscard]] std::string scene_json() const;
  /// Changing part. A number that is not finite is null.
  /// @param after the first point of the traces that is wanted
  [[nodiscard]] std::string state_json(std::uint64_t after) const;
  /// Somebody has asked for what changes.
  [[nodiscard]] bool watched() const noexcept { return watched_; }

 private:
  /// One point of the traces; of the force the extremes since the point before too.
  struct Point {
    double time_s, target_m, target_N, tool_m, model_N, commanded_N, least_N, most_N;
  };
  /// Copied as a whole for whoever asks.
  struct State {
    ServoRecord last;
    ServoCounts counts;
    double commanded_N = 0.0, target_m = 0.0, target_N = 0.0;
    double time_s = 0.0, served_Hz = 0.0, least_J = 0.0;
    double late_p99_s = 0.0, late_max_s = 0.0, busy_p50_s = 0.0, busy_p99_s = 0.0, busy_max_s = 0.0;
    std::uint64_t lost = 0;  ///< records that the ring had no room for
    std::uint64_t first_point = 0;
    std::deque<Point> points;
    std::vector<std::int32_t> displacement_um;         ///< x, y, z of each sphere
    Eigen::Vector3d hand_N = Eigen::Vector3d::Zero();  ///< commanded, in the scene's coordinates
    Eigen::Vector3d tool_m = Eigen::Vector3d::Zero();  ///< from the surface at rest, scene
    std::string place;  ///< what is missing before the session can begin
    bool begun = false, over = false;
    StopCause cause = StopCause::none;
    std::string detail;
  };
  /// The points from the one numbered `after` on.
  [[nodiscard]] static Json trace_json(const State& s, std::uint64_t after);
  void count(const ServoRecord& row);
  void count_late(int missed);
  [[nodiscard]] Eigen::Vector3d tool_of(const ServoRecord& row) const;
  void take_point(const ServoRecord& row);
  void take_shape(const ServoRecord& row);
  void take_times();

  HilSession session_;
  const bool real_time_;
  mutable std::mutex mutex_;  ///< of all that follows
  State state_;
  std::string scene_ = "{}";
  TissueShape shape_;
  Eigen::Matrix3Xd displacement_m_;
  OperatorScript script_;
  TimeHistogram late_, busy_;
  std::deque<bool> late_last_;  ///< of the last 1000 rows, which had missed a period
  int late_now_ = 0;            ///< of them
  std::uint64_t next_point_ = 0, window_from_ = 0, window_served_ = 0;
  double least_N_ = 0.0, most_N_ = 0.0;  ///< commanded, since the last point
  mutable std::atomic<bool> watched_{false};
};

/// Instruction to the operator, a sentence.
[[nodiscard]] std::string instruction_of(const SessionPhase& phase);
/// The same before the session begins, from a row of waiting.
[[nodiscard]] std::string instruction_of(const ServoRecord& waiting);

}  // namespace tpm::haptics
