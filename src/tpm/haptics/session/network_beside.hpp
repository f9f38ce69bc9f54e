#pragma once
#include <memory>
#include <thread>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/haptics/loop/triple_buffer.hpp"

namespace tpm::haptics {

/// Tangent stiffness at a contact, by its depth: instantaneous, of a tissue that has relaxed there.
class StiffnessByDepth {
 public:
  /// Arguments as of ServoNetwork. Throws Error(numerical) where the tissue buckles.
  StiffnessByDepth(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
                   std::size_t contact, const Eigen::Vector3d& into_tissue, double deepest_m);
  /// N/m; beyond the range that of its end.
  [[nodiscard]] Eigen::Matrix3d at(const Eigen::Vector3d& displacement_m) const noexcept;

 private:
  Eigen::Vector3d into_;
  double stride_m_;
  std::vector<Eigen::Matrix3d> stiffness_;
};

/// The whole network at a lower rate than the loop's, which uses the last force F and stiffness K
/// handed over, taken at u0, as F - K (u - u0) (docs/haptics.md). With threads the network works
/// beside the loop, and the hand-over is free of locks; without, it is stepped in the loop and its
/// answer used one of its own steps later, the same bits each time.
///
/// reset() and step() belong to one thread.
class NetworkBeside final : public ContactModel {
 public:
  /// @param network its period is periods_between(period_s) periods of the loop
  NetworkBeside(std::unique_ptr<ServoNetwork> network, StiffnessByDepth stiffness, double period_s,
                bool threads);
  ~NetworkBeside() override;
  NetworkBeside(const NetworkBeside&) = delete;
  NetworkBeside& operator=(const NetworkBeside&) = delete;

  /// Of the loop between two steps of the network: 5 ms, and at least one.
  [[nodiscard]] static int periods_between(double period_s);

  void reset() noexcept override;
  ContactAnswer step(const ToolPose& tool) noexcept override;
  [[nodiscard]] double period_s() const noexcept override { return period_s_; }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return network_->instantaneous_stiffness();
  }
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override {
    return network_->equilibrium_stiffness();
  }

  /// Periods of the loop that the answer in use is old.
  [[nodiscard]] std::uint64_t age() const noexcept { return step_ - used_.step; }

 private:
  /// Where the contact is at the end of a step of the network.
  struct Place {
    std::uint64_t run = 0;   ///< resets so far
    std::uint64_t step = 0;  ///< of the loop
    Eigen::Vector3d displacement_m = Eigen::Vector3d::Zero();
  };
  struct Linearised {
    std::uint64_t run = 0, step = 0;
    Eigen::Vector3d displacement_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
    Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
    double error_N = 0.0;
    double unforeseen_N_per_s = 0.0;  ///< what the answer before did not say, over its age
    bool valid = true;
  };
  void work() noexcept;
  [[nodiscard]] Linearised follow(const Place& place) noexcept;
  [[nodiscard]] Linearised at_rest() const noexcept;

  std::unique_ptr<ServoNetwork> network_;
  StiffnessByDepth stiffness_;
  double period_s_;
  std::uint64_t every_;
  // Of the loop.
  std::uint64_t run_ = 0, step_ = 0;
  Linearised used_, next_;
  // Of whoever steps the network.
  Place reached_;
  Eigen::Vector3d reached_N_ = Eigen::Vector3d::Zero();
  // Between the two.
  TripleBuffer<Place> places_;
  TripleBuffer<Linearised> answers_;
  std::atomic<bool> over_{false};
  bool threads_;
  std::thread thread_;
};

}  // namespace tpm::haptics
