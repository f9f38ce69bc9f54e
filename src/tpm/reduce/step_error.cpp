#include "tpm/reduce/step_error.hpp"

#include <Eigen/Eigenvalues>
#include <unsupported/Eigen/MatrixFunctions>

#include "tpm/solve/relaxation_filter.hpp"

namespace tpm {
namespace {

constexpr double kNoMode = 1e-9;  // of the contact's stiffness: a field that adds nothing

/// The inverse, without directions that have no stiffness to speak of.
Eigen::Matrix3d inverse_where_stiff(const Eigen::Matrix3d& matrix, double scale) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> modes(matrix);
  Eigen::Vector3d inverse = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    if (modes.eigenvalues()[i] > kNoMode * scale) inverse[i] = 1.0 / modes.eigenvalues()[i];
  }
  return modes.eigenvectors() * inverse.asDiagonal() * modes.eigenvectors().transpose();
}

}  // namespace

StepError::StepError(PushedContact& tissue, const Positions& position, double relaxed,
                     double period_s) {
  const BondMemory at_once = tissue.memory(position, relaxed, 0.0);
  const BondMemory in_the_end = tissue.memory(position, relaxed, 1.0);
  const ContactFields first = tissue.fields(position, at_once);
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
    tissue.bonds().add_stiffness_times(position, at_once, displacement, force);
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
  SixSquare z_of_memory = SixSquare::Zero();
  z_of_memory.bottomRows<3>() = soft * relaxing.bottomRows<3>();
  SixThree z_of_contact = SixThree::Zero();
  z_of_contact.topRows<3>().setIdentity();
  z_of_contact.bottomRows<3>() = -soft * stiffness.bottomLeftCorner<3, 3>();
  force_of_memory_ = stiffness.topRows<3>() * z_of_memory - relaxing.topRows<3>();

  const double z = period_s / tissue.bonds().relaxation_time_s();
  // The contact moves linearly: (p, u, change of u) is a linear system of its own.
  Eigen::Matrix<double, 12, 12> rate = Eigen::Matrix<double, 12, 12>::Zero();
  rate.block<6, 6>(0, 0) = z * (z_of_memory - SixSquare::Identity());
  rate.block<6, 3>(0, 6) = z * z_of_contact;
  rate.block<3, 3>(6, 9).setIdentity();
  const Eigen::Matrix<double, 12, 12> over = rate.exp();
  exact_.of_memory = over.block<6, 6>(0, 0);
  exact_.of_end = over.block<6, 3>(0, 9);
  exact_.of_start = over.block<6, 3>(0, 6) - exact_.of_end;

  const RelaxationWeights w = relaxation_weights(z);
  // p_new = r p + w0 z + w1 z_new with both z from the balance.
  const SixSquare left = SixSquare::Identity() - w.w1 * z_of_memory;
  const auto solved = left.partialPivLu();
  stepped_.of_memory = solved.solve(w.r * SixSquare::Identity() + w.w0 * z_of_memory);
  stepped_.of_start = solved.solve(w.w0 * z_of_contact);
  stepped_.of_end = solved.solve(w.w1 * z_of_contact);
}

void StepError::reset() noexcept {
  exact_memory_.setZero();
  stepped_memory_.setZero();
  at_.setZero();
}

Eigen::Vector3d StepError::advance(const Eigen::Vector3d& displacement_m) noexcept {
  const auto move = [&](const Advance& by, Six& memory) {
    memory = (by.of_memory * memory + by.of_start * at_ + by.of_end * displacement_m).eval();
  };
  move(exact_, exact_memory_);
  move(stepped_, stepped_memory_);
  at_ = displacement_m;
  return force_of_memory_ * (exact_memory_ - stepped_memory_);
}

}  // namespace tpm
