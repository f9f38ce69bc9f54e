#include "tpm/organ/balance/quasistatic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/require.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/relaxation/sampled_function.hpp"
#include "tpm/organ/balance/buckling.hpp"
#include "tpm/organ/balance/contact_landing.hpp"
#include "tpm/organ/balance/resumed_run.hpp"
#include "tpm/organ/balance/shown_responses.hpp"
#include "tpm/organ/balance/stage_tangents.hpp"
#include "tpm/organ/balance/step_growth.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/model.hpp"

namespace tpm::organ {
namespace {

constexpr double kStepShare = 0.1;   // of the tolerance, for one step
constexpr double kLeastStep = 1e-9;  // of a piece of the protocol
constexpr double kLeastMove = 1e-9;  // of a jump
// A step of p stages after a change of rate errs by about (h / (kFirstStep tau))^(p + 1), with the
// shortest relaxation time.
constexpr double kFirstStep = 28.0;
constexpr double kMostGrowth = 30.0;  // from one step to the next

/// One run: the state and how it is carried through the protocol.
class Run {
 public:
  Run(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
      const Probes& probes, const QuasiStaticOptions& options, const Protocol& protocol,
      std::span<const double> times_s, const QuasiStaticObserver& observer)
      : protocol_(protocol),
        options_(options),
        times_s_(times_s),
        observer_(observer),
        tissue_(bonds, rest, constraints, probes, protocol, options.equilibrium),
        stages_(tissue_, options.stages, !options.step_s) {
    order_ = rising_order(times_s);
    const auto asked = static_cast<Eigen::Index>(times_s.size());
    result_.response.resize(asked);
    if (options.directions.empty()) return;
    tangents_.emplace(tissue_, stages_, options.directions,
                      kStepShare * options.derivative_tolerance.value_or(options.tolerance));
    result_.derivative.setZero(asked, tangents_->count());
  }

  QuasiStaticRun go(const QuasiStaticState* begin) {
    begin ? start_from(*begin) : start();
    const auto knots = path().knots();
    for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
      Knot from = knots[k];
      const Knot& to = knots[k + 1];
      if (begin && to.time_s <= begin->time_s) continue;
      if (begin && from.time_s < begin->time_s) from = {state_.time_s, state_.imposed};
      if (to.time_s == from.time_s) {
        if (options_.extremes) show_extreme(shown_now(response_now()), energy_);  // before the jump
        move_to(to.value, false);
      } else {
        cross(from, to);
      }
    }
    if (next_ < order_.size()) hold_on(knots.back());
    result_.work = work();
    result_.solver = tissue_.equilibrium().choice();
    if (options_.energies) result_.energy = with_stored(energy_, stored_J(state_));
    result_.position = state_.position;
    result_.viscous = state_.viscous;
    return std::move(result_);
  }

  [[nodiscard]] QuasiStaticWork work() const {
    QuasiStaticWork work = stages_.work();
    work.rejected = result_.work.rejected;
    return work;
  }

 private:
  [[nodiscard]] const ImposedPath& path() const { return tissue_.path(); }

  [[nodiscard]] Error failed(double at, std::string_view what,
                             ErrorCause cause = ErrorCause::unspecified) const {
    const bool depth = protocol_.drive() == Drive::displacement;
    const double imposed = path().value(0, at);
    return Error(
        ExitCode::numerical, cause, "network",
        fmt::format("at t = {} s and {} of {} {} {}", significant(state_.time_s, 5),
                    depth ? "a depth" : "a load", significant(depth ? 1e3 * imposed : imposed, 4),
                    depth ? "mm" : "N", what));
  }

  [[nodiscard]] Error lost(double imposed, bool unstable, const std::string& otherwise) {
    if (unstable)
      return failed(imposed, "the tissue " + buckling_words(tissue_, state_), ErrorCause::buckled);
    return failed(imposed, otherwise + snap_words(tissue_, state_), ErrorCause::snapped_through);
  }

  /// Puts the tissue at rest and sets what tolerances refer to.
  void set_scales(double time_s) {
    state_ = tissue_.at_rest(time_s);
    response_.reset();
    stages_.begin(state_, first_step_s(first_change_s()), protocol_.peak());
  }

