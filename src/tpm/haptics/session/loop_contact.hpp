#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "tpm/haptics/loop/servo_step.hpp"
#include "tpm/haptics/session/rendering_check.hpp"
#include "tpm/haptics/session/session.hpp"

namespace tpm::haptics {

/// Settings of a contact that is opened for a haptic loop of the caller's own.
struct LoopContactOptions {
  double rate_Hz = 0.0;  ///< of the caller's loop, 500 to 4000; 0: that of the file, or 1 kHz
  /// Whose limits apply, as limits_of() takes it. Empty: the device of `device_file`, else omega7.
  /// "virtual" for a loop that moves nothing.
  std::string device;
  /// Measurements of it (schemas/device.schema.json), see limits_from(). Without a delay measured
  /// on it hardware counts as 20 ms late and free of friction (check_rendering()).
  std::filesystem::path device_file;
  bool start_gate = true;    ///< forces wait until the tool is in free air and at rest
  double longest_s = 600.0;  ///< of a law file: for how long spring-pots keep their history, > 0
  /// Do not refuse what would be unstable (RenderingCheck::refusal()). Only of a device without
  /// motors ("virtual"): else Error(usage).
  bool accept_unstable = false;
};

/// The state of a contact after a step, as a drawing thread gets it. Device coordinates.
struct LoopContactState {
  ServoRecord row;
  double time_s = 0.0;                                  ///< of the contact, missed periods included
  std::uint64_t missed = 0;                             ///< periods without a step so far
  Eigen::Vector3d surface_m = Eigen::Vector3d::Zero();  ///< where the tissue begins
};

/// The contact of a session or of a law, stepped by a haptic loop of the caller's own (CHAI3D,
/// SOFA, ROS 2, the C interface). A step is a whole cycle of `tpm hil run`: contact, slip, limits,
/// passivity, watch of energy and oscillation (ServoStep). Phases of a session are not followed;
/// the contact lasts as long as it is stepped.
///
/// One thread steps, one other may draw. step() neither allocates nor locks nor throws.
class LoopContact {
 public:
  /// Reads a session (schemas/hil.schema.json) or a law (schemas/law.schema.json); which of the two
  /// it is, the key `model` or `law` says.
  /// Throws Error(usage) for an option out of its range, Error(bad_input) as read_session(),
  /// read_law() and make_loop_model() do, Error(answer_is_no) if the rendering would be unstable or
  /// beyond the device's limits.
  explicit LoopContact(const std::filesystem::path& file, const LoopContactOptions& options = {});
  ~LoopContact();
  LoopContact(const LoopContact&) = delete;
  LoopContact& operator=(const LoopContact&) = delete;

  /// One period of the loop.
  /// @param position_m of the tool, device coordinates
  /// @param force_N on the hand, device coordinates; zero once the contact has stopped
  /// @param missed periods since the last step in which the caller did not step, >= 0: the tissue
  ///        lives through them with the motion taken as linear
  ///        A loop that misses some in more calls than the session allows, also while the contact
  ///        waits to begin, or more than the tissue can make up for, is stopped: overrun_storm
  /// @returns none, or why the contact has stopped; it then stays so until reset()
  StopCause step(const Eigen::Vector3d& position_m, Eigen::Vector3d& force_N,
                 int missed = 0) noexcept;
  /// The same by the caller's clock: the number of periods since the last step follows from the
  /// time, so that a loop at another rate lives through the same time as the contact. Between two
  /// periods of the contact the force of the last one is held. The mean rate counts, not each
  /// interval: the contact lives through one period a call while it is within 1.25 of the clock.
  /// @param time_s of any clock that does not jump; rising from call to call, at most kMostTime_s
  ///               in size: a hundredth of any period must still tell
  /// @returns as step(); kBadTime, with a zero force and without a step, for a time that is not
  ///          finite, larger, before that of the last call, or the same in more than kMostStill
  ///          calls in a row
  StopCause step_at(double time_s, const Eigen::Vector3d& position_m,
                    Eigen::Vector3d& force_N) noexcept;
  static constexpr StopCause kBadTime = StopCause::exception;
  static constexpr double kMostTime_s = 1e10;
  static constexpr int kMostStill = 100;
  /// Back to rest. Allocates: not for the loop.
  void reset();

  /// The newest state. For one thread that draws; never waits.
  [[nodiscard]] LoopContactState state() noexcept;
  /// Where all spheres are, in the coordinates of the scene, m. Spheres but that of the contact are
  /// those of the model stepped every kDrawnEvery_s with the motion of the contact. For the thread
  /// that draws.
  /// @param all 3 x spheres()
  void positions(Eigen::Ref<Eigen::Matrix3Xd> all) noexcept;

  [[nodiscard]] Eigen::Index spheres() const { return loop_.shape.rest_m.cols(); }
  [[nodiscard]] const HilSession& session() const { return session_; }
  [[nodiscard]] const LoopModel& loop() const { return loop_; }
  [[nodiscard]] const RenderingCheck& rendering() const { return rendering_; }
  [[nodiscard]] double period_s() const { return session_.servo.period_s; }

 private:
  struct Stepped;  ///< what a reset makes anew

  HilSession session_;
  LoopModel loop_;
  RenderingCheck rendering_;
  ServoSettings settings_;
  std::unique_ptr<Stepped> stepped_;
  Eigen::Matrix3Xd displacement_m_;
  std::uint64_t drawn_ = 0;                               ///< steps of the drawn model
  Eigen::Vector3d drawn_at_m_ = Eigen::Vector3d::Zero();  ///< contact at the last of them
};

}  // namespace tpm::haptics
