#include "tpm/organ/linear/panel_kernels.hpp"

#include <algorithm>
#include <bit>

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define TPM_HAS_AVX2 1
#endif

namespace tpm::organ {
namespace {

constexpr std::size_t kPanelWide = 8;

void times_portable(const FloatPanel& panel, const float* x, float* out) noexcept {
  std::fill(out, out + panel.stride, 0.0F);
  const float* column = panel.numbers;
  for (std::size_t j = 0; j < panel.columns; ++j, column += panel.stride) {
    for (std::size_t i = 0; i < panel.stride; ++i) out[i] += column[i] * x[j];
  }
}

/// The first of two numbers in a word: the digits of the second are the last ones of its own.
float first_of(std::uint32_t word) {
  return std::bit_cast<float>(word);
}
float second_of(std::uint32_t word) {
  return std::bit_cast<float>(word << 16U);
}

void packed_times_portable(const PackedPanel& panel, const float* x, float* out) noexcept {
  std::fill(out, out + panel.rows, 0.0F);
  const std::uint32_t* word = panel.words;
  for (std::size_t j = 0; j < panel.columns; ++j) {
    const float by = x[j];
    for (std::size_t i = 0; i < panel.rows; i += 2 * kPanelWide, word += kPanelWide) {
      float* const first = out + i;
      float* const second = first + kPanelWide;
      for (std::size_t s = 0; s < kPanelWide; ++s) first[s] += first_of(word[s]) * by;
      if (i + kPanelWide == panel.rows) continue;
      for (std::size_t s = 0; s < kPanelWide; ++s) second[s] += second_of(word[s]) * by;
    }
  }
}

void subtract_packed_transposed_portable(const PackedPanel& panel, const float* x,
                                         float* out) noexcept {
  const std::uint32_t* word = panel.words;
  for (std::size_t j = 0; j < panel.columns; ++j) {
    float sum[kPanelWide] = {};
    for (std::size_t i = 0; i < panel.rows; i += 2 * kPanelWide, word += kPanelWide) {
      const float* const first = x + i;
      const float* const second = first + kPanelWide;
      for (std::size_t s = 0; s < kPanelWide; ++s) sum[s] += first_of(word[s]) * first[s];
      if (i + kPanelWide == panel.rows) continue;
      for (std::size_t s = 0; s < kPanelWide; ++s) sum[s] += second_of(word[s]) * second[s];
    }
    for (const float part : sum) out[j] -= part;
  }
}

constexpr PanelKernels kPortable{times_portable, packed_times_portable,
                                 subtract_packed_transposed_portable};

#ifdef TPM_HAS_AVX2

/// `Count` vectors of the product, from row `begin` on.
template <std::size_t Count>
[[gnu::target("avx2,fma"), gnu::always_inline]] inline void rows_times(const FloatPanel& panel,
                                                                       std::size_t begin,
                                                                       const float* x, float* out) {
  __m256 even[Count], odd[Count];
  for (std::size_t c = 0; c < Count; ++c) even[c] = odd[c] = _mm256_setzero_ps();
  const float* column = panel.numbers + begin;
  std::size_t j = 0;
  for (; j + 2 <= panel.columns; j += 2, column += 2 * panel.stride) {
    const __m256 x0 = _mm256_broadcast_ss(x + j);
    const __m256 x1 = _mm256_broadcast_ss(x + j + 1);
    for (std::size_t c = 0; c < Count; ++c) {
      even[c] = _mm256_fmadd_ps(_mm256_load_ps(column + 8 * c), x0, even[c]);
      odd[c] = _mm256_fmadd_ps(_mm256_load_ps(column + panel.stride + 8 * c), x1, odd[c]);
    }
  }
  if (j < panel.columns) {
    const __m256 x0 = _mm256_broadcast_ss(x + j);
    for (std::size_t c = 0; c < Count; ++c) {
      even[c] = _mm256_fmadd_ps(_mm256_load_ps(column + 8 * c), x0, even[c]);
    }
  }
  for (std::size_t c = 0; c < Count; ++c) {
    _mm256_store_ps(out + begin + 8 * c, _mm256_add_ps(even[c], odd[c]));
  }
}

[[gnu::target("avx2,fma")]] void times_avx2(const FloatPanel& panel, const float* x,
                                            float* out) noexcept {
  std::size_t i = 0;
  for (; i + 4 * kPanelWide <= panel.stride; i += 4 * kPanelWide) rows_times<4>(panel, i, x, out);
  switch ((panel.stride - i) / kPanelWide) {
    case 3:
      rows_times<3>(panel, i, x, out);
      break;
    case 2:
      rows_times<2>(panel, i, x, out);
      break;
    case 1:
      rows_times<1>(panel, i, x, out);
      break;
    default:
      break;
  }
}

/// Eight words as numbers.
struct PackedWords {
  __m256i words;
  [[gnu::target("avx2,fma"), gnu::always_inline]] explicit PackedWords(const std::uint32_t* from)
      : words(_mm256_load_si256(reinterpret_cast<const __m256i*>(from))) {}
  [[gnu::target("avx2,fma"), gnu::always_inline]] [[nodiscard]] __m256 first() const {
    return _mm256_castsi256_ps(words);
  }
  [[gnu::target("avx2,fma"), gnu::always_inline]] [[nodiscard]] __m256 second() const {
    return _mm256_castsi256_ps(_mm256_slli_epi32(words, 16));
  }
};

/// `Count` times eight words of each column of the product; the last of them without second
/// numbers if `kSingle`.
template <std::size_t Count, bool kSingle>
[[gnu::target("avx2,fma"), gnu::always_inline]] inline void words_times(const std::uint32_t* column,
                                                                        std::size_t stride,
                                                                        std::size_t columns,
                                                                        const float* x,
                                                                        float* out) {
  __m256 first[2][Count], second[2][Count];
  for (std::size_t k = 0; k < 2; ++k) {
    for (std::size_t c = 0; c < Count; ++c) first[k][c] = second[k][c] = _mm256_setzero_ps();
  }
  const auto add = [&](std::size_t k, const std::uint32_t* from, float by)
      __attribute__((target("avx2,fma"), always_inline)) {
    const __m256 xj = _mm256_set1_ps(by);
    for (std::size_t c = 0; c < Count; ++c) {
      const PackedWords w(from + 8 * c);
      first[k][c] = _mm256_fmadd_ps(w.first(), xj, first[k][c]);
      if (!kSingle || c + 1 < Count) second[k][c] = _mm256_fmadd_ps(w.second(), xj, second[k][c]);
    }
  };
  std::size_t j = 0;
  for (; j + 2 <= columns; j += 2, column += 2 * stride) {
    add(0, column, x[j]);
    add(1, column + stride, x[j + 1]);
  }
  if (j < columns) add(0, column, x[j]);
  for (std::size_t c = 0; c < Count; ++c) {
    _mm256_store_ps(out + 16 * c, _mm256_add_ps(first[0][c], first[1][c]));
    if (kSingle && c + 1 == Count) continue;
    _mm256_store_ps(out + 16 * c + 8, _mm256_add_ps(second[0][c], second[1][c]));
  }
}

[[gnu::target("avx2,fma")]] void packed_times_avx2(const PackedPanel& panel, const float* x,
                                                   float* out) noexcept {
  const std::size_t stride = PackedPanel::words_of(panel.rows);
  const std::uint32_t* words = panel.words;
  std::size_t left = panel.rows / kPanelWide;  // blocks
  for (; left >= 4; left -= 4, words += 16, out += 32) {
    words_times<2, false>(words, stride, panel.columns, x, out);
  }
  switch (left) {
    case 3:
      words_times<2, true>(words, stride, panel.columns, x, out);
      break;
    case 2:
      words_times<1, false>(words, stride, panel.columns, x, out);
      break;
    case 1:
      words_times<1, true>(words, stride, panel.columns, x, out);
      break;
    default:
      break;
  }
}

/// Sums of `Columns` columns times x, subtracted from out.
template <std::size_t Columns>
[[gnu::target("avx2,fma"), gnu::always_inline]] inline void subtract_columns(
    const std::uint32_t* column, std::size_t stride, std::size_t rows, const float* x, float* out) {
  __m256 first[Columns], second[Columns];
  for (std::size_t c = 0; c < Columns; ++c) first[c] = second[c] = _mm256_setzero_ps();
  std::size_t i = 0;
  for (; i + 16 <= rows; i += 16, column += 8) {
    const __m256 x0 = _mm256_load_ps(x + i);
    const __m256 x1 = _mm256_load_ps(x + i + 8);
    for (std::size_t c = 0; c < Columns; ++c) {
      const PackedWords w(column + c * stride);
      first[c] = _mm256_fmadd_ps(w.first(), x0, first[c]);
      second[c] = _mm256_fmadd_ps(w.second(), x1, second[c]);
    }
  }
  if (i < rows) {
    const __m256 x0 = _mm256_load_ps(x + i);
    for (std::size_t c = 0; c < Columns; ++c) {
      const PackedWords w(column + c * stride);
      first[c] = _mm256_fmadd_ps(w.first(), x0, first[c]);
    }
  }
  for (std::size_t c = 0; c < Columns; ++c) first[c] = _mm256_add_ps(first[c], second[c]);
  if constexpr (Columns == 4) {
    const __m256 sums =
        _mm256_hadd_ps(_mm256_hadd_ps(first[0], first[1]), _mm256_hadd_ps(first[2], first[3]));
    const __m128 sum = _mm_add_ps(_mm256_castps256_ps128(sums), _mm256_extractf128_ps(sums, 1));
    _mm_storeu_ps(out, _mm_sub_ps(_mm_loadu_ps(out), sum));
  } else {
    for (std::size_t c = 0; c < Columns; ++c) {
      __m128 sum = _mm_add_ps(_mm256_castps256_ps128(first[c]), _mm256_extractf128_ps(first[c], 1));
      sum = _mm_hadd_ps(sum, sum);
      sum = _mm_hadd_ps(sum, sum);
      out[c] -= _mm_cvtss_f32(sum);
    }
  }
}

[[gnu::target("avx2,fma")]] void subtract_packed_transposed_avx2(const PackedPanel& panel,
                                                                 const float* x,
                                                                 float* out) noexcept {
  const std::size_t stride = PackedPanel::words_of(panel.rows);
  const std::uint32_t* column = panel.words;
  std::size_t j = 0;
  for (; j + 4 <= panel.columns; j += 4, column += 4 * stride) {
    subtract_columns<4>(column, stride, panel.rows, x, out + j);
  }
  switch (panel.columns - j) {
    case 3:
      subtract_columns<3>(column, stride, panel.rows, x, out + j);
      break;
    case 2:
      subtract_columns<2>(column, stride, panel.rows, x, out + j);
      break;
    case 1:
      subtract_columns<1>(column, stride, panel.rows, x, out + j);
      break;
    default:
      break;
  }
}

constexpr PanelKernels kAvx2{times_avx2, packed_times_avx2, subtract_packed_transposed_avx2};

#endif

/// Rounded to 16 bits.
std::uint32_t rounded(float number) {
  const auto bits = std::bit_cast<std::uint32_t>(number);
  return (bits + 0x7FFFU + ((bits >> 16U) & 1U)) >> 16U;
}

/// The word whose first_of() is nearest to a number, with given last 16 bits.
std::uint32_t nearest_word(float number, std::uint32_t last) {
  constexpr std::uint32_t kSign = 0x80000000U;
  const auto bits = std::bit_cast<std::uint32_t>(number);
  const std::uint32_t size = bits & ~kSign;
  const std::uint32_t above = size > last ? (size - last + 0x8000U) >> 16U : 0U;
  return (bits & kSign) | (above << 16U) | last;
}

}  // namespace

void pack_panel(const Eigen::MatrixXd& matrix, std::span<std::uint32_t> words) {
  const auto rows = static_cast<std::size_t>(matrix.rows());
  const std::size_t filled = PackedPanel::filled(rows);
  std::uint32_t* to = words.data();
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    const auto number = [&](std::size_t i) {
      return i < rows ? static_cast<float>(matrix(static_cast<Eigen::Index>(i), j)) : 0.0F;
    };
    for (std::size_t i = 0; i < filled; i += 2 * kPanelWide) {
      const bool is_single = i + kPanelWide == filled;
      for (std::size_t s = i; s < i + kPanelWide; ++s) {
        *to++ = is_single ? std::bit_cast<std::uint32_t>(number(s))
                          : nearest_word(number(s), rounded(number(s + kPanelWide)));
      }
    }
  }
}

const PanelKernels& panel_kernels(bool portable) noexcept {
#ifdef TPM_HAS_AVX2
  if (!portable && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return kAvx2;
#else
  static_cast<void>(portable);
#endif
  return kPortable;
}

}  // namespace tpm::organ
