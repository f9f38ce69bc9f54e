#include "tpm/organ/steps/adaptive_rules.hpp"

#include <ida/ida.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <cmath>
#include <limits>

#include "tpm/organ/linear/sundials.hpp"

namespace tpm::organ {
namespace {

using sundials::check;
using sundials::view;
using Vector = Eigen::VectorXd;
constexpr long kMostSteps = std::numeric_limits<long>::max();

struct FreeNonlinearSolver {
  void operator()(SUNNonlinearSolver s) const { SUNNonlinSolFree(s); }
};
struct FreeIda {
  void operator()(void* memory) const { IDAFree(&memory); }
};

/// Data of an integrator's callbacks.
struct Side {
  NewtonSystem& system;
  long most_rates;
  MethodEnd last = MethodEnd::completed;  ///< the latest failure of the problem itself
  double at_s = 0.0;                      ///< its time
  bool exhausted = false;
  double gamma = 0.0;                ///< of IDA's matrix with masses
  BalanceSystem* balance = nullptr;  ///< what IDA solves without masses

  /// 0, or what SUNDIALS takes for "try a shorter step" or "stop".
  int answer(MethodEnd end, double time_s) {
    at_s = time_s;
    exhausted = system.work().rates > most_rates;
    if (exhausted) return -1;
    if (end != MethodEnd::completed) last = end;
    return end == MethodEnd::completed ? 0 : 1;
  }
};

Side& side(void* user_data) {
  return *static_cast<Side*>(user_data);
}

/// End of a run whose integrator gave up.
MethodEnd end_of(const Side& side, bool newton) {
  if (side.exhausted) return MethodEnd::too_much_work;
  if (side.last != MethodEnd::completed) return side.last;
  return newton ? MethodEnd::newton_failed : MethodEnd::diverged;
}

extern "C" {
int method_rate(sunrealtype t, N_Vector z, N_Vector z_dot, void* user_data) {
  auto rate = view(z_dot);
  const MethodEnd end = side(user_data).system.rate(t, view(z), rate);
  return side(user_data).answer(
      end == MethodEnd::completed && !rate.allFinite() ? MethodEnd::diverged : end, t);
}

int method_setup(sunrealtype t, N_Vector z, N_Vector, SUNMatrix, sunbooleantype,
                 sunbooleantype* is_new, sunrealtype gamma, void* user_data, N_Vector, N_Vector,
                 N_Vector) {
  *is_new = SUNTRUE;
  return side(user_data).answer(side(user_data).system.factorise(t, view(z), gamma), t);
}

int dae_residual(sunrealtype t, N_Vector z, N_Vector z_dot, N_Vector r, void* user_data);
int dae_setup(sunrealtype t, sunrealtype c, N_Vector z, N_Vector, N_Vector, SUNMatrix,
              void* user_data, N_Vector, N_Vector, N_Vector);

int method_solve(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, sunrealtype) {
  auto solution = view(x);
  solution = view(b);
  static_cast<NewtonSystem*>(solver->content)->solve(solution);
  return 0;
}
}

class CvodeRule final : public AdaptiveRule {
 public:
  CvodeRule(NewtonSystem& system, const MethodSettings& settings)
      : side_{system, settings.most_rates},
        context_(sundials::make_context()),
        state_(N_VNew_Serial(system.size(), context_.get())),
        error_(N_VClone(state_.get())),
        memory_(CVodeCreate(settings.rule == StepRule::cvode_adams ? CV_ADAMS : CV_BDF,
                            context_.get())) {
    view(state_.get()).setZero();
    view(error_.get()) = settings.tolerance * system.scales();
    void* m = memory_.get();
    check(CVodeInit(m, method_rate, 0.0, state_.get()), "CVodeInit");
    check(CVodeSetUserData(m, &side_), "CVodeSetUserData");
    check(CVodeSVtolerances(m, 0.0, error_.get()), "CVodeSVtolerances");
    check(CVodeSetMaxNumSteps(m, kMostSteps), "CVodeSetMaxNumSteps");
    sundials::mute(m);
    if (settings.rule == StepRule::cvode_adams) {
      nonlinear_.reset(SUNNonlinSol_FixedPoint(state_.get(), 0, context_.get()));
      check(CVodeSetNonlinearSolver(m, nonlinear_.get()), "CVodeSetNonlinearSolver");
      return;
    }
    matrix_ = sundials::custom_matrix(context_.get());
    solver_ = sundials::custom_solver(context_.get(), &system, method_solve);
    check(CVodeSetLinearSolver(m, solver_.get(), matrix_.get()), "CVodeSetLinearSolver");
    check(CVodeSetLinSysFn(m, method_setup), "CVodeSetLinSysFn");
  }

  MethodEnd restart(double time_s, double stop_s, const Vector& state) override {
    before_ += steps_of_piece();
    started_ = true;
    view(state_.get()) = state;
    check(CVodeReInit(memory_.get(), time_s, state_.get()), "CVodeReInit");
    check(CVodeSetStopTime(memory_.get(), stop_s), "CVodeSetStopTime");
    return MethodEnd::completed;
  }

