#include "tpm/organ/balance/inertial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/require.hpp"
#include "tpm/base/text.hpp"
#include "tpm/organ/balance/inertial_integration.hpp"
#include "tpm/organ/balance/resumed_run.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/model.hpp"

namespace tpm::organ {
namespace {

void require_valid(const InertialOptions& options) {
  require_number(options.tolerance >= 1e-12 && options.tolerance <= 0.1, "tolerance",
                 options.tolerance, "1e-12 to 0.1");
  require_number(options.highest_order >= 1 && options.highest_order <= 5, "highest order",
                 options.highest_order, "1 to 5");
  require_number(options.damping_ratio >= 0.0 && options.damping_ratio <= 10.0, "damping ratio",
                 options.damping_ratio, "0 to 10");
  require_number(options.stiffness_share >= 0.0 && options.stiffness_share <= 1.0,
                 "stiffness share", options.stiffness_share, "0 to 1");
  require_number(options.contact_damping_ratio >= 0.0 && options.contact_damping_ratio <= 10.0,
                 "contact damping ratio", options.contact_damping_ratio, "0 to 10");
}

Inertia inertia_of(const BondSystem& bonds, const Eigen::VectorXd& mass, const LowestMode& lowest,
                   const InertialOptions& options) {
  const double omega = lowest.angular_frequency();
  Inertia inertia{mass,
                  2.0 * options.damping_ratio * omega * (1.0 - options.stiffness_share),
                  {},
                  options.contact_damping_ratio};
  const double beta = 2.0 * options.damping_ratio * options.stiffness_share / omega;
  if (beta > 0.0) {
    inertia.dashpot_N_s_m = beta * bonds.stiffness_when(lowest.relaxation_factor);
    inertia.dashpot_N_s_m.tail(static_cast<Eigen::Index>(bonds.contact_count())).setZero();
  }
  return inertia;
}

/// The knots up to the last time asked for, where the last value is constant for ever.
std::vector<Knot> finite_knots(const Protocol& protocol, const ImposedPath& path,
                               std::span<const double> times_s) {
  std::vector<Knot> knots(path.knots().begin(), path.knots().end());
  double latest = knots.back().time_s;
  for (const double t : times_s) {
    if (std::isinf(t)) {
      throw bad_input(protocol.name(), "an integrator does not reach t = infinity",
                      "a finite time, or the quasi-static network");
    }
    latest = std::max(latest, t);
  }
  if (latest > knots.back().time_s) knots.push_back({latest, knots.back().value});
  return knots;
}

void require_no_jump_of_depth(const Protocol& protocol) {
  if (protocol.drive() == Drive::force) return;
  const auto knots = protocol.knots();
  bool jumps = knots.front().value != 0.0 && !protocol.equilibrium_at_start();
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    jumps =
        jumps || (knots[k].time_s == knots[k + 1].time_s && knots[k].value != knots[k + 1].value);
  }
  if (!jumps) return;
  throw bad_input(protocol.name(),
                  "the depth jumps, which takes an infinite force where spheres "
                  "have mass",
                  "a ramp");
}

/// The network of an Inertial, what it is asked, and its observers (Inertial::run()).
struct MotionInput {
  const BondSystem& bonds;
  const Positions& rest;
  const Constraints& constraints;
  const Probes& probes;
  const InertialOptions& options;
  double angular_frequency;  ///< of the lowest mode, rad/s
  Inertia inertia;
  const Protocol& protocol;
  std::span<const double> times_s;
  const InertialObserver& observer;
  const InertialState* from;
  const StepObserver& steps;
};

/// One run: the state and how it is carried through the protocol.
class MotionRun {
 public:
  /// @param in must live as long as this
  explicit MotionRun(const MotionInput& in)
      : options_(in.options),
        protocol_(in.protocol),
        observer_(in.observer),
        steps_(in.steps),
        times_s_(in.times_s),
        order_(rising_order(in.times_s)),
        tissue_(in.bonds, in.rest, in.constraints, in.probes, in.protocol),
        knots_(finite_knots(in.protocol, tissue_.path(), in.times_s)),
        equation_(tissue_, in.rest, in.inertia) {
    TissueState start = tissue_.at_rest(knots_.front().time_s);
    const double response_scale = std::abs(tissue_.linear_response(start, protocol_.peak()));
    double depth = tissue_.depth_driven() ? protocol_.peak() : response_scale;
    for (std::size_t g = 1; g < tissue_.groups(); ++g) {
      if (tissue_.depth_driven(g)) depth = std::max(depth, tissue_.path().peak(g));
    }
    const InertialState* from = in.from;
    if (!from && protocol_.equilibrium_at_start() && knots_.front().value != 0.0) {
      preload(in.bonds, in.rest, in.constraints, in.probes, start);
    }
    if (from && from->motion.size() != equation_.size()) {
      throw bad_input("state", fmt::format("{} numbers", from->motion.size()),
                      fmt::format("{}, as the network has", equation_.size()));
    }
    integration_.emplace(equation_, options_,
                         from ? from->motion : equation_.pack(start.position, start.viscous),
                         step_error(depth, in.angular_frequency), energy_error(response_scale),
                         from ? from->spent_J : Eigen::Vector4d::Zero());
    if (from) go_on_from(*from);
    result_.response.resize(static_cast<Eigen::Index>(times_s_.size()));
    result_.of_driven_sphere.resize(result_.response.size());
  }

