#include "tpm/organ/linear/multigrid.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr std::size_t kCoarsestNodes = 100;  // solved directly: 600 numbers
constexpr std::size_t kMostLevels = 20;
constexpr double kIndependent = 1e-6;  // a rigid motion that differs less is left out
constexpr int kPowerIterations = 12;   // for the largest eigenvalue of D^-1 A
constexpr double kPowerMargin = 1.1;   // the estimate comes from below

/// The part of the modes on each aggregate made orthonormal: the columns of the unsmoothed
/// prolongation, and what of them is the modes again (the coarse modes). A mode that depends on
/// those before it (the turn of a single node, of two about their line) gets a zero column.
template <int N>
BlockRows<N, 6> tentative(const Aggregates& aggregates, const RigidModes<N>& modes,
                          RigidModes<6>& coarse_modes) {
  std::vector<std::vector<std::uint32_t>> members(aggregates.count);
  BlockRows<N, 6> p;
  p.columns = aggregates.count;
  for (std::uint32_t i = 0; i < modes.size(); ++i) {
    const std::uint32_t a = aggregates.of_node[i];
    if (a != Aggregates::kNone) {
      members[a].push_back(i);
      p.column.push_back(a);
    }
    p.begin.push_back(p.column.size());
  }
  p.block.resize(p.column.size());
  coarse_modes.assign(aggregates.count, Eigen::Matrix<double, 6, 6>::Zero());
  Eigen::Matrix<double, Eigen::Dynamic, 6> q;
  for (std::size_t a = 0; a < aggregates.count; ++a) {
    const auto n = static_cast<Eigen::Index>(members[a].size());
    q.resize(N * n, 6);
    for (Eigen::Index m = 0; m < n; ++m) {
      q.middleRows<N>(N * m) = modes[members[a][static_cast<std::size_t>(m)]];
    }
    Eigen::Matrix<double, 6, 6>& r = coarse_modes[a];
    for (Eigen::Index j = 0; j < 6; ++j) {
      const double before = q.col(j).norm();
      for (int twice = 0; twice < 2; ++twice) {
        for (Eigen::Index k = 0; k < j; ++k) {
          const double part = q.col(k).dot(q.col(j));
          r(k, j) += part;
          q.col(j) -= part * q.col(k);
        }
      }
      const double left = q.col(j).norm();
      const bool independent = left > kIndependent * before;
      r(j, j) = independent ? left : 0.0;
      q.col(j) *= independent ? 1.0 / left : 0.0;
    }
    for (Eigen::Index m = 0; m < n; ++m) {
      p.block[p.begin[members[a][static_cast<std::size_t>(m)]]] = q.middleRows<N>(N * m);
    }
  }
  return p;
}

/// D^-1 times the blocks of each row.
template <int N, int C>
void scale_rows(const std::vector<Eigen::Matrix<double, N, N>>& inverse, double factor,
                BlockRows<N, C>& matrix) {
  for (std::size_t i = 0; i < matrix.rows(); ++i) {
    for (std::size_t p = matrix.begin[i]; p < matrix.begin[i + 1]; ++p) {
      matrix.block[p] = (factor * inverse[i] * matrix.block[p]).eval();
    }
  }
}

/// The largest eigenvalue of D^-1 A, by power iteration from a fixed start.
template <int N>
double largest_eigenvalue(const BlockRows<N, N>& matrix,
                          const std::vector<Eigen::Matrix<double, N, N>>& inverse) {
  const auto n = static_cast<Eigen::Index>(matrix.rows());
  BlockVector<N> x(N, n);
  BlockVector<N> y;
  Random random(1);
  for (double& value : x.reshaped()) value = random.normal();
  double value = 1.0;
  for (int i = 0; i < kPowerIterations; ++i) {
    x /= x.norm();
    multiply(matrix, x, y);
    for (Eigen::Index j = 0; j < n; ++j) {
      x.col(j).noalias() = inverse[static_cast<std::size_t>(j)].lazyProduct(y.col(j));
    }
    value = x.norm();
  }
  return kPowerMargin * value;
}

