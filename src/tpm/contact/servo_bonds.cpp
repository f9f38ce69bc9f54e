#include "tpm/contact/servo_bonds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpm/organ/bonds/material_refusal.hpp"

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define TPM_HAS_AVX2 1
#endif

namespace tpm::contact {

float ServoWeights::longest_kept() const {
  float longest = keep;
  for (const ServoBranch& branch : branches) longest = std::max(longest, branch.keep);
  return longest;
}

ServoWeights servo_weights(const BondSystem& bonds, double period_s) {
  ServoWeights weights{1.0F, 0.0F, 0.0F, {}};
  for (std::size_t i = 0; i < bonds.first_contact(); ++i) {
    if (!(bonds.relaxing()[static_cast<Eigen::Index>(i)] > 0.0)) continue;
    const std::vector<ViscousLaw::Branch>& branches = bonds.laws()[bonds.law_of(i)].branches;
    double of_start = 0.0;
    double of_end = 0.0;
    for (const ViscousLaw::Branch& branch : branches) {
      const RelaxationWeights w = relaxation_weights(period_s / branch.relaxation_time_s);
      of_start += branch.share * w.w0;
      of_end += branch.share * w.w1;
      weights.branches.push_back({static_cast<float>(branch.share), static_cast<float>(w.r),
                                  static_cast<float>(w.w0), static_cast<float>(w.w1)});
    }
    weights.of_start = static_cast<float>(of_start);
    weights.of_end = static_cast<float>(of_end);
    weights.keep = weights.branches.front().keep;
    if (weights.branches.size() == 1) weights.branches.clear();
    break;
  }
  return weights;
}

void require_servo_material(const BondSystem& bonds, std::string_view who) {
  require_material(bonds, who, {&Capabilities::branches, &Capabilities::stiffening});
}

/// The cubic part of a bond's equilibrium force, N/m^3.
double cubic_of(const BondSystem& bonds, std::size_t bond) {
  const auto row = static_cast<Eigen::Index>(bond);
  double sum = 0.0;
  for (const ViscousLaw::Spring& spring : bonds.laws()[bonds.law_of(bond)].springs) {
    sum += spring.share * spring.function.cubic_per_m2().value();
  }
  return (bonds.stiffness()[row] - bonds.relaxing()[row]) * sum;
}

/// Forces that a sweep adds up: those of this step, of the next one, or both.
enum class Sweep { both, now, next };

struct ServoBondKernels {
  using Group = ServoBonds::Group;

  /// Factors that advance a group's viscous elongations.
  struct Step {
    const ServoWeights& weights;
    std::size_t latest;
    ServoBonds::BranchLane* branch;  ///< of the first group; null: one branch
  };

  /// @param group its viscous elongations move on unless only what comes next is asked for
  template <Sweep kSweep>
  static void plain(Group& group, const Step& step, const float* u, float* force) {
    const ServoWeights& w = step.weights;
    const std::size_t latest = step.latest;
    for (std::size_t i = 0; i < ServoBonds::kWide; ++i) {
      const float* const ua = u + group.a[i];
      const float* const ub = u + group.b[i];
      const float ux = ub[0] - ua[0];
      const float uy = ub[1] - ua[1];
      const float uz = ub[2] - ua[2];
      const float x = group.x[i] + ux;
      const float y = group.y[i] + uy;
      const float z = group.z[i] + uz;
      const float length = std::sqrt(x * x + y * y + z * z);
      const float l = (ux * (group.x[i] + x) + uy * (group.y[i] + y) + uz * (group.z[i] + z)) /
                      (length + group.rest[i]);
      const float viscous = group.offset[latest][i] + w.of_end * l;
      const float taut = l >= group.least[i] ? 1.0F / length : 0.0F;
      const float elastic = (group.k[i] + group.cubic[i] * l * l) * l;
      float now = taut * (elastic - group.g[i] * viscous);
      float next = now;
      if constexpr (kSweep != Sweep::next) {
        float offset = w.keep * viscous + w.of_start * l;
        if (step.branch != nullptr) {
          offset = 0.0F;
          for (std::size_t j = 0; j < w.branches.size(); ++j) {
            const ServoBranch& branch = w.branches[j];
            const float m = step.branch[j].offset[latest][i] + branch.of_end * l;
            const float left = branch.keep * m + branch.of_start * l;
            step.branch[j].offset[1 - latest][i] = left;
            offset += branch.share * left;
          }
        }
        group.offset[1 - latest][i] = offset;
        next = taut * (elastic - group.g[i] * (offset + w.of_end * l));
      }
      float* const fa = force + std::size_t{2} * group.a[i];
      float* const fb = force + std::size_t{2} * group.b[i];
      const float direction[3] = {x, y, z};
      for (std::size_t c = 0; c < 3; ++c) {
        if constexpr (kSweep != Sweep::next) {
          fa[c] += now * direction[c];
          fb[c] -= now * direction[c];
        }
        if constexpr (kSweep != Sweep::now) {
          fa[4 + c] += next * direction[c];
          fb[4 + c] -= next * direction[c];
        }
      }
    }
  }

#ifdef TPM_HAS_AVX2
  /// Eight vectors of three side by side, as [0|4] [1|5] [2|6] [3|7].
  struct Four {
    __m256 of[4];
  };

