#pragma once
#include <span>
#include <vector>

#include "tpm/organ/balance/ball_on_network.hpp"

namespace tpm::organ {

/// Where the centre of a ball is at an instant.
struct BallPlace {
  double time_s = 0.0;
  Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
};

/// The network of BallOnNetwork under the same ball by other means: CVODE (Adams, functional
/// iteration: viscous elongations change no faster than bonds relax) integrates it with an error
/// control of its own, the free spheres balanced by ImplicitBalance at each evaluation.
/// @param places at rising times, straight and even between them; the viscous state is zero at the
/// first
/// @param tolerance of the viscous elongations, in parts of the ball's reach, > 0
/// @returns force of the tissue on the ball at each place, N
/// Throws Error(bad_input) as NetworkUnderBall, Error(numerical) where forces cannot be balanced or
/// the integrator gives up.
[[nodiscard]] std::vector<Eigen::Vector3d> ball_forces_by_cvode(
    const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
    const BallTool& ball, std::span<const BallPlace> places, double tolerance);

}  // namespace tpm::organ
