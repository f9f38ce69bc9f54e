// Compiled for AVX2 (tests/CMakeLists.txt), without headers whose types would then differ from
// those of the library.
#include "servo_kernels.hpp"

#include <algorithm>

#if defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
#if __has_include(<xsimd/xsimd.hpp>)
#include <xsimd/xsimd.hpp>
#endif
#if __has_include(<hwy/highway.h>)
#define HWY_COMPILE_ONLY_STATIC
#include <hwy/highway.h>
#endif

namespace tpm::test {
namespace {

constexpr std::size_t kWide = ServoLanes::kWide;

/// Vectors by intrinsics, as servo_bonds.cpp has them.
struct ByHand {
  using V = __m256;
  static V load(const float* p) { return _mm256_load_ps(p); }
  static void store(float* p, V v) { _mm256_store_ps(p, v); }
  static V set(float v) { return _mm256_set1_ps(v); }
  static V add(V a, V b) { return _mm256_add_ps(a, b); }
  static V mul(V a, V b) { return _mm256_mul_ps(a, b); }
  static V div(V a, V b) { return _mm256_div_ps(a, b); }
  static V root(V a) { return _mm256_sqrt_ps(a); }
  static V fma(V a, V b, V c) { return _mm256_fmadd_ps(a, b, c); }
  static V less(V a, V b, V c) { return _mm256_fnmadd_ps(a, b, c); }
  static V where_at_least(V value, V l, V least) {
    return _mm256_and_ps(value, _mm256_cmp_ps(l, least, _CMP_GE_OQ));
  }
  static void apart(const ServoLanes& lanes, const float* u, V& x, V& y, V& z) {
    V of[4];
    for (std::size_t i = 0; i < 4; ++i) {
      const __m128 low = _mm_sub_ps(_mm_load_ps(u + lanes.b[i]), _mm_load_ps(u + lanes.a[i]));
      const __m128 high =
          _mm_sub_ps(_mm_load_ps(u + lanes.b[i + 4]), _mm_load_ps(u + lanes.a[i + 4]));
      of[i] = _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
    }
    const V a = _mm256_unpacklo_ps(of[0], of[1]), b = _mm256_unpackhi_ps(of[0], of[1]);
    const V c = _mm256_unpacklo_ps(of[2], of[3]), d = _mm256_unpackhi_ps(of[2], of[3]);
    x = _mm256_shuffle_ps(a, c, 0x44);
    y = _mm256_shuffle_ps(a, c, 0xEE);
    z = _mm256_shuffle_ps(b, d, 0x44);
  }
  static void rows(V x, V y, V z, V (&of)[4]) {
    const V zero = _mm256_setzero_ps();
    const V a = _mm256_unpacklo_ps(x, y), b = _mm256_unpackhi_ps(x, y);
    const V c = _mm256_unpacklo_ps(z, zero), d = _mm256_unpackhi_ps(z, zero);
    of[0] = _mm256_shuffle_ps(a, c, 0x44);
    of[1] = _mm256_shuffle_ps(a, c, 0xEE);
    of[2] = _mm256_shuffle_ps(b, d, 0x44);
    of[3] = _mm256_shuffle_ps(b, d, 0xEE);
  }
  static void pull(const ServoLanes& lanes, std::size_t i, V f, float* force) {
    float* const fa = force + std::size_t{2} * lanes.a[i];
    float* const fb = force + std::size_t{2} * lanes.b[i];
    _mm256_store_ps(fa, _mm256_add_ps(_mm256_load_ps(fa), f));
    _mm256_store_ps(fb, _mm256_sub_ps(_mm256_load_ps(fb), f));
  }
  static void add_forces(const ServoLanes& lanes, const V (&now)[3], const V (&next)[3],
                         float* force) {
    V first[4], second[4];
    rows(now[0], now[1], now[2], first);
    rows(next[0], next[1], next[2], second);
    for (std::size_t i = 0; i < 4; ++i) {
      pull(lanes, i, _mm256_permute2f128_ps(first[i], second[i], 0x20), force);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      pull(lanes, i + 4, _mm256_permute2f128_ps(first[i], second[i], 0x31), force);
    }
  }
};

#if __has_include(<hwy/highway.h>)
/// Vectors by highway, its AVX2 target.
struct ByHighway {
  static constexpr hwy::HWY_NAMESPACE::FixedTag<float, 8> kD{};
  static constexpr hwy::HWY_NAMESPACE::FixedTag<float, 4> kHalf{};
  static constexpr hwy::HWY_NAMESPACE::FixedTag<double, 4> kPairs{};
  using V = hwy::HWY_NAMESPACE::Vec<hwy::HWY_NAMESPACE::FixedTag<float, 8>>;
  static V load(const float* p) { return Load(kD, p); }
  static void store(float* p, V v) { Store(v, kD, p); }
  static V set(float v) { return Set(kD, v); }
  static V add(V a, V b) { return Add(a, b); }
  static V mul(V a, V b) { return Mul(a, b); }
  static V div(V a, V b) { return Div(a, b); }
  static V root(V a) { return Sqrt(a); }
  static V fma(V a, V b, V c) { return MulAdd(a, b, c); }
  static V less(V a, V b, V c) { return NegMulAdd(a, b, c); }
  static V where_at_least(V value, V l, V least) { return IfThenElseZero(Ge(l, least), value); }
  static V low_pairs(V a, V b) {
    return BitCast(kD, InterleaveLower(kPairs, BitCast(kPairs, a), BitCast(kPairs, b)));
  }
  static V high_pairs(V a, V b) {
    return BitCast(kD, InterleaveUpper(kPairs, BitCast(kPairs, a), BitCast(kPairs, b)));
  }
  static void apart(const ServoLanes& lanes, const float* u, V& x, V& y, V& z) {
    const auto row = [&](std::size_t i) {
      return Sub(Load(kHalf, u + lanes.b[i]), Load(kHalf, u + lanes.a[i]));
    };
    const V of0 = Combine(kD, row(4), row(0)), of1 = Combine(kD, row(5), row(1));
    const V of2 = Combine(kD, row(6), row(2)), of3 = Combine(kD, row(7), row(3));
    const V a = InterleaveLower(kD, of0, of1), b = InterleaveUpper(kD, of0, of1);
    const V c = InterleaveLower(kD, of2, of3), d = InterleaveUpper(kD, of2, of3);
    x = low_pairs(a, c);
    y = high_pairs(a, c);
    z = low_pairs(b, d);
  }
  static void rows(V x, V y, V z, V (&of)[4]) {
    const V a = InterleaveLower(kD, x, y), b = InterleaveUpper(kD, x, y);
    const V c = InterleaveLower(kD, z, Zero(kD)), d = InterleaveUpper(kD, z, Zero(kD));
    of[0] = low_pairs(a, c);
    of[1] = high_pairs(a, c);
    of[2] = low_pairs(b, d);
    of[3] = high_pairs(b, d);
  }
  static void pull(const ServoLanes& lanes, std::size_t i, V f, float* force) {
    float* const fa = force + std::size_t{2} * lanes.a[i];
    float* const fb = force + std::size_t{2} * lanes.b[i];
    Store(Add(Load(kD, fa), f), kD, fa);
    Store(Sub(Load(kD, fb), f), kD, fb);
  }
  static void add_forces(const ServoLanes& lanes, const V (&now)[3], const V (&next)[3],
                         float* force) {
    V first[4] = {now[0], now[0], now[0], now[0]}, second[4] = {now[0], now[0], now[0], now[0]};
    rows(now[0], now[1], now[2], first);
    rows(next[0], next[1], next[2], second);
    for (std::size_t i = 0; i < 4; ++i) {
      pull(lanes, i, ConcatLowerLower(kD, second[i], first[i]), force);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      pull(lanes, i + 4, ConcatUpperUpper(kD, second[i], first[i]), force);
    }
  }
};
#endif

#if __has_include(<xsimd/xsimd.hpp>)
/// Vectors by xsimd 8.1. It does not join two halves, so rows go through memory; its zips stay
/// within the halves for floats and doubles.
struct ByXsimd {
  using V = xsimd::batch<float, xsimd::fma3<xsimd::avx2>>;
  using Pairs = xsimd::batch<double, xsimd::fma3<xsimd::avx2>>;
  using Half = xsimd::batch<float, xsimd::sse4_2>;
  static V load(const float* p) { return V::load_aligned(p); }
  static void store(float* p, V v) { v.store_aligned(p); }
  static V set(float v) { return V(v); }
  static V add(V a, V b) { return a + b; }
  static V mul(V a, V b) { return a * b; }
  static V div(V a, V b) { return a / b; }
  static V root(V a) { return xsimd::sqrt(a); }
  static V fma(V a, V b, V c) { return xsimd::fma(a, b, c); }
  static V less(V a, V b, V c) { return xsimd::fnma(a, b, c); }
  static V where_at_least(V value, V l, V least) {
    return xsimd::select(l >= least, value, V(0.0F));
  }
  static V low_pairs(V a, V b) {
    return xsimd::bitwise_cast<V>(
        xsimd::zip_lo(xsimd::bitwise_cast<Pairs>(a), xsimd::bitwise_cast<Pairs>(b)));
  }
  static V high_pairs(V a, V b) {
    return xsimd::bitwise_cast<V>(
        xsimd::zip_hi(xsimd::bitwise_cast<Pairs>(a), xsimd::bitwise_cast<Pairs>(b)));
  }
  static std::size_t place(std::size_t i) { return 8 * (i % 4) + 4 * (i / 4); }
  static void apart(const ServoLanes& lanes, const float* u, V& x, V& y, V& z) {
    alignas(32) float row[32];
    for (std::size_t i = 0; i < kWide; ++i) {
      (Half::load_aligned(u + lanes.b[i]) - Half::load_aligned(u + lanes.a[i]))
          .store_aligned(row + place(i));
    }
    const V a = xsimd::zip_lo(load(row), load(row + 8));
    const V b = xsimd::zip_hi(load(row), load(row + 8));
    const V c = xsimd::zip_lo(load(row + 16), load(row + 24));
    const V d = xsimd::zip_hi(load(row + 16), load(row + 24));
    x = low_pairs(a, c);
    y = high_pairs(a, c);
    z = low_pairs(b, d);
  }
  static void put_rows(V x, V y, V z, float* row) {
    const V a = xsimd::zip_lo(x, y), b = xsimd::zip_hi(x, y);
    const V c = xsimd::zip_lo(z, V(0.0F)), d = xsimd::zip_hi(z, V(0.0F));
    store(row, low_pairs(a, c));
    store(row + 8, high_pairs(a, c));
    store(row + 16, low_pairs(b, d));
    store(row + 24, high_pairs(b, d));
  }
  static void add_forces(const ServoLanes& lanes, const V (&now)[3], const V (&next)[3],
                         float* force) {
    alignas(32) float row[2][32];
    put_rows(now[0], now[1], now[2], row[0]);
    put_rows(next[0], next[1], next[2], row[1]);
    for (std::size_t i = 0; i < kWide; ++i) {
      float* const fa = force + std::size_t{2} * lanes.a[i];
      float* const fb = force + std::size_t{2} * lanes.b[i];
      for (std::size_t n = 0; n < 2; ++n) {
        const Half f = Half::load_aligned(row[n] + place(i));
        (Half::load_aligned(fa + 4 * n) + f).store_aligned(fa + 4 * n);
        (Half::load_aligned(fb + 4 * n) - f).store_aligned(fb + 4 * n);
      }
    }
  }
};
#endif

template <class P>
struct Spans {
  typename P::V x, y, z, square, change, now, next;
};

/// The sweep of servo_bonds.cpp for linear bonds with one branch.
template <class P>
void advance(ServoSweep& sweep, const float* u, float* force) {
  using V = typename P::V;
  constexpr std::size_t kTogether = 16;
  const V of_start = P::set(sweep.of_start), of_end = P::set(sweep.of_end);
  const V keep = P::set(sweep.keep), one = P::set(1.0F);
  Spans<P> spans[kTogether];
  for (std::size_t first = 0; first < sweep.groups.size(); first += kTogether) {
    const std::size_t count = std::min(kTogether, sweep.groups.size() - first);
    ServoLanes* const groups = sweep.groups.data() + first;
    for (std::size_t i = 0; i < count; ++i) {
      V ux = one, uy = one, uz = one;
      P::apart(groups[i], u, ux, uy, uz);
      const V x0 = P::load(groups[i].x.data()), y0 = P::load(groups[i].y.data());
      const V z0 = P::load(groups[i].z.data());
      Spans<P>& s = spans[i];
      s.x = P::add(x0, ux);
      s.y = P::add(y0, uy);
      s.z = P::add(z0, uz);
      s.square = P::fma(s.z, s.z, P::fma(s.y, s.y, P::mul(s.x, s.x)));
      s.change =
          P::fma(uz, P::add(z0, s.z), P::fma(uy, P::add(y0, s.y), P::mul(ux, P::add(x0, s.x))));
    }
    for (std::size_t i = 0; i < count; ++i) {
      ServoLanes& group = groups[i];
      Spans<P>& s = spans[i];
      const V length = P::root(s.square);
      const V sum = P::add(length, P::load(group.rest.data()));
      const V inverse = P::div(one, P::mul(length, sum));
      const V l = P::mul(P::mul(s.change, inverse), length);
      const V taut = P::where_at_least(P::mul(inverse, sum), l, P::load(group.least.data()));
      const V elastic = P::mul(P::load(group.k.data()), l), g = P::load(group.g.data());
      const V viscous = P::fma(of_end, l, P::load(group.offset[0].data()));
      s.now = P::mul(taut, P::less(g, viscous, elastic));
      const V offset = P::fma(keep, viscous, P::mul(of_start, l));
      P::store(group.offset[1].data(), offset);
      s.next = P::mul(taut, P::less(g, P::fma(of_end, l, offset), elastic));
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Spans<P>& s = spans[i];
      const V now[3] = {P::mul(s.now, s.x), P::mul(s.now, s.y), P::mul(s.now, s.z)};
      const V next[3] = {P::mul(s.next, s.x), P::mul(s.next, s.y), P::mul(s.next, s.z)};
      P::add_forces(groups[i], now, next, force);
    }
  }
}

}  // namespace

std::vector<ServoKernel> servo_kernels() {
  std::vector<ServoKernel> kernels{{"intrinsics", advance<ByHand>}};
#if __has_include(<hwy/highway.h>)
  kernels.push_back({"highway", advance<ByHighway>});
#endif
#if __has_include(<xsimd/xsimd.hpp>)
  kernels.push_back({"xsimd", advance<ByXsimd>});
#endif
  return kernels;
}

}  // namespace tpm::test
#else
std::vector<tpm::test::ServoKernel> tpm::test::servo_kernels() {
  return {};
}
#endif
