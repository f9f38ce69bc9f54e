#include "tpm/organ/balance/stage_tangents.hpp"

#include <cmath>

#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr int kMostTangentIterations = 60;
constexpr Eigen::Index kTangentAndersonDepth = 8;

}  // namespace

StageTangents::StageTangents(DrivenTissue& tissue, StageBalance& balance,
                             const std::vector<TangentDirection>& directions, double tolerance)
    : tissue_(tissue),
      balance_(balance),
      tolerance_(tolerance),
      anderson_(kLanes * balance.coordinates_, kTangentAndersonDepth) {
  const std::span<const ViscousLaw> laws = tissue.bonds().laws();
  for (const TangentDirection& direction : directions) {
    Tangent tangent;
    tangent.stiffness = balance.bonds_.in_order(direction.stiffness);
    tangent.relaxing = balance.bonds_.in_order(direction.relaxing);
    tangent.laws = direction.laws;
    tangent.laws.resize(laws.size());
    for (std::size_t i = 0; i < laws.size(); ++i) {
      LawChange& change = tangent.laws[i];
      change.share.resize(laws[i].branches.size());
      change.log_time.resize(laws[i].branches.size());
      for (double& log_time : change.log_time) log_time += direction.log_relaxation_time;
    }
    tangent.imposed = direction.imposed;
    tangent_.push_back(std::move(tangent));
  }
  at_rest();
}

void StageTangents::at_rest() {
  const auto relaxing = static_cast<Eigen::Index>(balance_.bonds_.relaxing_bonds().size());
  for (Tangent& tangent : tangent_) {
    tangent.start.setZero(balance_.coordinates_);
    tangent.begin.followed.setZero(relaxing);
    tangent.begin.mean.setZero(relaxing);
    tangent.begin.viscous.setZero(tissue_.bonds().most_branches(), relaxing);
  }
}

StageTangents::Stages StageTangents::stages_at(const StageBalance::Places& places,
                                               std::span<const double> fractions, double h) const {
  Stages stages;
  stages.weights = balance_.weights_at(places, fractions, h);
  for (std::size_t i = 0; i < stages.weights.size(); ++i) {
    const auto [law, first, count] = balance_.bonds_.groups()[i];
    std::vector<LaneMatrix> aging, viscous;
    for (std::size_t b = 0; b < stages.weights[i].branch.size(); ++b) {
      const auto j = static_cast<Eigen::Index>(b);
      const auto start = balance_.begin_.viscous.row(j).segment(first, count);
      aging.push_back(balance_.aging(places, fractions, h, i, b));
      const ViscousWeights& weight = stages.weights[i].branch[b];
      LaneMatrix m = weight.of_stages * balance_.followed_.middleCols(first, count);
      m.noalias() += weight.of_start * balance_.begin_.followed.segment(first, count);
      m.noalias() += weight.of_viscous * start;
      viscous.push_back(std::move(m));
    }
    stages.aging.push_back(std::move(aging));
    stages.viscous.push_back(std::move(viscous));
  }
  return stages;
}

StageTangents::Stages StageTangents::stages_of_step(double h) const {
  Stages stages = stages_at(balance_.stage_places_, balance_.lane_nodes(), h);
  stages.position = balance_.x_;
  balance_.apply(balance_.weights_, balance_.followed_, balance_.begin_, balance_.known_,
                 stages.mean);
  stages.imposed = balance_.imposed_;
  return stages;
}

