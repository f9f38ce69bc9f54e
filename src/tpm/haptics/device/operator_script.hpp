#pragma once
#include <Eigen/Core>
#include <vector>

namespace tpm::haptics {

/// A stretch of what an operator means to do: along one direction, and across it.
struct OperatorPiece {
  enum class Aim {
    place,  ///< a position, m, reached through the stiffness of the arm
    force,  ///< a push, N
  };
  Aim aim = Aim::place;
  double end_s = 0.0;  ///< begins where the one before ends
  double from = 0.0, to = 0.0;
  /// Where the hand means to be across, m, in the coordinates of the device.
  Eigen::Vector3d across_from_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d across_to_m = Eigen::Vector3d::Zero();
};

/// Intention of an operator at an instant.
struct OperatorAim {
  OperatorPiece::Aim aim = OperatorPiece::Aim::place;
  double value = 0.0;  ///< m or N
  double rate = 0.0;   ///< its change, a second
  Eigen::Vector3d across_m = Eigen::Vector3d::Zero(), across_m_per_s = Eigen::Vector3d::Zero();
};

/// Intended motion of an operator, for a simulated arm.
class OperatorScript {
 public:
  OperatorScript() = default;
  explicit OperatorScript(std::vector<OperatorPiece> pieces) : pieces_(std::move(pieces)) {}

  /// Calls with rising times are cheap. There is at least one piece.
  [[nodiscard]] OperatorAim at(double time_s) noexcept;
  [[nodiscard]] const std::vector<OperatorPiece>& pieces() const { return pieces_; }

 private:
  std::vector<OperatorPiece> pieces_;
  std::size_t now_ = 0;
  double start_s_ = 0.0;
};

}  // namespace tpm::haptics
