#include "tpm/network/stage_balance.hpp"

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <limits>

#include "tpm/core/error.hpp"

namespace tpm {
namespace {

constexpr int kMostIterations = 25;
constexpr int kTooManyIterations = 8;      // a new factorisation pays
constexpr double kFollowingChange = 0.45;  // likewise
constexpr double kHopeless = 10.0;         // times the tolerance: an error that no balance mends
constexpr int kLastHopeless = 2;           // iterations after which only the balance decides
constexpr double kFurthestExtrapolation = 1.0;  // of the step before
constexpr Eigen::Index kMemoryDepth = 6;
// How far what is driven may go at one step of a load: beyond, it may have snapped to another
// place.
constexpr double kLongestMove = 0.25;    // of a bond
constexpr double kSnap = 2.0;            // times what the stiffness says
constexpr double kGrains = 8.0;          // roundings of a coordinate that no balance gets below
constexpr double kLongPart = 0.25;       // of a step: its quadrature takes 16 points instead of 8
constexpr double kLeastBalance = 1e-12;  // of an equilibrium, in parts of the force

std::vector<double> with_start(std::vector<double> nodes) {
  nodes.insert(nodes.begin(), 0.0);
  return nodes;
}

/// Where a function that is below 0 at `from` and above at `to` crosses it.
template <class Function>
double root_between(const Function& function, double from, double to) {
  std::uintmax_t most = 100;
  return boost::math::tools::toms748_solve(function, from, to,
                                           boost::math::tools::eps_tolerance<double>(), most)
      .first;
}

Eigen::Map<const Eigen::RowVectorXd> by_coordinate(const Eigen::Matrix3Xd& vectors) {
  return {vectors.data(), vectors.size()};
}

}  // namespace

StageBalance::StageBalance(DrivenTissue& tissue, int stages, bool choosing)
    : tissue_(tissue),
      stages_(stages),
      choosing_(choosing),
      coordinates_(3 * static_cast<Eigen::Index>(tissue.freedom().size())),
      bonds_(tissue.bonds()),
      full_(with_start(radau_nodes(stages))),
      inner_(radau_nodes(stages)),
      factor_(tissue.equilibrium()),
      anderson_(coordinates_ * kLanes, kMemoryDepth),
      x_(kLanes, coordinates_),
      d_(kLanes, coordinates_),
      force_(kLanes, coordinates_) {}

double StageBalance::node(int lane) const {
  return inner_.nodes()[static_cast<std::size_t>(std::min(lane, stages_ - 1))];
}

TissueMove StageBalance::move(TissueState& state, double imposed, bool relaxed, double tolerance) {
  const BondMemory memory{
      relaxed ? Eigen::VectorXd(Eigen::VectorXd::Zero(state.remembered.size())) : state.remembered,
      relaxed ? 1.0 : 0.0};
  Positions position = state.position;
  tissue_.impose(position, imposed);
  const std::optional<double> furthest_m = furthest_depth_change_m(state, memory, imposed);
  if (!furthest_m) return TissueMove::unbalanced;
  Eigen::Matrix3Xd load;
  tissue_.load(imposed, load);
  // A force error of this size is within the tolerance whatever it acts on; below the least one
  // the rounding of positions decides.
  const double force_scale = tissue_.depth_driven() ? scale_ : std::abs(imposed);
  const EquilibriumSearch search = tissue_.equilibrium().find(
      position, memory, load, std::max(tolerance, kLeastBalance) * force_scale);
  work_.factorisations += search.factorisations;
  work_.back_solves += search.iterations;
  factorised_ = false;
  has_last_ = false;
  if (!search.stable) return TissueMove::unstable;
  if (!search.converged) return TissueMove::unbalanced;
  const double change_m = std::abs(tissue_.depth_of(position - state.position));
  if (change_m > *furthest_m) return TissueMove::unbalanced;
  state.imposed = imposed;
  state.position = std::move(position);
  tissue_.bonds().elongations(state.position, state.elongation);
  if (relaxed) state.remembered = state.elongation;
  state.closed = tissue_.bonds().closed_contacts(state.position);
  return TissueMove::done;
}

std::optional<double> StageBalance::furthest_depth_change_m(const TissueState& state,
                                                            const BondMemory& memory,
                                                            double imposed) {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  if (tissue_.depth_driven() || imposed == state.imposed) return kAny;
  ++work_.factorisations;
  if (!tissue_.equilibrium().factorise(state.position, memory)) return std::nullopt;
  const double expected =
      std::abs((imposed - state.imposed) * tissue_.unit_field(state, memory).stiffness);
  const BondSystem& bonds = tissue_.bonds();
  const auto joined = static_cast<Eigen::Index>(bonds.first_contact());
  const double longest = kLongestMove * bonds.rest_length_m().head(joined).mean();
  if (expected > longest) return std::nullopt;
  return std::min(kSnap * expected, longest);
}

void StageBalance::set_weights(double z) {
  weights_.of_stages.setZero();
  for (int lane = 0; lane < kLanes; ++lane) {
    const Eigen::VectorXd weight = full_.weights(node(lane), z);
    weights_.of_start[lane] = weight[0];
    weights_.of_stages.row(lane).head(stages_) = weight.tail(stages_).transpose();
    weights_.of_memory[lane] = std::exp(-z * node(lane));
  }
  // The error is judged where outputs are taken from: at the stages, of which the last is more
  // accurate than the others, and before the first of them, where a step that is long against the
  // relaxation time hides how the tissue settles after a change of rate.
  std::vector<double> places = inner_.nodes();
  places.push_back(0.25 * inner_.nodes().front());
  places.push_back(0.5 * inner_.nodes().front());
  const auto count = static_cast<Eigen::Index>(places.size());
  judge_.setZero(count, kLanes);
  judge_start_.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    Eigen::VectorXd difference = full_.weights(places[static_cast<std::size_t>(i)], z);
    difference.tail(stages_) -= inner_.weights(places[static_cast<std::size_t>(i)], z);
    judge_start_[i] = difference[0];
    judge_.row(i).head(stages_) = difference.tail(stages_).transpose();
  }
}

