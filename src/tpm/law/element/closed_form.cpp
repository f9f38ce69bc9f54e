#include "tpm/law/element/closed_form.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/law/relaxation/creep_exact.hpp"
#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpmkit/error.hpp"

namespace tpm::law {
namespace {

Response make_response(std::size_t n, Want want) {
  Response response;
  response.value.resize(static_cast<Eigen::Index>(n));
  if (want == Want::values_and_sensitivity) {
    response.sensitivity.setZero(static_cast<Eigen::Index>(n), kTpmParameterCount);
  }
  return response;
}

/// Derivatives of the two moduli and of ln(tau) with respect to E1, E2 and eta1.
struct BranchDerivatives {
  double equilibrium_E1, equilibrium_E2, relaxing_E1, relaxing_E2, log_tau_E, log_tau_eta1;

  explicit BranchDerivatives(const TpmParameters& p) {
    const double sum = p.E1_Pa + p.E2_Pa;
    const double share1 = p.E1_Pa / sum;
    const double share2 = p.E2_Pa / sum;
    equilibrium_E1 = share2 * share2;
    equilibrium_E2 = share1 * share1;
    relaxing_E1 = -share2 * share2;
    relaxing_E2 = share2 * (share2 + 2.0 * share1);
    log_tau_E = -1.0 / sum;
    log_tau_eta1 = 1.0 / p.eta1_Pa_s;
  }
};

/// Tension as a function of elongation, after the rule, in Pa m.
class Tension {
 public:
  Tension(const TensionRule& rule, const TpmParameters& p, double peak_m)
      : rule_(rule), law_{p.Eprime_Pa, p.spacing_m}, peak_m_(peak_m) {}

  struct Value {
    double value, d_Eprime, d_spacing;
  };
  [[nodiscard]] Value at(double e) const {
    switch (rule_.kind) {
      case TensionRule::Kind::frozen_at_value:
        return {rule_.lambda1_Pa * e, 0.0, 0.0};
      case TensionRule::Kind::frozen_at_peak: {
        const double lambda1 = lambda1_Pa(law_.Eprime_Pa, peak_m_, law_.spacing_m);
        const double d_spacing = peak_m_ > 0.0 ? law_.d_spacing(peak_m_) / peak_m_ * e : 0.0;
        return {lambda1 * e, lambda1_Pa(1.0, peak_m_, law_.spacing_m) * e, d_spacing};
      }
      case TensionRule::Kind::exact:
        break;
    }
    return {law_.value(e), TensionLaw{1.0, law_.spacing_m}.value(e), law_.d_spacing(e)};
  }

