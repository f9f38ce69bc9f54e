#include "tpm/organ/balance/stage_balance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/dense_algebra.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr int kMostIterations = 25;
constexpr int kTooManyIterations = 8;  // a new factorisation is cheaper
// Times what a step may err, a tenth of the run's tolerance: a bound of what the last correction
// mends; and where it leaves no more than that if it shrinks as much as before, which it need not.
constexpr double kLeftToCorrect = 3.0, kLeftIfShrinking = 8.0;
constexpr double kMixingShare = 0.8;  // of what relaxes on average: what relaxes less is overdone
constexpr double kHopeless = 10.0;    // times the tolerance: an error that no balance mends
constexpr int kLastHopeless = 2;      // iterations after which only the balance decides
constexpr Eigen::Index kAndersonDepth = 7;
// Largest motion of a driven sphere in one step of a load: beyond, it may have snapped to another
// place.
constexpr double kLongestMove = 0.25;    // of a bond
constexpr double kSnap = 2.0;            // times what the stiffness says
constexpr double kRoundings = 8.0;       // roundings of a coordinate that no balance gets below
constexpr double kLeastBalance = 1e-12;  // of an equilibrium, in parts of the force

std::vector<double> with_start(std::vector<double> nodes) {
  nodes.insert(nodes.begin(), 0.0);
  return nodes;
}

Eigen::Map<const Eigen::RowVectorXd> by_coordinate(const Eigen::Matrix3Xd& vectors) {
  return {vectors.data(), vectors.size()};
}

}  // namespace

StageBalance::StageBalance(DrivenTissue& tissue, int stages, bool choosing)
    : tissue_(tissue),
      stages_(stages),
      choosing_(choosing),
      coordinates_(3 * static_cast<Eigen::Index>(tissue.constraints().size())),
      bonds_(tissue.bonds()),
      inner_(radau_nodes(stages)),
      full_(with_start(inner_.nodes())),
      factor_(tissue.equilibrium()),
      anderson_(coordinates_ * kLanes, kAndersonDepth),
      x_(kLanes, coordinates_),
      d_(kLanes, coordinates_),
      force_(kLanes, coordinates_) {
  for (int lane = 0; lane < kLanes; ++lane) {
    lane_nodes_[static_cast<std::size_t>(lane)] = node(lane);
    stage_places_.push_back(full_.place(node(lane)));
  }
  choose_error_places();
}

double StageBalance::node(int lane) const {
  return inner_.nodes()[static_cast<std::size_t>(std::min(lane, stages_ - 1))];
}

void StageBalance::begin(const TissueState& rest, double h, double peak) {
  set_weights(h);
  const double unit =
      refactorise(rest, relaxation_factor_of_step())
          ? tissue_.relaxed_response(
                rest, Eigen::Map<const Eigen::Matrix3Xd>(lane_field_.data(), 3, coordinates_ / 3))
          : tissue_.linear_response(rest, 1.0);
  unit_response_ = std::abs(unit);
  scale_ = std::abs(unit * peak);
  per_beside_.clear();
  const ViscousState all_relaxed{Eigen::VectorXd::Zero(rest.mean.size()), 1.0};
  for (std::size_t g = 1; g < tissue_.groups() && factorised_; ++g) {
    const double of_group =
        tissue_.path().peak(g) *
        tissue_.relaxed_response(rest, tissue_.unit_field(rest, all_relaxed, g).displacement, g);
    per_beside_.push_back(of_group > 0.0 ? scale_ / of_group : 1.0);
  }
  if (!per_beside_.empty()) factorised_ = false;  // to be weighed with these
}

TissueMove StageBalance::move(TissueState& state, double imposed, bool relaxed, double tolerance) {
  const ViscousState viscous_state{
      relaxed ? Eigen::VectorXd(Eigen::VectorXd::Zero(state.mean.size())) : state.mean,
      relaxed ? 1.0 : 0.0};
  Positions position = state.position;
  tissue_.impose(position, imposed);
  const auto furthest_m = furthest_depth_changes_m(state, viscous_state, imposed);
  if (!furthest_m) return TissueMove::unbalanced;
  Eigen::Matrix3Xd load;
  tissue_.load(imposed, load);
  // A force error of this size is within the tolerance whatever it acts on; below the least one
  // the rounding of positions decides. Also where a load is taken off.
  const double force_scale =
      tissue_.depth_driven()
          ? scale_
          : std::max(std::abs(tissue_.path().value(0, imposed)), scale_ / unit_response_);
  const EquilibriumSearch search = tissue_.equilibrium().find(
      position, viscous_state, load, std::max(tolerance, kLeastBalance) * force_scale);
  work_.factorisations += search.factorisations;
  work_.back_solves += search.iterations;
  factorised_ = false;
  last_rate_.reset();
  if (!search.stable) return TissueMove::unstable;
  if (!search.converged) return TissueMove::unbalanced;
  for (std::size_t g = 0; g < furthest_m->size(); ++g) {
    const double change_m = std::abs(tissue_.depth_of(position - state.position, g));
    if (change_m > (*furthest_m)[g]) return TissueMove::unbalanced;
  }
  state.imposed = imposed;
  state.position = std::move(position);
  tissue_.bonds().followed(state.position, state.followed);
  if (relaxed) state.set_equilibrium();
  state.closed = tissue_.bonds().closed_contacts(state.position);
  return TissueMove::done;
}