  [[gnu::target("avx2,fma"), gnu::always_inline]] static inline void to_lanes(const Four& v,
                                                                              __m256& x, __m256& y,
                                                                              __m256& z) {
    const __m256 a = _mm256_unpacklo_ps(v.of[0], v.of[1]);
    const __m256 b = _mm256_unpackhi_ps(v.of[0], v.of[1]);
    const __m256 c = _mm256_unpacklo_ps(v.of[2], v.of[3]);
    const __m256 d = _mm256_unpackhi_ps(v.of[2], v.of[3]);
    x = _mm256_shuffle_ps(a, c, 0x44);
    y = _mm256_shuffle_ps(a, c, 0xEE);
    z = _mm256_shuffle_ps(b, d, 0x44);
  }

  [[gnu::target("avx2,fma"), gnu::always_inline]] static inline Four from_lanes(__m256 x, __m256 y,
                                                                                __m256 z) {
    const __m256 zero = _mm256_setzero_ps();
    const __m256 a = _mm256_unpacklo_ps(x, y);
    const __m256 b = _mm256_unpackhi_ps(x, y);
    const __m256 c = _mm256_unpacklo_ps(z, zero);
    const __m256 d = _mm256_unpackhi_ps(z, zero);
    return {{_mm256_shuffle_ps(a, c, 0x44), _mm256_shuffle_ps(a, c, 0xEE),
             _mm256_shuffle_ps(b, d, 0x44), _mm256_shuffle_ps(b, d, 0xEE)}};
  }

  /// Groups of bonds are worked on several at a time, each thing for all before the next: what one
  /// waits for is hidden behind the others.
  static constexpr std::size_t kTogether = 16;

  /// State of a group between its steps.
  struct Spans {
    __m256 x, y, z;         ///< from end to end
    __m256 square, change;  ///< of its length, and against that at rest
    __m256 now, next;       ///< pulls per length
  };

  [[gnu::target("avx2,fma"), gnu::always_inline]] static inline void measure_avx2(
      const Group& group, const float* u, Spans& spans) {
    Four apart;
    for (std::size_t i = 0; i < 4; ++i) {
      const __m128 low = _mm_sub_ps(_mm_load_ps(u + group.b[i]), _mm_load_ps(u + group.a[i]));
      const __m128 high =
          _mm_sub_ps(_mm_load_ps(u + group.b[i + 4]), _mm_load_ps(u + group.a[i + 4]));
      apart.of[i] = _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
    }
    __m256 ux, uy, uz;
    to_lanes(apart, ux, uy, uz);
    const __m256 x0 = _mm256_load_ps(group.x.data());
    const __m256 y0 = _mm256_load_ps(group.y.data());
    const __m256 z0 = _mm256_load_ps(group.z.data());
    spans.x = _mm256_add_ps(x0, ux);
    spans.y = _mm256_add_ps(y0, uy);
    spans.z = _mm256_add_ps(z0, uz);
    spans.square = _mm256_fmadd_ps(
        spans.z, spans.z, _mm256_fmadd_ps(spans.y, spans.y, _mm256_mul_ps(spans.x, spans.x)));
    spans.change = _mm256_fmadd_ps(uz, _mm256_add_ps(z0, spans.z),
                                   _mm256_fmadd_ps(uy, _mm256_add_ps(y0, spans.y),
                                                   _mm256_mul_ps(ux, _mm256_add_ps(x0, spans.x))));
  }

