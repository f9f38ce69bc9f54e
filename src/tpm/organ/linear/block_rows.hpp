#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace tpm::organ {

/// Vectors of a block matrix: N numbers per node, one column each.
template <int N>
using BlockVector = Eigen::Matrix<double, N, Eigen::Dynamic>;

/// A sparse matrix of R x C blocks, row by row.
template <int R, int C>
struct BlockRows {
  using Block = Eigen::Matrix<double, R, C>;

  std::size_t columns = 0;
  std::vector<std::size_t> begin{0};  ///< first block of each row, one more at the end
  std::vector<std::uint32_t> column;  ///< of each block, rising in a row
  std::vector<Block> block;

  [[nodiscard]] std::size_t rows() const { return begin.size() - 1; }
};

/// y = A x.
template <int R, int C>
void multiply(const BlockRows<R, C>& a, const BlockVector<C>& x, BlockVector<R>& y) {
  y.resize(R, static_cast<Eigen::Index>(a.rows()));
  for (std::size_t i = 0; i < a.rows(); ++i) {
    Eigen::Matrix<double, R, 1> sum = Eigen::Matrix<double, R, 1>::Zero();
    for (std::size_t p = a.begin[i]; p < a.begin[i + 1]; ++p) {
      sum.noalias() += a.block[p].lazyProduct(x.col(a.column[p]));
    }
    y.col(static_cast<Eigen::Index>(i)) = sum;
  }
}

/// y = A^T x.
template <int R, int C>
void multiply_transposed(const BlockRows<R, C>& a, const BlockVector<R>& x, BlockVector<C>& y) {
  y.setZero(C, static_cast<Eigen::Index>(a.columns));
  for (std::size_t i = 0; i < a.rows(); ++i) {
    const Eigen::Matrix<double, R, 1> value = x.col(static_cast<Eigen::Index>(i));
    for (std::size_t p = a.begin[i]; p < a.begin[i + 1]; ++p) {
      y.col(a.column[p]).noalias() += a.block[p].transpose().lazyProduct(value);
    }
  }
}

/// Gathers one row of a product at a time: the blocks of columns in any order, sorted at the end.
template <int R, int C>
class RowGatherer {
 public:
  explicit RowGatherer(std::size_t columns) : place_(columns, kNowhere) {}

  /// The block of a column of the row being gathered, 0 at first.
  [[nodiscard]] typename BlockRows<R, C>::Block& at(std::uint32_t column);
  /// Appends the row to a matrix and starts the next.
  void finish_row(BlockRows<R, C>& matrix);

 private:
  static constexpr std::uint32_t kNowhere = 0xffffffffU;
  std::vector<std::uint32_t> place_;  ///< of each column among the gathered ones
  std::vector<std::uint32_t> column_;
  std::vector<typename BlockRows<R, C>::Block> block_;
  std::vector<std::uint32_t> order_;
};

/// A B. Instantiated for (3, 3, 6) and (6, 6, 6).
template <int R, int K, int C>
[[nodiscard]] BlockRows<R, C> product(const BlockRows<R, K>& a, const BlockRows<K, C>& b);

/// P^T Q. Instantiated for (3, 6, 6) and (6, 6, 6).
template <int R, int C, int D>
[[nodiscard]] BlockRows<C, D> transposed_product(const BlockRows<R, C>& p,
                                                 const BlockRows<R, D>& q);

/// The inverse of each diagonal block. Empty if one is not positive definite: neither is the
/// matrix.
template <int N>
[[nodiscard]] std::vector<Eigen::Matrix<double, N, N>> inverse_diagonal(
    const BlockRows<N, N>& matrix);

}  // namespace tpm::organ