/// P - D^-1 A P times 4/3 over the largest eigenvalue of D^-1 A.
template <int N>
BlockRows<N, 6> smoothed(const BlockRows<N, N>& matrix,
                         const std::vector<Eigen::Matrix<double, N, N>>& inverse,
                         const BlockRows<N, 6>& p) {
  BlockRows<N, 6> result = product(matrix, p);
  scale_rows(inverse, -4.0 / 3.0 / largest_eigenvalue(matrix, inverse), result);
  for (std::size_t i = 0; i < p.rows(); ++i) {
    if (p.begin[i] == p.begin[i + 1]) continue;
    // A node is its own neighbour, so its aggregate is in the row.
    const auto first = result.column.begin() + static_cast<std::ptrdiff_t>(result.begin[i]);
    const auto last = result.column.begin() + static_cast<std::ptrdiff_t>(result.begin[i + 1]);
    const auto at = std::lower_bound(first, last, p.column[p.begin[i]]);
    result.block[static_cast<std::size_t>(at - result.column.begin())] += p.block[p.begin[i]];
  }
  return result;
}

/// Numbers of a node that stand for no motion get 1 on the diagonal.
void fill_empty_diagonal(BlockRows<6, 6>& matrix) {
  for (std::uint32_t i = 0; i < matrix.rows(); ++i) {
    for (std::size_t p = matrix.begin[i]; p < matrix.begin[i + 1]; ++p) {
      if (matrix.column[p] != i) continue;
      for (Eigen::Index k = 0; k < 6; ++k) {
        if (matrix.block[p](k, k) == 0.0) matrix.block[p](k, k) = 1.0;
      }
    }
  }
}

/// One forward Gauss-Seidel sweep from 0.
template <int N>
void sweep_forward(const BlockRows<N, N>& matrix,
                   const std::vector<Eigen::Matrix<double, N, N>>& inverse,
                   const BlockVector<N>& right, BlockVector<N>& x) {
  x.resize(N, right.cols());
  for (std::size_t i = 0; i < matrix.rows(); ++i) {
    Eigen::Matrix<double, N, 1> sum = right.col(static_cast<Eigen::Index>(i));
    for (std::size_t p = matrix.begin[i]; p < matrix.begin[i + 1] && matrix.column[p] < i; ++p) {
      sum.noalias() -= matrix.block[p].lazyProduct(x.col(matrix.column[p]));
    }
    x.col(static_cast<Eigen::Index>(i)).noalias() = inverse[i].lazyProduct(sum);
  }
}

/// One backward sweep.
template <int N>
void sweep_backward(const BlockRows<N, N>& matrix,
                    const std::vector<Eigen::Matrix<double, N, N>>& inverse,
                    const BlockVector<N>& right, BlockVector<N>& x) {
  for (std::size_t i = matrix.rows(); i-- > 0;) {
    Eigen::Matrix<double, N, 1> sum = right.col(static_cast<Eigen::Index>(i));
    for (std::size_t p = matrix.begin[i]; p < matrix.begin[i + 1]; ++p) {
      if (matrix.column[p] == i) continue;
      sum.noalias() -= matrix.block[p].lazyProduct(x.col(matrix.column[p]));
    }
    x.col(static_cast<Eigen::Index>(i)).noalias() = inverse[i].lazyProduct(sum);
  }
}

}  // namespace

Aggregates aggregate(std::span<const std::size_t> begin, std::span<const std::uint32_t> column) {
  const std::size_t n = begin.size() - 1;
  constexpr std::uint32_t none = Aggregates::kNone;
  Aggregates found;
  found.of_node.assign(n, none);
  const auto neighbours = [&](std::size_t i) {
    return column.subspan(begin[i], begin[i + 1] - begin[i]);
  };
  const auto alone = [&](std::size_t i) {
    return std::all_of(neighbours(i).begin(), neighbours(i).end(),
                       [&](std::uint32_t j) { return j == i; });
  };
  for (std::size_t i = 0; i < n; ++i) {
    const bool all_there = std::all_of(neighbours(i).begin(), neighbours(i).end(),
                                       [&](std::uint32_t j) { return found.of_node[j] == none; });
    if (!all_there || found.of_node[i] != none || alone(i)) continue;
    const auto a = static_cast<std::uint32_t>(found.count++);
    found.of_node[i] = a;
    for (const std::uint32_t j : neighbours(i)) found.of_node[j] = a;
  }
  // A node that no aggregate took is next to one: else it would have become one.
  const std::vector<std::uint32_t> first_round = found.of_node;
  for (std::size_t i = 0; i < n; ++i) {
    if (first_round[i] != none) continue;
    for (const std::uint32_t j : neighbours(i)) {
      if (first_round[j] == none) continue;
      found.of_node[i] = first_round[j];
      break;
    }
  }
  return found;
}