  /// @param branch offsets of the group's branches, where there are several
  template <Sweep kSweep, bool kCubic, bool kBranches>
  [[gnu::target("avx2,fma"), gnu::always_inline]] static inline void relax_avx2(
      Group& group, const Step& step, ServoBonds::BranchLane* branch_lane, Spans& spans) {
    const ServoWeights& w = step.weights;
    const std::size_t latest = step.latest;
    const __m256 length = _mm256_sqrt_ps(spans.square);
    const __m256 sum = _mm256_add_ps(length, _mm256_load_ps(group.rest.data()));
    const __m256 inverse = _mm256_div_ps(_mm256_set1_ps(1.0F), _mm256_mul_ps(length, sum));
    const __m256 l = _mm256_mul_ps(_mm256_mul_ps(spans.change, inverse), length);
    const __m256 carries = _mm256_cmp_ps(l, _mm256_load_ps(group.least.data()), _CMP_GE_OQ);
    const __m256 taut = _mm256_and_ps(_mm256_mul_ps(inverse, sum), carries);
    const __m256 k = _mm256_load_ps(group.k.data());
    const __m256 g = _mm256_load_ps(group.g.data());
    const __m256 of_end = _mm256_set1_ps(w.of_end);
    __m256 elastic = _mm256_mul_ps(k, l);
    if constexpr (kCubic) {
      const __m256 cubic = _mm256_mul_ps(_mm256_load_ps(group.cubic.data()), l);
      elastic = _mm256_mul_ps(_mm256_fmadd_ps(cubic, l, k), l);
    }
    const __m256 viscous = _mm256_fmadd_ps(of_end, l, _mm256_load_ps(group.offset[latest].data()));
    spans.now = _mm256_mul_ps(taut, _mm256_fnmadd_ps(g, viscous, elastic));
    if constexpr (kSweep != Sweep::next) {
      __m256 offset = _mm256_setzero_ps();
      if constexpr (kBranches) {
        for (std::size_t j = 0; j < w.branches.size(); ++j) {
          const ServoBranch& branch = w.branches[j];
          ServoBonds::BranchLane& lane = branch_lane[j];
          const __m256 m = _mm256_fmadd_ps(_mm256_set1_ps(branch.of_end), l,
                                           _mm256_load_ps(lane.offset[latest].data()));
          const __m256 left = _mm256_fmadd_ps(_mm256_set1_ps(branch.keep), m,
                                              _mm256_mul_ps(_mm256_set1_ps(branch.of_start), l));
          _mm256_store_ps(lane.offset[1 - latest].data(), left);
          offset = _mm256_fmadd_ps(_mm256_set1_ps(branch.share), left, offset);
        }
      } else {
        offset = _mm256_fmadd_ps(_mm256_set1_ps(w.keep), viscous,
                                 _mm256_mul_ps(_mm256_set1_ps(w.of_start), l));
      }
      _mm256_store_ps(group.offset[1 - latest].data(), offset);
      spans.next =
          _mm256_mul_ps(taut, _mm256_fnmadd_ps(g, _mm256_fmadd_ps(of_end, l, offset), elastic));
    }
  }