  InertialRun go() {
    for (std::size_t k = 0; k + 1 < knots_.size(); ++k) {
      if (knots_[k].time_s == knots_[k + 1].time_s) continue;
      if (knots_[k + 1].time_s > begin_s_) {
        cross(knots_[k], knots_[k + 1]);
      } else {  // over already, but the speed it leaves with counts
        equation_.set_piece(knots_[k], knots_[k + 1]);
      }
    }
    const double end = knots_.back().time_s;
    while (next_ < order_.size()) put(end, value_at(protocol_, end));
    finish(end);
    return std::move(result_);
  }

 private:
  void go_on_from(const InertialState& from) {
    started_ = true;
    begin_s_ = from.time_s;
    impact_work_ = from.impact_work_J;
    stored_at_start_ = from.stored_at_start_J;
    settled_s_ = from.settled_s;
  }

  /// Where a load or a depth held for ever has brought the tissue.
  void preload(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
               const Probes& probes, TissueState& state) const {
    const double forever = std::numeric_limits<double>::infinity();
    const Protocol held(protocol_.drive(), {{0.0, knots_.front().value}}, "preload", true);
    const QuasiStaticRun run =
        QuasiStatic(bonds, rest, constraints, probes, {std::min(options_.tolerance, 1e-6), 5})
            .run(held, std::span(&forever, 1));
    state.position = run.position;
    state.viscous = run.viscous;
  }

  [[nodiscard]] Eigen::VectorXd step_error(double depth, double omega) const {
    // A protocol that imposes nothing has no scale of its own, and nothing moves.
    const double scale = options_.tolerance * (depth > 0.0 ? depth : 1e-3);
    Eigen::VectorXd error = Eigen::VectorXd::Constant(equation_.size(), scale);
    error.segment(equation_.coordinates(), equation_.coordinates()) *= omega;
    return error;
  }

  [[nodiscard]] std::optional<double> energy_error(double response_scale) const {
    if (!options_.energy) return std::nullopt;
    const double work = protocol_.peak() * response_scale;
    return options_.tolerance * (work > 0.0 ? work : 1e-6);
  }

  void cross(const Knot& from, const Knot& to) {
    const double speed_before = equation_.imposed_speed();
    const Eigen::Matrix3Xd velocity_before = equation_.imposed_velocity();
    equation_.set_piece(from, to);
    if (!started_) begin(from.time_s);
    const double begin_s = std::max(from.time_s, begin_s_);
    if (begin_s == from.time_s) change_speed(from.time_s, speed_before, velocity_before);
    integration_->restart(begin_s, to.time_s);
    begin_smooth();
    // CVODES refuses times that rounding alone separates from where it starts.
    const auto is_ahead = [&](double time_s) {
      return time_s - integration_->time_s() > 1e-14 * std::max(std::abs(time_s), to.time_s);
    };
    const auto put_reached = [&] {
      while (next_ < order_.size() && asked_s() < to.time_s && !is_ahead(asked_s())) {
        put(asked_s(), value_at(protocol_, asked_s()));
      }
    };
    put_reached();
    while (is_ahead(to.time_s)) {
      const bool stops = integration_->watches_gaps() && next_ < order_.size();
      step_towards(stops ? std::min(asked_s(), to.time_s) : to.time_s, to.time_s);
      put_reached();
    }
    // Asked for twice, the corner is answered from either side.
    while (next_ + 1 < order_.size() && asked_s() == to.time_s &&
           times_s_[order_[next_ + 1]] == to.time_s) {
      put(to.time_s, equation_.imposed_value(to.time_s));
    }
    if (steps_.corner) steps_.corner();
  }

