#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tpm/haptics/loop/delay_watch.hpp"
#include "tpm/haptics/loop/energy_watch.hpp"
#include "tpm/haptics/loop/late_energy_watch.hpp"
#include "tpm/haptics/loop/one_sided_contact.hpp"
#include "tpm/haptics/loop/oscillation_watch.hpp"
#include "tpm/haptics/loop/passivity.hpp"
#include "tpm/haptics/loop/start_gate.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {

/// One cycle of the loop: read, model, limits, passivity, write. Neither allocates nor locks nor
/// throws.
///
/// **Slip.** Forces are limited by a slip element between the hand and the model's tool, not by
/// changing what the model answers: with the cap
///
///     C = min(limit, F_before + s T),   limit = ramp-in's part of force_limit_N,
///
/// the model's tool is set back by d >= 0 along the push so that the force predicted from
/// the stiffness is <= C; what is sent is min(F, C). The work of the hand is that of the model's
/// tool plus F d >= 0: a slip takes energy and never gives any (exact where F <= C; where the
/// tissue is stiffer than predicted, F - C lasts one period). While the force is zero the model's
/// tool recovers towards the hand, which costs nothing.
///
/// **Damping.** Once the rendering has given energy away, the passivity controller adds damping.
/// The sum never pulls the hand towards the tissue, rises no faster than the limit of the rise
/// allows, and is zero where the tissue's force is. A rendering that needs damping in more than
/// kMostDamped of its cycles is not what the session asked for, and ends.
///
/// **Validity.** A force outside the validity of the model is not sent. The last valid force
/// stays, fades with `fade_s`, falls as the hand withdraws (by K dx, so that no more than F^2/2K
/// comes back) and never rises. When forces are valid again the model's tool slips to the force
/// that is being sent.
class ServoStep {
 public:
  /// Positions of earlier calls are used for so long; a jump is not counted over a longer time.
  static constexpr double kMostStale_s = 0.020;

  /// @param device, model must live as long as this
  ServoStep(HapticDevice& device, ContactModel& model, ServoSettings settings);

  /// @param missed periods that went by without a cycle: the model lives through them too, in this
  ///        cycle and the next ones, at most kMostSteps periods in each
  /// @return none to go on; the row is filled either way, and the device is stopped if not none
  StopCause cycle(int missed, ServoRecord& row) noexcept;
  /// Zero force, forces off. Bounded. Keeps the first cause.
  void stop(StopCause cause) noexcept;
  /// After the loop: completes the cause of a lost connection with what the device has learned.
  void complete_cause() noexcept {
    if (cause_ != StopCause::communication || !device_.learn_end()) return;
    const StopCause known = look_at_status();
    if (known != StopCause::none) cause_ = known;
  }
  /// The cause in words where it alone does not say enough; else empty.
  [[nodiscard]] std::string detail() const;

