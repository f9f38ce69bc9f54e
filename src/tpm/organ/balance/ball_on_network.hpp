#pragma once
#include <optional>
#include <vector>

#include "tpm/organ/balance/equilibrium.hpp"

namespace tpm::organ {

/// A rigid ball without friction that pushes spheres of an organ away and does not hold them. Each
/// sphere that it overlaps is pushed along the line of centres; the pair stores k/2 overlap^2.
struct BallTool {
  Eigen::Vector3d start_m = Eigen::Vector3d::Zero();  ///< its centre before it moves
  double radius_m = 0.0;                              ///< > 0
  double sphere_radius_m = 0.0;                       ///< of the organ's spheres
  double stiffness_N_per_m = 0.0;                     ///< k, of each overlap, > 0
  std::vector<std::size_t> touchable;                 ///< spheres that it may touch, rising

  /// Distance of centres at which they touch.
  [[nodiscard]] double reach_m() const { return radius_m + sphere_radius_m; }
  /// Distance that the ball, moved aside from its start, goes along a direction until it touches a
  /// sphere that it may touch; none if it meets none but on a flank, where it would slide off.
  /// @param into unit vector
  [[nodiscard]] std::optional<double> depth_to_touch_m(const Positions& rest,
                                                       const Eigen::Vector3d& aside_m,
                                                       const Eigen::Vector3d& into) const;
};

/// Default stiffness of the overlap of ball and sphere, N/m: so much more
/// than tissue that it costs little depth, and not so much that rounding shows.
inline constexpr double kUsualBallStiffness_N_per_m = 1e4;

/// A ball that touches the outermost layer of an organ at rest, and may touch all of that layer.
/// @param aim sphere on the axis along which it came
/// @param into direction it came along, unit vector
[[nodiscard]] BallTool ball_on_surface(const Organ& organ, std::size_t aim,
                                       const Eigen::Vector3d& into, double radius_m,
                                       double stiffness_N_per_m = kUsualBallStiffness_N_per_m);

/// An organ with a ball: what its equilibria need.
struct NetworkUnderBall {
  /// @param organ_bonds, rest, organ_constraints of the organ, without tools
  /// Throws Error(bad_input) for a ball without radius or stiffness.
  NetworkUnderBall(const BondSystem& organ_bonds, const Positions& rest,
                   const Constraints& organ_constraints, const BallTool& ball);

  BondSystem bonds;         ///< with the contacts of the ball
  Constraints constraints;  ///< the ball is fixed where it is put
  Positions position;       ///< of all spheres at rest, then of the ball
};

/// The quasi-static network under a ball that moves in space: double precision, every step balanced
/// by Newton's method with exact tangents, elongations linear in a step, under which the
/// viscous elongations are advanced exactly. The error falls with the square of the step.
class BallOnNetwork {
 public:
  /// @param bonds, constraints of the organ, without tools
  /// @param tolerance_N of the force left on each sphere
  /// Throws Error(bad_input) for a ball without radius or stiffness.
  BallOnNetwork(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
                const BallTool& ball, double tolerance_N = 1e-10);
  BallOnNetwork(const BallOnNetwork&) = delete;
  BallOnNetwork& operator=(const BallOnNetwork&) = delete;

  /// One step of any length to a place of the ball.
  /// @returns force of the tissue on the ball, N
  /// Throws Error(numerical) where the tissue buckles or the forces cannot be balanced.
  Eigen::Vector3d step(const Eigen::Vector3d& ball_m, double step_s);

  /// Of all spheres, then of the ball, m.
  [[nodiscard]] const Positions& position() const { return network_.position; }
  [[nodiscard]] int touching() const;
  /// In springs and overlaps.
  [[nodiscard]] double stored_J() const;
  [[nodiscard]] double dissipation_W() const;

 private:
  [[nodiscard]] bool balance(const Eigen::Vector3d& ball_m, const ViscousState& viscous_state);

  NetworkUnderBall network_;
  Equilibrium equilibrium_;
  double tolerance_N_;
  Eigen::VectorXd elongation_, viscous_;
};

}  // namespace tpm::organ
