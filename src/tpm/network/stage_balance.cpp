#include "tpm/network/stage_balance.hpp"

#include <algorithm>
#include <cmath>

namespace tpm {
namespace {

constexpr int kMostIterations = 25;
constexpr int kTooManyIterations = 8;     // a new factorisation pays
constexpr double kFollowingChange = 0.2;  // likewise
constexpr double kBalanceShare = 0.1;     // of a step's tolerance, for what is left unbalanced
constexpr double kFurthestExtrapolation = 1.0;  // of the step before
constexpr Eigen::Index kMemoryDepth = 6;

std::vector<double> with_start(std::vector<double> nodes) {
  nodes.insert(nodes.begin(), 0.0);
  return nodes;
}

}  // namespace

DrivenTissue::DrivenTissue(const BondSystem& bonds, Positions rest, Freedom freedom,
                           const Probe& probe, Drive drive)
    : bonds_(bonds),
      rest_(std::move(rest)),
      freedom_(std::move(freedom)),
      probe_(probe),
      drive_(drive),
      equilibrium_(bonds_, freedom_) {
  if (depth_driven()) freedom_.impose(probe.sphere, probe.direction);
}

TissueState DrivenTissue::at_rest(double time_s) const {
  TissueState state;
  state.time_s = time_s;
  state.position = rest_;
  bonds_.elongations(rest_, state.elongation);
  state.remembered = Eigen::VectorXd::Zero(state.elongation.size());
  return state;
}

void DrivenTissue::impose(Positions& position, double imposed) const {
  if (!depth_driven()) return;
  const auto column = static_cast<Eigen::Index>(probe_.sphere);
  const double depth = (position.col(column) - rest_.col(column)).dot(probe_.direction);
  position.col(column) += (imposed - depth) * probe_.direction;
}

void DrivenTissue::load(double imposed, Eigen::Matrix3Xd& force) const {
  force.setZero(3, rest_.cols());
  if (depth_driven()) return;
  force.col(static_cast<Eigen::Index>(probe_.sphere)) = imposed * probe_.direction;
}

double DrivenTissue::response(const Positions& position, const Eigen::Matrix3Xd& force) const {
  const auto column = static_cast<Eigen::Index>(probe_.sphere);
  if (depth_driven()) return -force.col(column).dot(probe_.direction);
  return (position.col(column) - rest_.col(column)).dot(probe_.direction);
}

double DrivenTissue::response(const TissueState& state) const {
  Eigen::Matrix3Xd force;
  load(state.imposed, force);
  bonds_.add_forces(state.position, {state.remembered, 0.0}, force);
  return response(state.position, force);
}

void DrivenTissue::unit_field(const TissueState& state, const BondMemory& memory,
                              Eigen::Matrix3Xd& field, double& stiffness) const {
  const auto column = static_cast<Eigen::Index>(probe_.sphere);
  Eigen::Matrix3Xd unit = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  unit.col(column) = probe_.direction;
  if (!depth_driven()) {
    field = unit;
    equilibrium_.displace(field);
    stiffness = field.col(column).dot(probe_.direction);
    return;
  }
  Eigen::Matrix3Xd pushed = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  bonds_.add_stiffness_times(state.position, memory, unit, pushed);
  field = -pushed;
  equilibrium_.displace(field);
  stiffness = -pushed.cwiseProduct(field).sum();
  field += unit;
}

double DrivenTissue::linear_response(const TissueState& rest, double peak) {
  const BondMemory relaxed{Eigen::VectorXd::Zero(rest.elongation.size()), 1.0};
  Eigen::Matrix3Xd field;
  double path = 0.0;
  if (!equilibrium_.factorise(rest.position, relaxed)) return 0.0;
  unit_field(rest, relaxed, field, path);
  if (!depth_driven()) return path * peak;
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  bonds_.add_stiffness_times(rest.position, relaxed, field, force);
  return force.col(static_cast<Eigen::Index>(probe_.sphere)).dot(probe_.direction) * peak;
}

StageBalance::StageBalance(DrivenTissue& tissue, int stages)
    : tissue_(tissue),
      stages_(stages),
      coordinates_(3 * static_cast<Eigen::Index>(tissue.freedom().size())),
      full_(with_start(radau_nodes(stages))),
      inner_(radau_nodes(stages)),
      anderson_(coordinates_ * stages, kMemoryDepth),
      x_(coordinates_ * stages),
      d_(coordinates_ * stages) {
  const auto bonds = static_cast<Eigen::Index>(tissue.bonds().size());
  elongation_.resize(bonds, stages + 1);
  remembered_.resize(bonds, stages);
  weights_.resize(stages + 1, stages);
  decay_.resize(stages);
  imposed_.resize(static_cast<std::size_t>(stages));
}

Eigen::Map<Positions> StageBalance::stage(Eigen::Index j) {
  return {x_.data() + j * coordinates_, 3, coordinates_ / 3};
}

TissueMove StageBalance::move(TissueState& state, double imposed, bool relaxed, double tolerance) {
  const BondMemory memory{
      relaxed ? Eigen::VectorXd(Eigen::VectorXd::Zero(state.remembered.size())) : state.remembered,
      relaxed ? 1.0 : 0.0};
  Positions position = state.position;
  tissue_.impose(position, imposed);
  Eigen::Matrix3Xd load;
  tissue_.load(imposed, load);
  // A force error of this size is within the tolerance whatever it acts on.
  const double force_scale = tissue_.depth_driven() ? scale_ : std::abs(imposed);
  const EquilibriumSearch search =
      tissue_.equilibrium().find(position, memory, load, tolerance * force_scale);
  work_.factorisations += search.factorisations;
  work_.back_solves += search.iterations;
  factorised_ = false;
  has_last_ = false;
  if (!search.stable) return TissueMove::unstable;
  if (!search.converged) return TissueMove::unbalanced;
  state.imposed = imposed;
  state.position = std::move(position);
  tissue_.bonds().elongations(state.position, state.elongation);
  if (relaxed) state.remembered = state.elongation;
  return TissueMove::done;
}

bool StageBalance::refactorise(const TissueState& state, double following) {
  const BondSystem& bonds = tissue_.bonds();
  following_ = following;
  // The same memory at this instant, of which a share follows.
  memory_.following = following;
  memory_.offset = state.remembered - following * state.elongation;
  ++work_.factorisations;
  factorised_ =
      tissue_.equilibrium().factorise(state.position, memory_) && tissue_.equilibrium().is_stable();
  if (!factorised_) return false;
  tissue_.unit_field(state, memory_, field_, path_stiffness_);
  ++work_.back_solves;
  bonds.elongation_changes(state.position, field_, goal_);
  goal_ = tissue_.adjoint_sign() * goal_.cwiseProduct(bonds.relaxing());
  last_iterations_ = 0;
  return true;
}

void StageBalance::predict(const TissueState& state, double h, double rate) {
  for (Eigen::Index j = 0; j < stages_; ++j) {
    const double c = inner_.nodes()[static_cast<std::size_t>(j)];
    imposed_[static_cast<std::size_t>(j)] = state.imposed + c * h * rate;
    auto x = stage(j);
    if (has_last_ && last_rate_ == rate) {
      // Only what is free moves: rounding in the extrapolation would make held spheres drift.
      const double ahead = std::min(c * h / last_h_, kFurthestExtrapolation);
      const Eigen::VectorXd path = last_path_ * full_.interpolation(1.0 + ahead);
      Eigen::Matrix3Xd moved =
          Eigen::Map<const Positions>(path.data(), 3, coordinates_ / 3) - state.position;
      tissue_.freedom().project(moved);
      x = state.position + moved;
    } else {
      x = state.position + c * h * rate * field_;
    }
    Positions imposed = x;
    tissue_.impose(imposed, imposed_[static_cast<std::size_t>(j)]);
    x = imposed;
  }
}

void StageBalance::residuals(const TissueState& state) {
  const BondSystem& bonds = tissue_.bonds();
  Eigen::VectorXd column;
  for (Eigen::Index j = 0; j < stages_; ++j) {
    bonds.elongations(stage(j), column);
    elongation_.col(j + 1) = column;
  }
  remembered_.noalias() = elongation_ * weights_;
  remembered_.noalias() += state.remembered * decay_.transpose();
  imbalance_ = 0.0;
  memory_.following = 0.0;
  for (Eigen::Index j = 0; j < stages_; ++j) {
    tissue_.load(imposed_[static_cast<std::size_t>(j)], force_);
    memory_.offset = remembered_.col(j);
    bonds.add_forces(stage(j), memory_, force_);
    tissue_.freedom().project(force_);
    Eigen::Map<Eigen::Matrix3Xd> d(d_.data() + j * coordinates_, 3, coordinates_ / 3);
    d = force_;
    tissue_.equilibrium().displace(d);
    imbalance_ = std::max(imbalance_, d.cwiseProduct(force_).sum());
  }
  work_.back_solves += stages_;
  ++work_.iterations;
  imbalance_ = std::sqrt(std::max(imbalance_, 0.0) * path_stiffness_);
}

bool StageBalance::balance(const TissueState& state, double tolerance) {
  anderson_.restart();
  double first = 0.0;
  for (int i = 0; i < kMostIterations; ++i) {
    residuals(state);
    last_iterations_ = i;
    if (!std::isfinite(imbalance_)) return false;
    if (imbalance_ <= tolerance) {
      x_ += d_;  // the correction is known: it costs nothing
      return true;
    }
    if (i == 0) first = imbalance_;
    if (i > 3 && imbalance_ > 10.0 * first) return false;
    anderson_.step(x_, d_);
  }
  return false;
}

double StageBalance::error_of(double z) const {
  // Judged where outputs are taken from: at the stages, of which the last is more accurate than
  // the others, and before the first of them, where a step that is long against the relaxation
  // time hides how the tissue settles after a change of rate.
  const double first = inner_.nodes().front();
  double worst = 0.0;
  const auto judge = [&](double c) {
    Eigen::VectorXd difference = full_.weights(c, z);
    difference.tail(stages_) -= inner_.weights(c, z);
    const Eigen::VectorXd change = goal_.cwiseProduct(elongation_ * difference);
    worst = std::max(worst, std::abs(change.sum()) + 0.1 * change.lpNorm<1>());
  };
  judge(0.25 * first);
  judge(0.5 * first);
  for (const double c : inner_.nodes()) judge(c);
  return worst;
}

StepOutcome StageBalance::try_step(const TissueState& state, double h, double rate,
                                   double tolerance) {
  const double z = h / tissue_.bonds().relaxation_time_s();
  double following = 0.0;
  for (Eigen::Index j = 0; j < stages_; ++j) {
    const double c = inner_.nodes()[static_cast<std::size_t>(j)];
    weights_.col(j) = full_.weights(c, z);
    decay_[j] = std::exp(-z * c);
    following += weights_(j + 1, j) / stages_;
  }
  StepOutcome outcome;
  const bool stale = !factorised_ || last_iterations_ > kTooManyIterations ||
                     std::abs(following - following_) > kFollowingChange;
  if (stale && !refactorise(state, following)) {
    outcome.unstable = true;
    return outcome;
  }
  elongation_.col(0) = state.elongation;
  predict(state, h, rate);
  outcome.balanced = balance(state, kBalanceShare * tolerance * scale_);
  if (!outcome.balanced) {
    factorised_ = false;
    return outcome;
  }
  Eigen::VectorXd column;
  for (Eigen::Index j = 0; j < stages_; ++j) {
    tissue_.bonds().elongations(stage(j), column);
    elongation_.col(j + 1) = column;
  }
  remembered_.noalias() = elongation_ * weights_;
  remembered_.noalias() += state.remembered * decay_.transpose();
  outcome.error = error_of(z);
  const double allowed = tolerance * scale_;
  outcome.accepted = outcome.error <= allowed;
  outcome.growth = std::pow(allowed / std::max(outcome.error, 1e-30), 1.0 / (stages_ + 1));
  return outcome;
}

double StageBalance::corrected_response(const Positions& position, const BondMemory& memory,
                                        double imposed) {
  tissue_.load(imposed, force_);
  tissue_.bonds().add_forces(position, memory, force_);
  const double plain = tissue_.response(position, force_);
  tissue_.freedom().project(force_);
  return plain + tissue_.adjoint_sign() * field_.cwiseProduct(force_).sum();
}

double StageBalance::response_within(const TissueState& state, double c, double h, double rate) {
  const double z = h / tissue_.bonds().relaxation_time_s();
  const Eigen::VectorXd shape = full_.interpolation(c);
  Positions position = shape[0] * state.position;
  for (Eigen::Index j = 0; j < stages_; ++j) position += shape[j + 1] * stage(j);
  memory_.following = 0.0;
  memory_.offset = elongation_ * full_.weights(c, z) + std::exp(-z * c) * state.remembered;
  return corrected_response(position, memory_, state.imposed + c * h * rate);
}

void StageBalance::accept(TissueState& state, double h, double rate) {
  last_path_.resize(coordinates_, stages_ + 1);
  last_path_.col(0) = Eigen::Map<const Eigen::VectorXd>(state.position.data(), coordinates_);
  for (Eigen::Index j = 0; j < stages_; ++j) {
    last_path_.col(j + 1) = x_.segment(j * coordinates_, coordinates_);
  }
  has_last_ = true;
  last_h_ = h;
  last_rate_ = rate;
  state.time_s += h;
  state.imposed += h * rate;
  state.position = stage(stages_ - 1);
  state.elongation = elongation_.col(stages_);
  state.remembered = remembered_.col(stages_ - 1);
  ++work_.steps;
  see(tissue_.response(state));
}

}  // namespace tpm
