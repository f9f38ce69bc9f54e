#include "tpm/solve/block_ldlt.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <stdexcept>

#include "tpm/core/wide_vectors.hpp"

namespace tpm {
namespace {

using Edge = std::array<std::uint32_t, 2>;

/// C = A B^T, where A and C are by columns and B is padded.
[[gnu::always_inline]] inline void multiply_transposed(const double* a, const double* b,
                                                       double* c) {
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) {
      c[3 * column + row] =
          a[row] * b[column] + a[3 + row] * b[4 + column] + a[6 + row] * b[8 + column];
    }
  }
}

/// W -= A F, where A and W are padded and F is by columns.
[[gnu::always_inline]] inline void subtract_product(const double* a, const double* f, double* w) {
  using Column [[gnu::vector_size(32)]] = double;
  const auto* const from = reinterpret_cast<const Column*>(a);
  auto* const to = reinterpret_cast<Column*>(w);
  const Column a0 = from[0], a1 = from[1], a2 = from[2];
  to[0] -= a0 * f[0] + a1 * f[1] + a2 * f[2];
  to[1] -= a0 * f[3] + a1 * f[4] + a2 * f[5];
  to[2] -= a0 * f[6] + a1 * f[7] + a2 * f[8];
}

/// The place of each node in an elimination order with little fill.
std::vector<std::uint32_t> elimination_order(std::size_t nodes, std::span<const Edge> edges) {
  using Graph = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;
  std::vector<Eigen::Triplet<double, int>> entries;
  entries.reserve(2 * edges.size() + nodes);
  for (std::size_t i = 0; i < nodes; ++i) {
    entries.emplace_back(static_cast<int>(i), static_cast<int>(i), 1.0);
  }
  for (const auto& [a, b] : edges) {
    entries.emplace_back(static_cast<int>(a), static_cast<int>(b), 1.0);
    entries.emplace_back(static_cast<int>(b), static_cast<int>(a), 1.0);
  }
  const auto n = static_cast<Eigen::Index>(nodes);
  Graph graph(n, n);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(graph, permutation);
  std::vector<std::uint32_t> order(nodes);
  for (std::size_t place = 0; place < nodes; ++place) {
    const int node = permutation.indices()[static_cast<Eigen::Index>(place)];
    order[static_cast<std::size_t>(node)] = static_cast<std::uint32_t>(place);
  }
  return order;
}

/// Rows of each column of the factor: those of the matrix and those of the columns whose first row
/// this is (their parent in the elimination tree).
std::vector<std::vector<std::uint32_t>> factor_columns(std::span<const std::uint32_t> order,
                                                       std::span<const Edge> edges) {
  std::vector<std::vector<std::uint32_t>> columns(order.size());
  for (const auto& [a, b] : edges) {
    const auto [low, high] = std::minmax(order[a], order[b]);
    columns[low].push_back(high);
  }
  for (std::uint32_t j = 0; j < columns.size(); ++j) {
    auto& rows = columns[j];
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    if (rows.empty()) continue;
    auto& parent = columns[rows.front()];
    parent.insert(parent.end(), rows.begin() + 1, rows.end());
  }
  return columns;
}

}  // namespace

BlockPattern::BlockPattern(std::size_t nodes, std::span<const Edge> edges)
    : order_(elimination_order(nodes, edges)) {
  const auto columns = factor_columns(order_, edges);
  std::vector<std::uint32_t> in_row(nodes + 1, 0);
  for (const auto& rows : columns) {
    column_.push_back(static_cast<std::uint32_t>(row_.size()));
    row_.insert(row_.end(), rows.begin(), rows.end());
    for (const std::uint32_t row : rows) ++in_row[row];
    products_ += rows.size() * (rows.size() + 1) / 2;
  }
  column_.push_back(static_cast<std::uint32_t>(row_.size()));
  row_begin_.assign(nodes + 1, 0);
  for (std::size_t i = 0; i < nodes; ++i) row_begin_[i + 1] = row_begin_[i] + in_row[i];
  row_entry_.resize(row_.size());
  std::vector<std::uint32_t> next(row_begin_.begin(), row_begin_.end() - 1);
  for (std::uint32_t j = 0; j < nodes; ++j) {
    for (std::uint32_t p = column_[j]; p < column_[j + 1]; ++p) {
      row_entry_[next[row_[p]]++] = {j, p};
    }
  }
}

BlockPattern::Place BlockPattern::place(std::uint32_t a, std::uint32_t b) const {
  const auto [low, high] = std::minmax(order_.at(a), order_.at(b));
  const auto begin = row_.begin() + column_[low];
  const auto end = row_.begin() + column_[low + 1];
  const auto found = std::lower_bound(begin, end, high);
  if (found == end || *found != high) throw std::out_of_range("nodes that are not neighbours");
  return {static_cast<std::uint32_t>(found - row_.begin()), order_[a] == low};
}