  /// Duration of the first piece in which the imposed value changes gradually, s.
  [[nodiscard]] double first_change_s() const {
    const auto knots = path().knots();
    for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
      const double length_s = knots[k + 1].time_s - knots[k].time_s;
      if (length_s > 0.0 && knots[k + 1].value != knots[k].value) return length_s;
    }
    return std::numeric_limits<double>::infinity();
  }

  /// The first step that is tried in a piece of the protocol, s.
  [[nodiscard]] double first_step_s(double length_s) const {
    const double of_time = kFirstStep * std::pow(options_.tolerance, 1.0 / (options_.stages + 1));
    const double fit = of_time * tissue_.bonds().shortest_relaxation_time_s();
    return std::min(length_s, options_.step_s.value_or(fit));
  }

  void start() {
    const Knot& first = path().knots().front();
    set_scales(first.time_s);
    if (protocol_.equilibrium_at_start()) {
      move_to(first.value, true);
    } else if (first.value != 0.0) {
      move_to(first.value, false);
    }
  }

  /// A state is known up to the tolerance of the run that found it; its forces are balanced here.
  void start_from(const QuasiStaticState& begin) {
    set_scales(begin.time_s);
    stages_.see(begin.response);
    state_.position = begin.position;
    state_.viscous = begin.viscous;
    state_.mean = tissue_.bonds().mean_viscous(begin.viscous);
    tissue_.bonds().followed(state_.position, state_.followed);
    state_.imposed = path().single() ? begin.imposed : path().coordinate_at(begin.time_s);
    if (begin.energy) energy_ = *begin.energy;
    shown_.see(begin);
    follow(state_.imposed, false);
  }

  [[nodiscard]] double response_now() {
    if (!response_) response_ = tissue_.response(state_);
    return *response_;
  }

  template <class State>
  [[nodiscard]] double stored_J(const State& state) const {
    return tissue_.bonds().stored_energy_J(state.position, state.viscous) +
           tissue_.dead_energy_J(state.position);
  }

  [[nodiscard]] static QuasiStaticEnergy with_stored(QuasiStaticEnergy spent, double stored_J) {
    spent.stored_J = stored_J;
    return spent;
  }

  /// Goes to an imposed value through equilibria, instantaneously or with everything relaxed on the
  /// way. Such a move is reversible: the work is what is stored.
  void move_to(double value, bool relaxed) {
    const double before_J = stored_J(state_);
    follow(value, relaxed);
    energy_.work_J += stored_J(state_) - before_J;
  }

  /// Waits for ever; what the springs lose then and the probe adds turns into heat.
  void settle() {
    const double before_J = stored_J(state_);
    const auto loads_J = [&] {
      return tissue_.loads_J(state_.position, state_.imposed, response_now());
    };
    const double loads_before_J = loads_J();
    follow(state_.imposed, true);
    const double work_J = loads_J() - loads_before_J;
    energy_.work_J += work_J;
    energy_.dissipated_J += work_J + before_J - stored_J(state_);
  }

  void follow(double value, bool relaxed) {
    const double begin = state_.imposed;
    double done = 0.0;
    double stride = 1.0;
    const double tolerance = 1e-3 * options_.tolerance;
    while (done < 1.0) {
      const double aim = std::min(1.0, done + stride);
      const double imposed = begin + aim * (value - begin);
      const TissueMove move = stages_.move(state_, imposed, relaxed, tolerance);
      if (move == TissueMove::done) {
        done = aim;
        stride *= 2.0;
        continue;
      }
      stride *= 0.5;
      if (stride > kLeastMove) continue;
      throw lost(imposed, move == TissueMove::unstable, "no equilibrium is found");
    }
    response_.reset();
    stages_.see(response_now());
    if (tangents_) tangents_->follow_move(state_, relaxed);
  }

