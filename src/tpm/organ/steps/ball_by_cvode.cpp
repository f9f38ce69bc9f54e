#include "tpm/organ/steps/ball_by_cvode.hpp"

#include <fmt/format.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "tpm/base/text.hpp"
#include "tpm/organ/linear/sundials.hpp"
#include "tpm/organ/steps/implicit_balance.hpp"
#include "tpm/organ/steps/viscous_elongations.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

struct FreeFixedPoint {
  void operator()(SUNNonlinearSolver s) const { SUNNonlinSolFree(s); }
};
using FixedPoint = std::unique_ptr<std::remove_pointer_t<SUNNonlinearSolver>, FreeFixedPoint>;

/// The network as an equation for its viscous elongations.
class ViscousNetwork {
 public:
  ViscousNetwork(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
                 const BallTool& ball, std::span<const BallPlace> places)
      : network_(bonds, rest, constraints, ball),
        places_(places),
        viscous_(bonds),
        balance_(network_.bonds, network_.constraints, work_),
        load_(Eigen::Matrix3Xd::Zero(3, network_.position.cols())) {
    viscous_state_.offset = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(network_.bonds.size()));
  }

  [[nodiscard]] Eigen::Index size() const { return viscous_.size(); }

  /// @returns false where no balance is found
  [[nodiscard]] bool rate(double time_s, const Eigen::Ref<const Eigen::VectorXd>& y,
                          Eigen::Ref<Eigen::VectorXd> rate) {
    if (!balanced(time_s, y)) return false;
    network_.bonds.followed(network_.position, of_bond_);
    viscous_.spread(of_bond_, followed_);
    rate = (followed_ - y).cwiseQuotient(viscous_.times_s());
    return true;
  }

  [[nodiscard]] std::optional<Eigen::Vector3d> force(double time_s,
                                                     const Eigen::Ref<const Eigen::VectorXd>& y) {
    if (!balanced(time_s, y)) return std::nullopt;
    balance_forces(network_.bonds, network_.position, viscous_state_, load_, force_);
    return force_.rightCols<1>();
  }

 private:
  // Accuracy of balances: 1e-12 of it, times the stiffness of all contacts of the ball.
  static constexpr double kDisplaced_m = 1e-3;

  [[nodiscard]] Eigen::Vector3d ball_at(double time_s) const {
    const auto later = [time_s](const BallPlace& place) { return place.time_s < time_s; };
    const auto next = std::partition_point(places_.begin(), places_.end(), later);
    if (next == places_.begin()) return places_.front().at_m;
    if (next == places_.end()) return places_.back().at_m;
    const BallPlace& from = *(next - 1);
    const double part = (time_s - from.time_s) / (next->time_s - from.time_s);
    return from.at_m + part * (next->at_m - from.at_m);
  }

  [[nodiscard]] bool balanced(double time_s, const Eigen::Ref<const Eigen::VectorXd>& y) {
    viscous_.set_mean(y, of_bond_);
    viscous_state_.offset.head(of_bond_.size()) = of_bond_;
    const Eigen::Vector3d to = ball_at(time_s), from = network_.position.rightCols<1>();
    constexpr int kMostParts = 64;
    for (int parts = 1; parts <= kMostParts; parts *= 4) {
      Positions next = network_.position;
      bool found = true;
      for (int i = 1; i <= parts && found; ++i) {
        next.rightCols<1>() = from + static_cast<double>(i) / parts * (to - from);
        found = balance_.find(next, viscous_state_, load_, kDisplaced_m) == MethodEnd::completed;
      }
      if (!found) continue;
      network_.position = std::move(next);
      return true;
    }
    return false;
  }

  NetworkUnderBall network_;
  std::span<const BallPlace> places_;
  ViscousElongations viscous_;
  MethodWork work_;
  ImplicitBalance balance_;
  Eigen::Matrix3Xd load_, force_;
  ViscousState viscous_state_;
  Eigen::VectorXd of_bond_, followed_;
};

extern "C" int ball_rate(sunrealtype t, N_Vector y, N_Vector y_dot, void* network) {
  auto rate = sundials::view(y_dot);
  // 1: another, shorter step.
  return static_cast<ViscousNetwork*>(network)->rate(t, sundials::view(y), rate) ? 0 : 1;
}

}  // namespace

std::vector<Eigen::Vector3d> ball_forces_by_cvode(const BondSystem& bonds, const Positions& rest,
                                                  const Constraints& constraints,
                                                  const BallTool& ball,
                                                  std::span<const BallPlace> places,
                                                  double tolerance) {
  using sundials::check;
  ViscousNetwork network(bonds, rest, constraints, ball, places);
  std::vector<Eigen::Vector3d> forces;
  if (places.empty()) return forces;
  const sundials::Context context = sundials::make_context();
  const sundials::Vector state(N_VNew_Serial(network.size(), context.get()));
  sundials::view(state.get()).setZero();
  const FixedPoint iteration(SUNNonlinSol_FixedPoint(state.get(), 0, context.get()));
  const sundials::Cvodes memory(CVodeCreate(CV_ADAMS, context.get()));
  void* const m = memory.get();
  check(CVodeInit(m, ball_rate, places.front().time_s, state.get()), "CVodeInit");
  check(CVodeSetUserData(m, &network), "CVodeSetUserData");
  check(CVodeSStolerances(m, 0.0, tolerance * ball.reach_m()), "CVodeSStolerances");
  check(CVodeSetMaxNumSteps(m, std::numeric_limits<long>::max()), "CVodeSetMaxNumSteps");
  check(CVodeSetStopTime(m, places.back().time_s), "CVodeSetStopTime");
  check(CVodeSetNonlinearSolver(m, iteration.get()), "CVodeSetNonlinearSolver");
  sundials::mute(m);
  for (const BallPlace& place : places) {
    double reached = 0.0;
    if (place.time_s > places.front().time_s) {
      check(CVode(m, place.time_s, state.get(), &reached, CV_NORMAL), "CVode");
    }
    const std::optional<Eigen::Vector3d> force =
        network.force(place.time_s, sundials::view(state.get()));
    if (!force) {
      throw Error(ExitCode::numerical, "ball",
                  fmt::format("no balance at t = {} s", significant(place.time_s, 5)));
    }
    forces.push_back(*force);
  }
  return forces;
}

}  // namespace tpm::organ