StageTangents::Stages StageTangents::instantaneous(const TissueState& state, bool relaxed) const {
  Stages stages;
  const Eigen::Map<const Eigen::RowVectorXd> position(state.position.data(), state.position.size());
  stages.position = position.replicate(kLanes, 1);
  const StageBalance::Start start = balance_.start_of(state);
  stages.mean = start.mean.replicate(kLanes, 1);
  stages.imposed.setConstant(state.imposed);
  ViscousWeights weight;
  weight.of_stages.setZero();
  if (relaxed) weight.of_stages.setIdentity();
  weight.of_start.setZero();
  weight.of_viscous.setConstant(relaxed ? 0.0 : 1.0);
  for (const LaneBonds::Group& group : balance_.bonds_.groups()) {
    const std::size_t branches = tissue_.bonds().laws()[group.law].branches.size();
    stages.weights.push_back({weight, std::vector<ViscousWeights>(branches, weight)});
    stages.aging.emplace_back(branches, LaneMatrix::Zero(kLanes, group.count));
    std::vector<LaneMatrix> viscous;
    for (std::size_t b = 0; b < branches; ++b) {
      const auto row = start.viscous.row(static_cast<Eigen::Index>(b));
      viscous.emplace_back(row.segment(group.first, group.count).replicate(kLanes, 1));
    }
    stages.viscous.push_back(std::move(viscous));
  }
  return stages;
}

void StageTangents::prepare(Tangent& tangent, const Stages& stages) const {
  balance_.find_known(stages.weights, tangent.begin, tangent.known);
  tangent.drift.setZero(kLanes, tangent.begin.mean.size());
  for (std::size_t i = 0; i < stages.weights.size(); ++i) {
    const LaneBonds::Group& group = balance_.bonds_.groups()[i];
    const std::vector<ViscousLaw::Branch>& branches = tissue_.bonds().laws()[group.law].branches;
    const LawChange& change = tangent.laws[group.law];
    auto drift = tangent.drift.middleCols(group.first, group.count);
    for (std::size_t b = 0; b < branches.size(); ++b) {
      drift += branches[b].share * change.log_time[b] * stages.aging[i][b];
      if (change.share[b] != 0.0) drift += change.share[b] * stages.viscous[i][b];
    }
  }
}

void StageTangents::update_viscous(Tangent& tangent, const Stages& stages) const {
  balance_.bonds_.followed_changes(stages.position, tangent.position, tangent.laws,
                                   tangent.followed);
  balance_.apply(stages.weights, tangent.followed, tangent.begin, tangent.known, tangent.mean);
  tangent.mean += tangent.drift;
}

void StageTangents::force_changes(const Tangent& tangent, const Stages& stages,
                                  const LaneMatrix& position, const LaneMatrix& mean) {
  force_.setZero(kLanes, balance_.coordinates_);
  tissue_.add_load(tangent.imposed * stages.imposed, force_);
  balance_.bonds_.add_force_changes(
      stages.position, stages.mean,
      {position, mean, tangent.stiffness, tangent.relaxing, tangent.laws}, force_);
}

void StageTangents::solve(Tangent& tangent, const Stages& stages) {
  const Constraints& constraints = tissue_.constraints();
  prepare(tangent, stages);
  tangent.position = tangent.start.replicate(kLanes, 1);
  tissue_.impose_change(tangent.position, tangent.imposed * stages.imposed);
  anderson_.restart();
  const LaneSquare mixing = balance_.mixing(stages.weights);
  const double allowed = std::max(tolerance_ * balance_.scale_, balance_.rounding_);
  for (int i = 0; i < kMostTangentIterations; ++i) {
    update_viscous(tangent, stages);
    force_changes(tangent, stages, tangent.position, tangent.mean);
    constraints.project(force_);
    const double imbalance = balance_.correction(force_, mixing, d_);
    if (!std::isfinite(imbalance)) break;
    if (imbalance <= allowed) {
      tangent.position += d_;
      update_viscous(tangent, stages);
      return;
    }
    anderson_.step(flat(tangent.position), flat(d_));
  }
  throw Error(ExitCode::numerical, "network",
              "the derivatives of a step are not found: its stiffness is near singular");
}

