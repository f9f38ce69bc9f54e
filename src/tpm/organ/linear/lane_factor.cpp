#include "tpm/organ/linear/lane_factor.hpp"

#include <algorithm>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/wide_vectors.hpp"

namespace tpm::organ {
namespace {

/// y -= A v.
[[gnu::always_inline]] inline void subtract_product(const float* a, const LaneNode& v,
                                                    LaneNode& y) {
  y.x -= a[0] * v.x + a[1] * v.y + a[2] * v.z;
  y.y -= a[3] * v.x + a[4] * v.y + a[5] * v.z;
  y.z -= a[6] * v.x + a[7] * v.y + a[8] * v.z;
}

/// y += A^T v.
[[gnu::always_inline]] inline void add_transposed(const float* a, const LaneNode& v, LaneNode& y) {
  y.x += a[0] * v.x + a[3] * v.y + a[6] * v.z;
  y.y += a[1] * v.x + a[4] * v.y + a[7] * v.z;
  y.z += a[2] * v.x + a[5] * v.y + a[8] * v.z;
}

}  // namespace

LaneFactor::LaneFactor(const BlockPattern& pattern)
    : pattern_(pattern),
      lower_(pattern.factor_blocks()),
      inverse_(pattern.nodes()),
      y_(pattern.nodes()) {}

void LaneFactor::copy(const BlockLdlt& factor) {
  for (std::size_t i = 0; i < inverse_.size(); ++i) {
    Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(inverse_[i].data()) =
        factor.inverse_[i].cast<float>();
  }
  Block* to = lower_.data();
  for (std::size_t f = 0; f < pattern_.layout_.size(); ++f) {
    const EliminationFronts::Front& front = pattern_.fronts_.fronts()[f];
    const std::size_t stride = pattern_.layout_[f].stride;
    const double* const panel = factor.panels_.data() + pattern_.layout_[f].panel;
    for (std::uint32_t i = 1; i < front.size(); ++i) {
      const std::uint32_t columns = std::min(i, front.own);
      const double* from = panel + std::size_t{3} * i;
      for (std::uint32_t j = 0; j < columns; ++j, ++to, from += 3 * stride) {
        const double* const c1 = from + stride;
        const double* const c2 = c1 + stride;
        for (std::size_t k = 0; k < 3; ++k) {
          (*to)[3 * k] = static_cast<float>(from[k]);
          (*to)[3 * k + 1] = static_cast<float>(c1[k]);
          (*to)[3 * k + 2] = static_cast<float>(c2[k]);
        }
      }
    }
  }
}

void LaneFactor::solve(LaneMatrix& x) {
  const auto n = static_cast<std::uint32_t>(pattern_.nodes());
  constexpr std::size_t kNode = std::size_t{3} * kLanes;
  double* const outside = x.data();
  LaneNode* const y = y_.data();
  const std::uint32_t* const node_of = pattern_.node_of_.data();
  const auto fronts = pattern_.fronts_.fronts();
  const std::uint32_t* const all_rows = pattern_.fronts_.all_rows().data();
  run_wide([ =, this ]() __attribute__((always_inline)) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const double* from = outside + kNode * node_of[j];
      for (int i = 0; i < kLanes; ++i) y[j].x[i] = static_cast<float>(from[i]);
      for (int i = 0; i < kLanes; ++i) y[j].y[i] = static_cast<float>(from[kLanes + i]);
      for (int i = 0; i < kLanes; ++i) y[j].z[i] = static_cast<float>(from[2 * kLanes + i]);
    }
    const Block* lower = lower_.data();
    for (const EliminationFronts::Front& front : fronts) {
      LaneNode* const own = y + front.first;
      const std::uint32_t* const rows = all_rows + front.rows;
      for (std::uint32_t i = 1; i < front.own + front.count; ++i) {
        LaneNode& to = i < front.own ? own[i] : y[rows[i - front.own]];
        const std::uint32_t columns = i < front.own ? i : front.own;
        LaneNode sum = to;
        for (std::uint32_t j = 0; j < columns; ++j) {
          subtract_product((lower++)->data(), own[j], sum);
        }
        to = sum;
      }
    }
    for (std::size_t f = fronts.size(); f-- > 0;) {
      const EliminationFronts::Front& front = fronts[f];
      LaneNode* const own = y + front.first;
      const std::uint32_t* const rows = all_rows + front.rows;
      // Minus the solution, until it is complete.
      for (std::uint32_t j = 0; j < front.own; ++j) {
        LaneNode minus{};
        subtract_product(inverse_[front.first + j].data(), own[j], minus);
        own[j] = minus;
      }
      for (std::uint32_t i = front.count; i-- > 0;) {
        const LaneNode value = y[rows[i]];
        lower -= front.own;
        for (std::uint32_t j = 0; j < front.own; ++j) {
          add_transposed(lower[j].data(), value, own[j]);
        }
      }
      for (std::uint32_t i = front.own; i-- > 0;) {
        own[i] = {-own[i].x, -own[i].y, -own[i].z};
        lower -= i;
        for (std::uint32_t j = 0; j < i; ++j) add_transposed(lower[j].data(), own[i], own[j]);
      }
    }
    for (std::uint32_t j = 0; j < n; ++j) {
      double* to = outside + kNode * node_of[j];
      for (int i = 0; i < kLanes; ++i) to[i] = static_cast<double>(y[j].x[i]);
      for (int i = 0; i < kLanes; ++i) to[kLanes + i] = static_cast<double>(y[j].y[i]);
      for (int i = 0; i < kLanes; ++i) to[2 * kLanes + i] = static_cast<double>(y[j].z[i]);
    }
  });
}

}  // namespace tpm::organ
