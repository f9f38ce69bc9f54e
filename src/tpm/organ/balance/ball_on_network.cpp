#include "tpm/organ/balance/ball_on_network.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpm/organ/bonds/tool.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

BondSystem with_ball(const BondSystem& bonds, const BallTool& ball) {
  if (!(ball.radius_m > 0.0)) throw bad_input("ball", "its radius is not above 0", "a ball");
  if (!(ball.stiffness_N_per_m > 0.0)) {
    throw bad_input("ball", "its stiffness is not above 0", "that of an overlap");
  }
  const auto column = static_cast<std::uint32_t>(bonds.spheres());
  std::vector<ToolContact> contacts;
  for (const std::size_t sphere : ball.touchable) {
    contacts.push_back({static_cast<std::uint32_t>(sphere), column, ball.reach_m(),
                        ball.stiffness_N_per_m, std::nullopt});
  }
  return bonds.with_tools(1, contacts);
}

Constraints with_ball_held(const Constraints& constraints) {
  Constraints all = constraints.extended(1);
  all.fix(constraints.size());
  return all;
}

Positions with_ball_at(const Positions& rest, const Eigen::Vector3d& ball_m) {
  Positions all(3, rest.cols() + 1);
  all.leftCols(rest.cols()) = rest;
  all.rightCols<1>() = ball_m;
  return all;
}

}  // namespace

std::optional<double> BallTool::depth_to_touch_m(const Positions& rest,
                                                 const Eigen::Vector3d& aside_m,
                                                 const Eigen::Vector3d& into) const {
  constexpr double kFlank = 0.8;  // of the reach, aside
  std::optional<double> depth_m;
  for (const std::size_t sphere : touchable) {
    const Eigen::Vector3d apart = rest.col(static_cast<Eigen::Index>(sphere)) - start_m - aside_m;
    const double along_m = apart.dot(into);
    const double across2 = (apart - along_m * into).squaredNorm();
    if (across2 > kFlank * kFlank * reach_m() * reach_m()) continue;
    const double met_m = along_m - std::sqrt(reach_m() * reach_m() - across2);
    depth_m = std::min(met_m, depth_m.value_or(met_m));
  }
  return depth_m;
}

BallTool ball_on_surface(const Organ& organ, std::size_t aim, const Eigen::Vector3d& into,
                         double radius_m, double stiffness_N_per_m) {
  BallTool ball;
  ball.radius_m = radius_m;
  ball.sphere_radius_m = organ.radius;
  ball.stiffness_N_per_m = stiffness_N_per_m;
  ball.start_m = touching_tool({ToolKind::sphere, radius_m}, organ, aim, into).position;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] == 0) ball.touchable.push_back(i);
  }
  return ball;
}

NetworkUnderBall::NetworkUnderBall(const BondSystem& organ_bonds, const Positions& rest,
                                   const Constraints& organ_constraints, const BallTool& ball)
    : bonds(with_ball(organ_bonds, ball)),
      constraints(with_ball_held(organ_constraints)),
      position(with_ball_at(rest, ball.start_m)) {}

BallOnNetwork::BallOnNetwork(const BondSystem& bonds, const Positions& rest,
                             const Constraints& constraints, const BallTool& ball,
                             double tolerance_N)
    : network_(bonds, rest, constraints, ball),
      equilibrium_(network_.bonds, network_.constraints),
      tolerance_N_(tolerance_N) {
  require_one_linear_branch(network_.bonds, "a ball on a network");
  network_.bonds.elongations(network_.position, elongation_);
  viscous_ = Eigen::VectorXd::Zero(elongation_.size());
}

bool BallOnNetwork::balance(const Eigen::Vector3d& ball_m, const ViscousState& viscous_state) {
  constexpr int kMostParts = 64;
  const Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, network_.position.cols());
  const Eigen::Vector3d from = network_.position.rightCols<1>();
  // A place too far for one search is approached along a line, under the same viscous state.
  for (int parts = 1; parts <= kMostParts; parts *= 4) {
    Positions next = network_.position;
    bool found = true;
    for (int i = 1; i <= parts && found; ++i) {
      next.rightCols<1>() = from + static_cast<double>(i) / parts * (ball_m - from);
      const EquilibriumSearch search = equilibrium_.find(next, viscous_state, load, tolerance_N_);
      found = search.converged && search.stable;
    }
    if (!found) continue;
    network_.position = std::move(next);
    return true;
  }
  return false;
}

Eigen::Vector3d BallOnNetwork::step(const Eigen::Vector3d& ball_m, double step_s) {
  const RelaxationWeights w = relaxation_weights(step_s / network_.bonds.relaxation_time_s());
  ViscousState viscous_state;
  viscous_state.offset = w.r * viscous_ + w.w0 * elongation_;
  viscous_state.relaxation_factor = w.w1;
  if (!balance(ball_m, viscous_state)) {
    throw Error(ExitCode::numerical, "ball",
                fmt::format("no stable equilibrium with the ball at ({}, {}, {}) mm",
                            significant(1e3 * ball_m.x(), 5), significant(1e3 * ball_m.y(), 5),
                            significant(1e3 * ball_m.z(), 5)));
  }
  network_.bonds.elongations(network_.position, elongation_);
  viscous_ = viscous_state.offset + w.w1 * elongation_;
  Eigen::Matrix3Xd force;
  equilibrium_.forces(network_.position, viscous_state,
                      Eigen::Matrix3Xd::Zero(3, network_.position.cols()), force);
  return force.rightCols<1>();
}

int BallOnNetwork::touching() const {
  const std::vector<char> closed = network_.bonds.closed_contacts(network_.position);
  return static_cast<int>(std::count(closed.begin(), closed.end(), 1));
}

double BallOnNetwork::stored_J() const {
  return network_.bonds.stored_energy_J(network_.position, viscous_);
}

double BallOnNetwork::dissipation_W() const {
  return network_.bonds.dissipation_W(network_.position, viscous_);
}

}  // namespace tpm::organ