std::optional<std::vector<double>> StageBalance::furthest_depth_changes_m(
    const TissueState& state, const ViscousState& viscous_state, double imposed) {
  const BondSystem& bonds = tissue_.bonds();
  const auto joined = static_cast<Eigen::Index>(bonds.first_contact());
  const double longest_m = kLongestMove * bonds.rest_length_m().head(joined).mean();
  const ImposedPath& path = tissue_.path();
  std::vector<double> furthest_m(tissue_.groups(), std::numeric_limits<double>::infinity());
  bool factorised = false;
  for (std::size_t g = 0; g < tissue_.groups(); ++g) {
    const double change = path.value(g, imposed) - path.value(g, state.imposed);
    if (tissue_.depth_driven(g) || change == 0.0) continue;
    if (!factorised) {
      ++work_.factorisations;
      factorised = tissue_.equilibrium().factorise(state.position, viscous_state);
      if (!factorised) return std::nullopt;
    }
    const double expected_m =
        std::abs(change * tissue_.unit_field(state, viscous_state, g).stiffness);
    if (expected_m > longest_m) return std::nullopt;
    // Other motions beside a load move it, too: by how much is not known from the load alone.
    furthest_m[g] = path.single() ? std::min(kSnap * expected_m, longest_m) : longest_m;
  }
  return furthest_m;
}

void StageBalance::set_weights(double h) {
  weights_ = weights_at(stage_places_, lane_nodes_, h);
  set_error_weights(h);
}

RelaxationFactor StageBalance::relaxation_factor_of_step() const {
  std::vector<double> of_law(tissue_.bonds().laws().size(), 0.0);
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    of_law[bonds_.groups()[i].law] = weights_[i].mean.of_stages.diagonal().head(stages_).mean();
  }
  return of_law.size() == 1 ? RelaxationFactor(of_law.front())
                            : RelaxationFactor(std::move(of_law));
}

double StageBalance::difference(const RelaxationFactor& a, const RelaxationFactor& b) const {
  double largest = 0.0;
  for (const LaneBonds::Group& group : bonds_.groups()) {
    largest = std::max(largest, std::abs(a(group.law) - b(group.law)));
  }
  return largest;
}

bool StageBalance::refactorise(const TissueState& state,
                               const RelaxationFactor& relaxation_factor) {
  relaxation_factor_ = relaxation_factor;
  // The same viscous elongations at this instant, of which a share follows.
  const ViscousState viscous_state =
      tissue_.bonds().viscous_state_at(state.mean, state.followed, relaxation_factor, state.closed);
  ++work_.factorisations;
  Equilibrium& equilibrium = tissue_.equilibrium();
  factorised_ = equilibrium.factorise(state.position, viscous_state) && equilibrium.is_stable();
  if (!factorised_) return false;
  factor_.take();
  const DrivenTissue::UnitField field = tissue_.unit_field(state, viscous_state);
  lane_field_ = by_coordinate(field.displacement);
  ++work_.back_solves;
  Eigen::VectorXd change;
  tissue_.bonds().elongation_changes(state.position, field.adjoint, change);
  adjoint_ =
      tissue_.adjoint_sign() * bonds_.of_relaxing(change.cwiseProduct(tissue_.bonds().relaxing()));
  rounding_ =
      kRoundings * std::numeric_limits<double>::epsilon() * state.position.cwiseAbs().maxCoeff();
  if (tissue_.depth_driven()) rounding_ *= tissue_.held_stiffness(state.position, viscous_state);
  set_relaxing_shares(state, change, field);
  if (!per_beside_.empty()) weigh_groups_beside(state, viscous_state);
  last_iterations_ = 0;
  return true;
}