 private:
  TensionRule rule_;
  TensionLaw law_;
  double peak_m_;
};

Response displacement_driven(const Protocol& protocol, std::span<const double> times_s,
                             const TpmParameters& p, const TensionRule& rule, Want want) {
  Response response = make_response(times_s.size(), want);
  const double scale = p.modulus_to_stiffness_m();
  const double relaxed = p.equilibrium_modulus_Pa();
  const double relaxing = p.relaxing_modulus_Pa();
  const Tension tension(rule, p, protocol.peak());
  const BranchDerivatives d(p);
  const auto order = rising_order(times_s);
  run_relaxation(
      protocol, p.relaxation_time_s(), times_s, order,
      [&](std::size_t i, double e, const RelaxationState& branch) {
        const auto row = static_cast<Eigen::Index>(i);
        const auto pull = tension.at(e);
        const double stress_length = relaxed * e + relaxing * (e - branch.w) + pull.value;
        response.value[row] = scale * stress_length;
        if (want == Want::values) return;
        const double d_log_tau = -relaxing * branch.d_w;
        auto s = response.sensitivity.row(row);
        s[kE1] = scale *
                 (d.equilibrium_E1 * e + d.relaxing_E1 * (e - branch.w) + d_log_tau * d.log_tau_E);
        s[kE2] = scale *
                 (d.equilibrium_E2 * e + d.relaxing_E2 * (e - branch.w) + d_log_tau * d.log_tau_E);
        s[kEprime] = scale * pull.d_Eprime;
        s[kEta1] = scale * d_log_tau * d.log_tau_eta1;
        s[kSpacing] = scale * pull.d_spacing;
        s[kA0] = stress_length / p.l0_m;
        s[kL0] = -scale * stress_length / p.l0_m;
      });
  return response;
}

/// Frozen lambda1: e = [ J0 F + (J - J0) w ] with the instant and final compliances J0 and J and
/// w following F with the retardation time T = tau (E2 + lambda1)/(P2 + lambda1).
Response force_driven_frozen(const Protocol& protocol, std::span<const double> times_s,
                             const TpmParameters& p, double lambda1, Want want) {
  Response response = make_response(times_s.size(), want);
  const double scale = p.modulus_to_stiffness_m();
  const double instantaneous = p.E2_Pa + lambda1;
  const double finally = p.equilibrium_modulus_Pa() + lambda1;
  if (!(instantaneous > 0.0 && finally > 0.0)) {
    throw bad_input("creep", "no spring carries the load in the end", "E1, E2 or lambda1 above 0");
  }
  const BranchDerivatives d(p);
  const auto order = rising_order(times_s);
  run_relaxation(
      protocol, p.relaxation_time_s() * instantaneous / finally, times_s, order,
      [&](std::size_t i, double load, const RelaxationState& branch) {
        const auto row = static_cast<Eigen::Index>(i);
        const double value =
            load / instantaneous + (1.0 / finally - 1.0 / instantaneous) * branch.w;
        response.value[row] = value / scale;
        if (want == Want::values) return;
        const double d_instantaneous = -(load - branch.w) / (instantaneous * instantaneous);
        const double d_finally = -branch.w / (finally * finally);
        const double d_log_T = (1.0 / finally - 1.0 / instantaneous) * branch.d_w;
        auto s = response.sensitivity.row(row);
        s[kE1] =
            (d_finally * d.equilibrium_E1 + d_log_T * (d.log_tau_E - d.equilibrium_E1 / finally)) /
            scale;
        s[kE2] = (d_instantaneous + d_finally * d.equilibrium_E2 +
                  d_log_T * (d.log_tau_E + 1.0 / instantaneous - d.equilibrium_E2 / finally)) /
                 scale;
        s[kEta1] = d_log_T * d.log_tau_eta1 / scale;
        s[kA0] = -response.value[row] / p.A0_m2;
        s[kL0] = response.value[row] / p.l0_m;
      });
  return response;
}

bool is_constant_load(const Protocol& protocol) {
  const auto knots = protocol.knots();
  return std::all_of(knots.begin(), knots.end(),
                     [&](const Knot& k) { return k.value == knots.front().value; });
}

Response force_driven_exact(const Protocol& protocol, std::span<const double> times_s,
                            const TpmParameters& p, Want want) {
  if (!is_constant_load(protocol)) {
    throw bad_input(protocol.name(), "a changing load with the true lambda1(e) has no closed form",
                    "a constant load, a frozen lambda1, or the model 'cvodes'");
  }
  Response response = make_response(times_s.size(), want);
  const CreepUnderConstantLoad creep(p, protocol.knots().front().value);
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double t = times_s[i] - protocol.start_s();
    response.value[row] = creep.depth_m(t);
    if (want == Want::values) continue;
    const TpmVector s = creep.depth_sensitivity(t);
    for (int j = 0; j < kTpmParameterCount; ++j) {
      response.sensitivity(row, j) = s[static_cast<std::size_t>(j)];
    }
  }
  return response;
}

}  // namespace

TpmParameters tpm_parameters(std::span<const double> parameters) {
  if (parameters.size() != kTpmParameterCount) {
    throw bad_input("model", fmt::format("{} parameters given", parameters.size()),
                    fmt::format("{}", static_cast<int>(kTpmParameterCount)));
  }
  TpmVector vector{};
  std::copy(parameters.begin(), parameters.end(), vector.begin());
  TpmParameters p = from_vector(vector);
  require_valid(p, "model");
  return p;
}

Response ClosedForm::respond(const Protocol& protocol, std::span<const double> times_s,
                             std::span<const double> parameters, Want want) const {
  const TpmParameters p = tpm_parameters(parameters);
  require_times_within(protocol, times_s);
  if (protocol.drive() == Drive::displacement) {
    return displacement_driven(protocol, times_s, p, tension_, want);
  }
  switch (tension_.kind) {
    case TensionRule::Kind::frozen_at_peak:
      throw bad_input("tension rule", "'frozen at peak' needs an imposed displacement",
                      "a frozen value of lambda1 or the exact rule");
    case TensionRule::Kind::frozen_at_value:
      return force_driven_frozen(protocol, times_s, p, tension_.lambda1_Pa, want);
    case TensionRule::Kind::exact:
      break;
  }
  return force_driven_exact(protocol, times_s, p, want);
}

}  // namespace tpm::law

namespace tpm {

std::unique_ptr<Model> make_closed_form(const TensionRule& tension) {
  ModelOptions options;
  options.tension = tension;
  return std::make_unique<law::ClosedForm>(options);
}

}  // namespace tpm
