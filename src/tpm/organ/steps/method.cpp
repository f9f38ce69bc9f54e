#include "tpm/organ/steps/method.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/require.hpp"
#include "tpm/base/text.hpp"
#include "tpm/organ/steps/adaptive_rules.hpp"
#include "tpm/organ/steps/step_rules.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/model.hpp"

namespace tpm::organ {
namespace {

using Vector = Eigen::VectorXd;
constexpr double kDivergedTimes = 1e3;  // what is to be expected
constexpr double kSameTime = 1e-9;      // of a step
constexpr double kBeyondReach = 3.0;    // of what is to be expected: no balance leads there

void require_valid(const MethodSettings& settings) {
  require_number(settings.step_s > 0.0 && std::isfinite(settings.step_s), "step", settings.step_s,
                 "a time above 0");
  require_number(settings.tolerance >= 1e-13 && settings.tolerance <= 0.1, "tolerance",
                 settings.tolerance, "1e-13 to 0.1");
  require_number(settings.sweeps >= 1, "sweeps", settings.sweeps, "at least 1");
  require_number(settings.most_rates >= 1, "most rates", static_cast<double>(settings.most_rates),
                 "at least 1");
}

std::string_view words(MethodEnd end) {
  static constexpr auto kNames = std::to_array<Word<MethodEnd>>({
      {MethodEnd::completed, ""},
      {MethodEnd::diverged, "a value is not finite or grew beyond 1000 times its scale"},
      {MethodEnd::newton_failed, "Newton's method found no solution"},
      {MethodEnd::buckled, "the tangent stiffness is no longer positive definite"},
      {MethodEnd::too_much_work, "more evaluations of the forces than allowed"},
      {MethodEnd::not_applicable, "the rule has no meaning here"},
  });
  return word_for(kNames, end);
}

/// One run through the protocol.
class MethodDriver {
 public:
  MethodDriver(StepSystem& system, const Protocol& protocol, const MethodSettings& settings,
               std::span<const double> times_s)
      : system_(system), protocol_(protocol), settings_(settings), times_s_(times_s) {
    run_.response = Vector::Constant(static_cast<Eigen::Index>(times_s.size()),
                                     std::numeric_limits<double>::quiet_NaN());
    knots_.assign(protocol.knots().begin(), protocol.knots().end());
    if (!times_s.empty() && times_s.back() > knots_.back().time_s) {
      knots_.push_back({times_s.back(), knots_.back().value});
    }
    bound_ = kDivergedTimes * system.scales();
    // Velocities have to be finite only: a short step may make them large for a while.
    const Eigen::Index n = system.coordinates();
    bound_.segment(n, n).setConstant(std::numeric_limits<double>::infinity());
  }
  virtual ~MethodDriver() = default;
  MethodDriver(const MethodDriver&) = delete;
  MethodDriver& operator=(const MethodDriver&) = delete;

  MethodRun go() {
    time_s_ = knots_.front().time_s;
    const MethodEnd end = applies() ? cross_all() : MethodEnd::not_applicable;
    run_.end = end;
    run_.end_time_s = time_s_;
    run_.work = system_.work();
    run_.work.steps = steps();
    if (end != MethodEnd::completed) {
      run_.reason = fmt::format("at t = {} s: {}", significant(time_s_, 5), words(end));
      const std::string more = detail();
      if (!more.empty()) run_.reason += " (" + more + ")";
    }
    return std::move(run_);
  }

 protected:
  /// The system has what the rule needs.
  [[nodiscard]] virtual bool applies() const = 0;
  [[nodiscard]] virtual MethodEnd jump() = 0;
  /// Crosses a piece and answers what is asked for before its end.
  [[nodiscard]] virtual MethodEnd cross(const Knot& from, const Knot& to) = 0;
  [[nodiscard]] virtual long steps() const = 0;
  [[nodiscard]] virtual std::string detail() const { return {}; }

  [[nodiscard]] bool all_answered() const { return next_ == times_s_.size(); }
  [[nodiscard]] double asked_s() const { return times_s_[next_]; }
  [[nodiscard]] double last_asked_s() const { return times_s_.back(); }

  [[nodiscard]] MethodEnd answer(double time_s, const Vector& state) {
    double response = 0.0;
    if (const auto end = system_.response(time_s, state, response); end != MethodEnd::completed)
      return end;
    if (!std::isfinite(response)) return MethodEnd::diverged;
    run_.response[static_cast<Eigen::Index>(next_++)] = response;
    return MethodEnd::completed;
  }

  [[nodiscard]] MethodEnd end_at(const Vector& state) const {
    // Written so that what is not a number fails.
    if (!(state.cwiseAbs().array() <= bound_.array()).all() || !state.allFinite()) {
      return MethodEnd::diverged;
    }
    return system_.work().rates > settings_.most_rates ? MethodEnd::too_much_work
                                                       : MethodEnd::completed;
  }