  template <Sweep kSweep>
  [[gnu::target("avx2,fma"), gnu::always_inline]] static inline void pull_avx2(const Group& group,
                                                                               const Spans& spans,
                                                                               float* force) {
    const auto [x, y, z, square, change, now, next] = spans;
    const Four first =
        from_lanes(_mm256_mul_ps(now, x), _mm256_mul_ps(now, y), _mm256_mul_ps(now, z));
    if constexpr (kSweep == Sweep::both) {
      const Four second =
          from_lanes(_mm256_mul_ps(next, x), _mm256_mul_ps(next, y), _mm256_mul_ps(next, z));
      for (std::size_t i = 0; i < 4; ++i) {
        pull(group, i, _mm256_permute2f128_ps(first.of[i], second.of[i], 0x20), force);
      }
      for (std::size_t i = 0; i < 4; ++i) {
        pull(group, i + 4, _mm256_permute2f128_ps(first.of[i], second.of[i], 0x31), force);
      }
    } else {
      constexpr std::size_t kAt = kSweep == Sweep::next ? 4 : 0;
      for (std::size_t i = 0; i < 4; ++i) {
        pull_half(group, i, _mm256_castps256_ps128(first.of[i]), force + kAt);
        pull_half(group, i + 4, _mm256_extractf128_ps(first.of[i], 1), force + kAt);
      }
    }
  }

  [[gnu::target("avx2,fma"), gnu::always_inline]] static inline void pull(const Group& group,
                                                                          std::size_t i, __m256 f,
                                                                          float* force) {
    float* const fa = force + std::size_t{2} * group.a[i];
    float* const fb = force + std::size_t{2} * group.b[i];
    _mm256_store_ps(fa, _mm256_add_ps(_mm256_load_ps(fa), f));
    _mm256_store_ps(fb, _mm256_sub_ps(_mm256_load_ps(fb), f));
  }

  [[gnu::target("avx2,fma"), gnu::always_inline]] static inline void pull_half(const Group& group,
                                                                               std::size_t i,
                                                                               __m128 f,
                                                                               float* force) {
    float* const fa = force + std::size_t{2} * group.a[i];
    float* const fb = force + std::size_t{2} * group.b[i];
    _mm_store_ps(fa, _mm_add_ps(_mm_load_ps(fa), f));
    _mm_store_ps(fb, _mm_sub_ps(_mm_load_ps(fb), f));
  }

  template <Sweep kSweep, bool kCubic, bool kBranches>
  [[gnu::target("avx2,fma")]] static void sweep_avx2(ServoBonds& bonds, Step step, const float* u,
                                                     float* force) {
    std::array<Spans, kTogether> spans;
    for (std::size_t first = 0; first < bonds.group_.size(); first += kTogether) {
      const std::span<Group> groups(bonds.group_.data() + first,
                                    std::min(kTogether, bonds.group_.size() - first));
      for (std::size_t i = 0; i < groups.size(); ++i) measure_avx2(groups[i], u, spans[i]);
      for (std::size_t i = 0; i < groups.size(); ++i) {
        relax_avx2<kSweep, kCubic, kBranches>(groups[i], step, step.branch, spans[i]);
        if constexpr (kBranches) step.branch += bonds.branches_;
      }
      for (std::size_t i = 0; i < groups.size(); ++i) {
        pull_avx2<kSweep>(groups[i], spans[i], force);
      }
    }
  }

  template <Sweep kSweep>
  static void sweep_vectors(ServoBonds& bonds, const Step& step, const float* u, float* force) {
    if (step.branch != nullptr) {
      bonds.cubic_ ? sweep_avx2<kSweep, true, true>(bonds, step, u, force)
                   : sweep_avx2<kSweep, false, true>(bonds, step, u, force);
    } else {
      bonds.cubic_ ? sweep_avx2<kSweep, true, false>(bonds, step, u, force)
                   : sweep_avx2<kSweep, false, false>(bonds, step, u, force);
    }
  }
#endif