  [[nodiscard]] double asked_s() const { return times_s_[order_[next_]]; }

  /// One step; what a tool meets in it is struck.
  void step_towards(double time_s, double stop_s) {
    using Reached = InertialIntegration::Reached;
    const Reached reached = integration_->step_towards(time_s);
    const double now_s = integration_->time_s();
    const bool meets = equation_.meets(now_s, integration_->state());
    const bool strikes = reached == Reached::meeting || (reached == Reached::target && meets);
    // Where a tool meets a sphere, a dashpot would push by the speed that the impact takes away.
    if (!strikes && !meets) show_step();
    if (!strikes) return;
    const ToolImpact impact = integration_->strike(now_s);
    integration_->spend(impact.work_J, impact.lost_J);
    const double of_probe = tissue_.depth_driven() ? impact.on_tissue_N_s : 0.0;
    if (impact.on_tissue_N_s != 0.0) {
      result_.impacts.push_back({now_s, of_probe, impact.on_tissue_N_s});
    }
    settle_after(now_s);
    if (now_s < stop_s) integration_->restart(now_s, stop_s);
    begin_smooth();
  }

  /// A contact so soft that it settles about as slowly as the protocol moves is part of the
  /// answer: nothing is left out of the largest response then, and the check with softer contacts
  /// shows by how much they matter.
  void settle_after(double time_s) {
    constexpr double kShort = 0.02;  // of the protocol
    const double settling_s = equation_.settling_time_s();
    const double protocol_s = knots_.back().time_s - knots_.front().time_s;
    if (settling_s > kShort * protocol_s) return;
    settled_s_ = std::max(settled_s_, time_s + settling_s);
  }

  void begin_smooth() {
    if (steps_.corner) steps_.corner();
    show_step();
  }

  void show_step() {
    if (!steps_.step) return;
    const double now_s = integration_->time_s();
    const auto state = integration_->state();
    show(now_s, equation_.imposed_value(now_s), equation_.response(now_s, state), state,
         steps_.step);
  }

  void begin(double time_s) {
    started_ = true;
    stored_at_start_ = equation_.stored_J(time_s, integration_->state());
  }

  void change_speed(double time_s, double speed_before, const Eigen::Matrix3Xd& velocity_before) {
    const double speed = equation_.imposed_speed();
    const Eigen::Matrix3Xd velocity = equation_.imposed_velocity();
    if (velocity == velocity_before) return;
    const double impulse = equation_.driven_mass_kg() * (speed - speed_before);
    impact_work_ +=
        0.5 * (velocity.colwise().squaredNorm() - velocity_before.colwise().squaredNorm())
                  .dot(equation_.inertia().mass_kg.transpose());
    // Spheres that the tool touches are taken along as it gains speed, so that nothing is lost.
    const ToolImpact impact = integration_->strike(time_s);
    impact_work_ += impact.work_J - impact.lost_J;
    if (impact.on_tissue_N_s != 0.0) settle_after(time_s);
    const double on_driven_spheres = equation_.driven_sphere_mass_kg() * (speed - speed_before);
    result_.impacts.push_back(
        {time_s, impulse + impact.on_tissue_N_s, on_driven_spheres + impact.on_tissue_N_s});
  }

  void put(double time_s, double imposed) {
    const auto row = static_cast<Eigen::Index>(order_[next_++]);
    // A time that rounding separates from the one reached is answered there.
    const auto state = integration_->state_at(std::min(time_s, integration_->time_s()));
    result_.response[row] = equation_.response(time_s, state);
    result_.of_driven_sphere[row] = equation_.drag_on_driven_sphere_N();
    if (observer_) show(time_s, imposed, result_.response[row], state, observer_);
  }

