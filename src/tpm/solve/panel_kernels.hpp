#pragma once
#include <cstddef>

namespace tpm {

/// A dense matrix by columns in single precision, each column filled up with zeros.
struct FloatPanel {
  const float* numbers;  ///< aligned to 32 bytes
  std::size_t stride;    ///< of columns, a multiple of 8
  std::size_t columns;
};

/// Products with panels for one kind of processor.
struct PanelKernels {
  /// out = panel x; `out` has `stride` numbers and is aligned to 32 bytes.
  void (*times)(const FloatPanel& panel, const float* x, float* out) noexcept;
  /// out -= panel^T x; `x` has `stride` numbers and is aligned to 32 bytes.
  void (*subtract_transposed)(const FloatPanel& panel, const float* x, float* out) noexcept;
};

/// The fastest that this processor has, or those that every processor has.
[[nodiscard]] const PanelKernels& panel_kernels(bool portable = false) noexcept;

}  // namespace tpm