  template <Sweep kSweep>
  static void sweep(ServoBonds& bonds, const ServoWeights& weights, const float* u, float* force) {
    Step step{weights, bonds.latest_, bonds.branches_ > 1 ? bonds.branch_.data() : nullptr};
#ifdef TPM_HAS_AVX2
    if (bonds.vectors_) return sweep_vectors<kSweep>(bonds, step, u, force);
#endif
    for (Group& group : bonds.group_) {
      plain<kSweep>(group, step, u, force);
      if (step.branch != nullptr) step.branch += bonds.branches_;
    }
  }
};

namespace {

/// The order in which bonds fill lanes: side by side such that share no sphere, so that sums do
/// not wait for each other, as far as there are any.
std::vector<std::size_t> order_in_lanes(std::span<const ServoBonds::Choice> chosen) {
  std::vector<std::size_t> left(chosen.size());
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = i;
  std::vector<std::size_t> order;
  std::vector<std::uint32_t> used;
  const auto is_used = [&](std::uint32_t sphere) {
    return std::find(used.begin(), used.end(), sphere) != used.end();
  };
  while (!left.empty()) {
    std::vector<std::size_t> later;
    std::size_t filled = 0;
    used.clear();
    for (const std::size_t i : left) {
      if (filled == ServoBonds::kWide || is_used(chosen[i].a) || is_used(chosen[i].b)) {
        later.push_back(i);
        continue;
      }
      used.insert(used.end(), {chosen[i].a, chosen[i].b});
      order.push_back(i);
      ++filled;
    }
    for (std::size_t i = 0; i < later.size() && filled < ServoBonds::kWide; ++filled) {
      order.push_back(later[i]);
      later.erase(later.begin());
    }
    left = std::move(later);
  }
  return order;
}

}  // namespace

ServoBonds::ServoBonds(const BondSystem& bonds, const Positions& rest,
                       std::span<const Choice> chosen, std::uint32_t filler, bool portable) {
#ifdef TPM_HAS_AVX2
  vectors_ = !portable && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
  static_cast<void>(portable);
#endif
  constexpr float kNever = -std::numeric_limits<float>::infinity();
  const std::vector<std::size_t> order = order_in_lanes(chosen);
  group_.resize((order.size() + kWide - 1) / kWide);
  branches_ = std::max<std::size_t>(servo_weights(bonds, 1.0).branches.size(), 1);
  if (branches_ > 1) branch_.assign(branches_ * group_.size(), {});
  for (std::size_t n = 0; n < kWide * group_.size(); ++n) {
    Group& group = group_[n / kWide];
    const std::size_t i = n % kWide;
    group.offset[0][i] = group.offset[1][i] = 0.0F;
    if (n >= order.size()) {
      group.a[i] = group.b[i] = 4 * filler;
      group.x[i] = group.rest[i] = 1.0F;
      group.y[i] = group.z[i] = group.k[i] = group.g[i] = group.cubic[i] = 0.0F;
      group.least[i] = kNever;
      continue;
    }
    const Choice& choice = chosen[order[n]];
    const auto row = static_cast<Eigen::Index>(choice.bond);
    const Eigen::Vector3f apart =
        (rest.col(bonds.end_b()[choice.bond]) - rest.col(bonds.end_a()[choice.bond])).cast<float>();
    group.a[i] = 4 * choice.a;
    group.b[i] = 4 * choice.b;
    group.x[i] = apart.x();
    group.y[i] = apart.y();
    group.z[i] = apart.z();
    group.rest[i] = static_cast<float>(bonds.rest_length_m()[row]);
    group.k[i] = static_cast<float>(bonds.stiffness()[row]);
    group.g[i] = static_cast<float>(bonds.relaxing()[row]);
    group.cubic[i] = static_cast<float>(cubic_of(bonds, choice.bond));
    cubic_ = cubic_ || group.cubic[i] != 0.0F;
    group.least[i] = bonds.is_rope(choice.bond) ? 0.0F : kNever;
  }
}

void ServoBonds::forget() noexcept {
  for (Group& group : group_) group.offset = {};
  for (BranchLane& branch : branch_) branch.offset = {};
}

void ServoBonds::advance(const float* displacement, const ServoWeights& weights,
                         float* force) noexcept {
  ServoBondKernels::sweep<Sweep::both>(*this, weights, displacement, force);
}

void ServoBonds::advance_now(const float* displacement, const ServoWeights& weights,
                             float* force) noexcept {
  ServoBondKernels::sweep<Sweep::now>(*this, weights, displacement, force);
}

void ServoBonds::add_next(const float* displacement, const ServoWeights& weights,
                          float* force) noexcept {
  ServoBondKernels::sweep<Sweep::next>(*this, weights, displacement, force);
}

}  // namespace tpm::contact
