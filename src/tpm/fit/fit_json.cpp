#include <fmt/format.h>

#include <cmath>

#include "tpm/core/text.hpp"
#include "tpm/fit/fit.hpp"

namespace tpm {
namespace {

/// Result numbers carry this many significant digits.
constexpr int kDigits = 6;

Json number(double value) {
  return rounded(value, kDigits);
}

Json optional_number(const std::optional<double>& value) {
  return value ? number(*value) : Json(nullptr);
}

/// "eta1_Pa_s": a key that says the unit of its SI value.
std::string si_key(std::string_view name, Dimension dimension) {
  std::string unit(si_symbol(dimension));
  std::string clean;
  for (const char c : unit) {
    if (c == '/') {
      clean += "_per_";
    } else if (c == ' ') {
      clean += '_';
    } else if (c != '^') {
      clean += c;
    }
  }
  return clean.empty() ? std::string(name) : fmt::format("{}_{}", name, clean);
}

Json parameter_values(const FitResult& result, const std::vector<double>& natural) {
  Json values = Json::object();
  for (std::size_t i = 0; i < natural.size(); ++i) {
    const FitParameter& p = result.parameters[i].parameter;
    values[si_key(p.name, p.unit.dimension)] = number(natural[i]);
  }
  return values;
}

Json parameter_json(const ParameterResult& p) {
  const Dimension dimension = p.parameter.unit.dimension;
  Json j{{"name", p.parameter.name}, {"SI_unit", si_symbol(dimension)}};
  j["scale"] = scale_name(p.parameter.scale);
  j["bounds_SI"] = {number(p.parameter.lower), number(p.parameter.upper)};
  j["estimate_SI"] = number(p.estimate);
  j["standard_error_SI"] = optional_number(p.standard_error);
  j["interval_SI"] = {optional_number(p.lower), optional_number(p.upper)};
  j["interval_connected"] = p.profile.connected;
  j["at_bound"] = p.at_lower_bound ? "lower" : p.at_upper_bound ? "upper" : "no";
  j["verdict"] = verdict_name(p.verdict);
  j["words"] = p.words;
  Json points = Json::array();
  for (const ProfilePoint& point : p.profile.points) {
    points.push_back({number(point.natural), number(point.deviance)});
  }
  j["profile_SI_and_deviance"] = std::move(points);
  j["profile_failures"] = p.profile.failures;
  return j;
}

Json minima_json(const FitResult& result) {
  Json list = Json::array();
  for (const DistinctMinimum& m : result.minima) {
    Json j{{"deviance", number(m.minimum.deviance)}, {"starts", m.starts}};
    j["converged"] = m.minimum.converged;
    j["parameters"] = parameter_values(result, m.minimum.natural);
    j["lowest"] = parameter_values(result, m.low);
    j["highest"] = parameter_values(result, m.high);
    list.push_back(std::move(j));
  }
  return list;
}

Json correlation_json(const FitResult& result) {
  const Covariance& c = result.covariance;
  Json j{{"full_rank", c.full_rank}};
  Json names = Json::array();
  for (const std::size_t i : c.free) names.push_back(result.parameters[i].parameter.name);
  j["parameters"] = std::move(names);
  Json rows = Json::array();
  for (Eigen::Index r = 0; r < c.correlation.rows(); ++r) {
    Json row = Json::array();
    for (Eigen::Index k = 0; k < c.correlation.cols(); ++k) {
      // Rounded to 6 decimals, not digits: a correlation of 1e-17 is 0.
      row.push_back(std::round(c.correlation(r, k) * 1e6) / 1e6 + 0.0);
    }
    rows.push_back(std::move(row));
  }
  j["correlation"] = std::move(rows);
  Json values = Json::array();
  for (const double s : c.singular_values) values.push_back(number(s));
  j["singular_values_of_scaled_jacobian"] = std::move(values);
  j["weakest_direction"] = result.weakest_words;
  return j;
}

Json data_json(const FitResult& result) {
  Json list = Json::array();
  for (const FittedDatum& d : result.data) {
    const bool force = d.datum.observable == Observable::contact_force;
    const std::string unit = force ? "_N" : "_m";
    Json j{{"dataset", result.config.data[d.datum.choice].dataset}, {"label", d.datum.label}};
    j["quantity"] = force ? "contact_force" : "indentation_depth";
    j["provenance"] = provenance_name(d.datum.provenance);
    j["role"] = d.datum.held_out ? "held_out" : "fitted";
    if (d.datum.value) j["observed" + unit] = number(*d.datum.value);
    if (d.datum.lower) j["band" + unit] = {number(*d.datum.lower), number(*d.datum.upper)};
    j["predicted" + unit] = number(d.predicted);
    if (d.predicted_sd) j["predicted_sd" + unit] = number(*d.predicted_sd);
    j["standardised_residual"] = number(d.standardised);
    list.push_back(std::move(j));
  }
  return list;
}

Json hypotheses_json(const FitResult& result) {
  Json list = Json::array();
  for (const HypothesisResult& h : result.hypotheses) {
    Json j{{"name", h.hypothesis.name}, {"deviance", number(h.minimum.deviance)}};
    j["rise"] = number(h.rise);
    j["p_value"] = number(h.p_value);
    j["excluded"] = h.excluded;
    j["parameters"] = parameter_values(result, h.minimum.natural);
    j["words"] = h.words;
    list.push_back(std::move(j));
  }
  return list;
}

Json assumptions_json(const FitConfig& config) {
  Json list = Json::array();
  for (const DataChoice& d : config.data) {
    Json j{{"dataset", d.dataset}, {"protocol", protocol_kind_name(d.protocol.kind)}};
    if (d.protocol.kind == ProtocolChoice::Kind::ramp_hold) {
      j["rate_m_per_s"] = number(d.protocol.rate_m_per_s);
      if (d.protocol.rate_provenance) {
        j["rate_provenance"] = provenance_name(*d.protocol.rate_provenance);
      }
    }
    j["noise"] = noise_kind_name(d.noise.kind);
    if (d.noise.kind != NoiseKind::absolute && d.noise.kind != NoiseKind::per_row) {
      j["noise_relative"] = number(d.noise.relative);
    }
    if (d.noise.absolute > 0.0) j["noise_absolute_SI"] = number(d.noise.absolute);
    j["noise_scale"] = d.noise.scale_known ? "known" : "estimated";
    list.push_back(std::move(j));
  }
  return list;
}

}  // namespace

Json to_json(const FitResult& result) {
  Json j{{"title", result.config.title},
         {"model", result.config.law ? law_name(*result.config.law) : result.config.model}};
  j["choices"] = assumptions_json(result.config);
  j["values_fitted"] = result.value_count;
  j["bands_fitted"] = result.band_count;
  j["chi_square"] = number(result.chi_square);
  j["deviance"] = number(result.best.deviance);
  j["degrees_of_freedom"] = result.degrees_of_freedom;
  j["chi_square_p_value"] = optional_number(result.chi_square_p);
  j["variance_factor"] = number(result.variance_factor);
  j["confidence_level"] = result.config.level;
  Json parameters = Json::array();
  for (const ParameterResult& p : result.parameters) parameters.push_back(parameter_json(p));
  j["parameters"] = std::move(parameters);
  j["linearised"] = correlation_json(result);
  j["starts"] = {{"run", result.starts_run},
                 {"failed", result.starts_failed},
                 {"agreeing_to_5_digits", result.starts_agreeing},
                 {"seed", result.config.seed}};
  j["minima"] = minima_json(result);
  j["hypotheses"] = hypotheses_json(result);
  j["data"] = data_json(result);
  j["flags"] = result.flags;
  return j;
}

}  // namespace tpm
