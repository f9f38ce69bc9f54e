#include "tpm/network/stage_tangents.hpp"

#include <cmath>

#include "tpm/core/error.hpp"

namespace tpm {
namespace {

constexpr int kMostTangentIterations = 60;
constexpr Eigen::Index kTangentMemoryDepth = 8;

}  // namespace

StageTangents::StageTangents(DrivenTissue& tissue, StageBalance& balance,
                             const std::vector<TangentDirection>& directions, double tolerance)
    : tissue_(tissue),
      balance_(balance),
      tolerance_(tolerance),
      anderson_(kLanes * balance.coordinates_, kTangentMemoryDepth) {
  for (const TangentDirection& direction : directions) {
    Tangent tangent;
    tangent.stiffness = balance.bonds_.in_order(direction.stiffness);
    tangent.relaxing = balance.bonds_.in_order(direction.relaxing);
    tangent.log_relaxation_time = direction.log_relaxation_time;
    tangent.imposed = direction.imposed;
    tangent_.push_back(std::move(tangent));
  }
  at_rest();
}

void StageTangents::at_rest() {
  const auto relaxing = static_cast<Eigen::Index>(balance_.bonds_.relaxing_bonds().size());
  for (Tangent& tangent : tangent_) {
    tangent.start.setZero(balance_.coordinates_);
    tangent.start_elongation.setZero(relaxing);
    tangent.start_memory.setZero(relaxing);
  }
}

StageTangents::Stages StageTangents::stages_of_step(double h) const {
  const double z = h / tissue_.bonds().relaxation_time_s();
  Stages stages;
  stages.position = balance_.x_;
  stages.memory = balance_.memory_;
  stages.imposed = balance_.imposed_;
  stages.weights = balance_.weights_;
  stages.aging = balance_.aging(balance_.lane_nodes(), z);
  return stages;
}

StageTangents::Stages StageTangents::at_once(const TissueState& state, bool relaxed) const {
  Stages stages;
  const Eigen::Map<const Eigen::RowVectorXd> position(state.position.data(), state.position.size());
  stages.position = position.replicate(kLanes, 1);
  const Eigen::RowVectorXd memory = balance_.bonds_.of_relaxing(state.remembered).transpose();
  stages.memory = memory.replicate(kLanes, 1);
  stages.imposed.setConstant(state.imposed);
  stages.weights.of_stages.setZero();
  if (relaxed) stages.weights.of_stages.setIdentity();
  stages.weights.of_start.setZero();
  stages.weights.of_memory.setConstant(relaxed ? 0.0 : 1.0);
  stages.aging.setZero(kLanes, memory.size());
  return stages;
}

void StageTangents::update_memory(Tangent& tangent, const Stages& stages) const {
  balance_.bonds_.elongation_changes(stages.position, tangent.position, tangent.elongation);
  stages.weights.apply(tangent.elongation, tangent.start_elongation, tangent.start_memory,
                       tangent.memory);
  tangent.memory += tangent.log_relaxation_time * stages.aging;
}

void StageTangents::force_changes(const Tangent& tangent, const Stages& stages,
                                  const LaneMatrix& position, const LaneMatrix& memory) {
  force_.setZero(kLanes, balance_.coordinates_);
  tissue_.add_load(tangent.imposed * stages.imposed, force_);
  balance_.bonds_.add_force_changes(stages.position, stages.memory, position, memory,
                                    tangent.stiffness, tangent.relaxing, force_);
}

void StageTangents::solve(Tangent& tangent, const Stages& stages) {
  const Freedom& freedom = tissue_.freedom();
  tangent.position = tangent.start.replicate(kLanes, 1);
  tissue_.impose_change(tangent.position, tangent.imposed * stages.imposed);
  anderson_.restart();
  const double allowed = std::max(tolerance_ * balance_.scale_, balance_.grain_);
  for (int i = 0; i < kMostTangentIterations; ++i) {
    update_memory(tangent, stages);
    force_changes(tangent, stages, tangent.position, tangent.memory);
    freedom.project(force_);
    d_ = force_;
    balance_.factor_.solve(d_);
    freedom.project(d_);
    const double energy = d_.cwiseProduct(force_).rowwise().sum().maxCoeff();
    if (!std::isfinite(energy)) break;
    if (std::sqrt(std::max(energy, 0.0) * balance_.path_stiffness_) <= allowed) {
      tangent.position += d_;
      update_memory(tangent, stages);
      return;
    }
    anderson_.step(flat(tangent.position), flat(d_));
  }
  throw Error(ExitCode::numerical, "network",
              "the derivatives of a step are not found: its stiffness is near singular");
}

void StageTangents::end_at(Tangent& tangent, Eigen::Index lane) const {
  tangent.start = tangent.position.row(lane);
  tangent.start_elongation = tangent.elongation.row(lane);
  tangent.start_memory = tangent.memory.row(lane);
}

void StageTangents::follow_move(const TissueState& state, bool relaxed) {
  balance_.require_factor(state, relaxed ? 1.0 : 0.0);
  balance_.bonds_.close_contacts(state.closed);
  const Stages stages = at_once(state, relaxed);
  for (Tangent& tangent : tangent_) {
    solve(tangent, stages);
    end_at(tangent, 0);
  }
}

void StageTangents::follow_step(double h) {
  const Stages stages = stages_of_step(h);
  for (Tangent& tangent : tangent_) solve(tangent, stages);
}

void StageTangents::accept() {
  for (Tangent& tangent : tangent_) end_at(tangent, balance_.stages_ - 1);
}

LaneVector StageTangents::response_changes(const LaneMatrix& position) {
  const LaneVector plain = tissue_.response_change(position, force_);
  tissue_.freedom().project(force_);
  return plain + tissue_.adjoint_sign() * (force_ * balance_.lane_field_.transpose());
}

Eigen::MatrixXd StageTangents::responses_within(const TissueState& state,
                                                std::span<const double> fractions, double h,
                                                double rate) {
  const double z = h / tissue_.bonds().relaxation_time_s();
  const StageBalance::Shapes shapes = balance_.shapes(fractions, z);
  const StageBalance::Within within = balance_.within(state, fractions, h, rate);
  Stages stages;
  stages.position = within.position;
  stages.memory = within.memory;
  stages.imposed = within.imposed;
  const LaneMatrix aging = balance_.aging(fractions, z);
  Eigen::MatrixXd answer(static_cast<Eigen::Index>(fractions.size()), count());
  for (Eigen::Index i = 0; i < count(); ++i) {
    const Tangent& tangent = tangent_[static_cast<std::size_t>(i)];
    LaneMatrix position = shapes.interpolation * (tangent.position.rowwise() - tangent.start);
    position.rowwise() += tangent.start;
    LaneMatrix memory;
    shapes.memory.apply(tangent.elongation, tangent.start_elongation, tangent.start_memory, memory);
    memory += tangent.log_relaxation_time * aging;
    force_changes(tangent, stages, position, memory);
    answer.col(i) = response_changes(position).head(answer.rows());
  }
  return answer;
}

Eigen::RowVectorXd StageTangents::response(const TissueState& state) {
  const Stages stages = at_once(state, false);
  Eigen::RowVectorXd answer(count());
  for (Eigen::Index i = 0; i < count(); ++i) {
    const Tangent& tangent = tangent_[static_cast<std::size_t>(i)];
    const LaneMatrix position = tangent.start.replicate(kLanes, 1);
    const LaneMatrix memory = tangent.start_memory.replicate(kLanes, 1);
    force_changes(tangent, stages, position, memory);
    answer[i] = tissue_.response_change(position, force_)[0];
  }
  return answer;
}

}  // namespace tpm
