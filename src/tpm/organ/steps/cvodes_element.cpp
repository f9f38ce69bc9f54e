#include "tpm/organ/steps/cvodes_element.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/element/closed_form.hpp"
#include "tpm/organ/linear/sundials.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

/// Variables by which the state is differentiated: the five material parameters and the factor
/// l0/A0 that turns a load into stress times length.
enum StateParameter : int { sE1, sE2, sEprime, sEta1, sSpacing, sLoadFactor, kStateParameters };

using StateVector = std::array<double, kStateParameters>;

/// The right-hand side on one linear piece of the history.
class ElementEquation {
 public:
  ElementEquation(const TpmParameters& p, const TensionRule& rule, const Protocol& protocol)
      : p_(p), drive_(protocol.drive()), law_{p.Eprime_Pa, p.spacing_m} {
    if (rule.kind == TensionRule::Kind::frozen_at_value) frozen_ = rule.lambda1_Pa;
    if (rule.kind == TensionRule::Kind::frozen_at_peak) {
      if (drive_ == Drive::force) {
        throw bad_input("tension rule", "'frozen at peak' needs an imposed displacement",
                        "a frozen value of lambda1 or the exact rule");
      }
      peak_ = protocol.peak();
    }
  }

  void set_piece(const Knot& from, const Knot& to) {
    from_ = from;
    slope_ = to.time_s > from.time_s ? (to.value - from.value) / (to.time_s - from.time_s) : 0.0;
  }

  [[nodiscard]] const TpmParameters& parameters() const { return p_; }

  /// de1/dt
  [[nodiscard]] double rate(double t, double e1) const {
    const double e = elongation(t, e1);
    return (p_.E2_Pa * (e - e1) - p_.E1_Pa * e1) / p_.eta1_Pa_s;
  }

  /// d(de1/dt)/de1
  [[nodiscard]] double rate_slope(double t, double e1) const {
    const double through_e =
        drive_ == Drive::force ? p_.E2_Pa / (p_.E2_Pa + tension_slope(elongation(t, e1))) : 0.0;
    return (p_.E2_Pa * (through_e - 1.0) - p_.E1_Pa) / p_.eta1_Pa_s;
  }

  /// Partial derivatives of de1/dt at constant e1.
  [[nodiscard]] double rate_partial(double t, double e1, int parameter) const {
    const double e = elongation(t, e1);
    double partial = p_.E2_Pa * elongation_partial(t, e, e1, parameter);
    if (parameter == sE1) partial -= e1;
    if (parameter == sE2) partial += e - e1;
    if (parameter == sEta1) partial -= rate(t, e1);
    return partial / p_.eta1_Pa_s;
  }

  /// Response and, in natural parameters, its derivatives given those of e1.
  [[nodiscard]] double response(double t, double e1) const {
    const double e = elongation(t, e1);
    if (drive_ == Drive::force) return e;
    return (p_.E2_Pa * (e - e1) + tension(e)) * p_.modulus_to_stiffness_m();
  }
  [[nodiscard]] TpmVector response_sensitivity(double t, double e1, const StateVector& s) const {
    const double e = elongation(t, e1);
    TpmVector d{};
    constexpr std::array<int, 5> kNatural{kE1, kE2, kEprime, kEta1, kSpacing};
    if (drive_ == Drive::force) {
      const double through_e1 = p_.E2_Pa / (p_.E2_Pa + tension_slope(e));
      for (int j = 0; j <= sSpacing; ++j) {
        d[at(kNatural[at(j)])] = elongation_partial(t, e, e1, j) + through_e1 * s[at(j)];
      }
      const double load_factor = p_.l0_m / p_.A0_m2;
      const double d_factor =
          elongation_partial(t, e, e1, sLoadFactor) + through_e1 * s[sLoadFactor];
      d[kA0] = -d_factor * load_factor / p_.A0_m2;
      d[kL0] = d_factor / p_.A0_m2;
      return d;
    }
    const double scale = p_.modulus_to_stiffness_m();
    for (int j = 0; j <= sSpacing; ++j) {
      double direct = tension_partial(e, j);
      if (j == sE2) direct += e - e1;
      d[at(kNatural[at(j)])] = scale * (direct - p_.E2_Pa * s[at(j)]);
    }
    const double force = response(t, e1);
    d[kA0] = force / p_.A0_m2;
    d[kL0] = -force / p_.l0_m;
    return d;
  }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  [[nodiscard]] double imposed(double t) const { return from_.value + slope_ * (t - from_.time_s); }

