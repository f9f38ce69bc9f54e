#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "tpm/haptics/device/operator_script.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {

/// An operator's arm: mass, damper and spring towards where the hand means to be (one published
/// fit), and the eye that moves that place while the depth shown is not the depth wanted.
struct ArmSettings {
  double mass_kg = 0.554;
  double damping_N_s_per_m = 6.45;
  double stiffness_N_per_m = 135.0;
  double correction_per_s = 3.0;  ///< rate at which a wrong depth is corrected

  [[nodiscard]] bool operator==(const ArmSettings&) const = default;
};

/// Workspace of a simulated device: a cylinder about the x axis, around the origin.
struct CylinderWorkspace {
  double radius_m = 0.0, half_length_m = 0.0;
};

/// A simulated Omega.7 and the arm that holds it.
struct PlantSettings {
  double period_s = 1e-3;          ///< of the commands
  double mass_kg = 0.3;            ///< moved by the hand, > 0
  double damping_N_s_per_m = 0.3;  ///< friction, >= 0
  double encoder_step_m = 1e-5;    ///< 0: positions as they are
  double motor_limit_N = 12.0;     ///< of the length of the force
  double watchdog_s = 0.008;       ///< forces are cut without a command for so long
  double least_watchdog_s = 0.0;   ///< what is asked of the watchdog counts only above it
  int delay_periods = 0;           ///< from a command to its force
  /// If given: where the hand means to be, along `push`, in place of its script.
  std::optional<double> arm_set_point_m = std::nullopt;
  double velocity_limit_m_per_s = 2.0;  ///< above it forces are cut
  ArmSettings arm;
  Eigen::Vector3d push = -Eigen::Vector3d::UnitZ();    ///< unit vector along which the script goes
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< from where
  /// At its end the handle meets a stop, as that of a mechanism does: it keeps its speed along the
  /// stop and loses that against it. Empty: no stop.
  std::optional<CylinderWorkspace> workspace = std::nullopt;
};

/// Assumptions among the settings, one line each.
[[nodiscard]] std::vector<Remark> assumptions_of(const PlantSettings& settings);

/// Motion of device and arm in a period around the place that the hand holds: distance and speed
/// from distance, speed and a constant force, exactly.
[[nodiscard]] Eigen::Matrix<double, 2, 3> place_propagator(const PlantSettings& settings);

/// The motion of device and arm under held commands: exact for a constant force and an intended
/// place that moves at constant speed, so that no integrator adds damping of its own. A hand whose
/// handle is at a stop does not correct a depth beyond it.
class VirtualPlant {
 public:
  VirtualPlant(const PlantSettings& settings, OperatorScript script);

  /// Reading of the encoders, m.
  [[nodiscard]] Eigen::Vector3d measured_m() const noexcept;
  /// A new command, N; true if the motors cannot give it.
  bool command(const Eigen::Vector3d& force_N) noexcept;
  /// One period passes.
  void advance() noexcept;

  [[nodiscard]] double time_s() const noexcept;
  [[nodiscard]] Eigen::Vector3d position_m() const noexcept {
    return settings_.origin_m + along_ * push_ + across_;
  }
  [[nodiscard]] Eigen::Vector3d velocity_m_per_s() const noexcept {
    return along_speed_ * push_ + across_speed_;
  }
  [[nodiscard]] bool watchdog_tripped() const noexcept { return watchdog_tripped_; }
  [[nodiscard]] bool too_fast() const noexcept { return too_fast_; }
  void forces(bool on) noexcept { forces_on_ = on; }
  /// The hand holds still where its script begins, until begin().
  void await() noexcept { waiting_ = true; }
  [[nodiscard]] bool waiting() const noexcept { return waiting_; }
  /// The script begins now.
  void begin() noexcept;
  /// Puts the place that the hand means somewhere; the device stays.
  void put_hand(double along_m) noexcept { meant_ = along_m; }

 private:
  using Propagator = Eigen::Matrix<double, 2, 3>;

  PlantSettings settings_;
  OperatorScript script_;
  Eigen::Vector3d push_;
  Propagator to_place_, free_;
  std::vector<Eigen::Vector3d> pending_;  ///< commands on their way, a ring
  std::size_t oldest_ = 0;
  Eigen::Vector3d command_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d across_ = Eigen::Vector3d::Zero(), across_speed_ = Eigen::Vector3d::Zero();
  double along_ = 0.0, along_speed_ = 0.0;
  double meant_ = 0.0;                              ///< place, m
  Eigen::Vector3d stop_ = Eigen::Vector3d::Zero();  ///< outwards, where the handle is at a stop
  [[nodiscard]] OperatorAim aim() noexcept;
  void meet_stop() noexcept;

  bool aimed_at_place_ = true, waiting_ = false;
  long periods_ = 0, since_command_ = 0;
  long began_ = 0;  ///< the period in which the script began
  bool forces_on_ = true, watchdog_tripped_ = false, too_fast_ = false;
};

}  // namespace tpm::haptics