  /// Forces that cannot be balanced because the viscous elongations have diverged are not the
  /// tissue's failure.
  [[nodiscard]] MethodEnd cause(MethodEnd end, const Vector& state) const {
    const Eigen::Index m = system_.viscous();
    const auto reach = kBeyondReach / kDivergedTimes * bound_.tail(m).array();
    return (state.tail(m).cwiseAbs().array() <= reach).all() ? end : MethodEnd::diverged;
  }

  StepSystem& system_;
  const Protocol& protocol_;
  const MethodSettings& settings_;
  Vector state_;
  double time_s_ = 0.0;

 private:
  [[nodiscard]] MethodEnd cross_all() {
    const Knot& first = knots_.front();
    system_.set_piece({first.time_s, 0.0}, {first.time_s + 1.0, 0.0});
    const bool relaxed = protocol_.equilibrium_at_start();
    if (const auto end = system_.start(first, relaxed, state_); end != MethodEnd::completed)
      return end;
    if (first.value != 0.0) {
      stand_at(first);
      const MethodEnd end = relaxed ? MethodEnd::completed : jump();
      if (end != MethodEnd::completed) return end;
    }
    for (std::size_t k = 0; k + 1 < knots_.size() && !all_answered(); ++k) {
      const Knot& from = knots_[k];
      const Knot& to = knots_[k + 1];
      MethodEnd end = MethodEnd::completed;
      if (from.time_s < to.time_s) {
        system_.set_piece(from, to);
        end = cross(from, to);
      } else if (from.value != to.value) {
        stand_at(to);
        end = jump();
      }
      if (end != MethodEnd::completed) return end;
    }
    if (knots_.size() == 1) stand_at(first);
    while (!all_answered()) {
      if (const auto end = answer(knots_.back().time_s, state_); end != MethodEnd::completed)
        return end;
    }
    return MethodEnd::completed;
  }

  void stand_at(const Knot& knot) { system_.set_piece(knot, {knot.time_s + 1.0, knot.value}); }

  std::span<const double> times_s_;
  std::vector<Knot> knots_;
  std::size_t next_ = 0;
  Vector bound_;
  MethodRun run_;
};

/// With given steps: pieces are divided evenly. A time within a step is answered by a shorter step
/// to it, which is then forgotten.
class FixedDriver final : public MethodDriver {
 public:
  FixedDriver(StepSystem& system, const Protocol& protocol, const MethodSettings& settings,
              std::span<const double> times_s)
      : MethodDriver(system, protocol, settings, times_s),
        rule_(fixed_rule(system, settings)),
        balance_(role_of<BalanceSystem>(system)) {}
  [[nodiscard]] bool applies() const override { return rule_ != nullptr; }

 private:
  MethodEnd jump() override { return rule_->jump(time_s_, state_); }

  MethodEnd cross(const Knot& from, const Knot& to) override {
    const double length = to.time_s - from.time_s;
    const double count = std::max(1.0, std::ceil(length / settings_.step_s * (1.0 - 1e-12)));
    // Each step up to the last time takes an evaluation at least.
    const double least = (last_asked_s() - from.time_s) / settings_.step_s;
    if (!(least <= static_cast<double>(settings_.most_rates))) return MethodEnd::too_much_work;
    const double h = length / count;
    const auto at_step = [&](std::uint64_t i) {
      return from.time_s + length * (static_cast<double>(i) / count);
    };
    const auto steps = static_cast<std::uint64_t>(count);
    for (std::uint64_t i = 0; i < steps; ++i) {
      time_s_ = at_step(i);
      const double until = i + 1 == steps ? to.time_s : at_step(i + 1);
      if (const auto end = answer_before(until, h); end != MethodEnd::completed) return end;
      if (all_answered()) return MethodEnd::completed;
      if (const auto end = rule_->step(time_s_, h, state_); end != MethodEnd::completed) {
        return cause(end, state_);
      }
      ++steps_;
      if (const auto end = end_at(state_); end != MethodEnd::completed) return end;
      time_s_ = until;
    }
    // Just before a jump at the end.
    while (!all_answered() && asked_s() < to.time_s) {
      if (const auto end = answer(to.time_s, state_); end != MethodEnd::completed) return end;
    }
    return MethodEnd::completed;
  }

  /// Answers what is asked for from here to the end of the step, that end left out.
  MethodEnd answer_before(double until_s, double h) {
    while (!all_answered() && asked_s() < until_s - kSameTime * h) {
      const double part = asked_s() - time_s_;
      if (part <= kSameTime * h) {
        if (const auto end = answer(time_s_, state_); end != MethodEnd::completed) return end;
        continue;
      }
      Vector there = state_;
      const auto place = balance_ != nullptr ? balance_->place() : BalanceSystem::Place{};
      if (const auto end = rule_->step(time_s_, part, there); end != MethodEnd::completed) {
        return cause(end, there);
      }
      ++steps_;
      if (const auto end = end_at(there); end != MethodEnd::completed) return end;
      if (const auto end = answer(time_s_ + part, there); end != MethodEnd::completed) return end;
      if (balance_ != nullptr) balance_->set_place(place);
    }
    return MethodEnd::completed;
  }

  [[nodiscard]] long steps() const override { return steps_; }

