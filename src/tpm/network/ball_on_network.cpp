#include "tpm/network/ball_on_network.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/network/tool.hpp"
#include "tpm/solve/relaxation_filter.hpp"

namespace tpm {
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

Freedom with_ball_held(const Freedom& freedom) {
  Freedom all = freedom.extended(1);
  all.hold(freedom.size());
  return all;
}

Positions with_ball_at(const Positions& rest, const Eigen::Vector3d& ball_m) {
  Positions all(3, rest.cols() + 1);
  all.leftCols(rest.cols()) = rest;
  all.rightCols<1>() = ball_m;
  return all;
}

}  // namespace

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

BallOnNetwork::BallOnNetwork(const BondSystem& bonds, const Positions& rest, const Freedom& freedom,
                             const BallTool& ball, double tolerance_N)
    : bonds_(with_ball(bonds, ball)),
      freedom_(with_ball_held(freedom)),
      equilibrium_(bonds_, freedom_),
      tolerance_N_(tolerance_N),
      position_(with_ball_at(rest, ball.start_m)) {
  bonds_.elongations(position_, elongation_);
  remembered_ = Eigen::VectorXd::Zero(elongation_.size());
}

bool BallOnNetwork::balance(const Eigen::Vector3d& ball_m, const BondMemory& memory) {
  constexpr int kMostParts = 64;
  const Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, position_.cols());
  const Eigen::Vector3d from = position_.rightCols<1>();
  // A place too far for one search is approached along a line, under the same memory.
  for (int parts = 1; parts <= kMostParts; parts *= 4) {
    Positions next = position_;
    bool found = true;
    for (int i = 1; i <= parts && found; ++i) {
      next.rightCols<1>() = from + static_cast<double>(i) / parts * (ball_m - from);
      const EquilibriumSearch search = equilibrium_.find(next, memory, load, tolerance_N_);
      found = search.converged && search.stable;
    }
    if (!found) continue;
    position_ = std::move(next);
    return true;
  }
  return false;
}

Eigen::Vector3d BallOnNetwork::step(const Eigen::Vector3d& ball_m, double step_s) {
  const RelaxationWeights w = relaxation_weights(step_s / bonds_.relaxation_time_s());
  BondMemory memory;
  memory.offset = w.r * remembered_ + w.w0 * elongation_;
  memory.following = w.w1;
  if (!balance(ball_m, memory)) {
    throw Error(ExitCode::numerical, "ball",
                fmt::format("no stable equilibrium with the ball at ({}, {}, {}) mm",
                            significant(1e3 * ball_m.x(), 5), significant(1e3 * ball_m.y(), 5),
                            significant(1e3 * ball_m.z(), 5)));
  }
  bonds_.elongations(position_, elongation_);
  remembered_ = memory.offset + memory.following * elongation_;
  Eigen::Matrix3Xd force;
  equilibrium_.forces(position_, memory, Eigen::Matrix3Xd::Zero(3, position_.cols()), force);
  return force.rightCols<1>();
}

int BallOnNetwork::touching() const {
  const std::vector<char> closed = bonds_.closed_contacts(position_);
  return static_cast<int>(std::count(closed.begin(), closed.end(), 1));
}

double BallOnNetwork::stored_J() const {
  return bonds_.stored_energy_J(position_, remembered_);
}

double BallOnNetwork::dissipation_W() const {
  return bonds_.dissipation_W(position_, remembered_);
}

}  // namespace tpm
