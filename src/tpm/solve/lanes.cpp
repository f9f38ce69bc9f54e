#include "tpm/solve/lanes.hpp"

#include <array>

#include "tpm/core/wide_vectors.hpp"

namespace tpm {

// A Ref is a view: what it shows is changed.
// NOLINTBEGIN(performance-unnecessary-value-param)
void ViscousWeights::apply(const Eigen::Ref<const LaneMatrix>& stages,
                           const Eigen::Ref<const Eigen::RowVectorXd>& start,
                           const Eigen::Ref<const Eigen::RowVectorXd>& viscous_start,
                           Eigen::Ref<LaneMatrix> out) const {
  const double* const weight = of_stages.data();
  const double* const from_start = of_start.data();
  const double* const from_viscous = of_viscous.data();
  const double* const at_start = start.data();
  const double* const viscous = viscous_start.data();
  const double* const in = stages.data();
  double* const to = out.data();
  const auto bonds = static_cast<std::size_t>(start.size());
  run_wide([=]() __attribute__((always_inline)) {
    for (std::size_t i = 0; i < bonds; ++i) {
      std::array<double, kLanes> sum;
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) {
        double lane = from_start[s] * at_start[i] + from_viscous[s] * viscous[i];
        for (std::size_t j = 0; j < kLanes; ++j)
          lane += weight[kLanes * j + s] * in[kLanes * i + j];
        sum[s] = lane;
      }
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) to[kLanes * i + s] = sum[s];
    }
  });
}

void ViscousWeights::apply(const Eigen::Ref<const LaneMatrix>& stages,
                           const Eigen::Ref<const LaneMatrix>& known,
                           Eigen::Ref<LaneMatrix> out) const {
  const double* const weight = of_stages.data();
  const double* const at_start = known.data();
  const double* const in = stages.data();
  double* const to = out.data();
  const auto bonds = static_cast<std::size_t>(stages.cols());
  run_wide([=]() __attribute__((always_inline)) {
    for (std::size_t i = 0; i < bonds; ++i) {
      std::array<double, kLanes> sum;
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) {
        double lane = at_start[kLanes * i + s];
        for (std::size_t j = 0; j < kLanes; ++j)
          lane += weight[kLanes * j + s] * in[kLanes * i + j];
        sum[s] = lane;
      }
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) to[kLanes * i + s] = sum[s];
    }
  });
}
// NOLINTEND(performance-unnecessary-value-param)

void mix_lanes(const LaneSquare& weights, const LaneMatrix& in, LaneMatrix& out) {
  out.resize(kLanes, in.cols());
  const double* const weight = weights.data();
  const double* const from = in.data();
  double* const to = out.data();
  const auto columns = static_cast<std::size_t>(in.cols());
  run_wide([=]() __attribute__((always_inline)) {
    for (std::size_t i = 0; i < columns; ++i) {
      std::array<double, kLanes> sum;
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) {
        double lane = 0.0;
        for (std::size_t j = 0; j < kLanes; ++j)
          lane += weight[kLanes * j + s] * from[kLanes * i + j];
        sum[s] = lane;
      }
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) to[kLanes * i + s] = sum[s];
    }
  });
}

}  // namespace tpm