void StageBalance::weigh_groups_beside(const TissueState& state,
                                       const ViscousState& viscous_state) {
  double bound = std::sqrt(bounding_stiffness_);
  Eigen::VectorXd slope;
  tissue_.bonds().kernel_slopes(state.position, slope);
  const Eigen::VectorXd relaxing = tissue_.bonds().relaxing().cwiseProduct(slope).cwiseMax(0.0);
  for (std::size_t g = 1; g < tissue_.groups(); ++g) {
    const DrivenTissue::UnitField field = tissue_.unit_field(state, viscous_state, g);
    ++work_.back_solves;
    Eigen::VectorXd change;
    tissue_.bonds().elongation_changes(state.position, field.adjoint, change);
    const double weight = per_beside_[g - 1];
    adjoint_ += weight * tissue_.adjoint_sign(g) *
                bonds_.of_relaxing(change.cwiseProduct(tissue_.bonds().relaxing()));
    bound += weight * std::sqrt(std::max(field.stiffness, 0.0) + change.cwiseAbs2().dot(relaxing));
  }
  bounding_stiffness_ = bound * bound;
}

void StageBalance::set_relaxing_shares(const TissueState& state, const Eigen::VectorXd& change,
                                       const DrivenTissue::UnitField& field) {
  Eigen::VectorXd slope;
  tissue_.bonds().kernel_slopes(state.position, slope);
  relaxing_share_.assign(tissue_.bonds().laws().size(), 0.0);
  double whole = field.whole;
  double relaxing = 0.0;
  for (const std::size_t bond : bonds_.relaxing_bonds()) {
    const auto i = static_cast<Eigen::Index>(bond);
    const std::size_t law = tissue_.bonds().law_of(bond);
    const double stiffness = std::max(tissue_.bonds().relaxing()[i] * slope[i], 0.0);
    const double energy = stiffness * change[i] * change[i];
    relaxing_share_[law] += energy;
    relaxing += energy;
    whole += relaxation_factor_(law) * energy;
  }
  // Compressed bonds can take more than they give; what relaxes is no more than all.
  const double most = std::max(whole, relaxing);
  for (double& share : relaxing_share_) share = most > 0.0 ? kMixingShare * share / most : 0.0;
  // Of the response to what is left, and to what follows it.
  bounding_stiffness_ = field.stiffness + relaxing;
}

LaneSquare StageBalance::mixing(const StepWeights& weights) const {
  LaneSquare coupled = LaneSquare::Identity();
  double factorised = 1.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const std::size_t law = bonds_.groups()[i].law;
    coupled -= relaxing_share_[law] * weights[i].mean.of_stages;
    factorised -= relaxing_share_[law] * relaxation_factor_(law);
  }
  LaneSquare mixing = factorised * solve_square(coupled, LaneSquare::Identity());
  for (Eigen::Index lane = stages_; lane < kLanes; ++lane)
    mixing.row(lane) = mixing.row(stages_ - 1);
  return mixing;
}

double StageBalance::correction(const LaneMatrix& force, const LaneSquare& mixing, LaneMatrix& d) {
  solved_ = force;
  factor_.solve(solved_);
  tissue_.constraints().project(solved_);
  mix_lanes(mixing, solved_, d);
  const double energy = solved_.cwiseProduct(force).rowwise().sum().maxCoeff();
  return std::isfinite(energy) ? std::sqrt(std::max(energy, 0.0) * bounding_stiffness_) : energy;
}

void StageBalance::require_factor(const TissueState& state,
                                  const RelaxationFactor& relaxation_factor) {
  if (factorised_ && difference(relaxation_factor_, relaxation_factor) == 0.0) return;
  if (refactorise(state, relaxation_factor)) return;
  throw Error(ExitCode::numerical, "network",
              "the stiffness behind a jump is not positive: its derivatives do not exist");
}

void StageBalance::predict(const TissueState& state, double h, double rate) {
  LaneVector since, as_before;
  for (int lane = 0; lane < kLanes; ++lane) {
    since[lane] = h * node(lane);
    as_before[lane] = last_rate_ == rate ? std::min(since[lane], last_h_) : 0.0;
  }
  imposed_ = (rate * since).array() + state.imposed;
  if (tissue_.path().single()) {
    x_.noalias() = rate * (since - as_before) * lane_field_;
  } else {
    x_.setZero();  // the first correction brings what other groups move
  }
  if (as_before[0] > 0.0) x_.noalias() += as_before * last_velocity_;
  // Only what is free moves: rounding would make fixed spheres drift.
  tissue_.constraints().project(x_);
  x_.rowwise() += start_;
  tissue_.impose(x_, imposed_);
}

void StageBalance::update_viscous() {
  bonds_.followed(x_, followed_);
  apply(weights_, followed_, begin_, known_, mean_viscous_);
}

void StageBalance::residuals() {
  force_.setZero();
  tissue_.add_load(imposed_, force_);
  if (bonds_.is_linear()) {
    bonds_.add_forces_of_stages(x_, following_, followed_, force_);
  } else {
    update_viscous();
    bonds_.add_forces(x_, mean_viscous_, force_);
  }
  plain_response_ = tissue_.response(x_, force_);
  tissue_.constraints().project(force_);
  imbalance_ = correction(force_, mixing_, d_);
  work_.back_solves += stages_;
  ++work_.iterations;
}

