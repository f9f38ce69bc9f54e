#include "tpm/fit/groups/young_moduli.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// Largest depth above contact among the fitted samples.
std::optional<double> fitted_depth(const FitResult& fit) {
  const std::vector<LawParameter> table = law_parameters(fit.config.law.value());
  const auto contact = std::ranges::find(table, "contact", &LawParameter::name);
  std::optional<double> deepest;
  for (const RecordingFit& r : fit.recordings) {
    const double begins = model_parameters(
        fit.config, fit.best.natural, r.choice)[static_cast<std::size_t>(contact - table.begin())];
    for (std::size_t i = 0; i < r.drive.size(); ++i) {
      if (!r.fitted[i] || r.drive[i] <= begins) continue;
      deepest = std::max(deepest.value_or(0.0), r.drive[i] - begins);
    }
  }
  return deepest;
}

/// "E_inf" of "k_inf", "E1" of "k1", "E0" of "k0".
std::string modulus_name(const std::string& stiffness) {
  return "E" + stiffness.substr(1);
}

/// "Pa", of a spring-pot "Pa s^alpha" (its stiffness at 1 s).
std::string modulus_unit(const LawSpec& law, const std::string& stiffness) {
  const bool springpots =
      law.fractional != Fractional::none && !has_relaxation_time(law.fractional);
  if (!springpots || stiffness == "k_inf") return "Pa";
  return stiffness == "k2" ? "Pa s^beta" : "Pa s^alpha";
}

bool is_modulus(const FitParameter& p) {
  return p.unit.dimension == Dimension::stiffness && p.name != "k_tension";
}

/// Newtons per metre to pascals. Throws Error(bad_input) for a law of stress.
double factor_of(const LawSpec& law, const ContactGeometry& geometry) {
  if (law.response == Quantity::stress) {
    throw bad_input("probe", "a law of stress", "none: its stiffnesses are moduli already");
  }
  return modulus_Pa(law, 1.0, geometry).value();
}

/// The sum of all stiffnesses, with the variance that the covariance gives it; none if one of them
/// is not free on a linear scale.
std::optional<YoungModulus> sum_of(const FitResult& fit, const std::vector<std::size_t>& places,
                                   double factor) {
  const Covariance& c = fit.covariance;
  YoungModulus sum{"E_instantaneous",
                   "",
                   "Pa",
                   0.0,
                   {},
                   {},
                   {},
                   "linearised",
                   pooled_doubt(std::nullopt, is_not_described(fit))};
  Eigen::VectorXd direction = Eigen::VectorXd::Zero(std::ssize(c.free));
  for (const std::size_t i : places) {
    const ParameterResult& p = fit.parameters[i];
    sum.estimate += factor * p.estimate;
    sum.of += (sum.of.empty() ? "" : " + ") + p.parameter.name;
    const auto place = std::find(c.free.begin(), c.free.end(), i);
    if (place != c.free.end()) {
      direction[place - c.free.begin()] = p.parameter.natural_slope(p.parameter.theta(p.estimate));
    }
  }
  if (!c.full_rank) return sum;
  const double sd = factor * std::sqrt(direction.dot(c.theta_covariance() * direction));
  const double z = threshold_of(fit).multiplier(fit.best.deviance);
  sum.standard_error = sd;
  sum.lower = sum.estimate - z * sd;
  sum.upper = sum.estimate + z * sd;
  return sum;
}

bool adds_up(const LawSpec& law) {
  return law.form == BranchForm::parallel && law.fractional == Fractional::none;
}

std::vector<std::size_t> modulus_places(const FitResult& fit) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    if (is_modulus(fit.parameters[i].parameter)) places.push_back(i);
  }
  return places;
}

std::string typical_words(std::size_t specimens, const std::string& doubt) {
  return fmt::format("typical of {} specimen{}{}", specimens, specimens == 1 ? "" : "s",
                     doubt.empty() ? "" : ", " + doubt);
}

/// The typical sum of all stiffnesses over the specimens, by the logarithm of each one's; none if
/// no fit tells it.
std::optional<YoungModulus> pooled_sum(const SpecimenStudy& study, double factor) {
  std::vector<SpecimenEstimate> estimates;
  int not_described = 0;
  std::string of;
  for (const SpecimenRow& row : study.rows) {
    if (!row.fit) continue;
    const std::vector<std::size_t> places = modulus_places(*row.fit);
    if (places.size() < 2) return std::nullopt;
    const auto sum = sum_of(*row.fit, places, factor);
    if (!sum || !sum->standard_error || !(sum->estimate > 0.0)) continue;
    if (!(*sum->standard_error > 0.0)) continue;
    of = sum->of;
    not_described += is_not_described(*row.fit);
    estimates.push_back(
        {row.name, std::log(sum->estimate), *sum->standard_error / sum->estimate, row.specimen});
  }
  if (estimates.empty()) return std::nullopt;
  const RandomEffects effects = random_effects_of_repeats(estimates, study.level);
  return YoungModulus{"E_instantaneous",
                      of,
                      "Pa",
                      std::exp(effects.mean),
                      std::nullopt,
                      std::exp(effects.interval.lower),
                      std::exp(effects.interval.upper),
                      "pooled",
                      typical_words(effects.specimens, pooled_doubt(std::nullopt, not_described))};
}

}  // namespace