void BlockMatrix::set_zero() {
  std::fill(diagonal.begin(), diagonal.end(), Eigen::Matrix3d::Zero());
  std::fill(below.begin(), below.end(), Eigen::Matrix3d::Zero());
}

BlockLdlt::BlockLdlt(const BlockPattern& pattern)
    : pattern_(pattern),
      node_of_(pattern.nodes()),
      lower_(pattern.factor_blocks()),
      pivot_(pattern.nodes()),
      inverse_(pattern.nodes()),
      work_(pattern.nodes()),
      permuted_(3, static_cast<Eigen::Index>(pattern.nodes())) {
  for (std::uint32_t node = 0; node < node_of_.size(); ++node) {
    node_of_[pattern.order_[node]] = node;
  }
}

void BlockLdlt::gather_column(const BlockMatrix& matrix, std::uint32_t column) {
  work_[column].matrix() = matrix.diagonal[node_of_[column]];
  for (std::uint32_t p = pattern_.column_[column]; p < pattern_.column_[column + 1]; ++p) {
    work_[pattern_.row_[p]].matrix() = matrix.below[p];
  }
}

void BlockLdlt::eliminate_before(std::uint32_t column) {
  const BlockPattern::RowEntry* const entries = pattern_.row_entry_.data();
  const std::uint32_t begin = pattern_.row_begin_[column];
  const std::uint32_t end = pattern_.row_begin_[column + 1];
  const std::uint32_t* const columns = pattern_.column_.data();
  const std::uint32_t* const row = pattern_.row_.data();
  const PaddedBlock* const lower = lower_.data();
  const Eigen::Matrix3d* const pivot = pivot_.data();
  PaddedBlock* const work = work_.data();
  run_wide([=]() __attribute__((always_inline)) {
    for (std::uint32_t e = begin; e < end; ++e) {
      const auto [k, at] = entries[e];
      std::array<double, 9> factor;  // pivot times the transposed block, by columns
      multiply_transposed(pivot[k].data(), lower[at].column.data(), factor.data());
      const std::uint32_t last = columns[k + 1];
      for (std::uint32_t p = at; p < last; ++p) {
        subtract_product(lower[p].column.data(), factor.data(), work[row[p]].column.data());
      }
    }
  });
}

bool BlockLdlt::invert_pivot(std::uint32_t column) {
  Eigen::Matrix3d& pivot = pivot_[column];
  pivot = 0.5 * (work_[column].matrix() + work_[column].matrix().transpose());
  if (!pivot.allFinite()) return false;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> signs;
  signs.computeDirect(pivot, Eigen::EigenvaluesOnly);
  negative_ += static_cast<std::size_t>((signs.eigenvalues().array() < 0.0).count());
  bool invertible = false;
  pivot.computeInverseWithCheck(inverse_[column], invertible, 0.0);
  return invertible;
}

bool BlockLdlt::factorise(const BlockMatrix& matrix) {
  negative_ = 0;
  const auto n = static_cast<std::uint32_t>(pattern_.nodes());
  for (std::uint32_t j = 0; j < n; ++j) {
    gather_column(matrix, j);
    eliminate_before(j);
    if (!invert_pivot(j)) return false;
    for (std::uint32_t p = pattern_.column_[j]; p < pattern_.column_[j + 1]; ++p) {
      lower_[p].matrix() = work_[pattern_.row_[p]].matrix().lazyProduct(inverse_[j]);
    }
  }
  return true;
}

// A Ref is a view: what it shows is changed.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
void BlockLdlt::solve(Eigen::Ref<Eigen::Matrix3Xd> x) const {
  const auto n = static_cast<std::uint32_t>(pattern_.nodes());
  Eigen::Matrix3Xd& y = permuted_;
  for (std::uint32_t j = 0; j < n; ++j) y.col(j) = x.col(node_of_[j]);
  for (std::uint32_t j = 0; j < n; ++j) {
    const Eigen::Vector3d value = y.col(j);
    for (std::uint32_t p = pattern_.column_[j]; p < pattern_.column_[j + 1]; ++p) {
      y.col(pattern_.row_[p]).noalias() -= lower_[p].matrix() * value;
    }
  }
  for (std::uint32_t j = n; j-- > 0;) {
    Eigen::Vector3d value = inverse_[j] * y.col(j);
    for (std::uint32_t p = pattern_.column_[j]; p < pattern_.column_[j + 1]; ++p) {
      value.noalias() -= lower_[p].matrix().transpose() * y.col(pattern_.row_[p]);
    }
    y.col(j) = value;
  }
  for (std::uint32_t j = 0; j < n; ++j) x.col(node_of_[j]) = y.col(j);
}

}  // namespace tpm