bool StageBalance::refactorise(const TissueState& state, double following) {
  following_ = following;
  // The same memory at this instant, of which a share follows.
  const BondMemory memory{state.remembered - following * state.elongation, following, state.closed};
  ++work_.factorisations;
  Equilibrium& equilibrium = tissue_.equilibrium();
  factorised_ = equilibrium.factorise(state.position, memory) && equilibrium.is_stable();
  if (!factorised_) return false;
  factor_.take();
  const DrivenTissue::UnitField field = tissue_.unit_field(state, memory);
  path_stiffness_ = field.stiffness;
  lane_field_ = by_coordinate(field.displacement);
  ++work_.back_solves;
  Eigen::VectorXd change;
  tissue_.bonds().elongation_changes(state.position, field.judge, change);
  goal_ =
      tissue_.adjoint_sign() * bonds_.of_relaxing(change.cwiseProduct(tissue_.bonds().relaxing()));
  grain_ = kGrains * std::numeric_limits<double>::epsilon() * state.position.cwiseAbs().maxCoeff();
  if (tissue_.depth_driven()) grain_ *= tissue_.held_stiffness(state.position, memory);
  last_iterations_ = 0;
  return true;
}

void StageBalance::require_factor(const TissueState& state, double following) {
  if (factorised_ && following_ == following) return;
  if (refactorise(state, following)) return;
  throw Error(ExitCode::numerical, "network",
              "the stiffness behind a jump is not positive: its derivatives do not exist");
}

void StageBalance::predict(const TissueState& state, double h, double rate) {
  LaneVector c;
  for (int lane = 0; lane < kLanes; ++lane) c[lane] = node(lane);
  imposed_ = (h * rate * c).array() + state.imposed;
  if (has_last_ && last_rate_ == rate) {
    Eigen::Matrix<double, kLanes, kLanes> shape = Eigen::Matrix<double, kLanes, kLanes>::Zero();
    for (int lane = 0; lane < kLanes; ++lane) {
      const double ahead = std::min(c[lane] * h / last_h_, kFurthestExtrapolation);
      const Eigen::VectorXd at = full_.interpolation(1.0 + ahead);
      shape.row(lane).head(stages_) = at.tail(stages_).transpose();
    }
    // From where the step before began to each stage, less the way to where this one begins.
    x_.noalias() = shape * last_path_;
    x_.rowwise() -= last_path_.row(stages_ - 1).eval();
    // Only what is free moves: rounding would make held spheres drift.
    tissue_.freedom().project(x_);
    x_.rowwise() += start_;
  } else {
    x_.noalias() = h * rate * c * lane_field_;
    x_.rowwise() += start_;
  }
  tissue_.impose(x_, imposed_);
}

