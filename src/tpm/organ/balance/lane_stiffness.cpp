#include "tpm/organ/balance/lane_stiffness.hpp"

namespace tpm::organ {
namespace {

constexpr double kLaneTolerance = 1e-4;

}  // namespace

LaneStiffness::LaneStiffness(const Equilibrium& equilibrium) : equilibrium_(equilibrium) {
  if (equilibrium.factor() != nullptr) factor_.emplace(equilibrium.pattern());
}

void LaneStiffness::take() {
  if (factor_) factor_->copy(*equilibrium_.factor());
}

void LaneStiffness::solve(LaneMatrix& x) {
  if (factor_) {
    factor_->solve(x);
    return;
  }
  const LaneMatrix right = x;
  Eigen::RowVectorXd lane;
  for (Eigen::Index s = 0; s < right.rows(); ++s) {
    if (s > 0 && right.row(s) == right.row(s - 1)) {
      x.row(s) = x.row(s - 1);
      continue;
    }
    lane = right.row(s);
    equilibrium_.displace(Eigen::Map<Eigen::Matrix3Xd>(lane.data(), 3, lane.size() / 3),
                          kLaneTolerance);
    x.row(s) = lane;
  }
}

}  // namespace tpm::organ
