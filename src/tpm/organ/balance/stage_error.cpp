// Declared in tpm/organ/balance/stage_balance.hpp.
// The error of a step: its collocation is compared with that through the stages alone.
#include <algorithm>
#include <array>
#include <cmath>

#include "tpm/base/wide_vectors.hpp"
#include "tpm/organ/balance/stage_balance.hpp"

namespace tpm::organ {
namespace {

// Differences of smooth motions cancel over the bonds; kinks, where ropes slacken, do not.
constexpr double kOfSmooth = 0.1, kOfKinks = 1.0;

bool has_ropes(const BondSystem& bonds) {
  for (std::size_t i = 0; i < bonds.first_contact(); ++i) {
    if (bonds.is_rope(i)) return true;
  }
  return false;
}

}  // namespace

void StageBalance::choose_error_places() {
  differing_share_ = has_ropes(tissue_.bonds()) ? kOfKinks : kOfSmooth;
  // The error is measured where outputs are taken from: at the stages, of which the last is more
  // accurate than the others, and before the first of them, where a step that is long against the
  // relaxation time hides how the tissue settles after a change of rate.
  std::vector<double> compared = inner_.nodes();
  compared.push_back(0.25 * inner_.nodes().front());
  compared.push_back(0.5 * inner_.nodes().front());
  for (const double place : compared) {
    full_error_places_.push_back(full_.place(place));
    inner_error_places_.push_back(inner_.place(place));
  }
}

void StageBalance::set_error_weights(double h) {
  const std::span<const double> times = tissue_.bonds().relaxation_times_s();
  error_weights_.assign(times.size(), {});
  const auto count = static_cast<Eigen::Index>(full_error_places_.size());
  for (std::size_t t = 0; t < times.size(); ++t) {
    const double z = h / times[t];
    ErrorWeights& weights = error_weights_[t];
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto place = static_cast<std::size_t>(i);
      Eigen::VectorXd difference = full_error_places_[place].weights(z);
      difference.tail(stages_) -= inner_error_places_[place].weights(z);
      weights.of_start[i] = difference[0];
      weights.of_stages.row(i).head(stages_) = difference.tail(stages_).transpose();
    }
  }
}

StageBalance::ErrorSums StageBalance::error_sums(const LaneBonds::Group& group,
                                                 const ErrorWeights& weights) const {
  ErrorSums sums;
  const double* const weight = weights.of_stages.data();
  const double* const weight_of_start = weights.of_start.data();
  const double* const aim = adjoint_.data() + group.first;
  const double* const followed = followed_.data() + kLanes * group.first;
  const double* const start = begin_.followed.data() + group.first;
  const auto bonds = static_cast<std::size_t>(group.count);
  run_wide([&]() __attribute__((always_inline)) {
    constexpr auto kPlaces = static_cast<std::size_t>(kErrorPlaces);
    std::array<double, kPlaces> size{};
    std::array<double, kLanes> stages{};
    double start_sum = 0.0;
    for (std::size_t i = 0; i < bonds; ++i) {
      const double* const at = followed + kLanes * i;
      const double size_of_aim = std::abs(aim[i]);
      for (std::size_t p = 0; p < kPlaces; ++p) {
        double difference = weight_of_start[p] * start[i];
        for (std::size_t s = 0; s < kLanes; ++s) difference += weight[kPlaces * s + p] * at[s];
        size[p] += size_of_aim * std::abs(difference);
      }
      for (std::size_t s = 0; s < kLanes; ++s) stages[s] += aim[i] * at[s];
      start_sum += aim[i] * start[i];
    }
    std::copy(size.begin(), size.end(), sums.size.data());
    std::copy(stages.begin(), stages.end(), sums.stages.data());
    sums.start = start_sum;
  });
  return sums;
}

double StageBalance::error() const {
  AtErrorPlaces error = AtErrorPlaces::Zero();
  for (const LaneBonds::Group& group : bonds_.groups()) {
    const std::vector<ViscousLaw::Branch>& branches = tissue_.bonds().laws()[group.law].branches;
    ErrorWeights mean;
    for (const ViscousLaw::Branch& branch : branches) {
      const ErrorWeights& weights = error_weights_[branch.time];
      mean.of_stages += branch.share * weights.of_stages;
      mean.of_start += branch.share * weights.of_start;
    }
    const ErrorSums sums = error_sums(group, mean);
    error += differing_share_ * sums.size;
    // Branch by branch, whose later errors do not cancel even where they do now.
    for (const ViscousLaw::Branch& branch : branches) {
      const ErrorWeights& weights = error_weights_[branch.time];
      error += branch.share *
               (weights.of_stages * sums.stages + weights.of_start * sums.start).cwiseAbs();
    }
  }
  return error.maxCoeff();
}

}  // namespace tpm::organ