  void show(double time_s, double imposed, double response,
            const Eigen::Map<const Eigen::VectorXd>& state, const InertialObserver& to) {
    std::vector<double> beside;
    for (std::size_t g = 1; g < tissue_.groups(); ++g) {
      beside.push_back(equation_.response(time_s, state, g));
    }
    const TissueMotion& now = equation_.unpack(time_s, state);
    to({.time_s = time_s,
        .imposed = imposed,
        .response = response,
        .position = now.position,
        .viscous = now.viscous,
        .energy = {},
        .beside = beside,
        .settling = time_s < settled_s_},
       equation_.contact_pushes_N(time_s, state));
  }

  void finish(double end) {
    result_.work = integration_->work();
    if (options_.energy) {
      const Eigen::Vector4d spent = integration_->spent_J();
      InertialEnergy energy;
      energy.work = spent[0] + impact_work_;
      energy.stored = equation_.stored_J(end, integration_->state()) - stored_at_start_;
      energy.kinetic = equation_.kinetic_J(end, integration_->state());
      energy.bond_heat = spent[1];
      energy.damping_heat = spent[2];
      energy.contact_heat = spent[3];
      result_.energy = energy;
    }
    const TissueMotion& last = equation_.unpack(end, integration_->state());
    result_.position = last.position;
    result_.velocity = last.velocity;
    result_.viscous = last.viscous;
    result_.end = {end,
                   integration_->state(),
                   options_.energy ? integration_->spent_J() : Eigen::Vector4d::Zero(),
                   impact_work_,
                   stored_at_start_,
                   settled_s_};
  }

  const InertialOptions& options_;
  const Protocol& protocol_;
  const InertialObserver& observer_;
  const StepObserver& steps_;
  std::span<const double> times_s_;
  std::vector<std::size_t> order_;
  std::size_t next_ = 0;  ///< the first of order_ not answered yet
  DrivenTissue tissue_;
  std::vector<Knot> knots_;  ///< of the path
  InertialEquation equation_;
  std::optional<InertialIntegration> integration_;
  bool started_ = false;
  double begin_s_ = -std::numeric_limits<double>::infinity();  ///< where an earlier run has ended
  double stored_at_start_ = 0.0;
  double impact_work_ = 0.0;
  double settled_s_ = std::numeric_limits<double>::lowest();
  InertialRun result_;
};

}  // namespace

Inertial::Inertial(const BondSystem& bonds, Positions rest, Constraints constraints, Probes probes,
                   Eigen::VectorXd mass_kg, InertialOptions options)
    : bonds_(bonds),
      rest_(std::move(rest)),
      constraints_(std::move(constraints)),
      probes_(std::move(probes)),
      mass_kg_(std::move(mass_kg)),
      options_(options) {
  require_valid(options_);
  require_valid(probes_, constraints_);
  for (Eigen::Index i = 0; i < rest_.cols(); ++i) {
    if (mass_kg_.size() == rest_.cols() && mass_kg_[i] > 0.0 && std::isfinite(mass_kg_[i]))
      continue;
    throw bad_input("mass", fmt::format("of sphere {} is not above 0", i + 1),
                    "one mass above 0 for every sphere");
  }
  const Positions& unloaded = probes_.loading().unloaded;
  lowest_ = lowest_mode(bonds_, unloaded.size() > 0 ? unloaded : rest_, constraints_, mass_kg_);
}

InertialRun Inertial::run(const Protocol& protocol, std::span<const double> times_s,
                          const InertialObserver& observer, const InertialState* from,
                          const StepObserver& steps) const {
  require_times_within(protocol, times_s);
  require_no_jump_of_depth(protocol);
  for (const DriveGroup& group : probes_.loading().beside) require_no_jump_of_depth(group.protocol);
  if (from) require_later(times_s, from->time_s);
  const MotionInput in{bonds_,
                       rest_,
                       constraints_,
                       probes_,
                       options_,
                       lowest_.angular_frequency(),
                       inertia_of(bonds_, mass_kg_, lowest_, options_),
                       protocol,
                       times_s,
                       observer,
                       from,
                       steps};
  return MotionRun(in).go();
}

}  // namespace tpm::organ
