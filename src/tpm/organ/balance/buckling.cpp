#include "tpm/organ/balance/buckling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/random.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

/// A motion of what is free, from a seed.
Eigen::Matrix3Xd random_motion(const Constraints& constraints, Eigen::Index columns) {
  Random random(1);
  Eigen::Matrix3Xd mode(3, columns);
  for (double& x : mode.reshaped()) x = random.normal();
  constraints.project(mode);
  return mode;
}

/// The softest motion by inverse iteration with the stiffness prepared last. Nothing if an
/// iterative solution does not come to an end.
std::optional<Eigen::Matrix3Xd> by_inverse_iteration(Equilibrium& equilibrium,
                                                     Eigen::Index columns) {
  constexpr int kIterations = 8;
  constexpr double kExactly = 1e-4;  // where solutions iterate
  Eigen::Matrix3Xd mode = random_motion(equilibrium.constraints(), columns);
  try {
    for (int i = 0; i < kIterations; ++i) {
      const double size = mode.norm();
      if (!(size > 0.0)) return std::nullopt;
      mode /= size;
      equilibrium.displace(mode, kExactly);
    }
  } catch (const Error& error) {
    if (error.code() != ExitCode::numerical) throw;
    return std::nullopt;
  }
  if (!mode.allFinite()) return std::nullopt;
  return mode;
}

/// The motion of least curvature, also where the stiffness is not positive definite: the Rayleigh
/// quotient is minimised over the motion, its gradient and the last step (Knyazev 2001, one vector,
/// not preconditioned).
Eigen::Matrix3Xd by_least_curvature(const Equilibrium& equilibrium, const Positions& position,
                                    const ViscousState& viscous) {
  constexpr int kMostDescents = 500;
  constexpr double kNoDescent = 1e-6;  // of the largest curvature met
  const Constraints& constraints = equilibrium.constraints();
  const auto times = [&](const Eigen::VectorXd& motion) {
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, position.cols());
    const Eigen::Matrix3Xd shift = motion.reshaped(3, position.cols());
    equilibrium.bonds().add_stiffness_times(position, viscous, shift, force);
    constraints.project(force);
    return Eigen::VectorXd(force.reshaped());
  };
  Eigen::VectorXd mode = random_motion(constraints, position.cols()).reshaped();
  mode.normalize();
  Eigen::VectorXd step;
  double largest = 0.0;
  for (int i = 0; i < kMostDescents; ++i) {
    const Eigen::VectorXd force = times(mode);
    const double curvature = mode.dot(force);
    const Eigen::VectorXd gradient = force - curvature * mode;
    largest = std::max(largest, force.norm());
    if (!(gradient.norm() > kNoDescent * largest)) break;
    Eigen::MatrixXd span(mode.size(), step.size() > 0 ? 3 : 2);
    span.col(0) = mode;
    span.col(1) = gradient.normalized();
    if (step.size() > 0) span.col(2) = step.normalized();
    span = orthonormal_columns(span);
    Eigen::MatrixXd image(span.rows(), span.cols());
    for (Eigen::Index k = 0; k < span.cols(); ++k) image.col(k) = times(span.col(k));
    const Eigen::MatrixXd small = span.transpose() * image;
    Eigen::VectorXd next = span * symmetric_modes(0.5 * (small + small.transpose())).vectors.col(0);
    step = next - next.dot(mode) * mode;
    if (!next.allFinite() || !(step.norm() > 0.0)) break;
    mode = next.normalized();
  }
  return mode.reshaped(3, position.cols());
}

}  // namespace

std::string buckling_place(Equilibrium& equilibrium, const Positions& position,
                           const ViscousState& viscous, Eigen::Index spheres) {
  // Where solutions iterate they need a stiffness that is positive definite.
  std::optional<Eigen::Matrix3Xd> mode;
  if (equilibrium.factorise(position, viscous) &&
      (equilibrium.choice().direct || equilibrium.is_stable())) {
    mode = by_inverse_iteration(equilibrium, position.cols());
  }
  if (!mode) mode = by_least_curvature(equilibrium, position, viscous);
  Eigen::Index most = 0;
  mode->leftCols(spheres).colwise().squaredNorm().maxCoeff(&most);
  const Eigen::Vector3d place = 1e3 * position.col(most);
  return fmt::format(" around sphere {} at ({}, {}, {}) mm", most + 1, significant(place.x(), 4),
                     significant(place.y(), 4), significant(place.z(), 4));
}

std::string softest_place(DrivenTissue& tissue, const TissueState& state) {
  const auto spheres = static_cast<Eigen::Index>(tissue.bonds().without_tools().spheres());
  return buckling_place(tissue.equilibrium(), state.position, {state.mean, 0.0, state.closed},
                        spheres);
}

std::string snap_words(DrivenTissue& tissue, const TissueState& state) {
  return ": it may snap through" + softest_place(tissue, state);
}

std::string buckling_words(DrivenTissue& tissue, const TissueState& state) {
  return fmt::format("buckles{}: its stiffness is no longer positive",
                     softest_place(tissue, state));
}

}  // namespace tpm::organ
