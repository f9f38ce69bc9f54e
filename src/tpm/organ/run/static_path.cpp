#include "tpm/organ/run/static_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/organ/balance/buckling.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr double kLongestPathMove = 0.05;    // of the spacing, of the driven sphere in one stride
constexpr double kLeastStride = 1e-4;        // of what is imposed already
constexpr double kLeastStart = 1e-12;        // of the way, where nothing is imposed yet
constexpr double kBalanceShare = 1e-3;       // of the tolerance, for forces left
constexpr double kLeastPathBalance = 1e-13;  // of the force: below, rounding decides

}  // namespace

StaticPath::StaticPath(const BondSystem& bonds, Positions rest, double spacing_m,
                       const Constraints& constraints, const Probes& probes, Drive drive,
                       double peak, double tolerance, EquilibriumOptions equilibrium)
    : tissue_(bonds, std::move(rest), constraints, probes, drive, equilibrium),
      state_(tissue_.at_rest(0.0)),
      longest_move_m_(kLongestPathMove * spacing_m) {
  require_valid(probes, constraints);
  const double force =
      drive == Drive::force ? peak : std::abs(tissue_.linear_response(state_, peak));
  tolerance_N_ = std::max(kBalanceShare * tolerance, kLeastPathBalance) * force;
}

void StaticPath::start_from(const QuasiStaticState& state) {
  state_.position = state.position;
  tissue_.bonds().followed(state_.position, state_.followed);
  state_.set_equilibrium();
  state_.closed = tissue_.bonds().closed_contacts(state.position);
  state_.imposed = state.imposed;
}

bool StaticPath::stride_to(double imposed) {
  const ViscousState relaxed{Eigen::VectorXd::Zero(state_.mean.size()), 1.0};
  Positions position = state_.position;
  tissue_.impose(position, imposed);
  const auto moved_far = [&] {
    return std::abs(tissue_.depth_of(position - state_.position)) > longest_move_m_;
  };
  unstable_ = false;
  if (moved_far()) return false;
  Eigen::Matrix3Xd load;
  tissue_.load(imposed, load);
  const EquilibriumSearch search =
      tissue_.equilibrium().find(position, relaxed, load, tolerance_N_);
  unstable_ = !search.stable;
  if (!search.stable || !search.converged) return false;
  if (moved_far()) return false;
  state_.imposed = imposed;
  state_.position = std::move(position);
  tissue_.bonds().followed(state_.position, state_.followed);
  state_.set_equilibrium();
  state_.closed = tissue_.bonds().closed_contacts(state_.position);
  return true;
}

QuasiStaticState StaticPath::move_to(double imposed, double time_s) {
  const double begin = state_.imposed;
  double done = 0.0;
  double stride = 1.0;
  while (done < 1.0 && imposed != begin) {
    const double aim = std::min(1.0, done + stride);
    if (stride_to(aim < 1.0 ? begin + aim * (imposed - begin) : imposed)) {
      done = aim;
      stride *= 2.0;
      continue;
    }
    stride *= 0.5;
    const double least = kLeastStride * std::abs(state_.imposed / (imposed - begin));
    if (stride > std::max(least, kLeastStart)) continue;
    const bool depth = tissue_.depth_driven();
    throw Error(
        ExitCode::numerical, unstable_ ? ErrorCause::buckled : ErrorCause::snapped_through,
        "network",
        fmt::format("on the way to t = {} s, at {} of {} {}, the tissue {}", significant(time_s, 5),
                    depth ? "a depth" : "a load",
                    significant((depth ? 1e3 : 1.0) * state_.imposed, 4), depth ? "mm" : "N",
                    unstable_ ? buckling_words(tissue_, state_)
                              : "finds no equilibrium near" + snap_words(tissue_, state_)));
  }
  const double stored_J = tissue_.bonds().stored_energy_J(state_.position, state_.viscous);
  return {time_s,          state_.imposed, tissue_.response(state_),
          state_.position, state_.viscous, QuasiStaticEnergy{stored_J, 0.0, stored_J}};
}

}  // namespace tpm::organ
