#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tpm/core/dense_algebra.hpp"
#include "tpm/reduce/zone_network.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
namespace {

constexpr double kMissedStride_m = 2e-3;
constexpr double kMissedAside_m = 2e-3;
constexpr double kAsideDepths = 2.0;  // frozen depths at which the surroundings are tried across
constexpr double kNoField = 1e-8;     // of the energy of a field: what it adds is nothing

using Fields = std::vector<Eigen::Matrix3Xd>;

Eigen::MatrixXd flat_columns(const Fields& fields) {
  Eigen::MatrixXd flat(fields.front().size(), static_cast<Eigen::Index>(fields.size()));
  for (std::size_t j = 0; j < fields.size(); ++j) {
    flat.col(static_cast<Eigen::Index>(j)) = fields[j].reshaped();
  }
  return flat;
}

/// The part of a symmetric matrix with eigenvalues of 0 and above.
Eigen::MatrixXd not_negative(const Eigen::MatrixXd& matrix, double& softest) {
  const SymmetricModes modes = symmetric_modes(matrix);
  const Eigen::VectorXd& values = modes.values;
  softest = values[0] / values[values.size() - 1];
  return modes.vectors * values.cwiseMax(0.0).asDiagonal() * modes.vectors.transpose();
}

/// What some bonds of a tissue pull with, everything relaxed by a part, N.
Eigen::Matrix3Xd pulls(const PushedContact& tissue, const Positions& position, double relaxed,
                       const std::vector<char>& chosen) {
  const BondSystem& bonds = tissue.bonds();
  Eigen::VectorXd tension;
  bonds.tensions(position, tissue.memory(position, relaxed, relaxed), tension);
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, position.cols());
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    if (chosen[b] == 0) continue;
    const std::uint32_t from = bonds.end_a()[b];
    const std::uint32_t to = bonds.end_b()[b];
    const Eigen::Vector3d along = (position.col(to) - position.col(from)).normalized();
    force.col(from) += tension[static_cast<Eigen::Index>(b)] * along;
    force.col(to) -= tension[static_cast<Eigen::Index>(b)] * along;
  }
  return force;
}

double weighed(const ContactFields& fields, const Eigen::Matrix3Xd& force) {
  Eigen::Vector3d sum;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    sum[axis] = fields.displacement[static_cast<std::size_t>(axis)].cwiseProduct(force).sum();
  }
  return sum.norm();
}

}  // namespace

