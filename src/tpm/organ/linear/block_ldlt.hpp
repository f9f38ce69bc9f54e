#pragma once
#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cstdint>
#include <vector>

#include "tpm/organ/linear/block_pattern.hpp"
#include "tpm/organ/linear/dense_update.hpp"
#include "tpm/organ/linear/zeroed_numbers.hpp"

namespace tpm::organ {

/// L D L^T of a symmetric matrix with 3x3 pivots, without exchange of rows: stable for positive
/// definite matrices, and for others good enough to count signs.
///
/// Multifrontal: the columns of a front are one dense panel, and what they leave to later columns
/// is one dense matrix, which is added to the parent's. In a panel 48 columns are eliminated at a
/// time; all else is products of dense matrices (DenseUpdate).
///
/// A large matrix is factorised on all processors: parts of the tree of fronts first, then the rows
/// of each product of a front behind them. The factor is the same to the bit for any number of
/// threads. solve() allocates nothing, nor does factorise() where that is not worth a thread.
class BlockLdlt {
 public:
  /// @param pattern must live as long as this
  /// @param portable does without what not every processor has: for tests
  explicit BlockLdlt(const BlockPattern& pattern, bool portable = false);

  /// False if a pivot cannot be inverted or is not finite; the factor is then of no use. Throws as
  /// for_each_in_parallel.
  [[nodiscard]] bool factorise(const BlockMatrix& matrix);
  /// Of the last factorisation: eigenvalues below 0 that the matrix has (Sylvester's law).
  [[nodiscard]] std::size_t negative_count() const { return negative_; }

  /// Replaces the right-hand side, one column per node, by the solution.
  void solve(Eigen::Ref<Eigen::Matrix3Xd> x) const;

 private:
  friend class LaneFactor;
  /// A front while it is eliminated.
  struct Work {
    DensePanel panel, update;
    std::uint32_t first;       ///< place
    std::size_t own, reached;  ///< coordinates
  };
  /// Memory that one thread needs to eliminate fronts.
  struct Scratch {
    explicit Scratch(std::size_t longest);  ///< coordinates of a front
    std::vector<double> scaled;             ///< L D of the columns being eliminated
    std::vector<double> lower_inverse;      ///< minus the inverse of L on the diagonal
    std::size_t negative = 0;               ///< eigenvalues below 0 of the pivots
    bool done = true;
  };
  [[nodiscard]] Work work_on(std::size_t front);
  void gather(const BlockMatrix& matrix, std::size_t front, const Work& work);
  void add_child(const EliminationFronts::Front& child, const DensePanel& from, const Work& work);
  void eliminate_front(const BlockMatrix& matrix, std::size_t front, Scratch& scratch);
  [[nodiscard]] bool eliminate(const Work& work, Scratch& scratch);
  [[nodiscard]] bool eliminate_diagonal(const DensePanel& block, std::size_t size,
                                        std::uint32_t place, Scratch& scratch);
  template <class Function>
  void for_rows(std::size_t rows, std::size_t multiplications, const Function& f) const;
  void multiply(const DenseUpdate::Product& product) const;
  [[nodiscard]] bool invert_pivot(std::uint32_t place, Scratch& scratch);
  void scale_columns(const DensePanel& from, std::size_t rows, std::size_t columns,
                     std::uint32_t place, const DensePanel& to) const;

  const BlockPattern& pattern_;
  const DenseUpdate& update_;
  ZeroedNumbers panels_;                          ///< L of each front, its own coordinates first
  std::array<ZeroedNumbers, 2> stacks_;           ///< what fronts leave to their parents
  std::vector<Eigen::Matrix3d> pivot_, inverse_;  ///< by place
  std::vector<Scratch> scratch_;                  ///< of each part, then of the fronts after
  mutable Eigen::Matrix3Xd permuted_;
  mutable std::vector<double> local_;  ///< of a front, in solve()
  std::size_t negative_ = 0;
};

}  // namespace tpm::organ
