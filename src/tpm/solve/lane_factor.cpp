#include "tpm/solve/lane_factor.hpp"

#include "tpm/core/wide_vectors.hpp"

namespace tpm {
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
      node_of_(pattern.nodes()),
      lower_(pattern.factor_blocks()),
      inverse_(pattern.nodes()),
      y_(pattern.nodes()) {
  for (std::uint32_t node = 0; node < node_of_.size(); ++node) {
    node_of_[pattern.order_[node]] = node;
  }
}

void LaneFactor::copy(const BlockLdlt& factor) {
  const auto put = [](const auto& from, Block& to) {
    Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(to.data()) =
        from.template cast<float>();
  };
  for (std::size_t i = 0; i < lower_.size(); ++i) put(factor.lower_[i].matrix(), lower_[i]);
  for (std::size_t i = 0; i < inverse_.size(); ++i) put(factor.inverse_[i], inverse_[i]);
}

void LaneFactor::solve(LaneMatrix& x) {
  const auto n = static_cast<std::uint32_t>(pattern_.nodes());
  constexpr std::size_t kNode = std::size_t{3} * kLanes;
  double* const outside = x.data();
  LaneNode* const y = y_.data();
  const std::uint32_t* const column = pattern_.column_.data();
  const std::uint32_t* const row = pattern_.row_.data();
  const Block* const lower = lower_.data();
  run_wide([ =, this ]() __attribute__((always_inline)) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const double* from = outside + kNode * node_of_[j];
      for (int i = 0; i < kLanes; ++i) y[j].x[i] = static_cast<float>(from[i]);
      for (int i = 0; i < kLanes; ++i) y[j].y[i] = static_cast<float>(from[kLanes + i]);
      for (int i = 0; i < kLanes; ++i) y[j].z[i] = static_cast<float>(from[2 * kLanes + i]);
    }
    for (std::uint32_t j = 0; j < n; ++j) {
      const LaneNode value = y[j];
      const std::uint32_t end = column[j + 1];
      for (std::uint32_t p = column[j]; p < end; ++p) {
        subtract_product(lower[p].data(), value, y[row[p]]);
      }
    }
    for (std::uint32_t j = n; j-- > 0;) {
      LaneNode minus{};
      subtract_product(inverse_[j].data(), y[j], minus);
      const std::uint32_t end = column[j + 1];
      for (std::uint32_t p = column[j]; p < end; ++p) {
        add_transposed(lower[p].data(), y[row[p]], minus);
      }
      y[j] = {-minus.x, -minus.y, -minus.z};
    }
    for (std::uint32_t j = 0; j < n; ++j) {
      double* to = outside + kNode * node_of_[j];
      for (int i = 0; i < kLanes; ++i) to[i] = static_cast<double>(y[j].x[i]);
      for (int i = 0; i < kLanes; ++i) to[kLanes + i] = static_cast<double>(y[j].y[i]);
      for (int i = 0; i < kLanes; ++i) to[2 * kLanes + i] = static_cast<double>(y[j].z[i]);
    }
  });
}

}  // namespace tpm
