#include "tpm/organ/steps/implicit_balance.hpp"

#include <cmath>
#include <limits>

namespace tpm::organ {
namespace {

constexpr int kMostStepIterations = 60;
constexpr int kMostStepHalvings = 30;
constexpr double kShareOfDepth = 1e-12;
constexpr double kFast = 0.05;  // what a step may leave of the force for its factor to be kept
constexpr double kNear = 1e-5;  // of the depth: Newton's steps are not checked any more
constexpr double kForceResolution = 8.0 * std::numeric_limits<double>::epsilon();

}  // namespace

ImplicitBalance::ImplicitBalance(const BondSystem& bonds, const Constraints& constraints,
                                 MethodWork& work)
    : bonds_(bonds),
      constraints_(constraints),
      work_(work),
      matrix_(bonds.pattern()),
      factor_(bonds.pattern()),
      kept_{KeptFactor(bonds.pattern()), KeptFactor(bonds.pattern())} {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.spheres()));
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    const double k = bonds.stiffness()[static_cast<Eigen::Index>(i)];
    sum[bonds.end_a()[i]] += k;
    sum[bonds.end_b()[i]] += k;
  }
  stiffest_ = sum.maxCoeff();
}

double ImplicitBalance::potential(const Positions& position, const ViscousState& viscous_state,
                                  const Eigen::Matrix3Xd& load,
                                  const SphereAnchors* anchors) const {
  const double bonds =
      bonds_.potential_J(position, viscous_state) - position.cwiseProduct(load).sum();
  if (anchors == nullptr) return bonds;
  return bonds +
         0.5 * (position - anchors->to).colwise().squaredNorm().dot(anchors->stiffness.transpose());
}

double ImplicitBalance::tolerance_N(const Positions& position, double depth_m,
                                    const SphereAnchors* anchors) const {
  double stiffness = stiffest_;
  if (anchors != nullptr) stiffness += anchors->stiffness.maxCoeff();
  return stiffness * (kShareOfDepth * depth_m + kForceResolution * position.cwiseAbs().maxCoeff());
}

bool ImplicitBalance::factorise_matrix(const Positions& position, const ViscousState& viscous_state,
                                       const SphereAnchors* anchors, BlockLdlt& factor) {
  ++work_.factorisations;
  matrix_.set_zero();
  bonds_.add_stiffness(position, viscous_state, matrix_);
  if (anchors != nullptr) {
    for (std::size_t i = 0; i < matrix_.diagonal.size(); ++i) {
      matrix_.diagonal[i].diagonal().array() += anchors->stiffness[static_cast<Eigen::Index>(i)];
    }
  }
  constraints_.constrain(bonds_, matrix_);
  return factor.factorise(matrix_);
}

MethodEnd ImplicitBalance::factorise(const Positions& position, const ViscousState& viscous_state) {
  if (!factorise_matrix(position, viscous_state, nullptr, factor_)) return MethodEnd::newton_failed;
  return factor_.negative_count() == 0 ? MethodEnd::completed : MethodEnd::buckled;
}

void ImplicitBalance::displace(Eigen::Matrix3Xd& vectors) {
  displace(vectors, factor_);
}

void ImplicitBalance::displace(Eigen::Matrix3Xd& vectors, const BlockLdlt& factor) {
  ++work_.solves;
  constraints_.project(vectors);
  factor.solve(vectors);
  constraints_.project(vectors);
}

ImplicitBalance::KeptFactor& ImplicitBalance::kept_for(const ViscousState& viscous_state,
                                                       const SphereAnchors* anchors) {
  const double anchored = anchors == nullptr ? 0.0 : anchors->stiffness.maxCoeff();
  for (KeptFactor& kept : kept_) {
    const bool alike =
        kept.relaxation_factor == viscous_state.relaxation_factor && kept.anchored == anchored;
    if (kept.used > 0 && alike) return kept;
  }
  KeptFactor& oldest = kept_[0].used <= kept_[1].used ? kept_[0] : kept_[1];
  oldest.used = 0;
  oldest.relaxation_factor = viscous_state.relaxation_factor;
  oldest.anchored = anchored;
  return oldest;
}

MethodEnd ImplicitBalance::find(Positions& position, const ViscousState& viscous_state,
                                const Eigen::Matrix3Xd& load, double depth_m,
                                const SphereAnchors* anchors) {
  const double tolerance = tolerance_N(position, depth_m, anchors);
  double energy = potential(position, viscous_state, load, anchors);
  KeptFactor& kept = kept_for(viscous_state, anchors);
  bool known = kept.used > 0;  // and found elsewhere
  kept.used = 0;               // until it has served
  double left_before = std::numeric_limits<double>::infinity();
  for (int iteration = 0;; ++iteration) {
    ++work_.rates;
    balance_forces(bonds_, position, viscous_state, load, force_);
    if (anchors != nullptr) {
      force_ -= (position - anchors->to) * anchors->stiffness.asDiagonal();
    }
    constraints_.project(force_);
    const double left = force_.colwise().norm().maxCoeff();
    if (!std::isfinite(left)) return MethodEnd::newton_failed;
    if (left <= tolerance && iteration > 0) {
      kept.used = ++balances_;
      return MethodEnd::completed;
    }
    if (iteration == kMostStepIterations) return MethodEnd::newton_failed;
    if (left > kFast * left_before) known = false;
    left_before = left;
    for (bool moved = false; !moved;) {
      const bool here = !known;
      if (here) {
        if (!factorise_matrix(position, viscous_state, anchors, kept.factor)) {
          return MethodEnd::newton_failed;
        }
        if (kept.factor.negative_count() > 0) {
          return anchors == nullptr ? MethodEnd::buckled : MethodEnd::newton_failed;
        }
        known = true;
      }
      step_ = force_;
      displace(step_, kept.factor);
      const double slope = -force_.cwiseProduct(step_).sum();
      // There the potential has no digits left to compare.
      const bool near = step_.colwise().norm().maxCoeff() <= kNear * depth_m;
      double length = 1.0;
      for (int halvings = 0; !moved; ++halvings, length *= 0.5) {
        if (halvings == kMostStepHalvings) return MethodEnd::newton_failed;
        const Positions next = position + length * step_;
        const double there = potential(next, viscous_state, load, anchors);
        moved = near || there <= energy + 1e-4 * length * slope;
        if (!moved && !here) {
          known = false;  // a shorter step is worth less than a factor found here
          break;
        }
        if (!moved) continue;
        position = next;
        energy = there;
      }
    }
  }
}

}  // namespace tpm::organ