template <>
const BlockRows<3, 3>& Multigrid::matrix_of<3>(std::size_t) const {
  return finest_;
}
template <>
const BlockRows<6, 6>& Multigrid::matrix_of<6>(std::size_t level) const {
  return coarse_matrix_[level - 1];
}

Multigrid::Multigrid(const BlockRows<3, 3>& matrix, const RigidModes<3>& modes) : finest_(matrix) {
  build(modes);
}

template <int N>
bool Multigrid::coarsen(const BlockRows<N, N>& matrix, GridLevel<N>& grid,
                        const RigidModes<N>& modes, RigidModes<6>& coarse_modes) {
  grid.inverse = inverse_diagonal(matrix);
  if (grid.inverse.empty()) return false;
  const Aggregates aggregates = aggregate(matrix.begin, matrix.column);
  grid.prolongation = smoothed(matrix, grid.inverse, tentative(aggregates, modes, coarse_modes));
  BlockRows<6, 6> coarse =
      transposed_product(grid.prolongation, product(matrix, grid.prolongation));
  fill_empty_diagonal(coarse);
  coarse_matrix_.push_back(std::move(coarse));
  return true;
}

void Multigrid::build(const RigidModes<3>& modes) {
  RigidModes<6> coarse_modes;
  if (!coarsen(finest_, fine_, modes, coarse_modes)) return;
  while (coarse_matrix_.back().rows() > kCoarsestNodes) {
    const BlockRows<6, 6>& matrix = coarse_matrix_.back();
    coarse_.emplace_back();
    RigidModes<6> next;
    if (!coarsen(matrix, coarse_.back(), coarse_modes, next)) return;
    if (2 * coarse_matrix_.back().rows() > matrix.rows()) {
      throw Error(ExitCode::numerical, "multigrid",
                  "the nodes do not gather into fewer than half as many");
    }
    coarse_modes = std::move(next);
  }
  factorise_coarsest();
}

bool Multigrid::refresh() {
  if (!definite_) return false;
  fine_.inverse = inverse_diagonal(finest_);
  definite_ = !fine_.inverse.empty();
  return true;
}

void Multigrid::factorise_coarsest() {
  const BlockRows<6, 6>& matrix = coarse_matrix_.back();
  const auto n = static_cast<Eigen::Index>(matrix.rows());
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(6 * n, 6 * n);
  for (std::size_t i = 0; i < matrix.rows(); ++i) {
    for (std::size_t p = matrix.begin[i]; p < matrix.begin[i + 1]; ++p) {
      dense.block<6, 6>(6 * static_cast<Eigen::Index>(i),
                        6 * static_cast<Eigen::Index>(matrix.column[p])) = matrix.block[p];
    }
  }
  coarsest_.compute(dense);
  definite_ = coarsest_.info() == Eigen::Success;
}

void Multigrid::correct_from_below(std::size_t level, const BlockVector<6>& r,
                                   BlockVector<6>& z) const {
  if (level <= coarse_.size()) {
    cycle(level, coarse_[level - 1], r, z);
    return;
  }
  z.resize(6, r.cols());
  z.reshaped() = coarsest_.solve(r.reshaped());
}

template <int N>
void Multigrid::cycle(std::size_t level, const GridLevel<N>& grid, const BlockVector<N>& r,
                      BlockVector<N>& z) const {
  const BlockRows<N, N>& matrix = matrix_of<N>(level);
  sweep_forward(matrix, grid.inverse, r, z);
  multiply(matrix, z, grid.residual);
  grid.residual = r - grid.residual;
  multiply_transposed(grid.prolongation, grid.residual, grid.coarse_right);
  correct_from_below(level + 1, grid.coarse_right, grid.coarse_solution);
  multiply(grid.prolongation, grid.coarse_solution, grid.correction);
  z += grid.correction;
  sweep_backward(matrix, grid.inverse, r, z);
}

void Multigrid::apply(const BlockVector<3>& r, BlockVector<3>& z) const {
  cycle(0, fine_, r, z);
}

}  // namespace tpm::organ
