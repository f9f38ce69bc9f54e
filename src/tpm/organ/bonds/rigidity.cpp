#include "tpm/organ/bonds/rigidity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"
#include "tpm/organ/bonds/local_support.hpp"
#include "tpm/organ/bonds/stiffness_blocks.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr double kZeroMode = 1e-9;        // of the mean diagonal
constexpr std::size_t kMostModes = 24;    // found one by one
constexpr int kInverseIterations = 4;     // each gains about nine digits over what is stiff
constexpr double kTakesPart = 0.01;       // of the largest motion in the modes
constexpr double kTakesPartInside = 0.1;  // where motions of the whole have been taken out

/// The matrix at rest plus a multiple of 1 on what is free.
BlockMatrix shifted(const BlockMatrix& stiffness, const Constraints& constraints, double shift) {
  BlockMatrix matrix = stiffness;
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    matrix.diagonal[i] += shift * constraints.projector(i);
  }
  return matrix;
}

double mean_diagonal(const BondSystem& bonds, const Positions& rest,
                     const ViscousState& viscous_state) {
  double sum = 0.0;
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    sum += 2.0 * bonds.stiffness_block(i, rest, viscous_state).trace();
  }
  return sum / (3.0 * static_cast<double>(bonds.spheres()));
}

/// An orthonormal basis of the softest motions, one column each, coordinates of all spheres.
Eigen::MatrixXd softest(const BlockPattern& pattern, const BlockMatrix& matrix,
                        const Constraints& constraints, Eigen::Index count) {
  BlockLdlt factor(pattern);
  const auto n = static_cast<Eigen::Index>(constraints.size());
  Eigen::MatrixXd basis(3 * n, count);
  Random random(1);
  for (double& x : basis.reshaped()) x = random.normal();
  if (!factor.factorise(matrix)) return Eigen::MatrixXd::Zero(3 * n, count);
  for (int i = 0; i < kInverseIterations; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      Eigen::Map<Eigen::Matrix3Xd> mode(basis.col(j).data(), 3, n);
      constraints.project(mode);
      factor.solve(mode);
      constraints.project(mode);
    }
    basis = orthonormal_columns(basis);
  }
  return basis;
}

std::vector<std::size_t> spheres_that_move(const Eigen::MatrixXd& modes, std::size_t spheres,
                                           double takes_part) {
  std::vector<double> motion(spheres);
  for (std::size_t i = 0; i < spheres; ++i) {
    motion[i] = modes.middleRows(3 * static_cast<Eigen::Index>(i), 3).norm();
  }
  const double most = *std::max_element(motion.begin(), motion.end());
  std::vector<std::size_t> order(spheres);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return motion[a] > motion[b]; });
  std::erase_if(order, [&](std::size_t i) { return motion[i] < takes_part * most; });
  return order;
}

std::string words_with(const ZeroEnergyModes& modes, const std::string& spheres) {
  return fmt::format("{} zero-energy mode{}; loose: {}", modes.count, modes.count == 1 ? "" : "s",
                     spheres);
}

}  // namespace

Eigen::MatrixXd whole_motions(const Positions& rest, const Constraints& constraints) {
  constexpr double kNotStopped = 1e-9;
  const Eigen::Matrix3Xd from = rest.colwise() - rest.rowwise().mean().eval();
  const double size = std::max(from.colwise().norm().maxCoeff(), 1e-300);
  Eigen::MatrixXd motions(3 * rest.cols(), 6);
  Eigen::Matrix<double, 6, 6> held = Eigen::Matrix<double, 6, 6>::Zero();
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    const Eigen::Vector3d p = from.col(i) / size;
    Eigen::Matrix<double, 3, 6> motion;
    motion.leftCols<3>().setIdentity();
    motion.rightCols<3>() << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;
    motions.middleRows<3>(3 * i) = motion;
    const auto sphere = static_cast<std::size_t>(i);
    if (constraints.is_free(sphere)) continue;
    const Eigen::Matrix<double, 3, 6> stopped =
        motion - Eigen::Matrix<double, 3, 6>(constraints.projector(sphere) * motion);
    held += stopped.transpose() * stopped;
  }
  const auto [values, vectors] = symmetric_modes(held);
  const auto free = (values.array() <= kNotStopped * std::max(values.maxCoeff(), 1.0)).count();
  if (free == 0) return Eigen::MatrixXd(motions.rows(), 0);
  return orthonormal_columns(motions * vectors.leftCols(free));
}

ZeroEnergyModes zero_energy_modes(const BondSystem& bonds, const Positions& rest,
                                  const Constraints& constraints, const Eigen::MatrixXd& whole) {
  const ViscousState none{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())), 0.0};
  StiffnessBlocks blocks(bonds, constraints);
  const BlockMatrix& stiffness = blocks.assemble(rest, none);
  const double mean = mean_diagonal(bonds, rest, none);
  const double size = mean > 0.0 ? mean : 1.0;

  ZeroEnergyModes modes;
  BlockLdlt factor(blocks.pattern());
  if (!factor.factorise(shifted(stiffness, constraints, -kZeroMode * size))) {
    throw Error(ExitCode::numerical, "network", "the stiffness at rest cannot be factorised");
  }
  const std::size_t free = factor.negative_count();
  const auto of_whole = static_cast<std::size_t>(whole.cols());
  modes.count = free > of_whole ? free - of_whole : 0;
  if (modes.count == 0) return modes;
  const auto found = static_cast<Eigen::Index>(std::min(free, kMostModes));
  Eigen::MatrixXd motions = softest(
      blocks.pattern(), shifted(stiffness, constraints, kZeroMode * size), constraints, found);
  if (of_whole > 0) motions -= whole * (whole.transpose() * motions).eval();
  modes.spheres =
      spheres_that_move(motions, constraints.size(), of_whole > 0 ? kTakesPartInside : kTakesPart);
  return modes;
}

std::string words(const ZeroEnergyModes& modes) {
  return words_with(modes, sphere_list(modes.spheres));
}

void require_rigid(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
                   std::string_view where, const Eigen::MatrixXd& whole) {
  const ZeroEnergyModes modes = zero_energy_modes(bonds, rest, constraints, whole);
  if (modes.is_rigid()) return;
  throw bad_input(where, words_with(modes, sphere_list(modes.spheres, rest)),
                  "a network without mechanisms: more bonds (a wider support) or more anchors");
}

}  // namespace tpm::organ