  MethodEnd advance_to(double time_s, Vector& state) override {
    double reached = 0.0;
    side_.last = MethodEnd::completed;
    const int flag = CVode(memory_.get(), time_s, state_.get(), &reached, CV_NORMAL);
    if (flag < 0) {
      given_up_ = {side_.at_s, sundials::flag_name(flag)};
      return end_of(side_, flag == CV_CONV_FAILURE);
    }
    state = view(state_.get());
    return MethodEnd::completed;
  }

  [[nodiscard]] GivenUp given_up() const override { return given_up_; }
  [[nodiscard]] long steps() const override { return before_ + steps_of_piece(); }

 private:
  [[nodiscard]] long steps_of_piece() const {
    long steps = 0;
    if (started_) check(CVodeGetNumSteps(memory_.get(), &steps), "CVodeGetNumSteps");
    return steps;
  }

  Side side_;
  sundials::Context context_;
  sundials::Vector state_, error_;
  sundials::Matrix matrix_;
  sundials::LinearSolver solver_;
  std::unique_ptr<std::remove_pointer_t<SUNNonlinearSolver>, FreeNonlinearSolver> nonlinear_;
  sundials::Cvodes memory_;
  bool started_ = false;
  long before_ = 0;
  GivenUp given_up_;
};

/// Of a system whose state is empty: elastic bonds without masses. SUNDIALS does not take it; each
/// answer is a balance of its own.
class NothingToIntegrate final : public AdaptiveRule {
 public:
  MethodEnd restart(double /*time_s*/, double /*stop_s*/, const Vector& /*state*/) override {
    return MethodEnd::completed;
  }
  MethodEnd advance_to(double /*time_s*/, Vector& /*state*/) override {
    ++steps_;
    return MethodEnd::completed;
  }
  [[nodiscard]] GivenUp given_up() const override { return {}; }
  [[nodiscard]] long steps() const override { return steps_; }

 private:
  long steps_ = 0;
};

extern "C" {
int dae_solve(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, sunrealtype) {
  auto solution = view(x);
  solution = view(b);
  BalanceSystem* balance = side(solver->content).balance;
  if (balance == nullptr) {
    solution *= side(solver->content).gamma;
    side(solver->content).system.solve(solution);
  } else {
    auto place = solution.head(balance->places());
    auto y = solution.tail(balance->viscous());
    balance->solve_pair(place, y);
  }
  return 0;
}
}

/// The unknowns are (x, v, y) with masses, and (positions, y) without.
class IdaRule final : public AdaptiveRule {
 public:
  IdaRule(NewtonSystem& system, const MethodSettings& settings)
      : side_{.system = system,
              .most_rates = settings.most_rates,
              .balance = role_of<BalanceSystem>(system)},
        places_(side_.balance != nullptr ? side_.balance->places() : 0),
        context_(sundials::make_context()),
        state_(N_VNew_Serial(places_ + system.size(), context_.get())),
        rate_(N_VClone(state_.get())),
        error_(N_VClone(state_.get())),
        memory_(IDACreate(context_.get())) {
    const Vector scales = system.scales();
    view(state_.get()).setZero();
    view(rate_.get()).setZero();
    view(error_.get()).head(places_).setConstant(settings.tolerance * scales[0]);
    view(error_.get()).tail(scales.size()) = settings.tolerance * scales;
    void* m = memory_.get();
    check(IDAInit(m, dae_residual, 0.0, state_.get(), rate_.get()), "IDAInit");
    check(IDASetUserData(m, &side_), "IDASetUserData");
    check(IDASVtolerances(m, 0.0, error_.get()), "IDASVtolerances");
    check(IDASetMaxNumSteps(m, kMostSteps), "IDASetMaxNumSteps");
    mute();
    matrix_ = sundials::custom_matrix(context_.get());
    solver_ = sundials::custom_solver(context_.get(), &side_, dae_solve);
    check(IDASetLinearSolver(m, solver_.get(), matrix_.get()), "IDASetLinearSolver");
    check(IDASetJacFn(m, dae_setup), "IDASetJacFn");
  }

  MethodEnd restart(double time_s, double stop_s, const Vector& state) override {
    NewtonSystem& system = side_.system;
    before_ += steps_of_piece();
    started_ = true;
    auto z = view(state_.get());
    auto z_dot = view(rate_.get());
    Vector rate(state.size());
    if (const auto end = system.rate(time_s, state, rate); end != MethodEnd::completed) return end;
    z.tail(state.size()) = state;
    z_dot.tail(state.size()) = rate;
    if (places_ > 0) {
      z.head(places_) = side_.balance->placed();
      Vector moving;
      if (const auto end = place_rate(time_s, stop_s, state, rate, moving);
          end != MethodEnd::completed) {
        return end;
      }
      z_dot.head(places_) = moving;
    }
    check(IDAReInit(memory_.get(), time_s, state_.get(), rate_.get()), "IDAReInit");
    check(IDASetStopTime(memory_.get(), stop_s), "IDASetStopTime");
    return MethodEnd::completed;
  }

