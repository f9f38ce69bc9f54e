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

constexpr double kZeroMode = 1e-9;      // of the mean diagonal
constexpr std::size_t kMostModes = 24;  // found one by one
constexpr int kInverseIterations = 4;   // each gains about nine digits over what is stiff
constexpr double kTakesPart = 0.01;     // of the largest motion in the modes

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

std::vector<std::size_t> spheres_that_move(const Eigen::MatrixXd& modes, std::size_t spheres) {
  std::vector<double> motion(spheres);
  for (std::size_t i = 0; i < spheres; ++i) {
    motion[i] = modes.middleRows(3 * static_cast<Eigen::Index>(i), 3).norm();
  }
  const double most = *std::max_element(motion.begin(), motion.end());
  std::vector<std::size_t> order(spheres);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return motion[a] > motion[b]; });
  std::erase_if(order, [&](std::size_t i) { return motion[i] < kTakesPart * most; });
  return order;
}

std::string words_with(const ZeroEnergyModes& modes, const std::string& spheres) {
  return fmt::format("{} zero-energy mode{}; loose: {}", modes.count, modes.count == 1 ? "" : "s",
                     spheres);
}

}  // namespace

ZeroEnergyModes zero_energy_modes(const BondSystem& bonds, const Positions& rest,
                                  const Constraints& constraints) {
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
  modes.count = factor.negative_count();
  if (modes.count == 0) return modes;
  const auto found = static_cast<Eigen::Index>(std::min(modes.count, kMostModes));
  modes.spheres =
      spheres_that_move(softest(blocks.pattern(), shifted(stiffness, constraints, kZeroMode * size),
                                constraints, found),
                        constraints.size());
  return modes;
}

std::string words(const ZeroEnergyModes& modes) {
  return words_with(modes, sphere_list(modes.spheres));
}

void require_rigid(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
                   std::string_view where) {
  const ZeroEnergyModes modes = zero_energy_modes(bonds, rest, constraints);
  if (modes.is_rigid()) return;
  throw bad_input(where, words_with(modes, sphere_list(modes.spheres, rest)),
                  "a network without mechanisms: more bonds (a wider support) or more anchors");
}

}  // namespace tpm::organ