StageBalance::Balance StageBalance::balance(double allowed) {
  anderson_.restart();
  double first = 0.0;
  double before = 0.0;
  for (int i = 0; i < kMostIterations; ++i) {
    residuals();
    last_iterations_ = i;
    if (!std::isfinite(imbalance_)) return Balance::failed;
    left_ = imbalance_ * (i > 0 ? std::min(1.0, imbalance_ / before) : 1.0);
    if (imbalance_ <= std::max(kLeftToCorrect * allowed, rounding_) ||
        (imbalance_ <= kLeftIfShrinking * allowed && left_ <= allowed)) {
      // Of the last correction the adjoint knows what it does to the response.
      end_response_ = plain_response_[stages_ - 1] +
                      tissue_.adjoint_sign() * force_.row(stages_ - 1).dot(lane_field_);
      x_ += d_;  // the correction is known: it costs nothing
      return Balance::found;
    }
    if (choosing_ && i > 0 && i <= kLastHopeless &&
        error() > kHopeless * (kLeftToCorrect * allowed + imbalance_)) {
      return Balance::hopeless;
    }
    if (i == 0) first = imbalance_;
    if (i > 3 && imbalance_ > 10.0 * first) return Balance::failed;
    before = imbalance_;
    anderson_.step(flat(x_), flat(d_));
  }
  return Balance::failed;
}

StepOutcome StageBalance::try_step(const TissueState& state, double h, double rate,
                                   double tolerance) {
  set_weights(h);
  StepOutcome outcome;
  const RelaxationFactor relaxation_factor = relaxation_factor_of_step();
  const bool stale = !factorised_ || last_iterations_ > kTooManyIterations;
  if (stale && !refactorise(state, relaxation_factor)) {
    outcome.unstable = true;
    return outcome;
  }
  closed_ = state.closed;
  bonds_.close_contacts(closed_);
  start_ = by_coordinate(state.position);
  begin_ = start_of(state);
  find_known(weights_, begin_, known_);
  set_following();
  mixing_ = mixing(weights_);
  predict(state, h, rate);
  outcome.allowed = tolerance * scale_;
  const Balance balanced = balance(outcome.allowed);
  outcome.balanced = balanced != Balance::failed;
  if (!outcome.balanced) {
    factorised_ = false;
    return outcome;
  }
  if (balanced == Balance::found) bonds_.followed(x_, followed_);
  outcome.error = std::max(error(), 1e-12 * outcome.allowed);
  outcome.left = left_;
  outcome.accepted =
      balanced == Balance::found && outcome.error <= std::max(outcome.allowed, rounding_);
  return outcome;
}

LaneMatrix StageBalance::aging(const Places& places, std::span<const double> fractions, double h,
                               std::size_t group, std::size_t branch) const {
  // m depends on z = h / tau by its weights and by what is left of the start, exp(-z c) m0.
  const auto [law, first, count] = bonds_.groups()[group];
  const double z = h / tissue_.bonds().laws()[law].branches[branch].relaxation_time_s;
  LaneSquare slopes = LaneSquare::Zero();
  LaneVector start_slope, decay_slope;
  for (int lane = 0; lane < kLanes; ++lane) {
    const std::size_t place = std::min(static_cast<std::size_t>(lane), fractions.size() - 1);
    const double c = fractions[place];
    const Eigen::VectorXd slope = places[place].weight_slopes(z);
    start_slope[lane] = slope[0];
    slopes.row(lane).head(stages_) = slope.tail(stages_).transpose();
    decay_slope[lane] = -c * std::exp(-z * c);
  }
  LaneMatrix change = slopes * followed_.middleCols(first, count);
  change.noalias() += start_slope * begin_.followed.segment(first, count);
  change.noalias() +=
      decay_slope * begin_.viscous.row(static_cast<Eigen::Index>(branch)).segment(first, count);
  return -z * change;
}

double StageBalance::accept(TissueState& state, double h, double rate) {
  const int middle = (stages_ - 1) / 2;
  last_velocity_ = (x_.row(stages_ - 1) - x_.row(middle)) / (h * (1.0 - node(middle)));
  last_h_ = h;
  last_rate_ = rate;
  state.time_s += h;
  state.imposed += h * rate;
  const Eigen::RowVectorXd end = x_.row(stages_ - 1);
  state.position = Eigen::Map<const Positions>(end.data(), 3, coordinates_ / 3);
  tissue_.bonds().followed(state.position, state.followed);
  Eigen::MatrixXd viscous;
  viscous_in_lane(weights_, followed_, begin_, stages_ - 1, viscous);
  put_viscous(viscous, state.viscous);
  state.mean = tissue_.bonds().mean_viscous(state.viscous);
  ++work_.steps;
  see(end_response_);
  return end_response_;
}

}  // namespace tpm::organ