  /// Steps through a piece in which the imposed value is linear.
  void cross(const Knot& from, const Knot& to) {
    const double length = to.time_s - from.time_s;
    const double rate = (to.value - from.value) / length;
    StepGrowth growth(options_.stages + 1);
    double h = first_step_s(length);
    if (rate == 0.0 && from.value == 0.0 && is_relaxed()) return stand_still(to.time_s);
    if (!path().single()) stages_.forget_motion();  // the rate means another motion now
    while (state_.time_s < to.time_s) {
      const double left = to.time_s - state_.time_s;
      const bool last = h >= left * (1.0 - 1e-12);
      if (last) h = left;
      const StepOutcome outcome =
          stages_.try_step(state_, h, rate, kStepShare * options_.tolerance);
      if (options_.may_go_on && !options_.may_go_on(work())) {
        throw failed(state_.imposed, "the run has taken as long as it may");
      }
      const double factor = growth.after(h, outcome);
      const bool kept = outcome.accepted || (options_.step_s && outcome.balanced);
      if (!kept) {
        ++result_.work.rejected;
        landing_.reset();
        h *= outcome.balanced ? std::clamp(factor, 0.05, 0.9) : 0.25;
        if (h > kLeastStep * length) continue;
        throw lost(state_.imposed, outcome.unstable, "the forces cannot be balanced");
      }
      if (!lands_on_contact(h, length)) continue;
      if (tangents_) tangents_->follow_step(h);
      std::optional<StepEnergy> energy;
      if (options_.energies) energy = stages_.energy_of_step(state_, h, rate);
      report_within(h, rate, energy);
      if (energy) energy_ = with(energy->whole());
      result_.error_estimate += outcome.error + outcome.left;
      response_ = stages_.accept(state_, h, rate);
      if (tangents_) tangents_->accept();
      if (last) state_.time_s = to.time_s;
      state_.imposed = last ? to.value : state_.imposed;
      if (landing_.cut()) {
        change_contact(landing_.cut()->contact);
        h = landing_.cut()->whole_s;
        landing_.reset();
        growth = StepGrowth(options_.stages + 1);
      } else {
        h = options_.step_s ? *options_.step_s : h * std::clamp(factor, 0.2, kMostGrowth);
      }
    }
  }

  /// False if the step just balanced has to be found again, h long.
  [[nodiscard]] bool lands_on_contact(double& h, double length) {
    const auto change = stages_.contact_change(kStepShare * options_.tolerance);
    const auto answer = landing_.see(change, h, kLeastStep * length);
    if (answer == ContactLanding::Answer::change_first) change_contact(change->contact);
    return answer == ContactLanding::Answer::keep;
  }

  void change_contact(std::size_t contact) {
    stages_.change_contact(state_, contact);
    response_.reset();
    if (landing_.may_change(state_.time_s, state_.closed.size())) return;
    throw failed(state_.imposed, "contacts with a tool open and close without end");
  }

  [[nodiscard]] bool is_relaxed() const {
    if (!tissue_.preloaded()) return state_.viscous.isZero(0.0);
    return state_.viscous == state_.followed.replicate(1, state_.viscous.cols());
  }

  void stand_still(double until_s) {
    while (next_ < order_.size() && times_s_[order_[next_]] < until_s) {
      put(response_now(), energy_);
    }
    state_.time_s = until_s;
  }

  /// The energy at the start of a step, and what is spent since.
  [[nodiscard]] QuasiStaticEnergy with(const QuasiStaticEnergy& part) const {
    QuasiStaticEnergy sum = energy_;
    sum.work_J += part.work_J;
    sum.dissipated_J += part.dissipated_J;
    return sum;
  }

  /// Of an asked time, by its rank, in the step just found.
  [[nodiscard]] double fraction_of(std::size_t rank, double h) const {
    return std::max((times_s_[order_[rank]] - state_.time_s) / h, 0.0);
  }

  /// Answers the times asked for within the step just found, its end left out.
  void report_within(double h, double rate, const std::optional<StepEnergy>& energy) {
    std::vector<double> fractions;
    for (std::size_t i = next_; i < order_.size() && times_s_[order_[i]] < state_.time_s + h; ++i) {
      fractions.push_back(fraction_of(i, h));
    }
    if (tangents_ || !observer_) answer(fractions, h, rate);
    if (options_.extremes && energy) shown_.add_extremes(*energy, tissue_.groups(), fractions);
    for (std::span<const double> rest = fractions; observer_ && !rest.empty();) {
      const std::size_t count = std::min<std::size_t>(kLanes, rest.size());
      show_within(rest.first(count), h, rate, energy);
      rest = rest.subspan(count);
    }
  }