  MethodEnd advance_to(double time_s, Vector& state) override {
    double reached = 0.0;
    side_.last = MethodEnd::completed;
    const int flag =
        IDASolve(memory_.get(), time_s, &reached, state_.get(), rate_.get(), IDA_NORMAL);
    if (flag < 0) {
      char* name = IDAGetReturnFlagName(flag);
      given_up_ = {side_.at_s, name};
      std::free(name);  // NOLINT(cppcoreguidelines-no-malloc): SUNDIALS allocates it with malloc
      return end_of(side_, flag == IDA_CONV_FAIL);
    }
    state = view(state_.get()).tail(state.size());
    return MethodEnd::completed;
  }

  [[nodiscard]] GivenUp given_up() const override { return given_up_; }
  [[nodiscard]] long steps() const override { return before_ + steps_of_piece(); }

 private:
  /// The rate of the positions along the solution, from two balances close to each other.
  MethodEnd place_rate(double time_s, double stop_s, const Vector& state, const Vector& rate,
                       Vector& moving) {
    NewtonSystem& system = side_.system;
    BalanceSystem& balance = *side_.balance;
    const BalanceSystem::Place here = balance.place();
    const double apart = 1e-4 * std::min(stop_s - time_s, shortest_s());
    const Vector from = balance.placed();
    Vector there = state + apart * rate;
    Vector unused(state.size());
    const MethodEnd end = system.rate(time_s + apart, there, unused);
    moving = (balance.placed() - from) / apart;
    balance.set_place(here);
    return end;
  }

  [[nodiscard]] double shortest_s() const {
    const Vector& times_s = side_.system.relaxation_times_s();
    return times_s.size() > 0 ? times_s.minCoeff() : std::numeric_limits<double>::infinity();
  }

  void mute() {
#if SUNDIALS_VERSION_MAJOR < 7
    const IDAErrHandlerFn nothing = [](int, const char*, const char*, char*, void*) {};
    check(IDASetErrHandlerFn(memory_.get(), nothing, nullptr), "IDASetErrHandlerFn");
#endif
  }

  [[nodiscard]] long steps_of_piece() const {
    long steps = 0;
    if (started_) check(IDAGetNumSteps(memory_.get(), &steps), "IDAGetNumSteps");
    return steps;
  }

  Side side_;
  Eigen::Index places_;
  sundials::Context context_;
  sundials::Vector state_, rate_, error_;
  sundials::Matrix matrix_;
  sundials::LinearSolver solver_;
  std::unique_ptr<void, FreeIda> memory_;
  bool started_ = false;
  long before_ = 0;
  GivenUp given_up_;
};

extern "C" {
int dae_residual(sunrealtype t, N_Vector z, N_Vector z_dot, N_Vector r, void* user_data) {
  NewtonSystem& system = side(user_data).system;
  BalanceSystem* balance = side(user_data).balance;
  auto left = view(r);
  MethodEnd end = MethodEnd::completed;
  if (balance == nullptr) {
    end = system.rate(t, view(z), left);
    left = view(z_dot) - left;
  } else {
    const Eigen::Index n = balance->places();
    const Eigen::Index m = system.viscous();
    Vector elongation;
    auto imbalance = left.head(n);
    balance->imbalance(t, view(z).head(n), view(z).tail(m), imbalance, elongation);
    left.tail(m) = view(z_dot).tail(m) -
                   (elongation - view(z).tail(m)).cwiseQuotient(system.relaxation_times_s());
  }
  return side(user_data).answer(
      end == MethodEnd::completed && !left.allFinite() ? MethodEnd::diverged : end, t);
}

int dae_setup(sunrealtype t, sunrealtype c, N_Vector z, N_Vector, N_Vector, SUNMatrix,
              void* user_data, N_Vector, N_Vector, N_Vector) {
  NewtonSystem& system = side(user_data).system;
  BalanceSystem* balance = side(user_data).balance;
  if (balance == nullptr) {
    side(user_data).gamma = 1.0 / c;
    return side(user_data).answer(system.factorise(t, view(z), 1.0 / c), t);
  }
  const MethodEnd end = balance->factorise_pair(t, view(z).head(balance->places()),
                                                view(z).tail(system.viscous()), c);
  return side(user_data).answer(end, t);
}
}

}  // namespace

std::unique_ptr<AdaptiveRule> adaptive_rule(StepSystem& system, const MethodSettings& settings) {
  auto* newton = role_of<NewtonSystem>(system);
  const bool adaptive = kStepRules[static_cast<std::size_t>(settings.rule)].adaptive;
  if (newton == nullptr || !adaptive) return nullptr;
  if (system.size() == 0) return std::make_unique<NothingToIntegrate>();
  if (settings.rule == StepRule::ida) return std::make_unique<IdaRule>(*newton, settings);
  return std::make_unique<CvodeRule>(*newton, settings);
}

}  // namespace tpm::organ
