#include "tpm/organ/steps/step_rules.hpp"

#include <cmath>
#include <numbers>
#include <tuple>

#include "tpm/law/relaxation/relaxation_filter.hpp"

namespace tpm::organ {

ImplicitStage ImplicitStage::of(Eigen::VectorXd known, double c,
                                const Eigen::VectorXd& relaxation_times_s) {
  const Eigen::ArrayXd ratio = c / relaxation_times_s.array();
  ImplicitStage stage{std::move(known), c, ratio / (1.0 + ratio)};
  stage.known.tail(ratio.size()).array() /= 1.0 + ratio;
  return stage;
}

void StepSystem::set_piece(const Knot& from, const Knot& to) {
  from_ = from;
  slope_ = (to.value - from.value) / (to.time_s - from.time_s);
}

namespace {

using Vector = Eigen::VectorXd;

/// A rule on a system in the roles that it needs.
template <class... Roles>
class RuleOn : public FixedRule {
 public:
  explicit RuleOn(Roles&... roles) : roles_(roles...) {}
  MethodEnd jump(double time_s, Vector& state) override {
    StepSystem& system = std::get<0>(roles_);
    return system.jump(system.imposed(time_s), state);
  }

 protected:
  template <class Role>
  [[nodiscard]] Role& as() const {
    return std::get<Role&>(roles_);
  }

 private:
  std::tuple<Roles&...> roles_;
};
using RateRule = RuleOn<RateSystem>;
using StageRule = RuleOn<StageSystem>;
using RateStageRule = RuleOn<RateSystem, StageSystem>;

/// The rule on a system that has all roles; else none.
template <class Rule, class... Roles>
std::unique_ptr<FixedRule> rule_on(Roles*... roles) {
  if (((roles == nullptr) || ...)) return nullptr;
  return std::make_unique<Rule>(*roles...);
}

/// z = known + c rate(t, z).
MethodEnd solve_stage(StageSystem& system, double time_s, Vector known, double c, Vector& state) {
  return system.stage(time_s, ImplicitStage::of(std::move(known), c, system.relaxation_times_s()),
                      state);
}

class ForwardEuler final : public RateRule {
 public:
  using RuleOn::RuleOn;
  MethodEnd step(double time_s, double h, Vector& state) override {
    auto& system = as<RateSystem>();
    rate_.resize(state.size());
    if (const MethodEnd end = system.rate(time_s, state, rate_); end != MethodEnd::completed)
      return end;
    state += h * rate_;
    return MethodEnd::completed;
  }

 private:
  Vector rate_;
};

/// With masses velocities first, by the forces where the step begins and the drag where it ends,
/// then positions by the new velocities. The viscous elongations follow at last, towards the new
/// elongations; without masses positions balance with the viscous elongations before.
class SemiImplicitEuler final : public RateRule {
 public:
  using RuleOn::RuleOn;
  MethodEnd step(double time_s, double h, Vector& state) override {
    auto& system = as<RateSystem>();
    const Eigen::Index n = system.coordinates();
    if (n > 0) {
      rate_.resize(state.size());
      if (const MethodEnd end = system.rate(time_s, state, rate_); end != MethodEnd::completed)
        return end;
      auto v = state.segment(n, n);
      const double drag = system.drag_per_s();
      v = ((1.0 + h * drag) * v + h * rate_.segment(n, n)) / (1.0 + h * drag);
      state.head(n) += h * v;
    }
    if (const MethodEnd end = system.elongations(time_s + h, state, elongation_);
        end != MethodEnd::completed) {
      return end;
    }
    const Eigen::ArrayXd ratio = h / system.relaxation_times_s().array();
    auto y = state.tail(system.viscous()).array();
    y = (y + ratio * elongation_.array()) / (1.0 + ratio);
    return MethodEnd::completed;
  }

 private:
  Vector rate_, elongation_;
};

/// The classical Runge-Kutta rule.
class RungeKutta4 final : public RateRule {
 public:
  using RuleOn::RuleOn;
  MethodEnd step(double time_s, double h, Vector& state) override {
    auto& system = as<RateSystem>();
    constexpr std::array<double, 4> kNode{0.0, 0.5, 0.5, 1.0};
    constexpr std::array<double, 4> kWeight{1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
    rate_.setZero(state.size());
    sum_.setZero(state.size());
    for (std::size_t i = 0; i < 4; ++i) {
      at_ = state + kNode[i] * h * rate_;
      if (const auto end = system.rate(time_s + kNode[i] * h, at_, rate_);
          end != MethodEnd::completed) {
        state = at_;  // what it failed at
        return end;
      }
      sum_ += kWeight[i] * h * rate_;
    }
    state += sum_;
    return MethodEnd::completed;
  }

 private:
  Vector rate_, sum_, at_;
};

class BackwardEuler final : public StageRule {
 public:
  using RuleOn::RuleOn;
  MethodEnd step(double time_s, double h, Vector& state) override {
    auto& system = as<StageSystem>();
    return solve_stage(system, time_s + h, state, h, state);
  }
};

class ImplicitMidpoint final : public StageRule {
 public:
  using RuleOn::RuleOn;
  MethodEnd step(double time_s, double h, Vector& state) override {
    auto& system = as<StageSystem>();
    middle_ = state;
    const MethodEnd end = solve_stage(system, time_s + 0.5 * h, state, 0.5 * h, middle_);
    if (end == MethodEnd::completed) state = 2.0 * middle_ - state;
    return end;
  }