YoungModuli young_moduli(const FitResult& fit, const ContactGeometry& geometry,
                         bool poisson_assumed) {
  const LawSpec& law = fit.config.law.value();
  const double factor = factor_of(law, geometry);
  YoungModuli all{geometry_words(geometry),
                  geometry.poisson_ratio,
                  poisson_assumed,
                  fit.config.level,
                  law.reference,
                  {},
                  geometry_remarks(law, geometry, fitted_depth(fit))};
  const std::vector<std::size_t> places = modulus_places(fit);
  for (const std::size_t i : places) {
    const ParameterResult& p = fit.parameters[i];
    const std::string& name = p.parameter.name;
    YoungModulus m{modulus_name(name),
                   name,
                   modulus_unit(law, name),
                   factor * p.estimate,
                   {},
                   {},
                   {},
                   "profile",
                   verdict_text(p)};
    if (p.standard_error) m.standard_error = factor * *p.standard_error;
    if (p.lower) m.lower = factor * *p.lower;
    if (p.upper) m.upper = factor * *p.upper;
    all.moduli.push_back(std::move(m));
  }
  if (adds_up(law) && places.size() > 1) {
    if (auto sum = sum_of(fit, places, factor)) all.moduli.push_back(*std::move(sum));
  }
  return all;
}

YoungModuli pooled_moduli(const SpecimenStudy& study, const ContactGeometry& geometry,
                          bool poisson_assumed) {
  const double factor = factor_of(study.law, geometry);
  std::optional<double> deepest;
  for (const SpecimenRow& row : study.rows) {
    const auto depth = row.fit ? fitted_depth(*row.fit) : std::nullopt;
    if (depth) deepest = std::max(deepest.value_or(0.0), *depth);
  }
  YoungModuli all{geometry_words(geometry),
                  geometry.poisson_ratio,
                  poisson_assumed,
                  study.level,
                  study.law.reference,
                  {},
                  geometry_remarks(study.law, geometry, deepest)};
  for (const PooledParameter& p : study.pooled) {
    if (!is_modulus(p.parameter)) continue;
    const auto pascals = [&](double theta) { return factor * p.parameter.natural(theta); };
    all.moduli.push_back(
        {modulus_name(p.parameter.name), p.parameter.name,
         modulus_unit(study.law, p.parameter.name), pascals(p.effects.mean), std::nullopt,
         pascals(p.effects.interval.lower), pascals(p.effects.interval.upper), "pooled",
         typical_words(p.effects.specimens, pooled_doubt(p.only_without, p.not_described))});
  }
  if (adds_up(study.law)) {
    if (auto sum = pooled_sum(study, factor)) all.moduli.push_back(*std::move(sum));
  }
  return all;
}

Json to_json(const YoungModuli& moduli) {
  Json list = Json::array();
  for (const YoungModulus& m : moduli.moduli) {
    list.push_back({{"name", m.name},
                    {"of", m.of},
                    {"unit", m.unit},
                    {"estimate_SI", rounded(m.estimate)},
                    {"standard_error_SI", or_null(m.standard_error)},
                    {"interval_SI", {or_null(m.lower), or_null(m.upper)}},
                    {"interval_from", m.basis},
                    {"verdict", m.verdict}});
  }
  return {{"geometry", moduli.geometry},
          {"poisson_ratio", moduli.poisson_ratio},
          {"poisson_ratio_provenance", moduli.poisson_assumed ? "assumed" : "given"},
          {"confidence_level", moduli.level},
          {"depth_reference_m", rounded(moduli.reference_m)},
          {"moduli", std::move(list)},
          {"remarks", remarks_json(moduli.remarks)}};
}

std::string to_terminal_text(const YoungModuli& moduli) {
  std::string text = fmt::format(
      "Young's moduli under {}; Poisson's ratio {} ({})\n{:<10} {:>12} {:>12}  {:<24} {:<10} {}\n",
      moduli.geometry, shortest(moduli.poisson_ratio), moduli.poisson_assumed ? "assumed" : "given",
      "modulus", "estimate", "std. error", fmt::format("{:.4g} % interval", 100.0 * moduli.level),
      "unit", "of; verdict");
  constexpr double kKilo = 1e3;
  for (const YoungModulus& m : moduli.moduli) {
    const auto shown = [](const std::optional<double>& value, const char* otherwise) {
      return value ? significant(*value / kKilo, kIntervalDigits) : std::string(otherwise);
    };
    text += fmt::format(
        "{:<10} {:>12} {:>12}  {:<24} {:<10} {}{}{}\n", m.name,
        significant(m.estimate / kKilo, kEstimateDigits),
        m.standard_error ? significant(*m.standard_error / kKilo, kErrorDigits) : "-",
        fmt::format("{} .. {}", shown(m.lower, "open"), shown(m.upper, "open")), "k" + m.unit, m.of,
        m.basis == "linearised" ? "; interval from the covariance" : "",
        m.verdict.empty() ? "" : "; " + m.verdict);
  }
  for (const Remark& remark : moduli.remarks) text += fmt::format("! {}\n", remark.text);
  return text;
}

std::vector<LawSpec> laws_of_probe(const std::vector<LawSpec>& laws,
                                   const ContactGeometry& geometry) {
  const Kernel kernel = geometry.sphere_radius_m       ? Kernel::hertz
                        : geometry.cone_half_angle_rad ? Kernel::power
                                                       : Kernel::linear;
  std::vector<LawSpec> kept;
  for (const LawSpec& law : laws) {
    if (law.kernel == kernel && law.tension == Tension::none) kept.push_back(law);
  }
  return kept;
}

std::optional<double> probe_exponent(const ContactGeometry& geometry) {
  return geometry.cone_half_angle_rad ? std::optional(2.0) : std::nullopt;
}

}  // namespace tpm::fit
