#include "tpm/organ/linear/lanes.hpp"

#include <array>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/wide_vectors.hpp"

namespace tpm::organ {
namespace {

/// out = weights in + what `first` makes of (column, lane).
template <class First>
void add_mixed(const LaneSquare& weights, const double* from, std::size_t columns, double* to,
               const First& first) {
  const double* const weight = weights.data();
  run_wide([=]() __attribute__((always_inline)) {
    for (std::size_t i = 0; i < columns; ++i) {
      std::array<double, kLanes> sum;
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) {
        double lane = first(i, s);
        for (std::size_t j = 0; j < kLanes; ++j)
          lane += weight[kLanes * j + s] * from[kLanes * i + j];
        sum[s] = lane;
      }
#pragma omp simd
      for (std::size_t s = 0; s < kLanes; ++s) to[kLanes * i + s] = sum[s];
    }
  });
}

}  // namespace

// A Ref is a view: what it shows is changed.
// NOLINTBEGIN(performance-unnecessary-value-param)
void ViscousWeights::apply(const Eigen::Ref<const LaneMatrix>& stages,
                           const Eigen::Ref<const Eigen::RowVectorXd>& start,
                           const Eigen::Ref<const Eigen::RowVectorXd>& viscous_start,
                           Eigen::Ref<LaneMatrix> out) const {
  const double* const from_start = of_start.data();
  const double* const from_viscous = of_viscous.data();
  const double* const at_start = start.data();
  const double* const viscous = viscous_start.data();
  add_mixed(
      of_stages, stages.data(), static_cast<std::size_t>(stages.cols()),
      out.data(), [=](std::size_t i, std::size_t s) __attribute__((always_inline)) {
        return from_start[s] * at_start[i] + from_viscous[s] * viscous[i];
      });
}

void ViscousWeights::apply(const Eigen::Ref<const LaneMatrix>& stages,
                           const Eigen::Ref<const LaneMatrix>& known,
                           Eigen::Ref<LaneMatrix> out) const {
  const double* const at_start = known.data();
  add_mixed(
      of_stages, stages.data(), static_cast<std::size_t>(stages.cols()),
      out.data(), [=](std::size_t i, std::size_t s) __attribute__((always_inline)) {
        return at_start[kLanes * i + s];
      });
}
// NOLINTEND(performance-unnecessary-value-param)

void mix_lanes(const LaneSquare& weights, const LaneMatrix& in, LaneMatrix& out) {
  out.resize(kLanes, in.cols());
  add_mixed(
      weights, in.data(), static_cast<std::size_t>(in.cols()), out.data(),
      [](std::size_t, std::size_t) __attribute__((always_inline)) { return 0.0; });
}

}  // namespace tpm::organ