void StageTangents::end_at(Tangent& tangent, const Stages& stages, Eigen::Index lane) const {
  tangent.start = tangent.position.row(lane);
  Eigen::MatrixXd viscous;
  balance_.viscous_in_lane(stages.weights, tangent.followed, tangent.begin, lane, viscous);
  for (std::size_t i = 0; i < stages.weights.size(); ++i) {
    const auto [law, first, count] = balance_.bonds_.groups()[i];
    for (std::size_t b = 0; b < stages.weights[i].branch.size(); ++b) {
      viscous.row(static_cast<Eigen::Index>(b)).segment(first, count) +=
          tangent.laws[law].log_time[b] * stages.aging[i][b].row(lane);
    }
  }
  tangent.begin.viscous = std::move(viscous);
  tangent.begin.followed = tangent.followed.row(lane);
  // Of the law as it was: what the changes of its shares add is drift, found anew in each step.
  tangent.begin.mean.setZero();
  for (const LaneBonds::Group& group : balance_.bonds_.groups()) {
    Eigen::Index j = 0;
    for (const ViscousLaw::Branch& branch : tissue_.bonds().laws()[group.law].branches) {
      tangent.begin.mean.segment(group.first, group.count) +=
          branch.share * tangent.begin.viscous.row(j++).segment(group.first, group.count);
    }
  }
}

void StageTangents::follow_move(const TissueState& state, bool relaxed) {
  balance_.require_factor(state, relaxed ? 1.0 : 0.0);
  balance_.bonds_.close_contacts(state.closed);
  const Stages stages = instantaneous(state, relaxed);
  for (Tangent& tangent : tangent_) {
    solve(tangent, stages);
    end_at(tangent, stages, 0);
  }
}

void StageTangents::follow_step(double h) {
  step_ = stages_of_step(h);
  for (Tangent& tangent : tangent_) solve(tangent, step_);
}

void StageTangents::accept() {
  for (Tangent& tangent : tangent_) end_at(tangent, step_, balance_.stages_ - 1);
}

LaneVector StageTangents::response_changes(const LaneMatrix& position) {
  const LaneVector plain = tissue_.response_change(position, force_);
  tissue_.constraints().project(force_);
  return plain + tissue_.adjoint_sign() * (force_ * balance_.lane_field_.transpose());
}

Eigen::MatrixXd StageTangents::responses_within(const TissueState& state,
                                                std::span<const double> fractions, double h,
                                                double rate) {
  StageBalance::Places places;
  for (const double c : fractions) places.push_back(balance_.full_.place(c));
  const StageBalance::Within within = balance_.within(state, fractions, h, rate);
  Stages stages = stages_at(places, fractions, h);
  stages.position = within.position;
  stages.mean = within.mean_viscous;
  stages.imposed = within.imposed;
  const LaneSquare interpolation = balance_.shapes(fractions, h).interpolation;
  Eigen::MatrixXd answer(static_cast<Eigen::Index>(fractions.size()), count());
  for (Eigen::Index i = 0; i < count(); ++i) {
    Tangent& tangent = tangent_[static_cast<std::size_t>(i)];
    LaneMatrix position = interpolation * (tangent.position.rowwise() - tangent.start);
    position.rowwise() += tangent.start;
    prepare(tangent, stages);
    LaneMatrix mean;
    balance_.apply(stages.weights, tangent.followed, tangent.begin, tangent.known, mean);
    mean += tangent.drift;
    force_changes(tangent, stages, position, mean);
    answer.col(i) = response_changes(position).head(answer.rows());
  }
  return answer;
}

Eigen::RowVectorXd StageTangents::response(const TissueState& state) {
  const Stages stages = instantaneous(state, false);
  Eigen::RowVectorXd answer(count());
  for (Eigen::Index i = 0; i < count(); ++i) {
    Tangent& tangent = tangent_[static_cast<std::size_t>(i)];
    prepare(tangent, stages);
    const LaneMatrix position = tangent.start.replicate(kLanes, 1);
    LaneMatrix mean = tangent.begin.mean.replicate(kLanes, 1);
    mean += tangent.drift;
    force_changes(tangent, stages, position, mean);
    answer[i] = tissue_.response_change(position, force_)[0];
  }
  return answer;
}

}  // namespace tpm::organ