  [[nodiscard]] const ServoCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] const DeviceStatus& device_status() const noexcept { return status_; }
  [[nodiscard]] StopCause cause() const noexcept { return cause_; }
  [[nodiscard]] std::uint64_t cycles() const noexcept { return cycle_; }
  [[nodiscard]] const EnergyWatch& energy() const noexcept { return energy_; }
  /// True if the motion is searched for a delay that has grown.
  [[nodiscard]] bool passive() const noexcept { return passive_; }

  /// Periods of the model in one cycle, at most.
  static constexpr int kMostSteps = 8;
  /// Share of the cycles in which damping may act, with the time constant over which it is counted.
  static constexpr double kMostDamped = 0.05, kDampedWindow_s = 5.0;

 private:
  /// A force of the model, and the motion and the periods that led to it.
  struct ModelForce {
    double force_N = 0.0, withdrawn_m = 0.0;
    int steps = 1;
    bool touching = false, valid = true;
  };
  struct Cap {
    double force_N = 0.0;
    std::uint32_t flag = 0;
  };
  [[nodiscard]] StopCause wait(int missed, ServoRecord& row) noexcept;
  void begin_row(int missed) noexcept;
  [[nodiscard]] bool free_in_space() noexcept;
  [[nodiscard]] StopCause read(int missed, ServoRecord& row) noexcept;
  void touch(int missed, ServoRecord& row) noexcept;
  void touch_along_push(int steps, ServoRecord& row) noexcept;
  void touch_in_space(int steps, ServoRecord& row) noexcept;
  [[nodiscard]] Cap cap() const noexcept;
  [[nodiscard]] double recovery_m() const noexcept;
  void learn_stiffness(double rise_N, double moved_m) noexcept;
  [[nodiscard]] double rendered_N(const ModelForce& model, const Cap& cap,
                                  ServoRecord& row) noexcept;
  void count_limits(std::uint32_t flags) noexcept;
  [[nodiscard]] Eigen::Vector3d with_damping(ServoRecord& row) noexcept;
  [[nodiscard]] StopCause check_rendering(int periods) noexcept;
  [[nodiscard]] StopCause write(const Eigen::Vector3d& force_N, ServoRecord& row) noexcept;
  [[nodiscard]] StopCause look_at_status() noexcept;
  [[nodiscard]] bool storm(int missed) noexcept;
  [[nodiscard]] StopCause work(int missed, ServoRecord& row) noexcept;

  HapticDevice& device_;
  ContactModel& model_;
  ServoSettings settings_;
  OneSidedContact contact_;
  PassivityControl passivity_;
  EnergyWatch energy_;
  OscillationWatch oscillation_;
  LateEnergyWatch late_;
  DelayWatch delay_;
  /// The rendering is passive with the friction of the device: a delay that has grown is looked for
  /// in the motion too, because the energy of a later force alone would stop every fast motion.
  bool passive_;
  double outside_validity_periods_;  ///< after which the session ends
  std::optional<StartGate> gate_;
  ServoCounts counts_;
  DeviceStatus status_;
  HandState hand_;
  Eigen::Vector3d position_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d moved_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d sent_N_ = Eigen::Vector3d::Zero();
  double sent_size_N_ = 0.0;    ///< of sent_N_
  double tissue_size_N_ = 0.0;  ///< of tissue_N_
  int to_status_ = 0;           ///< cycles until the device is asked for its status
  Eigen::Vector3d tissue_N_ = Eigen::Vector3d::Zero();  ///< on the hand, after slip and fading
  double tool_m_ = 0.0, surface_m_ = 0.0, leak_J_ = 0.0;
  double stiffness_N_per_m_;        ///< that a slip is predicted with
  double least_stiffness_N_per_m_;  ///< at rest
  double model_N_ = 0.0;            ///< size of the model's last force, valid or not
  double slip_m_ = 0.0;             ///< of the model's tool behind the hand, along the push
  Eigen::Vector3d slip_in_space_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d model_tool_m_ = Eigen::Vector3d::Zero();   ///< in space, from surface_m
  Eigen::Vector3d model_force_N_ = Eigen::Vector3d::Zero();  ///< on it, device coordinates
  double tissue_work_J_ = 0.0;                               ///< on the surface in this cycle
  double damped_share_ = 0.0;  ///< of the cycles of the last kDampedWindow_s
  double outside_validity_steps_ =
      0.0;  ///< periods outside validity, forgotten ten times as slowly
  bool was_outside_validity_ = false;
  int owed_ = 0;     ///< periods that the model has not lived through yet
  int stale_ = 0;    ///< periods for which the position is that of an earlier call
  ServoRecord row_;  ///< of this cycle; what it does not know anew is from the one before
  std::uint64_t cycle_ = 0;
  std::size_t phase_ = 0;
  std::vector<char> late_cycles_;  ///< of the last cycles served, a ring
  std::size_t served_ = 0;
  int late_now_ = 0;
  bool begun_ = false, awaited_ = false;
  StopCause cause_ = StopCause::none;
  bool too_stale_ = false;
};

}  // namespace tpm::haptics