void ZoneNetwork::build(PushedContact& tissue) {
  const BondSystem& bonds = tissue.bonds();
  const auto relaxed = static_cast<double>(weights_.of_end);
  std::vector<char> linear(bonds.size(), 0);
  std::vector<ServoBonds::Choice> near, far;
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    const std::uint32_t from = bonds.end_a()[b];
    const std::uint32_t to = bonds.end_b()[b];
    const ServoBonds::Choice choice{b, column_[from], column_[to]};
    if (held_or_free_[from] == 1 || held_or_free_[to] == 1) {
      linear[b] = 1;
    } else if (from == contact_ || to == contact_) {
      near.push_back(choice);
    } else if (held_or_free_[from] == 2 || held_or_free_[to] == 2) {
      far.push_back(choice);
    }
  }
  const std::size_t filler = zone_.size() + 1;
  const auto filler_column = static_cast<std::uint32_t>(filler);
  at_contact_ = ServoBonds(bonds, tissue.rest(), near, filler_column, options_.portable);
  elsewhere_ = ServoBonds(bonds, tissue.rest(), far, filler_column, options_.portable);
  displacement_.assign(4 * (filler + 1), 0.0F);
  force_.assign(8 * (filler + 1), 0.0F);

  const Positions pressed = tissue.at(options_.linear_depth_m * into_, relaxed);
  const LinearBonds around(tissue, pressed, relaxed, linear);
  Constraints outside = tissue.constraints();
  for (const std::size_t i : zone_) outside.hold(i);
  BlockLdlt factor(bonds.pattern());
  {
    BlockMatrix matrix = around.matrix(relaxed);
    outside.constrain(bonds, matrix);
    if (!outside_.empty() && (!factor.factorise(matrix) || factor.negative_count() > 0)) {
      throw Error(ExitCode::numerical, "zone", "its surroundings are not stiff by themselves");
    }
  }
  const auto follow = [&](const Eigen::Matrix3Xd& displacement) {
    Eigen::Matrix3Xd left = Eigen::Matrix3Xd::Zero(3, displacement.cols());
    around.add_resistance(displacement, relaxed, left);
    left *= -1.0;
    outside.project(left);
    if (!outside_.empty()) factor.solve(left);
    outside.project(left);
    return Eigen::Matrix3Xd(displacement + left);
  };
  const auto nothing = [&] { return Eigen::Matrix3Xd(Eigen::Matrix3Xd::Zero(3, pressed.cols())); };
  Fields basis;
  for (std::size_t i = zone_.size() - edge_; i < zone_.size(); ++i) {
    for (Eigen::Index c = 0; c < 3; ++c) {
      Eigen::Matrix3Xd unit = nothing();
      unit(c, static_cast<Eigen::Index>(zone_[i])) = 1.0;
      basis.push_back(follow(unit));
    }
  }
  const ContactFields instantaneous = tissue.fields(pressed, tissue.memory(pressed, relaxed, 0.0));
  const ContactFields in_the_end = tissue.fields(pressed, tissue.memory(pressed, relaxed, 1.0));
  Fields own;
  Fields resisted;
  for (const ContactFields* const fields : {&instantaneous, &in_the_end}) {
    for (const Eigen::Matrix3Xd& whole : fields->displacement) {
      Eigen::Matrix3Xd in_zone = whole;
      for (const std::size_t i : outside_) in_zone.col(static_cast<Eigen::Index>(i)).setZero();
      Eigen::Matrix3Xd rest = whole - follow(in_zone);
      for (std::size_t k = 0; k < own.size(); ++k) {
        rest -= own[k] * rest.cwiseProduct(resisted[k]).sum();
      }
      Eigen::Matrix3Xd pull = nothing();
      around.add_resistance(rest, relaxed, pull);
      const double energy = rest.cwiseProduct(pull).sum();
      Eigen::Matrix3Xd whole_pull = nothing();
      around.add_resistance(whole, relaxed, whole_pull);
      if (!(energy > kNoField * whole.cwiseProduct(whole_pull).sum())) continue;
      own.push_back(rest / std::sqrt(energy));
      resisted.push_back(pull / std::sqrt(energy));
    }
  }
  own_ = static_cast<Eigen::Index>(own.size());
  // Of one size with displacements, for single precision.
  const double size = std::sqrt(bonds.stiffness().maxCoeff());
  for (Eigen::Matrix3Xd& field : own) basis.push_back(field * size);

  const auto n = static_cast<Eigen::Index>(3 * zone_.size()) + own_;
  const auto tail = static_cast<Eigen::Index>(basis.size());
  Eigen::MatrixXd stiff = Eigen::MatrixXd::Zero(tail, tail);
  Eigen::MatrixXd relaxing = stiff;
  if (tail > 0) {
    Fields resist, relax;
    for (const Eigen::Matrix3Xd& field : basis) {
      resist.push_back(nothing());
      around.add_resistance(field, 1.0, resist.back());
      relax.push_back(nothing());
      around.add_relaxing(field, relax.back());
    }
    const Eigen::MatrixXd all = flat_columns(basis);
    Eigen::MatrixXd lasting = all.transpose() * flat_columns(resist);
    relaxing = all.transpose() * flat_columns(relax);
    lasting = (0.5 * (lasting + lasting.transpose())).eval();
    relaxing = (0.5 * (relaxing + relaxing.transpose())).eval();
    stiff = not_negative(lasting, softest_) + (1.0 - relaxed) * relaxing;
  }
  stiff_.put(stiff);
  relaxing_.put(relaxing);
  Eigen::MatrixXd outer(static_cast<Eigen::Index>(3 * outside_.size()), tail);
  for (Eigen::Index j = 0; j < tail; ++j) {
    for (std::size_t i = 0; i < outside_.size(); ++i) {
      outer.block<3, 1>(static_cast<Eigen::Index>(3 * i), j) =
          basis[static_cast<std::size_t>(j)].col(static_cast<Eigen::Index>(outside_[i]));
    }
  }
  outer_.put(outer);

  const Positions frozen = tissue.at(options_.frozen_depth_m * into_, relaxed);
  const BondMemory memory = tissue.memory(frozen, relaxed, relaxed);
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(n, n);
  whole.bottomRightCorner(tail, tail) = stiff;
  Eigen::MatrixXd coupling = Eigen::MatrixXd::Zero(n, 3);
  const auto in_zone = [&](std::uint32_t column) { return column < zone_.size(); };
  for (const auto* const some : {&near, &far}) {
    for (const auto& [bond, from, to] : *some) {
      const Eigen::Matrix3d block = bonds.stiffness_block(bond, frozen, memory);
      const Eigen::Index a = 3 * static_cast<Eigen::Index>(from);
      const Eigen::Index b = 3 * static_cast<Eigen::Index>(to);
      if (in_zone(from)) whole.block<3, 3>(a, a) += block;
      if (in_zone(to)) whole.block<3, 3>(b, b) += block;
      if (in_zone(from) && in_zone(to)) {
        whole.block<3, 3>(a, b) -= block;
        whole.block<3, 3>(b, a) -= block;
      }
      if (from == zone_.size() && in_zone(to)) coupling.middleRows<3>(b) += block;
      if (to == zone_.size() && in_zone(from)) coupling.middleRows<3>(a) += block;
    }
  }
  const Eigen::LLT<Eigen::MatrixXd> pivot(whole);
  if (pivot.info() != Eigen::Success) {
    throw Error(ExitCode::numerical, "zone", "it is not stiff where it is frozen");
  }
  const Eigen::MatrixXd inverse = pivot.solve(Eigen::MatrixXd::Identity(n, n));
  inverse_.put(inverse);
  const Eigen::MatrixXd field = inverse * coupling;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    field_[axis].assign(inverse_.stride, 0.0F);
    for (Eigen::Index i = 0; i < n; ++i) {
      field_[axis][static_cast<std::size_t>(i)] =
          static_cast<float>(field(i, static_cast<Eigen::Index>(axis)));
    }
  }
  for (AlignedFloats* const all : {&right_, &change_}) all->assign(inverse_.stride, 0.0F);
  for (AlignedFloats* const all :
       {&moved_, &offset_, &next_offset_, &pull_, &offset_pull_, &next_pull_}) {
    all->assign(std::max<std::size_t>(stiff_.stride, 8), 0.0F);
  }
  branch_offset_.assign(weights_.branches.size(), AlignedFloats(next_offset_.size(), 0.0F));
  step_error_ = std::make_unique<StepError>(tissue, frozen, relaxed, options_.period_s);
  build_errors(tissue, around, linear);
}