void StageBalance::update_memory() {
  bonds_.elongations(x_, elongation_);
  weights_.apply(elongation_, start_elongation_, start_memory_, memory_);
}

void StageBalance::residuals() {
  update_memory();
  force_.setZero();
  tissue_.add_load(imposed_, force_);
  bonds_.add_forces(x_, memory_, force_);
  tissue_.freedom().project(force_);
  d_ = force_;
  factor_.solve(d_);
  tissue_.freedom().project(d_);
  work_.back_solves += stages_;
  ++work_.iterations;
  const double energy = d_.cwiseProduct(force_).rowwise().sum().maxCoeff();
  imbalance_ = std::sqrt(std::max(energy, 0.0) * path_stiffness_);
  if (!std::isfinite(energy)) imbalance_ = energy;
}

StageBalance::Balance StageBalance::balance(double tolerance) {
  anderson_.restart();
  double first = 0.0;
  for (int i = 0; i < kMostIterations; ++i) {
    residuals();
    last_iterations_ = i;
    if (!std::isfinite(imbalance_)) return Balance::failed;
    if (imbalance_ <= tolerance) {
      x_ += d_;  // the correction is known: it costs nothing
      return Balance::found;
    }
    if (choosing_ && i > 0 && i <= kLastHopeless &&
        error() > kHopeless * (tolerance + imbalance_)) {
      return Balance::hopeless;
    }
    if (i == 0) first = imbalance_;
    if (i > 3 && imbalance_ > 10.0 * first) return Balance::failed;
    anderson_.step(flat(x_), flat(d_));
  }
  return Balance::failed;
}

double StageBalance::error() const {
  Eigen::MatrixXd change = judge_ * elongation_;
  change.noalias() += judge_start_ * start_elongation_;
  const Eigen::VectorXd sum = change * goal_;
  const Eigen::VectorXd size = change.cwiseAbs() * goal_.cwiseAbs();
  return (sum.cwiseAbs() + 0.1 * size).maxCoeff();
}

StepOutcome StageBalance::try_step(const TissueState& state, double h, double rate,
                                   double tolerance) {
  set_weights(h / tissue_.bonds().relaxation_time_s());
  StepOutcome outcome;
  const double following = weights_.of_stages.diagonal().head(stages_).mean();
  const bool stale = !factorised_ || last_iterations_ > kTooManyIterations ||
                     std::abs(following - following_) > kFollowingChange;
  if (stale && !refactorise(state, following)) {
    outcome.unstable = true;
    return outcome;
  }
  closed_ = state.closed;
  bonds_.close_contacts(closed_);
  start_ = by_coordinate(state.position);
  start_elongation_ = bonds_.of_relaxing(state.elongation).transpose();
  start_memory_ = bonds_.of_relaxing(state.remembered).transpose();
  predict(state, h, rate);
  outcome.allowed = tolerance * scale_;
  const Balance balanced = balance(std::max(outcome.allowed, grain_));
  outcome.balanced = balanced != Balance::failed;
  if (!outcome.balanced) {
    factorised_ = false;
    return outcome;
  }
  if (balanced == Balance::found) update_memory();
  outcome.error = std::max(error(), 1e-12 * outcome.allowed);
  outcome.accepted =
      balanced == Balance::found && outcome.error <= std::max(outcome.allowed, grain_);
  return outcome;
}

double StageBalance::gap_m(const ToolContact& contact, double fraction) const {
  const Eigen::RowVectorXd shape = full_.interpolation(fraction).tail(stages_).transpose();
  const auto place = [&](std::uint32_t column) -> Eigen::RowVector3d {
    const Eigen::Index first = 3 * static_cast<Eigen::Index>(column);
    const Eigen::RowVector3d start = start_.segment<3>(first);
    return start + shape * (x_.middleCols<3>(first).topRows(stages_).rowwise() - start);
  };
  return contact_gap_m(contact, place(contact.sphere).transpose(), place(contact.tool).transpose());
}

