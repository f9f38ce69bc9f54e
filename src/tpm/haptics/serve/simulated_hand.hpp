#pragma once
#include <atomic>
#include <optional>
#include <vector>

#include "tpm/haptics/device/virtual_plant.hpp"
#include "tpm/haptics/loop/triple_buffer.hpp"
#include "tpm/haptics/serve/inverse_server.hpp"
#include "tpmkit/device.hpp"

namespace tpm::haptics {

struct SimulatedHandSettings {
  PlantSettings plant;
  OperatorScript script;       ///< of the hand, while nobody moves it
  double force_limit_N = 8.0;  ///< of tissue and client together; nobody raises it
  double reach_m = 0.075;      ///< from the middle of the workspace to its end
};

/// A simulated device, the hand that holds it, and a client that pushes it as well as the tissue.
/// The servo loop uses it as a HapticDevice, the server as a ServedHand; they meet in mailboxes.
///
/// Device and arm move exactly for a force and a goal that stay within a period (place_propagator):
///
///     m x'' + b x' + k (x - goal) = F_tissue + F_client
///
/// along each axis; the forces are those of `delay_periods` ago. Where the script asks for a push
/// in place of a place, the goal is where the hand is and the push is added. At the end of the
/// workspace the device meets a stop, as a mechanism does: it keeps its speed along the stop and
/// loses that against it.
///
/// The hand holds a grip that leans with it: by kLean_rad_per_m about the axis across its way from
/// the middle of the workspace. Its buttons are those that a client presses.
class SimulatedHand final : public HapticDevice, public ServedHand {
 public:
  explicit SimulatedHand(SimulatedHandSettings settings);

  const DeviceIdentity& open() override;
  void prepare(const DevicePreparation& preparation) override;
  void enable_forces() override { forces_on_ = true; }
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override;
  DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept override;
  DeviceStatus status() noexcept override;
  void advance(double seconds) noexcept override;
  void stop() noexcept override { forces_on_ = false; }
  void cut_forces() noexcept override { forces_on_ = false; }

  [[nodiscard]] InverseState state() noexcept override;
  void push(const Eigen::Vector3d& force_N) noexcept override;
  void move_to(const std::optional<Eigen::Vector3d>& position_m) noexcept override;
  void let_go() noexcept override;
  void press(std::uint32_t buttons) noexcept override { buttons_ = buttons; }

  static constexpr double kLean_rad_per_m = 10.0;

  /// Largest force that was rendered, N; from any thread.
  [[nodiscard]] double largest_N() const noexcept { return largest_N_; }

 private:
  struct Wish {
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero(), goal_m = Eigen::Vector3d::Zero();
    std::int64_t force_at_ns = 0;
    bool guided = false;
  };
  void step() noexcept;
  void meet_stop() noexcept;
  [[nodiscard]] Eigen::Vector3d client_force_N() const noexcept;

  SimulatedHandSettings settings_;
  Eigen::Matrix<double, 2, 3> propagator_;
  DeviceIdentity identity_;
  Wish wish_;                  ///< of the server's thread
  std::uint32_t buttons_ = 0;  ///< the same
  TripleBuffer<Wish> asked_;
  TripleBuffer<InverseState> shown_;
  Eigen::Vector3d at_m_, speed_m_per_s_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d tissue_N_ = Eigen::Vector3d::Zero(), rendered_N_ = Eigen::Vector3d::Zero();
  double time_s_ = 0.0, owed_s_ = 0.0;
  std::vector<Eigen::Vector3d> on_their_way_;  ///< forces, a ring
  std::size_t oldest_ = 0;
  std::uint64_t saturations_ = 0;
  std::atomic<double> largest_N_{0.0};
  std::atomic<bool> forces_on_{false};
  /// Of what a client may push with; lowered by prepare() while the server's thread may already
  /// read.
  std::atomic<double> force_limit_N_{0.0};
};

}  // namespace tpm::haptics