  [[nodiscard]] double lambda1_frozen() const {
    return std::isnan(frozen_) ? lambda1_Pa(p_.Eprime_Pa, peak_, p_.spacing_m) : frozen_;
  }
  [[nodiscard]] bool is_frozen() const { return !std::isnan(frozen_) || peak_ > 0.0; }

  [[nodiscard]] double tension(double e) const {
    return is_frozen() ? lambda1_frozen() * e : law_.value(e);
  }
  [[nodiscard]] double tension_slope(double e) const {
    return is_frozen() ? lambda1_frozen() : law_.slope(e);
  }
  [[nodiscard]] double tension_partial(double e, int parameter) const {
    if (!std::isnan(frozen_)) return 0.0;
    const double where = peak_ > 0.0 ? peak_ : e;
    const double share = peak_ > 0.0 ? e / peak_ : 1.0;
    if (parameter == sEprime) return TensionLaw{1.0, p_.spacing_m}.value(where) * share;
    if (parameter == sSpacing) return law_.d_spacing(where) * share;
    return 0.0;
  }

  /// e at a given state: imposed, or the root of E2 (e - e1) + T(e) = load l0/A0.
  [[nodiscard]] double elongation(double t, double e1) const {
    if (drive_ == Drive::displacement) return imposed(t);
    const double target = imposed(t) / p_.modulus_to_stiffness_m() + p_.E2_Pa * e1;
    double e = p_.E2_Pa > 0.0 ? target / p_.E2_Pa : p_.spacing_m;
    for (int iteration = 0; iteration < 100; ++iteration) {
      const double step = (p_.E2_Pa * e + tension(e) - target) / (p_.E2_Pa + tension_slope(e));
      e -= step;
      if (std::abs(step) <= 4.0 * std::numeric_limits<double>::epsilon() * std::abs(e)) break;
    }
    return e;
  }

  /// de/dp at constant e1 and time.
  [[nodiscard]] double elongation_partial(double t, double e, double e1, int parameter) const {
    if (drive_ == Drive::displacement) return 0.0;
    double numerator = -tension_partial(e, parameter);
    if (parameter == sE2) numerator -= e - e1;
    if (parameter == sLoadFactor) numerator += imposed(t);
    return numerator / (p_.E2_Pa + tension_slope(e));
  }

  TpmParameters p_;
  Drive drive_;
  TensionLaw law_;
  double frozen_ = std::numeric_limits<double>::quiet_NaN();
  double peak_ = 0.0;
  Knot from_{0.0, 0.0};
  double slope_ = 0.0;
};

const ElementEquation& equation(void* user_data) {
  return *static_cast<const ElementEquation*>(user_data);
}

extern "C" {
int element_rate(sunrealtype t, N_Vector y, N_Vector y_dot, void* user_data) {
  NV_Ith_S(y_dot, 0) = equation(user_data).rate(t, NV_Ith_S(y, 0));
  return 0;
}
int element_jacobian(sunrealtype t, N_Vector y, N_Vector /*fy*/, SUNMatrix jacobian,
                     void* user_data, N_Vector, N_Vector, N_Vector) {
  SM_ELEMENT_D(jacobian, 0, 0) = equation(user_data).rate_slope(t, NV_Ith_S(y, 0));
  return 0;
}
int element_sensitivity(int /*count*/, sunrealtype t, N_Vector y, N_Vector /*y_dot*/, int which,
                        N_Vector s, N_Vector s_dot, void* user_data, N_Vector, N_Vector) {
  const ElementEquation& eq = equation(user_data);
  const double e1 = NV_Ith_S(y, 0);
  NV_Ith_S(s_dot, 0) = eq.rate_slope(t, e1) * NV_Ith_S(s, 0) + eq.rate_partial(t, e1, which);
  return 0;
}
}

