#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tpm::organ {

/// A dense matrix by columns in single precision, each column filled up with zeros.
struct FloatPanel {
  const float* numbers;  ///< aligned to 32 bytes
  std::size_t stride;    ///< of columns, a multiple of 8
  std::size_t columns;
};

/// A dense matrix by columns in half the bytes: 8 binary digits of each number (bfloat16), which is
/// enough to correct iterates. Rows stand in blocks of 8, two blocks in 8 words; a block without a
/// second is in single precision.
struct PackedPanel {
  const std::uint32_t* words;  ///< aligned to 32 bytes
  std::size_t rows;            ///< those of the matrix filled up with zeros to a multiple of 8
  std::size_t columns;

  static constexpr std::size_t kBlock = 8;  ///< rows
  /// Rows of a matrix filled up.
  [[nodiscard]] static std::size_t filled(std::size_t rows) {
    return (rows + kBlock - 1) / kBlock * kBlock;
  }
  /// Words of a column.
  [[nodiscard]] static std::size_t words_of(std::size_t rows) {
    return (filled(rows) / kBlock + 1) / 2 * kBlock;
  }
};

/// Writes words_of(rows) words for each column of the matrix. The error of a number is at most
/// 1/256 of it.
void pack_panel(const Eigen::MatrixXd& matrix, std::span<std::uint32_t> words);

/// Products with panels for one kind of processor.
struct PanelKernels {
  /// out = panel x; `out` has `stride` numbers and is aligned to 32 bytes.
  void (*times)(const FloatPanel& panel, const float* x, float* out) noexcept;
  /// The same of a packed panel; `out` has `rows` numbers.
  void (*packed_times)(const PackedPanel& panel, const float* x, float* out) noexcept;
  /// out -= panel^T x; `x` has `rows` numbers and is aligned to 32 bytes.
  void (*subtract_packed_transposed)(const PackedPanel& panel, const float* x, float* out) noexcept;
};

/// The fastest that this processor has, or those that every processor has.
[[nodiscard]] const PanelKernels& panel_kernels(bool portable = false) noexcept;

}  // namespace tpm::organ