std::optional<ContactChange> StageBalance::contact_change(double tolerance) const {
  const auto& contacts = tissue_.bonds().contacts();
  // Errors of force and length that change the response by the tolerance.
  const double of_response = tolerance * scale_;
  const double of_imposed = of_response / unit_response_;
  const double length = tissue_.depth_driven() ? of_imposed : of_response;
  const double force = tissue_.depth_driven() ? of_response : of_imposed;
  std::optional<ContactChange> first;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const bool closed = closed_[i] != 0;
    // How far on the wrong side it is: a closed contact that pulls, an open one that overlaps.
    const auto wrong = [&](double fraction) {
      const double gap = gap_m(contacts[i], fraction);
      return closed ? gap : -gap;
    };
    const double allowed = closed ? force / contacts[i].stiffness_N_per_m : length;
    double before = 0.0;
    for (int stage = 0; stage < stages_; ++stage) {
      const double at = node(stage);
      if (first && before >= first->fraction) break;
      if (wrong(at) > allowed) {
        const double crossing = wrong(before) < 0.0 ? root_between(wrong, before, at) : before;
        if (!first || crossing < first->fraction) first = ContactChange{i, crossing};
        break;
      }
      before = at;
    }
  }
  return first;
}

void StageBalance::change_contact(TissueState& state, std::size_t contact) {
  state.closed[contact] = state.closed[contact] != 0 ? 0 : 1;
  ++work_.contact_changes;
  factorised_ = false;
  has_last_ = false;
}

StageBalance::Shapes StageBalance::shapes(std::span<const double> fractions, double z) const {
  Shapes shapes;
  shapes.interpolation.setZero();
  shapes.memory.of_stages.setZero();
  for (int lane = 0; lane < kLanes; ++lane) {
    const double c = fractions[std::min(static_cast<std::size_t>(lane), fractions.size() - 1)];
    const Eigen::VectorXd weight = full_.weights(c, z);
    shapes.interpolation.row(lane).head(stages_) = full_.interpolation(c).tail(stages_).transpose();
    shapes.memory.of_start[lane] = weight[0];
    shapes.memory.of_stages.row(lane).head(stages_) = weight.tail(stages_).transpose();
    shapes.memory.of_memory[lane] = std::exp(-z * c);
  }
  return shapes;
}

std::array<double, kLanes> StageBalance::lane_nodes() const {
  std::array<double, kLanes> nodes{};
  for (int lane = 0; lane < kLanes; ++lane) nodes[static_cast<std::size_t>(lane)] = node(lane);
  return nodes;
}

LaneMatrix StageBalance::aging(std::span<const double> fractions, double z) const {
  // y depends on z = h / tau by its weights and by what is left of the start, exp(-z c) y0.
  Eigen::Matrix<double, kLanes, kLanes> slopes = Eigen::Matrix<double, kLanes, kLanes>::Zero();
  LaneVector start_slope, decay_slope;
  for (int lane = 0; lane < kLanes; ++lane) {
    const double c = fractions[std::min(static_cast<std::size_t>(lane), fractions.size() - 1)];
    const Eigen::VectorXd slope = full_.weight_slopes(c, z);
    start_slope[lane] = slope[0];
    slopes.row(lane).head(stages_) = slope.tail(stages_).transpose();
    decay_slope[lane] = -c * std::exp(-z * c);
  }
  LaneMatrix change = slopes * elongation_;
  change.noalias() += start_slope * start_elongation_;
  change.noalias() += decay_slope * start_memory_;
  return -z * change;
}

StageBalance::Within StageBalance::within(const TissueState& state,
                                          std::span<const double> fractions, double h,
                                          double rate) const {
  const Shapes at = shapes(fractions, h / tissue_.bonds().relaxation_time_s());
  Within states;
  for (int lane = 0; lane < kLanes; ++lane) {
    const double c = fractions[std::min(static_cast<std::size_t>(lane), fractions.size() - 1)];
    states.imposed[lane] = state.imposed + c * h * rate;
  }
  // Of displacements, not of coordinates, for the sake of rounding.
  states.position.noalias() = at.interpolation * (x_.rowwise() - start_);
  states.position.rowwise() += start_;
  bonds_.elongations(states.position, states.elongation);
  at.memory.apply(elongation_, start_elongation_, start_memory_, states.memory);
  return states;
}

LaneVector StageBalance::responses(const Within& states) {
  force_.setZero();
  tissue_.add_load(states.imposed, force_);
  bonds_.add_forces(states.position, states.memory, force_);
  const LaneVector plain = tissue_.response(states.position, force_);
  tissue_.freedom().project(force_);
  return plain + tissue_.adjoint_sign() * (force_ * lane_field_.transpose());
}