/// One CVODES run over a protocol.
class Integration {
 public:
  Integration(ElementEquation& eq, const Protocol& protocol, double depth_scale_m,
              double relative_tolerance, Want want)
      : equation_(eq),
        with_sensitivity_(want == Want::values_and_sensitivity),
        context_(sundials::make_context()),
        state_(N_VNew_Serial(1, context_.get())),
        matrix_(SUNDenseMatrix(1, 1, context_.get())),
        solver_(SUNLinSol_Dense(state_.get(), matrix_.get(), context_.get())),
        memory_(CVodeCreate(CV_BDF, context_.get())) {
    using sundials::check;
    NV_Ith_S(state_.get(), 0) = 0.0;
    void* m = memory_.get();
    check(CVodeInit(m, element_rate, protocol.start_s(), state_.get()), "CVodeInit");
    check(CVodeSetUserData(m, &equation_), "CVodeSetUserData");
    // Small against the peak, so that the first instants of a ramp are relatively accurate too.
    const double absolute = 1e-3 * relative_tolerance * depth_scale_m;
    check(CVodeSStolerances(m, relative_tolerance, absolute), "CVodeSStolerances");
    check(CVodeSetLinearSolver(m, solver_.get(), matrix_.get()), "CVodeSetLinearSolver");
    check(CVodeSetJacFn(m, element_jacobian), "CVodeSetJacFn");
    check(CVodeSetMaxNumSteps(m, 2'000'000), "CVodeSetMaxNumSteps");
    if (with_sensitivity_) set_up_sensitivities();
  }

  void restart(double t, double stop) {
    using sundials::check;
    void* m = memory_.get();
    check(CVodeReInit(m, t, state_.get()), "CVodeReInit");
    if (with_sensitivity_) {
      check(CVodeSensReInit(m, CV_SIMULTANEOUS, sensitivity_), "CVodeSensReInit");
    }
    check(CVodeSetStopTime(m, stop), "CVodeSetStopTime");
  }

  void advance_to(double t) {
    double reached = 0.0;
    sundials::check(CVode(memory_.get(), t, state_.get(), &reached, CV_NORMAL), "CVode");
    if (with_sensitivity_) {
      sundials::check(CVodeGetSens(memory_.get(), &reached, sensitivity_), "CVodeGetSens");
    }
  }

  [[nodiscard]] double e1() const { return NV_Ith_S(state_.get(), 0); }
  [[nodiscard]] StateVector sensitivities() const {
    StateVector s{};
    for (int j = 0; j < kStateParameters; ++j) {
      s[static_cast<std::size_t>(j)] = NV_Ith_S(sensitivity_[j], 0);
    }
    return s;
  }

  ~Integration() {
    if (sensitivity_ != nullptr) N_VDestroyVectorArray(sensitivity_, kStateParameters);
  }
  Integration(const Integration&) = delete;
  Integration& operator=(const Integration&) = delete;

 private:
  void set_up_sensitivities() {
    using sundials::check;
    void* m = memory_.get();
    sensitivity_ = N_VCloneVectorArray(kStateParameters, state_.get());
    for (int j = 0; j < kStateParameters; ++j) N_VConst(0.0, sensitivity_[j]);
    const TpmParameters& p = equation_.parameters();
    // CVODES divides the state's tolerance by these to get each sensitivity's; a parameter of 0
    // is measured in the other modulus.
    const double modulus = std::max(p.E1_Pa, p.E2_Pa);
    const auto or_modulus = [&](double v) { return v > 0.0 ? v : modulus; };
    scale_ = {or_modulus(p.E1_Pa), or_modulus(p.E2_Pa), or_modulus(p.Eprime_Pa),
              p.eta1_Pa_s,         p.spacing_m,         p.l0_m / p.A0_m2};
    check(CVodeSensInit1(m, kStateParameters, CV_SIMULTANEOUS, element_sensitivity, sensitivity_),
          "CVodeSensInit1");
    check(CVodeSetSensParams(m, nullptr, scale_.data(), nullptr), "CVodeSetSensParams");
    check(CVodeSensEEtolerances(m), "CVodeSensEEtolerances");
    // Off by default: without it the sensitivities are whatever the state's steps happen to give.
    check(CVodeSetSensErrCon(m, SUNTRUE), "CVodeSetSensErrCon");
  }