 private:
  Vector middle_;
};

/// Average acceleration, beta = 1/4 and gamma = 1/2: the trapezoidal rule for x and v, and with it
/// for the viscous elongations.
class Newmark final : public RateStageRule {
 public:
  using RuleOn::RuleOn;
  MethodEnd step(double time_s, double h, Vector& state) override {
    auto& system = as<RateSystem>();
    auto& stages = as<StageSystem>();
    rate_.resize(state.size());
    if (const MethodEnd end = system.rate(time_s, state, rate_); end != MethodEnd::completed)
      return end;
    return solve_stage(stages, time_s + h, state + 0.5 * h * rate_, 0.5 * h, state);
  }

 private:
  Vector rate_;
};

/// Bank et al. 1985 with gamma = 2 - sqrt 2: both stages have one Newton matrix, and the rule is
/// L-stable.
class TrBdf2 final : public RateStageRule {
 public:
  using RuleOn::RuleOn;
  MethodEnd step(double time_s, double h, Vector& state) override {
    auto& system = as<RateSystem>();
    auto& stages = as<StageSystem>();
    constexpr double kGamma = 2.0 - std::numbers::sqrt2;
    constexpr double kOfMiddle = 1.0 / (kGamma * (2.0 - kGamma));
    constexpr double kC = (1.0 - kGamma) / (2.0 - kGamma);
    rate_.resize(state.size());
    if (const MethodEnd end = system.rate(time_s, state, rate_); end != MethodEnd::completed)
      return end;
    middle_ = state;
    const double c = 0.5 * kGamma * h;
    if (const auto end = solve_stage(stages, time_s + kGamma * h, state + c * rate_, c, middle_);
        end != MethodEnd::completed) {
      return end;
    }
    Vector known = kOfMiddle * middle_ + (1.0 - kOfMiddle) * state;
    state = middle_;
    return solve_stage(stages, time_s + h, std::move(known), kC * h, state);
  }

 private:
  Vector rate_, middle_;
};

/// The viscous elongations are advanced exactly under elongations that are linear over the step,
/// solved together with the positions where it ends: those that balance or, with masses, those of
/// the trapezoidal rule (Newmark).
class Exponential final : public RateStageRule {
 public:
  using RuleOn::RuleOn;
  MethodEnd step(double time_s, double h, Vector& state) override {
    auto& system = as<RateSystem>();
    auto& stages = as<StageSystem>();
    const Eigen::Index n = system.coordinates();
    if (const MethodEnd end = system.elongations(time_s, state, elongation_);
        end != MethodEnd::completed) {
      return end;
    }
    if (h != weighted_for_s_) set_weights(h, system.relaxation_times_s());
    ImplicitStage stage{state, 0.5 * h, of_end_};
    if (n > 0) {
      rate_.resize(state.size());
      if (const MethodEnd end = system.rate(time_s, state, rate_); end != MethodEnd::completed)
        return end;
      stage.known.head(2 * n) += 0.5 * h * rate_.head(2 * n);
    }
    const Eigen::Index m = system.viscous();
    stage.known.tail(m) = keep_.cwiseProduct(state.tail(m)) + of_start_.cwiseProduct(elongation_);
    return stages.stage(time_s + h, stage, state);
  }

 private:
  void set_weights(double h, const Vector& times_s) {
    for (Vector* weights : {&keep_, &of_start_, &of_end_}) weights->resize(times_s.size());
    for (Eigen::Index i = 0; i < times_s.size(); ++i) {
      const RelaxationWeights w = relaxation_weights(h / times_s[i]);
      keep_[i] = w.r;
      of_start_[i] = w.w0;
      of_end_[i] = w.w1;
    }
    weighted_for_s_ = h;
  }

  Vector rate_, elongation_;
  double weighted_for_s_ = -1.0;
  Vector keep_, of_start_, of_end_;  ///< of each y
};

class Xpbd final : public RuleOn<ProjectionSystem> {
 public:
  Xpbd(ProjectionSystem& system, int sweeps) : RuleOn(system), sweeps_(sweeps) {}
  MethodEnd step(double time_s, double h, Vector& state) override {
    return as<ProjectionSystem>().project(time_s + h, h, sweeps_, state);
  }
  MethodEnd jump(double time_s, Vector& state) override {
    return as<ProjectionSystem>().project(time_s, 0.0, sweeps_, state);
  }

 private:
  int sweeps_;
};

}  // namespace

std::unique_ptr<FixedRule> fixed_rule(StepSystem& system, const MethodSettings& settings) {
  auto* rates = role_of<RateSystem>(system);
  auto* stages = role_of<StageSystem>(system);
  auto* projection = role_of<ProjectionSystem>(system);
  switch (settings.rule) {
    case StepRule::forward_euler:
      return rule_on<ForwardEuler>(rates);
    case StepRule::semi_implicit_euler:
      return rule_on<SemiImplicitEuler>(rates);
    case StepRule::rk4:
      return rule_on<RungeKutta4>(rates);
    case StepRule::backward_euler:
      return rule_on<BackwardEuler>(stages);
    case StepRule::implicit_midpoint:
      return rule_on<ImplicitMidpoint>(stages);
    case StepRule::newmark:
      return rule_on<Newmark>(rates, stages);
    case StepRule::tr_bdf2:
      return rule_on<TrBdf2>(rates, stages);
    case StepRule::exponential:
      return rule_on<Exponential>(rates, stages);
    case StepRule::xpbd:
      if (projection == nullptr) return nullptr;
      return std::make_unique<Xpbd>(*projection, settings.sweeps);
    case StepRule::cvode_adams:
    case StepRule::cvode_bdf:
    case StepRule::ida:
      break;
  }
  return nullptr;
}

}  // namespace tpm::organ
