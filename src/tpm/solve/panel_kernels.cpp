#include "tpm/solve/panel_kernels.hpp"

#include <algorithm>

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define TPM_HAS_AVX2 1
#endif

namespace tpm {
namespace {

constexpr std::size_t kPanelWide = 8;

void times_portable(const FloatPanel& panel, const float* x, float* out) noexcept {
  std::fill(out, out + panel.stride, 0.0F);
  const float* column = panel.numbers;
  for (std::size_t j = 0; j < panel.columns; ++j, column += panel.stride) {
    for (std::size_t i = 0; i < panel.stride; ++i) out[i] += column[i] * x[j];
  }
}

void subtract_transposed_portable(const FloatPanel& panel, const float* x, float* out) noexcept {
  const float* column = panel.numbers;
  for (std::size_t j = 0; j < panel.columns; ++j, column += panel.stride) {
    float sum[kPanelWide] = {};
    for (std::size_t i = 0; i < panel.stride; ++i) sum[i % kPanelWide] += column[i] * x[i];
    for (const float part : sum) out[j] -= part;
  }
}

constexpr PanelKernels kPortable{times_portable, subtract_transposed_portable};

#ifdef TPM_HAS_AVX2

/// `Count` vectors of the product, from row `begin` on.
template <int Count>
[[gnu::target("avx2,fma"), gnu::always_inline]] inline void rows_times(const FloatPanel& panel,
                                                                       std::size_t begin,
                                                                       const float* x, float* out) {
  __m256 even[Count], odd[Count];
  for (int c = 0; c < Count; ++c) even[c] = odd[c] = _mm256_setzero_ps();
  const float* column = panel.numbers + begin;
  std::size_t j = 0;
  for (; j + 2 <= panel.columns; j += 2, column += 2 * panel.stride) {
    const __m256 x0 = _mm256_broadcast_ss(x + j);
    const __m256 x1 = _mm256_broadcast_ss(x + j + 1);
    for (int c = 0; c < Count; ++c) {
      even[c] = _mm256_fmadd_ps(_mm256_load_ps(column + 8 * c), x0, even[c]);
      odd[c] = _mm256_fmadd_ps(_mm256_load_ps(column + panel.stride + 8 * c), x1, odd[c]);
    }
  }
  if (j < panel.columns) {
    const __m256 x0 = _mm256_broadcast_ss(x + j);
    for (int c = 0; c < Count; ++c) {
      even[c] = _mm256_fmadd_ps(_mm256_load_ps(column + 8 * c), x0, even[c]);
    }
  }
  for (int c = 0; c < Count; ++c) {
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

[[gnu::target("avx2,fma")]] void subtract_transposed_avx2(const FloatPanel& panel, const float* x,
                                                          float* out) noexcept {
  const float* column = panel.numbers;
  const std::size_t stride = panel.stride;
  std::size_t j = 0;
  for (; j + 4 <= panel.columns; j += 4, column += 4 * stride) {
    __m256 s0 = _mm256_setzero_ps(), s1 = s0, s2 = s0, s3 = s0;
    for (std::size_t i = 0; i < stride; i += kPanelWide) {
      const __m256 v = _mm256_load_ps(x + i);
      s0 = _mm256_fmadd_ps(_mm256_load_ps(column + i), v, s0);
      s1 = _mm256_fmadd_ps(_mm256_load_ps(column + stride + i), v, s1);
      s2 = _mm256_fmadd_ps(_mm256_load_ps(column + 2 * stride + i), v, s2);
      s3 = _mm256_fmadd_ps(_mm256_load_ps(column + 3 * stride + i), v, s3);
    }
    const __m256 sums = _mm256_hadd_ps(_mm256_hadd_ps(s0, s1), _mm256_hadd_ps(s2, s3));
    const __m128 sum = _mm_add_ps(_mm256_castps256_ps128(sums), _mm256_extractf128_ps(sums, 1));
    _mm_storeu_ps(out + j, _mm_sub_ps(_mm_loadu_ps(out + j), sum));
  }
  for (; j < panel.columns; ++j, column += stride) {
    __m256 s0 = _mm256_setzero_ps();
    for (std::size_t i = 0; i < stride; i += kPanelWide) {
      s0 = _mm256_fmadd_ps(_mm256_load_ps(column + i), _mm256_load_ps(x + i), s0);
    }
    __m128 sum = _mm_add_ps(_mm256_castps256_ps128(s0), _mm256_extractf128_ps(s0, 1));
    sum = _mm_hadd_ps(sum, sum);
    sum = _mm_hadd_ps(sum, sum);
    out[j] -= _mm_cvtss_f32(sum);
  }
}

constexpr PanelKernels kAvx2{times_avx2, subtract_transposed_avx2};

#endif

}  // namespace

const PanelKernels& panel_kernels(bool portable) noexcept {
#ifdef TPM_HAS_AVX2
  if (!portable && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return kAvx2;
#else
  static_cast<void>(portable);
#endif
  return kPortable;
}

}  // namespace tpm