  ElementEquation& equation_;
  bool with_sensitivity_;
  StateVector scale_{};
  sundials::Context context_;
  sundials::Vector state_;
  sundials::Matrix matrix_;
  sundials::LinearSolver solver_;
  N_Vector* sensitivity_ = nullptr;
  sundials::Cvodes memory_;
};

double depth_scale_m(const Protocol& protocol, const TpmParameters& p) {
  const double peak = protocol.peak();
  if (protocol.drive() == Drive::displacement) return peak;
  const double modulus = p.equilibrium_modulus_Pa() > 0.0 ? p.equilibrium_modulus_Pa() : p.E2_Pa;
  return equilibrium_depth_m(p, modulus, peak);
}

}  // namespace

CvodesElement::CvodesElement(const ModelOptions& options) : options_(options) {
  if (!(options.relative_tolerance >= 1e-13 && options.relative_tolerance <= 1e-2)) {
    throw bad_input("model 'cvodes'",
                    fmt::format("relative tolerance {}", shortest(options.relative_tolerance)),
                    "a value from 1e-13 to 1e-2");
  }
}

Response CvodesElement::respond(const Protocol& protocol, std::span<const double> times_s,
                                std::span<const double> parameters, Want want) const {
  const TpmParameters p = tpm_parameters(parameters);
  require_times_within(protocol, times_s);
  Response response;
  response.value.setZero(static_cast<Eigen::Index>(times_s.size()));
  if (want == Want::values_and_sensitivity) {
    response.sensitivity.setZero(response.value.size(), kTpmParameterCount);
  }
  if (protocol.peak() == 0.0) return response;

  if (std::any_of(times_s.begin(), times_s.end(), [](double t) { return std::isinf(t); })) {
    throw bad_input(protocol.name(), "an integrator does not reach t = infinity",
                    "a finite time, or the model 'closed_form'");
  }
  const std::vector<std::size_t> order = rising_order(times_s);

  ElementEquation eq(p, options_.tension, protocol);
  Integration run(eq, protocol, depth_scale_m(protocol, p), options_.relative_tolerance, want);
  const auto record = [&](std::size_t i) {
    const auto row = static_cast<Eigen::Index>(i);
    response.value[row] = eq.response(times_s[i], run.e1());
    if (want == Want::values) return;
    const TpmVector s = eq.response_sensitivity(times_s[i], run.e1(), run.sensitivities());
    std::copy(s.begin(), s.end(), response.sensitivity.row(row).data());
  };

  const auto knots = protocol.knots();
  std::size_t next = 0;
  for (std::size_t k = 0; k < knots.size(); ++k) {
    const bool last = k + 1 == knots.size();
    const Knot& from = knots[k];
    const Knot& to = last ? from : knots[k + 1];
    if (!last && to.time_s == from.time_s) continue;  // a jump: e1 does not move
    eq.set_piece(from, to);
    const auto due = [&] {
      return next < order.size() && (last || times_s[order[next]] < to.time_s);
    };
    while (due() && times_s[order[next]] == from.time_s) record(order[next++]);
    if (next == order.size()) break;
    run.restart(from.time_s, last ? times_s[order.back()] : to.time_s);
    while (due()) {
      run.advance_to(times_s[order[next]]);
      record(order[next++]);
    }
    if (!last) run.advance_to(to.time_s);
  }
  return response;
}

}  // namespace tpm::organ
