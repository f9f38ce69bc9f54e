#include "tpm/solve/block_ldlt.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <stdexcept>

namespace tpm {
namespace {

using Edge = std::array<std::uint32_t, 2>;

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

template <typename Scalar>
void BlockMatrix<Scalar>::set_zero() {
  std::fill(diagonal.begin(), diagonal.end(), Block::Zero());
  std::fill(below.begin(), below.end(), Block::Zero());
}

template <typename Scalar>
BlockLdlt<Scalar>::BlockLdlt(const BlockPattern& pattern)
    : pattern_(pattern),
      node_of_(pattern.nodes()),
      lower_(pattern.factor_blocks()),
      pivot_(pattern.nodes()),
      inverse_(pattern.nodes()),
      work_(pattern.nodes(), Block::Zero()),
      permuted_(3, static_cast<Eigen::Index>(pattern.nodes())) {
  for (std::uint32_t node = 0; node < node_of_.size(); ++node) {
    node_of_[pattern.order_[node]] = node;
  }
}

template <typename Scalar>
void BlockLdlt<Scalar>::gather_column(const BlockMatrix<Scalar>& matrix, std::uint32_t column) {
  work_[column] = matrix.diagonal[node_of_[column]];
  for (std::uint32_t p = pattern_.column_[column]; p < pattern_.column_[column + 1]; ++p) {
    work_[pattern_.row_[p]] = matrix.below[p];
  }
}

template <typename Scalar>
void BlockLdlt<Scalar>::eliminate_before(std::uint32_t column) {
  for (std::uint32_t e = pattern_.row_begin_[column]; e < pattern_.row_begin_[column + 1]; ++e) {
    const auto [k, at] = pattern_.row_entry_[e];
    const Block factor = pivot_[k] * lower_[at].transpose();
    for (std::uint32_t p = at; p < pattern_.column_[k + 1]; ++p) {
      work_[pattern_.row_[p]].noalias() -= lower_[p].lazyProduct(factor);
    }
  }
}

template <typename Scalar>
bool BlockLdlt<Scalar>::factorise(const BlockMatrix<Scalar>& matrix) {
  negative_ = 0;
  const auto n = static_cast<std::uint32_t>(pattern_.nodes());
  for (std::uint32_t j = 0; j < n; ++j) {
    gather_column(matrix, j);
    eliminate_before(j);
    pivot_[j] = Scalar(0.5) * (work_[j] + work_[j].transpose());
    if (!pivot_[j].allFinite()) return false;
    Eigen::SelfAdjointEigenSolver<Block> signs;
    signs.computeDirect(pivot_[j], Eigen::EigenvaluesOnly);
    negative_ += static_cast<std::size_t>((signs.eigenvalues().array() < Scalar(0)).count());
    bool invertible = false;
    pivot_[j].computeInverseWithCheck(inverse_[j], invertible, Scalar(0));
    if (!invertible) return false;
    for (std::uint32_t p = pattern_.column_[j]; p < pattern_.column_[j + 1]; ++p) {
      lower_[p] = work_[pattern_.row_[p]].lazyProduct(inverse_[j]);
    }
  }
  return true;
}

template <typename Scalar>
void BlockLdlt<Scalar>::solve(Eigen::Ref<Vectors> x) const {
  const auto n = static_cast<std::uint32_t>(pattern_.nodes());
  Vectors& y = permuted_;
  for (std::uint32_t j = 0; j < n; ++j) y.col(j) = x.col(node_of_[j]);
  for (std::uint32_t j = 0; j < n; ++j) {
    const Eigen::Matrix<Scalar, 3, 1> value = y.col(j);
    for (std::uint32_t p = pattern_.column_[j]; p < pattern_.column_[j + 1]; ++p) {
      y.col(pattern_.row_[p]).noalias() -= lower_[p] * value;
    }
  }
  for (std::uint32_t j = n; j-- > 0;) {
    Eigen::Matrix<Scalar, 3, 1> value = inverse_[j] * y.col(j);
    for (std::uint32_t p = pattern_.column_[j]; p < pattern_.column_[j + 1]; ++p) {
      value.noalias() -= lower_[p].transpose() * y.col(pattern_.row_[p]);
    }
    y.col(j) = value;
  }
  for (std::uint32_t j = 0; j < n; ++j) x.col(node_of_[j]) = y.col(j);
}

template struct BlockMatrix<double>;
template struct BlockMatrix<float>;
template class BlockLdlt<double>;
template class BlockLdlt<float>;

}  // namespace tpm