LaneVector StageBalance::responses_within(const TissueState& state,
                                          std::span<const double> fractions, double h,
                                          double rate) {
  return responses(within(state, fractions, h, rate));
}

std::vector<TissueState> StageBalance::states_within(const TissueState& state,
                                                     std::span<const double> fractions, double h,
                                                     double rate) {
  Within states = within(state, fractions, h, rate);
  force_.setZero();
  tissue_.add_load(states.imposed, force_);
  bonds_.add_forces(states.position, states.memory, force_);
  tissue_.freedom().project(force_);
  d_ = force_;
  factor_.solve(d_);
  tissue_.freedom().project(d_);
  std::vector<TissueState> all(fractions.size(), state);
  for (std::size_t lane = 0; lane < fractions.size(); ++lane) {
    const auto row = static_cast<Eigen::Index>(lane);
    TissueState& at = all[lane];
    ++work_.back_solves;
    at.time_s += fractions[lane] * h;
    at.imposed = states.imposed[row];
    const Eigen::RowVectorXd place = states.position.row(row) + d_.row(row);
    at.position = Eigen::Map<const Positions>(place.data(), 3, coordinates_ / 3);
    tissue_.bonds().elongations(at.position, at.elongation);
    for (std::size_t i = 0; i < bonds_.relaxing_bonds().size(); ++i) {
      at.remembered[static_cast<Eigen::Index>(bonds_.relaxing_bonds()[i])] =
          states.memory(row, static_cast<Eigen::Index>(i));
    }
  }
  return all;
}

QuasiStaticEnergy StageBalance::energy_of_step(const TissueState& state, double h, double rate,
                                               double from, double until) {
  using Long = boost::math::quadrature::gauss<double, 2 * kLanes>;
  using Short = boost::math::quadrature::gauss<double, kLanes>;
  const Eigen::VectorXd relaxing = bonds_.of_relaxing(tissue_.bonds().relaxing());
  QuasiStaticEnergy energy;
  double response_integral = 0.0;  // over the imposed value
  const double half = 0.5 * (until - from);
  std::array<double, kLanes> fractions{};
  LaneVector weight;
  const auto put = [&](std::size_t lane, double abscissa, double share) {
    fractions[lane] = from + half * (1.0 + abscissa);
    weight[static_cast<Eigen::Index>(lane)] = half * h * share;
  };
  const auto add = [&] {
    const Within states = within(state, fractions, h, rate);
    response_integral += rate * weight.dot(responses(states));
    const LaneVector heat =
        (states.elongation - states.memory).cwiseAbs2() * relaxing;  // times the relaxation time
    energy.dissipated_J += weight.dot(heat) / tissue_.bonds().relaxation_time_s();
  };
  if (until - from > kLongPart) {
    for (const double side : {-1.0, 1.0}) {
      for (std::size_t i = 0; i < kLanes; ++i)
        put(i, side * Long::abscissa()[i], Long::weights()[i]);
      add();
    }
  } else {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const double side = i % 2 == 0 ? -1.0 : 1.0;
      put(i, side * Short::abscissa()[i / 2], Short::weights()[i / 2]);
    }
    add();
  }
  if (tissue_.depth_driven()) {
    energy.work_J = response_integral;
  } else {
    // The integral of F du, by parts.
    const std::array<double, 2> ends{from, until};
    const LaneVector depth = responses_within(state, ends, h, rate);
    energy.work_J = (state.imposed + until * h * rate) * depth[1] -
                    (state.imposed + from * h * rate) * depth[0] - response_integral;
  }
  return energy;
}

void StageBalance::accept(TissueState& state, double h, double rate) {
  last_path_ = x_.rowwise() - start_;
  has_last_ = true;
  last_h_ = h;
  last_rate_ = rate;
  state.time_s += h;
  state.imposed += h * rate;
  const Eigen::RowVectorXd end = x_.row(stages_ - 1);
  state.position = Eigen::Map<const Positions>(end.data(), 3, coordinates_ / 3);
  tissue_.bonds().elongations(state.position, state.elongation);
  for (std::size_t i = 0; i < bonds_.relaxing_bonds().size(); ++i) {
    state.remembered[static_cast<Eigen::Index>(bonds_.relaxing_bonds()[i])] =
        memory_(stages_ - 1, static_cast<Eigen::Index>(i));
  }
  ++work_.steps;
  see(tissue_.response(state));
}

}  // namespace tpm
