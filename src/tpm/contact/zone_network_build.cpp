// Declared in tpm/contact/zone_network.hpp.
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/contact/zone_network.hpp"
#include "tpmkit/error.hpp"

namespace tpm::contact {
namespace {

constexpr double kNoField = 1e-8;  // of the energy of a field: what it adds is nothing

using Fields = std::vector<Eigen::Matrix3Xd>;

Eigen::MatrixXd flat_columns(const Fields& fields) {
  Eigen::MatrixXd flat(fields.front().size(), static_cast<Eigen::Index>(fields.size()));
  for (std::size_t j = 0; j < fields.size(); ++j) {
    flat.col(static_cast<Eigen::Index>(j)) = fields[j].reshaped();
  }
  return flat;
}

/// The part of a symmetric matrix with eigenvalues of 0 and above.
Eigen::MatrixXd not_negative(const Eigen::MatrixXd& matrix) {
  const SymmetricModes modes = symmetric_modes(matrix);
  return modes.vectors * modes.values.cwiseMax(0.0).asDiagonal() * modes.vectors.transpose();
}

}  // namespace

ZoneNetwork::Parts ZoneNetwork::build(PushedContact& tissue) {
  const BondSystem& bonds = tissue.bonds();
  const auto relaxed = static_cast<double>(weights_.of_end);
  std::vector<char> linear(bonds.size(), 0);
  Parts parts;
  parts.relaxed = relaxed;
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    const std::uint32_t from = bonds.end_a()[b];
    const std::uint32_t to = bonds.end_b()[b];
    const ServoBonds::Choice choice{b, column_[from], column_[to]};
    if (zone_role_[from] == 1 || zone_role_[to] == 1) {
      linear[b] = 1;
    } else if (column_[from] == column_[to]) {
      continue;  // within the patch, or between fixed spheres
    } else if (contact_.has(from) || contact_.has(to)) {
      parts.near.push_back(choice);
    } else if (zone_role_[from] == 2 || zone_role_[to] == 2) {
      parts.far.push_back(choice);
    }
  }
  const std::size_t filler = zone_.size() + 1;
  const auto filler_column = static_cast<std::uint32_t>(filler);
  at_contact_ = ServoBonds(bonds, tissue.rest(), parts.near, filler_column, options_.portable);
  elsewhere_ = ServoBonds(bonds, tissue.rest(), parts.far, filler_column, options_.portable);
  displacement_.assign(4 * (filler + 1), 0.0F);
  force_.assign(8 * (filler + 1), 0.0F);

  const Positions pressed = tissue.at(options_.linear_depth_m * into_, relaxed);
  const LinearBonds around(tissue, pressed, relaxed, linear);
  Constraints outside = tissue.constraints();
  for (const std::size_t i : zone_) outside.fix(i);
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
  const ContactFields instantaneous =
      tissue.fields(pressed, tissue.viscous_state(pressed, relaxed, 0.0));
  const ContactFields in_the_end =
      tissue.fields(pressed, tissue.viscous_state(pressed, relaxed, 1.0));
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

  const auto tail = static_cast<Eigen::Index>(basis.size());
  parts.lasting = parts.relaxing = Eigen::MatrixXd::Zero(tail, tail);
  if (tail > 0) {
    Fields resist, relax;
    for (const Eigen::Matrix3Xd& field : basis) {
      resist.push_back(nothing());
      around.add_resistance(field, 1.0, resist.back());
      relax.push_back(nothing());
      around.add_relaxing(field, relax.back());
    }
    const Eigen::MatrixXd all = flat_columns(basis);
    const Eigen::MatrixXd lasting = all.transpose() * flat_columns(resist);
    const Eigen::MatrixXd relaxing = all.transpose() * flat_columns(relax);
    parts.lasting = not_negative(0.5 * (lasting + lasting.transpose()));
    parts.relaxing = 0.5 * (relaxing + relaxing.transpose());
  }
  relaxing_.put(parts.relaxing);
  Eigen::MatrixXd outer(static_cast<Eigen::Index>(3 * outside_.size()), tail);
  for (Eigen::Index j = 0; j < tail; ++j) {
    for (std::size_t i = 0; i < outside_.size(); ++i) {
      outer.block<3, 1>(static_cast<Eigen::Index>(3 * i), j) =
          basis[static_cast<std::size_t>(j)].col(static_cast<Eigen::Index>(outside_[i]));
    }
  }
  outer_.put(outer);

  parts.frozen = tissue.at(options_.frozen_depth_m * into_, relaxed);
  set_weights(tissue, parts, weights_);
  for (AlignedFloats* const all : {&right_, &change_}) all->assign(inverse_.rows, 0.0F);
  for (AlignedFloats* const all :
       {&moved_, &offset_, &next_offset_, &pull_, &offset_pull_, &next_pull_}) {
    all->assign(std::max<std::size_t>(stiff_.stride, 8), 0.0F);
  }
  branch_offset_.assign(weights_.branches.size(), AlignedFloats(next_offset_.size(), 0.0F));
  step_error_ = std::make_unique<StepError>(tissue, parts.frozen, relaxed, options_.period_s);
  return parts;
}

void ZoneNetwork::set_weights(const PushedContact& tissue, const Parts& parts,
                              ServoWeights weights) {
  weights_ = std::move(weights);
  claim_.set_weights(weights_);
  const auto relaxed = static_cast<double>(weights_.of_end);
  const Eigen::MatrixXd stiff = parts.lasting + (1.0 - relaxed) * parts.relaxing;
  stiff_.put(stiff);
  const BondSystem& bonds = tissue.bonds();
  const auto n = static_cast<Eigen::Index>(3 * zone_.size()) + own_;
  const Eigen::Index tail = stiff.rows();
  const ViscousState viscous_state = tissue.viscous_state(parts.frozen, parts.relaxed, relaxed);
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(n, n);
  whole.bottomRightCorner(tail, tail) = stiff;
  Eigen::MatrixXd coupling = Eigen::MatrixXd::Zero(n, 3);
  const auto in_zone = [&](std::uint32_t column) { return column < zone_.size(); };
  for (const auto* const some : {&parts.near, &parts.far}) {
    for (const auto& [bond, from, to] : *some) {
      const Eigen::Matrix3d block = bonds.stiffness_block(bond, parts.frozen, viscous_state);
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
    field_[axis].assign(inverse_.rows, 0.0F);
    for (Eigen::Index i = 0; i < n; ++i) {
      field_[axis][static_cast<std::size_t>(i)] =
          static_cast<float>(field(i, static_cast<Eigen::Index>(axis)));
    }
  }
}

}  // namespace tpm::contact