  /// Puts derivatives at fractions of the step just found, and responses unless an observer is
  /// shown states, which bring them.
  void answer(std::span<const double> fractions, double h, double rate) {
    while (!tangents_ && !fractions.empty() && fractions.front() == 0.0) {
      put(response_now());
      fractions = fractions.subspan(1);
    }
    const Eigen::Index derivatives = tangents_ ? tangents_->count() : 0;
    Eigen::RowVectorXd allowed = Eigen::RowVectorXd::Constant(
        1 + derivatives, options_.derivative_tolerance.value_or(options_.tolerance));
    allowed[0] = options_.tolerance;
    const auto answers_at = [&](std::span<const double> asked) {
      const auto count = static_cast<Eigen::Index>(asked.size());
      Eigen::MatrixXd rows(count, 1 + derivatives);
      rows.col(0) = stages_.responses_within(state_, asked, h, rate).head(count);
      if (tangents_) {
        rows.rightCols(derivatives) = tangents_->responses_within(state_, asked, h, rate);
      }
      return rows;
    };
    const Eigen::MatrixXd answers =
        sampled(answers_at, fractions, kLanes, kStepShare * stages_.scale() * allowed);
    for (Eigen::Index i = 0; i < answers.rows() && tangents_; ++i) {
      derivative_row(next_ + static_cast<std::size_t>(i)) = answers.row(i).tail(derivatives);
    }
    if (observer_) return;
    for (Eigen::Index i = 0; i < answers.rows(); ++i) {
      const bool begins = fractions[static_cast<std::size_t>(i)] == 0.0;
      put(begins ? response_now() : answers(i, 0));
    }
  }

  /// Responses within the step just found, with the states there.
  void show_within(std::span<const double> fractions, double h, double rate,
                   const std::optional<StepEnergy>& energy) {
    std::vector<QuasiStaticState> states =
        stages_.states_within(state_, fractions, h, rate, options_.energies);
    for (std::size_t i = 0; i < fractions.size(); ++i) {
      if (fractions[i] == 0.0) states[i].response = response_now();
      const double loads_J =
          tissue_.loads_J(states[i].position, states[i].imposed, states[i].response);
      const QuasiStaticEnergy spent = energy ? with(energy->until(fractions[i], loads_J)) : energy_;
      const bool asked = next_ < order_.size() && fraction_of(next_, h) == fractions[i];
      asked ? show(std::move(states[i]), spent) : show_extreme(std::move(states[i]), spent);
    }
  }

  /// The last value held for as long as is asked, and for ever.
  void hold_on(const Knot& last) {
    while (next_ < order_.size()) {
      const double time = times_s_[order_[next_]];
      if (std::isinf(time)) {
        settle();
      } else if (time > state_.time_s) {
        const double latest = latest_finite_time();
        cross({state_.time_s, last.value}, {latest, last.value});
        continue;
      }
      if (tangents_) derivative_row(next_) = tangents_->response(state_);
      put(response_now(), energy_);
    }
  }

  [[nodiscard]] Eigen::MatrixXd::RowXpr derivative_row(std::size_t rank) {
    return result_.derivative.row(static_cast<Eigen::Index>(order_[rank]));
  }

  [[nodiscard]] double latest_finite_time() const {
    double latest = state_.time_s;
    for (const double t : times_s_) {
      if (std::isfinite(t)) latest = std::max(latest, t);
    }
    return latest;
  }

  void put(double response) {
    result_.response[static_cast<Eigen::Index>(order_[next_++])] = response;
  }

  void put(double response, const QuasiStaticEnergy& spent) {
    if (!observer_) return put(response);
    show(shown_now(response), spent);
  }