void ZoneNetwork::build_errors(PushedContact& tissue, const LinearBonds& around,
                               const std::vector<char>& linear) {
  const auto missed = [&](const Eigen::Vector3d& displacement_m, double relaxed) {
    const Positions position = tissue.at(displacement_m, relaxed);
    const ContactFields fields = tissue.fields(position, tissue.memory(position, relaxed, relaxed));
    Eigen::Matrix3Xd force = pulls(tissue, position, relaxed, linear);
    around.add_resistance(position - tissue.rest(), relaxed, force);
    return weighed(fields, force);
  };
  const auto worst = [&](const Eigen::Vector3d& displacement_m) {
    return std::max(missed(displacement_m, 0.0), missed(displacement_m, 1.0));
  };
  const auto count = static_cast<int>(std::ceil(options_.deepest_m / kMissedStride_m));
  missed_stride_m_ = options_.deepest_m / count;
  for (int i = 0; i <= count; ++i) missed_N_.push_back(worst(i * missed_stride_m_ * into_));
  const Eigen::Vector3d pressed =
      std::min(kAsideDepths * options_.frozen_depth_m, options_.deepest_m) * into_;
  const double there_N = worst(pressed);
  Eigen::Index least = 0;
  into_.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d first = into_.cross(Eigen::Vector3d::Unit(least)).normalized();
  for (const Eigen::Vector3d& aside : {first, Eigen::Vector3d(into_.cross(first))}) {
    for (const double way_m : {kMissedAside_m, -kMissedAside_m}) {
      const double change_N = std::max(0.0, worst(pressed + way_m * aside) - there_N);
      missed_aside_N_per_m_ = std::max(missed_aside_N_per_m_, change_N / kMissedAside_m);
    }
  }
}

}  // namespace tpm