  std::unique_ptr<FixedRule> rule_;
  BalanceSystem* balance_;  ///< of a system without masses
  long steps_ = 0;
};

class AdaptiveDriver final : public MethodDriver {
 public:
  AdaptiveDriver(StepSystem& system, const Protocol& protocol, const MethodSettings& settings,
                 std::span<const double> times_s)
      : MethodDriver(system, protocol, settings, times_s), rule_(adaptive_rule(system, settings)) {}
  [[nodiscard]] bool applies() const override { return rule_ != nullptr; }

 private:
  MethodEnd jump() override { return system_.jump(system_.imposed(time_s_), state_); }

  MethodEnd cross(const Knot& from, const Knot& to) override {
    time_s_ = from.time_s;
    while (!all_answered() && asked_s() <= from.time_s) {
      if (const auto end = answer(from.time_s, state_); end != MethodEnd::completed) return end;
    }
    if (all_answered()) return MethodEnd::completed;
    if (const auto end = rule_->restart(from.time_s, to.time_s, state_);
        end != MethodEnd::completed)
      return end;
    while (!all_answered() && asked_s() < to.time_s) {
      if (const auto end = advance(asked_s()); end != MethodEnd::completed) return end;
      if (const auto end = answer(time_s_, state_); end != MethodEnd::completed) return end;
    }
    return all_answered() ? MethodEnd::completed : advance(to.time_s);
  }

  MethodEnd advance(double time_s) {
    // Times that should be one and differ by rounding are too close for SUNDIALS.
    if (time_s - time_s_ <= 1e-13 * std::abs(time_s)) return MethodEnd::completed;
    if (const auto end = rule_->advance_to(time_s, state_); end != MethodEnd::completed) {
      const AdaptiveRule::GivenUp gave_up = rule_->given_up();
      time_s_ = gave_up.time_s;
      flag_ = gave_up.flag;
      return end;
    }
    time_s_ = time_s;
    return end_at(state_);
  }

  [[nodiscard]] long steps() const override { return rule_ ? rule_->steps() : 0; }
  [[nodiscard]] std::string detail() const override { return flag_; }

  std::unique_ptr<AdaptiveRule> rule_;
  std::string flag_;
};

MethodRun run_method(StepSystem& system, const Protocol& protocol, const MethodSettings& settings,
                     std::span<const double> times_s) {
  const bool adaptive = kStepRules[static_cast<std::size_t>(settings.rule)].adaptive;
  if (adaptive) return AdaptiveDriver(system, protocol, settings, times_s).go();
  return FixedDriver(system, protocol, settings, times_s).go();
}

void require_times(const Protocol& protocol, std::span<const double> times_s) {
  require_times_within(protocol, times_s);
  double before = protocol.start_s();
  for (const double t : times_s) {
    if (std::isinf(t)) {
      throw bad_input(protocol.name(), "no step leads to t = infinity", "finite times");
    }
    if (t < before) throw bad_input("times", shortest(t) + " s", "rising times");
    before = t;
  }
}

void require_valid(const MethodMasses& mass, std::size_t spheres) {
  if (static_cast<std::size_t>(mass.mass_kg.size()) != spheres) {
    throw bad_input("masses", fmt::format("{} of them", mass.mass_kg.size()),
                    fmt::format("one for each of {} spheres", spheres));
  }
  if (!(mass.mass_kg.array() > 0.0).all() || !mass.mass_kg.allFinite()) {
    throw bad_input("masses", "one that is not positive", "kg above 0");
  }
  if (!(mass.drag_per_s >= 0.0 && std::isfinite(mass.drag_per_s))) {
    throw bad_input("drag", shortest(mass.drag_per_s) + " 1/s", "at least 0");
  }
}

}  // namespace

MethodRun MethodProblem::run(const MethodSettings& settings,
                             std::span<const double> times_s) const {
  require_valid(settings);
  require_times(protocol_, times_s);
  const auto system = equations_(protocol_);
  return run_method(*system, protocol_, settings, times_s);
}

std::unique_ptr<MethodProblem> element_problem(const BondElement& material, Protocol protocol,
                                               std::optional<MethodMasses> mass) {
  require_one_branch(material, "element");
  if (mass) require_valid(*mass, 1);
  return std::make_unique<MethodProblem>(
      std::move(protocol), [material, mass = std::move(mass)](const Protocol& moved_by) {
        return element_system(material, moved_by, mass);
      });
}

std::unique_ptr<MethodProblem> network_problem(const DrivenNetwork& network, Protocol protocol,
                                               std::optional<MethodMasses> mass) {
  if (!network.tools.empty() || network.bonds.contact_count() > 0) {
    throw bad_input("network", "contacts with tools", "spheres that are driven themselves");
  }
  require_valid(network.probes, network.constraints);
  if (mass) require_valid(*mass, network.spheres());
  return std::make_unique<MethodProblem>(
      std::move(protocol), [&network, mass = std::move(mass)](const Protocol& moved_by) {
        return network_system(network, moved_by, mass);
      });
}

}  // namespace tpm::organ