  [[nodiscard]] QuasiStaticState shown_now(double response) const {
    return {state_.time_s, state_.imposed, response, state_.position, state_.viscous, std::nullopt};
  }

  /// Puts the response of a state, and shows it at the time that was asked for.
  void show(QuasiStaticState state, const QuasiStaticEnergy& spent) {
    state.time_s = times_s_[order_[next_]];
    complete(state, spent);
    put(state.response);
    shown_.see(state);
    observer_(state);
  }

  /// Shows a state that was not asked for, if a response is larger than all shown before.
  void show_extreme(QuasiStaticState state, const QuasiStaticEnergy& spent) {
    state.between = true;
    complete(state, spent);
    if (shown_.exceeded_by(state)) observer_(state);
    shown_.see(state);
  }

  void complete(QuasiStaticState& state, const QuasiStaticEnergy& spent) const {
    if (!path().single()) {
      state.beside = tissue_.beside_responses(
          state.position, {tissue_.bonds().mean_viscous(state.viscous), 0.0, state_.closed},
          state.imposed);
      state.imposed = path().value(0, state.imposed);
    }
    if (!options_.energies) return;
    state.energy = with_stored(spent, state.energy ? state.energy->stored_J : stored_J(state));
  }

  const Protocol& protocol_;
  const QuasiStaticOptions& options_;
  std::span<const double> times_s_;
  const QuasiStaticObserver& observer_;
  std::vector<std::size_t> order_;  ///< of times_s_, rising
  std::size_t next_ = 0;            ///< the first of them not answered yet
  DrivenTissue tissue_;
  StageBalance stages_;
  std::optional<StageTangents> tangents_;
  ContactLanding landing_;
  ShownResponses shown_;
  TissueState state_;
  std::optional<double> response_;  ///< there, once known
  QuasiStaticEnergy energy_;
  QuasiStaticRun result_;
};

}  // namespace

QuasiStatic::QuasiStatic(const BondSystem& bonds, Positions rest, Constraints constraints,
                         Probes probes, QuasiStaticOptions options)
    : bonds_(bonds),
      rest_(std::move(rest)),
      constraints_(std::move(constraints)),
      probes_(std::move(probes)),
      options_(std::move(options)) {
  require_number(options_.tolerance >= 1e-12 && options_.tolerance <= 0.1, "tolerance",
                 options_.tolerance, "1e-12 to 0.1");
  if (options_.stages < 2 || options_.stages > kLanes) {
    throw bad_input("stages", std::to_string(options_.stages), fmt::format("2 to {}", kLanes));
  }
  for (const TangentDirection& direction : options_.directions) {
    const auto size = static_cast<Eigen::Index>(bonds.size());
    if (direction.stiffness.size() == size && direction.relaxing.size() == size) continue;
    throw bad_input("directions", "changes of another number of bonds",
                    fmt::format("one number for each of the {} bonds", size));
  }
  if (options_.step_s) {
    require_number(is_positive(*options_.step_s), "step", *options_.step_s, "a time above 0", " s");
  }
  require_valid(probes_, constraints_);
}

QuasiStaticRun QuasiStatic::run(const Protocol& protocol, std::span<const double> times_s,
                                const QuasiStaticObserver& observer,
                                const QuasiStaticState* from) const {
  const Loading& loading = probes_.loading();
  if (!options_.directions.empty() && (!loading.beside.empty() || loading.dead_N.size() > 0)) {
    throw bad_input("directions", "of a run with several protocols or with loads that stay",
                    "one protocol and no other load");
  }
  if (from && !options_.directions.empty()) {
    throw bad_input("directions", "a run that resumes from a state",
                    "a run from rest: the derivatives of the state are not known");
  }
  require_times_within(protocol, times_s);
  if (from) {
    require_times_within(protocol, {&from->time_s, 1});
    require_same_network(*from, bonds_);
    require_later(times_s, from->time_s);
  }
  Run run(bonds_, rest_, constraints_, probes_, options_, protocol, times_s, observer);
  try {
    return run.go(from);
  } catch (const Error&) {
    if (options_.on_failure) options_.on_failure(run.work());
    throw;
  }
}

}  // namespace tpm::organ
