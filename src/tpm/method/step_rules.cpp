#include "tpm/method/step_rules.hpp"

#include <cmath>
#include <numbers>

#include "tpm/solve/relaxation_filter.hpp"

namespace tpm {

ImplicitStage ImplicitStage::of(Eigen::VectorXd known, double c, Eigen::Index remembered,
                                double relaxation_time_s) {
  const double ratio = c / relaxation_time_s;
  ImplicitStage stage{std::move(known), c, ratio / (1.0 + ratio)};
  stage.known.tail(remembered) /= 1.0 + ratio;
  return stage;
}

void StepSystem::set_piece(const Knot& from, const Knot& to) {
  from_ = from;
  slope_ = (to.value - from.value) / (to.time_s - from.time_s);
}

MethodEnd FixedRule::jump(StepSystem& system, double time_s, Eigen::VectorXd& state) {
  return system.jump(system.imposed(time_s), state);
}

namespace {

using Vector = Eigen::VectorXd;

/// z = known + c rate(t, z).
MethodEnd solve_stage(StepSystem& system, double time_s, Vector known, double c, Vector& state) {
  return system.stage(
      time_s,
      ImplicitStage::of(std::move(known), c, system.remembered(), system.relaxation_time_s()),
      state);
}

class ForwardEuler final : public FixedRule {
 public:
  MethodEnd step(StepSystem& system, double time_s, double h, Vector& state) override {
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
/// then positions by the new velocities. What bonds remember follows at last, towards the new
/// elongations; without masses positions balance with what was remembered before.
class SemiImplicitEuler final : public FixedRule {
 public:
  MethodEnd step(StepSystem& system, double time_s, double h, Vector& state) override {
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
    const double ratio = h / system.relaxation_time_s();
    auto y = state.tail(system.remembered());
    y = (y + ratio * elongation_) / (1.0 + ratio);
    return MethodEnd::completed;
  }

 private:
  Vector rate_, elongation_;
};

/// The classical Runge-Kutta rule.
class RungeKutta4 final : public FixedRule {
 public:
  MethodEnd step(StepSystem& system, double time_s, double h, Vector& state) override {
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

class BackwardEuler final : public FixedRule {
 public:
  MethodEnd step(StepSystem& system, double time_s, double h, Vector& state) override {
    return solve_stage(system, time_s + h, state, h, state);
  }
};

class ImplicitMidpoint final : public FixedRule {
 public:
  MethodEnd step(StepSystem& system, double time_s, double h, Vector& state) override {
    middle_ = state;
    const MethodEnd end = solve_stage(system, time_s + 0.5 * h, state, 0.5 * h, middle_);
    if (end == MethodEnd::completed) state = 2.0 * middle_ - state;
    return end;
  }

 private:
  Vector middle_;
};

/// Average acceleration, beta = 1/4 and gamma = 1/2: the trapezoidal rule for x and v, and with it
/// for what bonds remember.
class Newmark final : public FixedRule {
 public:
  MethodEnd step(StepSystem& system, double time_s, double h, Vector& state) override {
    rate_.resize(state.size());
    if (const MethodEnd end = system.rate(time_s, state, rate_); end != MethodEnd::completed)
      return end;
    return solve_stage(system, time_s + h, state + 0.5 * h * rate_, 0.5 * h, state);
  }

 private:
  Vector rate_;
};

/// Bank et al. 1985 with gamma = 2 - sqrt 2: both stages have one Newton matrix, and the rule is
/// L-stable.
class TrBdf2 final : public FixedRule {
 public:
  MethodEnd step(StepSystem& system, double time_s, double h, Vector& state) override {
    constexpr double kGamma = 2.0 - std::numbers::sqrt2;
    constexpr double kOfMiddle = 1.0 / (kGamma * (2.0 - kGamma));
    constexpr double kC = (1.0 - kGamma) / (2.0 - kGamma);
    rate_.resize(state.size());
    if (const MethodEnd end = system.rate(time_s, state, rate_); end != MethodEnd::completed)
      return end;
    middle_ = state;
    const double c = 0.5 * kGamma * h;
    if (const auto end = solve_stage(system, time_s + kGamma * h, state + c * rate_, c, middle_);
        end != MethodEnd::completed) {
      return end;
    }
    Vector known = kOfMiddle * middle_ + (1.0 - kOfMiddle) * state;
    state = middle_;
    return solve_stage(system, time_s + h, std::move(known), kC * h, state);
  }

 private:
  Vector rate_, middle_;
};

/// What bonds remember is advanced exactly under elongations that are linear over the step, solved
/// together with the positions where it ends: those that balance or, with masses, those of the
/// trapezoidal rule (Newmark).
class Exponential final : public FixedRule {
 public:
  MethodEnd step(StepSystem& system, double time_s, double h, Vector& state) override {
    const Eigen::Index n = system.coordinates();
    if (const MethodEnd end = system.elongations(time_s, state, elongation_);
        end != MethodEnd::completed) {
      return end;
    }
    const RelaxationWeights w = relaxation_weights(h / system.relaxation_time_s());
    ImplicitStage stage{state, 0.5 * h, w.w1};
    if (n > 0) {
      rate_.resize(state.size());
      if (const MethodEnd end = system.rate(time_s, state, rate_); end != MethodEnd::completed)
        return end;
      stage.known.head(2 * n) += 0.5 * h * rate_.head(2 * n);
    }
    const Eigen::Index m = system.remembered();
    stage.known.tail(m) = w.r * state.tail(m) + w.w0 * elongation_;
    return system.stage(time_s + h, stage, state);
  }

 private:
  Vector rate_, elongation_;
};

class Xpbd final : public FixedRule {
 public:
  explicit Xpbd(int sweeps) : sweeps_(sweeps) {}
  MethodEnd step(StepSystem& system, double time_s, double h, Vector& state) override {
    return system.project(time_s + h, h, sweeps_, state);
  }
  MethodEnd jump(StepSystem& system, double time_s, Vector& state) override {
    return system.project(time_s, 0.0, sweeps_, state);
  }

 private:
  int sweeps_;
};

}  // namespace

std::unique_ptr<FixedRule> fixed_rule(const MethodSettings& settings) {
  switch (settings.rule) {
    case StepRule::forward_euler:
      return std::make_unique<ForwardEuler>();
    case StepRule::semi_implicit_euler:
      return std::make_unique<SemiImplicitEuler>();
    case StepRule::rk4:
      return std::make_unique<RungeKutta4>();
    case StepRule::backward_euler:
      return std::make_unique<BackwardEuler>();
    case StepRule::implicit_midpoint:
      return std::make_unique<ImplicitMidpoint>();
    case StepRule::newmark:
      return std::make_unique<Newmark>();
    case StepRule::tr_bdf2:
      return std::make_unique<TrBdf2>();
    case StepRule::exponential:
      return std::make_unique<Exponential>();
    case StepRule::xpbd:
      return std::make_unique<Xpbd>(settings.sweeps);
    case StepRule::cvode_adams:
    case StepRule::cvode_bdf:
    case StepRule::ida:
      break;
  }
  return nullptr;
}

}  // namespace tpm
