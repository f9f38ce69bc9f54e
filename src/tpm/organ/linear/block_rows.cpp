#include "tpm/organ/linear/block_rows.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <numeric>

namespace tpm::organ {

template <int R, int C>
typename BlockRows<R, C>::Block& RowGatherer<R, C>::at(std::uint32_t column) {
  std::uint32_t& place = place_[column];
  if (place == kNowhere) {
    place = static_cast<std::uint32_t>(column_.size());
    column_.push_back(column);
    block_.push_back(BlockRows<R, C>::Block::Zero());
  }
  return block_[place];
}

template <int R, int C>
void RowGatherer<R, C>::finish_row(BlockRows<R, C>& matrix) {
  order_.resize(column_.size());
  std::iota(order_.begin(), order_.end(), 0U);
  std::sort(order_.begin(), order_.end(),
            [&](std::uint32_t p, std::uint32_t q) { return column_[p] < column_[q]; });
  for (const std::uint32_t p : order_) {
    matrix.column.push_back(column_[p]);
    matrix.block.push_back(block_[p]);
    place_[column_[p]] = kNowhere;
  }
  matrix.begin.push_back(matrix.column.size());
  column_.clear();
  block_.clear();
}

template <int R, int K, int C>
BlockRows<R, C> product(const BlockRows<R, K>& a, const BlockRows<K, C>& b) {
  BlockRows<R, C> result;
  result.columns = b.columns;
  result.begin.reserve(a.rows() + 1);
  RowGatherer<R, C> row(b.columns);
  for (std::size_t i = 0; i < a.rows(); ++i) {
    for (std::size_t p = a.begin[i]; p < a.begin[i + 1]; ++p) {
      const std::uint32_t k = a.column[p];
      for (std::size_t q = b.begin[k]; q < b.begin[k + 1]; ++q) {
        row.at(b.column[q]).noalias() += a.block[p].lazyProduct(b.block[q]);
      }
    }
    row.finish_row(result);
  }
  return result;
}

template <int R, int C, int D>
BlockRows<C, D> transposed_product(const BlockRows<R, C>& p, const BlockRows<R, D>& q) {
  // Where each column of P stands: rows and blocks, by column.
  std::vector<std::size_t> begin(p.columns + 1, 0);
  for (const std::uint32_t c : p.column) ++begin[c + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::array<std::size_t, 2>> entry(p.column.size());
  std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
  for (std::size_t i = 0; i < p.rows(); ++i) {
    for (std::size_t e = p.begin[i]; e < p.begin[i + 1]; ++e) entry[next[p.column[e]]++] = {i, e};
  }
  BlockRows<C, D> result;
  result.columns = q.columns;
  result.begin.reserve(p.columns + 1);
  RowGatherer<C, D> row(q.columns);
  for (std::size_t c = 0; c < p.columns; ++c) {
    for (std::size_t e = begin[c]; e < begin[c + 1]; ++e) {
      const auto [i, at] = entry[e];
      for (std::size_t f = q.begin[i]; f < q.begin[i + 1]; ++f) {
        row.at(q.column[f]).noalias() += p.block[at].transpose().lazyProduct(q.block[f]);
      }
    }
    row.finish_row(result);
  }
  return result;
}

template <int N>
std::vector<Eigen::Matrix<double, N, N>> inverse_diagonal(const BlockRows<N, N>& matrix) {
  using Block = Eigen::Matrix<double, N, N>;
  std::vector<Block> inverse(matrix.rows(), Block::Zero());
  for (std::size_t i = 0; i < matrix.rows(); ++i) {
    const auto row = matrix.column.begin();
    const auto first = row + static_cast<std::ptrdiff_t>(matrix.begin[i]);
    const auto last = row + static_cast<std::ptrdiff_t>(matrix.begin[i + 1]);
    const auto at = std::lower_bound(first, last, static_cast<std::uint32_t>(i));
    if (at == last || *at != i) return {};
    const Eigen::LLT<Block> factor(matrix.block[static_cast<std::size_t>(at - row)]);
    if (factor.info() != Eigen::Success) return {};
    inverse[i] = factor.solve(Block::Identity());
  }
  return inverse;
}

template class RowGatherer<3, 6>;
template class RowGatherer<6, 6>;
template BlockRows<3, 6> product(const BlockRows<3, 3>&, const BlockRows<3, 6>&);
template BlockRows<6, 6> product(const BlockRows<6, 6>&, const BlockRows<6, 6>&);
template BlockRows<6, 6> transposed_product(const BlockRows<3, 6>&, const BlockRows<3, 6>&);
template BlockRows<6, 6> transposed_product(const BlockRows<6, 6>&, const BlockRows<6, 6>&);
template std::vector<Eigen::Matrix3d> inverse_diagonal(const BlockRows<3, 3>&);
template std::vector<Eigen::Matrix<double, 6, 6>> inverse_diagonal(const BlockRows<6, 6>&);

}  // namespace tpm::organ
