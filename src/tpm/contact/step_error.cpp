#include "tpm/contact/step_error.hpp"

#include <limits>
#include <unsupported/Eigen/MatrixFunctions>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/law/relaxation/relaxation_filter.hpp"

namespace tpm::contact {
namespace {

constexpr double kNoMode = 1e-9;  // of the contact's stiffness: a field that adds nothing

/// The inverse, without directions that have no stiffness to speak of.
Eigen::Matrix3d inverse_where_stiff(const Eigen::Matrix3d& matrix, double scale) {
  const SymmetricModes modes = symmetric_modes(matrix);
  Eigen::Vector3d inverse = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    if (modes.values[i] > kNoMode * scale) inverse[i] = 1.0 / modes.values[i];
  }
  return modes.vectors * inverse.asDiagonal() * modes.vectors.transpose();
}

/// The branches of the bonds that relax; one that never does if none relaxes.
std::vector<ViscousLaw::Branch> branches_of(const BondSystem& bonds) {
  for (std::size_t i = 0; i < bonds.first_contact(); ++i) {
    if (!(bonds.relaxing()[static_cast<Eigen::Index>(i)] > 0.0)) continue;
    return bonds.laws()[bonds.law_of(i)].branches;
  }
  return {{1.0, std::numeric_limits<double>::infinity(), 0}};
}

}  // namespace

StepError::StepError(PushedContact& tissue, const Positions& position, double relaxed,
                     double period_s) {
  const ViscousState instantaneous = tissue.viscous_state(position, relaxed, 0.0);
  const ViscousState in_the_end = tissue.viscous_state(position, relaxed, 1.0);
  const ContactFields first = tissue.fields(position, instantaneous);
  const ContactFields last = tissue.fields(position, in_the_end);
  std::array<Eigen::Matrix3Xd, 6> field;
  for (std::size_t i = 0; i < 3; ++i) {
    field[i] = first.displacement[i];
    field[3 + i] = last.displacement[i] - first.displacement[i];
  }
  SixSquare stiffness;
  SixSquare lasting;
  for (int j = 0; j < 6; ++j) {
    const Eigen::Matrix3Xd& displacement = field[static_cast<std::size_t>(j)];
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, position.cols());
    tissue.bonds().add_stiffness_times(position, instantaneous, displacement, force);
    for (int i = 0; i < 6; ++i) {
      stiffness(i, j) = field[static_cast<std::size_t>(i)].cwiseProduct(force).sum();
    }
    force.setZero();
    tissue.bonds().add_stiffness_times(position, in_the_end, displacement, force);
    for (int i = 0; i < 6; ++i) {
      lasting(i, j) = field[static_cast<std::size_t>(i)].cwiseProduct(force).sum();
    }
  }
  const SixSquare relaxing = stiffness - lasting;
  // z = (u, v), forces K z - H p, of which those on v vanish; dp/dt = (z - p)/tau.
  const double scale = stiffness.topLeftCorner<3, 3>().trace();
  const Eigen::Matrix3d soft = inverse_where_stiff(stiffness.bottomRightCorner<3, 3>(), scale);
  SixSquare z_of_viscous = SixSquare::Zero();
  z_of_viscous.bottomRows<3>() = soft * relaxing.bottomRows<3>();
  SixThree z_of_contact = SixThree::Zero();
  z_of_contact.topRows<3>().setIdentity();
  z_of_contact.bottomRows<3>() = -soft * stiffness.bottomLeftCorner<3, 3>();
  const Eigen::Matrix<double, 3, 6> force_of_mean =
      stiffness.topRows<3>() * z_of_viscous - relaxing.topRows<3>();

  const std::vector<ViscousLaw::Branch> branches = branches_of(tissue.bonds());
  const auto n = static_cast<Eigen::Index>(branches.size());
  force_of_viscous_.resize(3, 6 * n);
  // The contact moves linearly: (p of all branches, u, change of u) is a linear system of its own,
  // dp_j/dt = (z - p_j)/tau_j, z = z_of_memory sum of gamma_j p_j + z_of_contact u.
  Eigen::MatrixXd rate = Eigen::MatrixXd::Zero(6 * n + 6, 6 * n + 6);
  // p_new = r p + w0 z + w1 z_new with both z from the balance.
  Eigen::MatrixXd left = Eigen::MatrixXd::Identity(6 * n, 6 * n);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(6 * n, 6 * n);
  Eigen::MatrixXd of_start(6 * n, 3);
  Eigen::MatrixXd of_end(6 * n, 3);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double x = period_s / branches[static_cast<std::size_t>(j)].relaxation_time_s;
    const RelaxationWeights w = relaxation_weights(x);
    for (Eigen::Index i = 0; i < n; ++i) {
      const SixSquare mean = branches[static_cast<std::size_t>(i)].share * z_of_viscous;
      rate.block<6, 6>(6 * j, 6 * i) += x * mean;
      left.block<6, 6>(6 * j, 6 * i) -= w.w1 * mean;
      right.block<6, 6>(6 * j, 6 * i) += w.w0 * mean;
    }
    rate.block<6, 6>(6 * j, 6 * j) -= x * SixSquare::Identity();
    right.block<6, 6>(6 * j, 6 * j) += w.r * SixSquare::Identity();
    rate.block<6, 3>(6 * j, 6 * n) = x * z_of_contact;
    of_start.middleRows<6>(6 * j) = w.w0 * z_of_contact;
    of_end.middleRows<6>(6 * j) = w.w1 * z_of_contact;
    force_of_viscous_.middleCols<6>(6 * j) =
        branches[static_cast<std::size_t>(j)].share * force_of_mean;
  }
  rate.block<3, 3>(6 * n, 6 * n + 3).setIdentity();
  const Eigen::MatrixXd over = rate.exp();
  exact_.of_viscous = over.topLeftCorner(6 * n, 6 * n);
  exact_.of_end = over.block(0, 6 * n + 3, 6 * n, 3);
  exact_.of_start = over.block(0, 6 * n, 6 * n, 3) - exact_.of_end;
  stepped_.of_viscous = solve_square(left, right);
  stepped_.of_start = solve_square(left, of_start);
  stepped_.of_end = solve_square(left, of_end);
  exact_.viscous = exact_.next = stepped_.viscous = stepped_.next = Eigen::VectorXd::Zero(6 * n);
}

void StepError::reset() noexcept {
  exact_.viscous.setZero();
  stepped_.viscous.setZero();
  at_.setZero();
}

void StepError::Advance::move(const Eigen::Vector3d& from, const Eigen::Vector3d& to) noexcept {
  next.noalias() = of_viscous * viscous;
  next.noalias() += of_start * from;
  next.noalias() += of_end * to;
  viscous.swap(next);
}

Eigen::Vector3d StepError::advance(const Eigen::Vector3d& displacement_m) noexcept {
  exact_.move(at_, displacement_m);
  stepped_.move(at_, displacement_m);
  at_ = displacement_m;
  Eigen::Vector3d error_N;
  error_N.noalias() = force_of_viscous_ * exact_.viscous;
  error_N.noalias() -= force_of_viscous_ * stepped_.viscous;
  return error_N;
}

}  // namespace tpm::contact
