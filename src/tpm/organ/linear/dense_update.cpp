#include "tpm/organ/linear/dense_update.hpp"

#include <algorithm>

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define TPM_DENSE_AVX2 1
#endif

namespace tpm::organ {
namespace {

using Product = DenseUpdate::Product;

constexpr std::size_t kRowsTogether = 4;  // of a vector
constexpr std::size_t kColumnsTogether = 4;
constexpr std::size_t kRowChunk =
    DenseUpdate::kRows;  // with 48 columns it fits into the first cache

/// Goes over C in tiles of up to 12 x 4 numbers and calls tile<vectors, columns>(c, a, b, depth).
template <class Tiles>
void for_each_tile(const Product& p) noexcept {
  for (std::size_t chunk = p.first_row; chunk < p.rows; chunk += kRowChunk) {
    const std::size_t chunk_end = std::min(chunk + kRowChunk, p.rows);
    for (std::size_t j = 0; j < p.columns; j += kColumnsTogether) {
      if (p.lower && j >= chunk_end) break;
      const std::size_t columns = std::min(kColumnsTogether, p.columns - j);
      const std::size_t depth = p.b_triangular ? std::min(p.depth, j + columns) : p.depth;
      const double* const b = p.b.numbers + j;
      std::size_t i = p.lower ? std::max(chunk, j) : chunk;
      while (i < chunk_end) {
        const std::size_t vectors =
            std::min<std::size_t>(3, (chunk_end - i + kRowsTogether - 1) / kRowsTogether);
        double* const c = p.c.numbers + i + j * p.c.stride;
        Tiles::run(vectors, columns, c, p.a.numbers + i, b, p, depth);
        i += vectors * kRowsTogether;
      }
    }
  }
}

/// Chooses the function for a size of tile.
template <template <int, int> class Tile>
struct TileTable {
  static void run(std::size_t vectors, std::size_t columns, double* c, const double* a,
                  const double* b, const Product& p, std::size_t depth) noexcept {
    using Function =
        void (*)(double*, const double*, const double*, const Product&, std::size_t) noexcept;
    static constexpr Function kTable[3][4] = {
        {Tile<1, 1>::run, Tile<1, 2>::run, Tile<1, 3>::run, Tile<1, 4>::run},
        {Tile<2, 1>::run, Tile<2, 2>::run, Tile<2, 3>::run, Tile<2, 4>::run},
        {Tile<3, 1>::run, Tile<3, 2>::run, Tile<3, 3>::run, Tile<3, 4>::run}};
    kTable[vectors - 1][columns - 1](c, a, b, p, depth);
  }
};

template <int Vectors, int Columns>
struct PortableTile {
  static void run(double* c, const double* a, const double* b, const Product& p,
                  std::size_t depth) noexcept {
    constexpr int kRows = Vectors * static_cast<int>(kRowsTogether);
    double sum[Columns][kRows] = {};
    for (std::size_t k = 0; k < depth; ++k, a += p.a.stride, b += p.b.stride) {
      for (int j = 0; j < Columns; ++j) {
        for (int i = 0; i < kRows; ++i) sum[j][i] += a[i] * b[j];
      }
    }
    for (int j = 0; j < Columns; ++j, c += p.c.stride) {
      for (int i = 0; i < kRows; ++i) c[i] = (p.overwrite ? 0.0 : c[i]) - sum[j][i];
    }
  }
};

constexpr DenseUpdate kPortableUpdate{for_each_tile<TileTable<PortableTile>>};

#ifdef TPM_DENSE_AVX2

template <int Vectors, int Columns>
struct Avx2Tile {
  [[gnu::target("avx2,fma")]] static void run(double* c, const double* a, const double* b,
                                              const Product& p, std::size_t depth) noexcept {
    __m256d sum[Columns][Vectors];
#pragma GCC unroll 4
    for (int j = 0; j < Columns; ++j) {
#pragma GCC unroll 4
      for (int v = 0; v < Vectors; ++v) sum[j][v] = _mm256_setzero_pd();
    }
    for (std::size_t k = 0; k < depth; ++k, a += p.a.stride, b += p.b.stride) {
      __m256d rows[Vectors];
#pragma GCC unroll 4
      for (int v = 0; v < Vectors; ++v) rows[v] = _mm256_loadu_pd(a + std::ptrdiff_t{4} * v);
#pragma GCC unroll 4
      for (int j = 0; j < Columns; ++j) {
        const __m256d factor = _mm256_broadcast_sd(b + j);
#pragma GCC unroll 4
        for (int v = 0; v < Vectors; ++v) sum[j][v] = _mm256_fmadd_pd(rows[v], factor, sum[j][v]);
      }
    }
#pragma GCC unroll 4
    for (int j = 0; j < Columns; ++j, c += p.c.stride) {
#pragma GCC unroll 4
      for (int v = 0; v < Vectors; ++v) {
        const __m256d before =
            p.overwrite ? _mm256_setzero_pd() : _mm256_loadu_pd(c + std::ptrdiff_t{4} * v);
        _mm256_storeu_pd(c + std::ptrdiff_t{4} * v, _mm256_sub_pd(before, sum[j][v]));
      }
    }
  }
};

constexpr DenseUpdate kAvx2Update{for_each_tile<TileTable<Avx2Tile>>};

#endif

}  // namespace

const DenseUpdate& dense_update(bool portable) noexcept {
#ifdef TPM_DENSE_AVX2
  if (!portable && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    return kAvx2Update;
  }
#else
  static_cast<void>(portable);
#endif
  return kPortableUpdate;
}

}  // namespace tpm::organ
