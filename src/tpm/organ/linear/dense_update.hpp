#pragma once
#include <cstddef>

namespace tpm::organ {

/// A dense matrix by columns in double precision, `stride` numbers from one column to the next.
struct DensePanel {
  double* numbers;
  std::size_t stride;
};

/// The product that nearly all operations of a dense factorisation go into.
struct DenseUpdate {
  static constexpr std::size_t kRows = 72;  ///< rows of A taken at a time, a multiple of 4

  /// Operands of C -= A B^T, or C = -A B^T, with A rows x depth, B columns x depth.
  struct Product {
    DensePanel c, a, b;
    std::size_t first_row = 0;  ///< of A and C, a multiple of kRows: those before it stay
    std::size_t rows, columns, depth;
    /// Part of C to compute: all of it, or of column j the rows from j on. More may be
    /// computed, of columns rounded down to a multiple of 4.
    bool lower = false;
    /// B is lower triangular: of its row j what stands behind column j is 0.
    bool b_triangular = false;
    bool overwrite = false;  ///< C has no meaning yet
  };

  /// Rows are rounded up to a multiple of 4: there must be room to read A and to write C, and what
  /// stands there then has no meaning.
  void (*run)(const Product& product) noexcept;
};

/// The fastest that this processor has, or the one that every processor has. Results of one kind of
/// processor are always the same to the bit.
[[nodiscard]] const DenseUpdate& dense_update(bool portable = false) noexcept;

}  // namespace tpm::organ
