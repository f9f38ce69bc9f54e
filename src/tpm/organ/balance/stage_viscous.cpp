// Declared in tpm/organ/balance/stage_balance.hpp.
// The viscous elongations at fractions of a step, from those at its start and its stages.
#include <algorithm>
#include <cmath>

#include "tpm/organ/balance/stage_balance.hpp"

namespace tpm::organ {

StageBalance::StepWeights StageBalance::weights_at(const Places& places,
                                                   std::span<const double> fractions,
                                                   double h) const {
  const std::span<const double> times = tissue_.bonds().relaxation_times_s();
  std::vector<ViscousWeights> of_time(times.size());
  for (std::size_t t = 0; t < times.size(); ++t) {
    const double z = h / times[t];
    of_time[t].of_stages.setZero();
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::size_t place = std::min(static_cast<std::size_t>(lane), fractions.size() - 1);
      const Eigen::VectorXd weight = places[place].weights(z);
      of_time[t].of_start[lane] = weight[0];
      of_time[t].of_stages.row(lane).head(stages_) = weight.tail(stages_).transpose();
      of_time[t].of_viscous[lane] = std::exp(-z * fractions[place]);
    }
  }
  StepWeights weights;
  for (const LaneBonds::Group& group : bonds_.groups()) {
    LawWeights law;
    law.mean.of_stages.setZero();
    law.mean.of_start.setZero();
    law.mean.of_viscous.setZero();
    for (const ViscousLaw::Branch& branch : tissue_.bonds().laws()[group.law].branches) {
      const ViscousWeights& weight = of_time[branch.time];
      law.mean.of_stages += branch.share * weight.of_stages;
      law.mean.of_start += branch.share * weight.of_start;
      law.mean.of_viscous += branch.share * weight.of_viscous;
      law.branch.push_back(weight);
    }
    weights.push_back(std::move(law));
  }
  return weights;
}

StageBalance::Start StageBalance::start_of(const TissueState& state) const {
  Start start;
  start.followed = bonds_.of_relaxing(state.followed).transpose();
  start.mean = bonds_.of_relaxing(state.mean).transpose();
  const std::vector<std::size_t>& relaxing = bonds_.relaxing_bonds();
  start.viscous.resize(state.viscous.cols(), static_cast<Eigen::Index>(relaxing.size()));
  for (Eigen::Index j = 0; j < state.viscous.cols(); ++j) {
    for (std::size_t i = 0; i < relaxing.size(); ++i) {
      start.viscous(j, static_cast<Eigen::Index>(i)) =
          state.viscous(static_cast<Eigen::Index>(relaxing[i]), j);
    }
  }
  return start;
}

void StageBalance::find_known(const StepWeights& weights, const Start& start,
                              LaneMatrix& known) const {
  known.resize(kLanes, start.followed.size());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const LaneBonds::Group& group = bonds_.groups()[i];
    const LawWeights& law = weights[i];
    if (law.branch.size() == 1) continue;
    auto here = known.middleCols(group.first, group.count);
    here.noalias() = law.mean.of_start * start.followed.segment(group.first, group.count);
    Eigen::Index j = 0;
    for (const ViscousLaw::Branch& branch : tissue_.bonds().laws()[group.law].branches) {
      const LaneVector kept = branch.share * law.branch[static_cast<std::size_t>(j)].of_viscous;
      here.noalias() += kept * start.viscous.row(j).segment(group.first, group.count);
      ++j;
    }
  }
}

void StageBalance::apply(const StepWeights& weights, const LaneMatrix& followed, const Start& start,
                         const LaneMatrix& known, LaneMatrix& mean) const {
  mean.resize(kLanes, followed.cols());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const auto [law, first, count] = bonds_.groups()[i];
    if (weights[i].branch.size() == 1) {
      weights[i].mean.apply(followed.middleCols(first, count), start.followed.segment(first, count),
                            start.mean.segment(first, count), mean.middleCols(first, count));
    } else {
      weights[i].mean.apply(followed.middleCols(first, count), known.middleCols(first, count),
                            mean.middleCols(first, count));
    }
  }
}

void StageBalance::set_following() {
  following_.clear();
  for (const LawWeights& law : weights_) {
    following_.push_back({&law.mean, begin_.followed.data(), begin_.mean.data(),
                          law.branch.size() == 1 ? nullptr : known_.data()});
  }
}

void StageBalance::viscous_in_lane(const StepWeights& weights, const LaneMatrix& followed,
                                   const Start& start, Eigen::Index lane,
                                   Eigen::MatrixXd& viscous) const {
  viscous.setZero(start.viscous.rows(), start.viscous.cols());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const auto [law, first, count] = bonds_.groups()[i];
    for (std::size_t b = 0; b < weights[i].branch.size(); ++b) {
      const ViscousWeights& weight = weights[i].branch[b];
      const auto j = static_cast<Eigen::Index>(b);
      viscous.row(j).segment(first, count) =
          weight.of_stages.row(lane) * followed.middleCols(first, count) +
          weight.of_start[lane] * start.followed.segment(first, count) +
          weight.of_viscous[lane] * start.viscous.row(j).segment(first, count);
    }
  }
}

void StageBalance::put_viscous(const Eigen::MatrixXd& viscous, Eigen::MatrixXd& of_bonds) const {
  for (const LaneBonds::Group& group : bonds_.groups()) {
    const auto branches =
        static_cast<Eigen::Index>(tissue_.bonds().laws()[group.law].branches.size());
    for (Eigen::Index i = group.first; i < group.first + group.count; ++i) {
      const std::size_t bond = bonds_.relaxing_bonds()[static_cast<std::size_t>(i)];
      of_bonds.row(static_cast<Eigen::Index>(bond)).head(branches) =
          viscous.col(i).head(branches).transpose();
    }
  }
}

}  // namespace tpm::organ
