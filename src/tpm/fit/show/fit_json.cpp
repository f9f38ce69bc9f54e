// Declared in tpm/fit/fit.hpp.

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/likelihood/experiment_refit.hpp"
#include "tpm/fit/show/fit_answer.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm::fit {
namespace {

Json parameter_values(const FitResult& result, const std::vector<double>& natural) {
  Json values = Json::object();
  for (std::size_t i = 0; i < natural.size(); ++i) {
    const FitParameter& p = result.parameters[i].parameter;
    values[si_key(p.name, p.unit.dimension)] = rounded(natural[i]);
  }
  return values;
}

Json pair_json(double lower, double upper) {
  return {rounded(lower), rounded(upper)};
}

Json bootstrap_json(const BootstrapParameter& b) {
  Json j{{"standard_error_SI", rounded(b.standard_error)}, {"bias_SI", rounded(b.bias)}};
  j["percentile_interval_SI"] = pair_json(b.percentile.lower, b.percentile.upper);
  j["bca_interval_SI"] = b.bca ? pair_json(b.bca->lower, b.bca->upper) : Json(nullptr);
  return j;
}

Json bootstrap_json(const BootstrapResult& b) {
  return {{"replicates", b.options.replicates},
          {"resample", resampling_name(b.options.resampling)},
          {"block_length", b.block_length},
          {"seed", b.options.seed},
          {"failed", b.failed},
          {"summary", b.summary}};
}

Json correlation_json(const Correlation& c) {
  return {{"lag_1", rounded(c.lag1)},
          {"samples", c.count},
          {"effective_samples", rounded(c.effective_count)},
          {"significant", c.significant},
          {"summary", c.summary}};
}

Json conditions_json(const ParameterResult& p) {
  return array_json(p.conditional_on, [](const Condition& c) {
    return Json{{"parameter", c.parameter},
                {"bound", c.upper ? "upper" : "lower"},
                {"bound_SI", rounded(c.value)},
                {"at_estimate", c.at_estimate}};
  });
}

/// The deviance of a profile where the interval ends; nothing without a profile.
std::optional<double> deviance_at_limit(const FitResult& result, std::size_t parameter) {
  if (result.parameters[parameter].profile.points.empty()) return std::nullopt;
  const double least = result.best.deviance;
  return least + threshold_of(result).rise_of(parameter, least);
}

Json parameter_json(const ParameterResult& p, const EstimatedParameter& estimated,
                    std::optional<double> limit) {
  Json j{{"name", p.parameter.name}, {"SI_unit", si_unit(p.parameter)}};
  j["scale"] = scale_name(p.parameter.scale);
  j["bounds_SI"] = {rounded(p.parameter.lower), rounded(p.parameter.upper)};
  j["estimate_SI"] = rounded(p.estimate);
  j["standard_error_SI"] = or_null(p.standard_error);
  j["interval_SI"] = {or_null(p.lower), or_null(p.upper)};
  j["interval_connected"] = p.profile.connected;
  if (limit) j["deviance_at_limit"] = rounded(*limit);
  j["at_bound"] = p.at_lower_bound ? "lower" : p.at_upper_bound ? "upper" : "no";
  j["verdict"] = verdict_text(p);
  if (p.not_separable) j["not_separable"] = remark_json(*p.not_separable);
  if (p.with_drift) {
    j["with_drift_SI"] = {
        {"estimate", rounded(p.with_drift->estimate)},
        {"interval", {or_null(p.with_drift->lower), or_null(p.with_drift->upper)}}};
  }
  if (p.unconfirmed) j["unconfirmed"] = remark_json(*p.unconfirmed);
  if (estimated.prior) {
    j["prior_SI"] = {{"mean", rounded(estimated.prior->mean)},
                     {"sd", rounded(estimated.prior->sd)},
                     {"from", estimated.prior->from}};
  }
  if (estimated.drift) j["drift_origin_s"] = rounded(estimated.drift->origin_s);
  if (estimated.rise) {
    j["rise_between_s"] = {rounded(estimated.rise->begin_s), rounded(estimated.rise->end_s)};
  }
  if (p.nuisance) j["nuisance"] = true;
  if (p.only_if_described) j["only_if_described"] = true;
  if (p.first_bounds) {
    j["bounds_widened_from_SI"] = pair_json(p.first_bounds->lower, p.first_bounds->upper);
  }
  if (!p.conditional_on.empty()) j["conditional_on"] = conditions_json(p);
  j["summary"] = p.summary;
  j["profile_SI_and_deviance"] = array_json(p.profile.points, [](const ProfilePoint& point) {
    return Json{rounded(point.natural), rounded(point.deviance)};
  });
  Json failed = Json::array();
  if (has_failed(p.profile.below)) failed.push_back("lower");
  if (has_failed(p.profile.above)) failed.push_back("upper");
  if (!failed.empty()) j["profile_failed"] = std::move(failed);
  Json exchanged = Json::array();
  if (p.profile.below == ProfileEnd::exchange) exchanged.push_back("lower");
  if (p.profile.above == ProfileEnd::exchange) exchanged.push_back("upper");
  if (!exchanged.empty()) j["changes_places"] = std::move(exchanged);
  j["profile_failures"] = p.profile.failures;
  if (p.profile.cut_short) j["interval_cut_short"] = true;
  return j;
}

Json minima_json(const FitResult& result) {
  return array_json(result.minima, [&](const DistinctMinimum& m) {
    Json j{{"deviance", rounded(m.minimum.deviance)}, {"starts", m.starts}};
    j["converged"] = m.minimum.converged;
    j["parameters"] = parameter_values(result, m.minimum.natural);
    j["lowest"] = parameter_values(result, m.low);
    j["highest"] = parameter_values(result, m.high);
    return j;
  });
}

Json linearised_json(const FitResult& result) {
  const Covariance& c = result.covariance;
  Json j{{"full_rank", c.full_rank}};
  j["parameters"] =
      array_json(c.free, [&](std::size_t i) { return result.parameters[i].parameter.name; });
  // Rounded to 6 decimals, not digits: a correlation of 1e-17 is 0.
  const auto decimals = [](double r) { return std::round(r * 1e6) / 1e6 + 0.0; };
  j["correlation"] = array_json(c.correlation.rowwise(),
                                [&](const auto& row) { return array_json(row, decimals); });
  j["singular_values_of_scaled_jacobian"] =
      array_json(c.singular_values, [](double v) { return rounded(v); });
  j["weakest_direction"] = result.weakest_words;
  return j;
}

Json data_json(const FitResult& result) {
  return array_json(result.data, [&](const FittedDatum& d) {
    const auto key = [&](std::string_view what) {
      return si_key(what, quantity_dimension(d.datum.quantity));
    };
    Json j{{"dataset", result.config.data[d.datum.choice].dataset}, {"label", d.datum.label}};
    j["quantity"] = quantity_name(d.datum.quantity);
    if (d.datum.frequency_Hz) j["frequency_Hz"] = rounded(*d.datum.frequency_Hz);
    j["provenance"] = provenance_name(d.datum.provenance);
    j["role"] = d.datum.held_out ? "held_out" : "fitted";
    if (d.datum.value) j[key("observed")] = rounded(*d.datum.value);
    if (d.datum.lower) j[key("band")] = {rounded(*d.datum.lower), rounded(*d.datum.upper)};
    j[key("predicted")] = rounded(d.predicted);
    if (d.predicted_sd) j[key("predicted_sd")] = rounded(*d.predicted_sd);
    if (d.confidence) {
      j[key("confidence_band")] = pair_json(d.confidence->lower, d.confidence->upper);
    }
    if (d.prediction) {
      j[key("prediction_band")] = pair_json(d.prediction->lower, d.prediction->upper);
    }
    j["standardised_residual"] = rounded(d.standardised);
    return j;
  });
}

/// Numbers about each recording; its samples are in the data.
Json recordings_json(const FitResult& result) {
  return array_json(result.recordings, [&](const RecordingFit& r) {
    const auto fitted = std::count(r.fitted.begin(), r.fitted.end(), true);
    Json j{{"dataset", result.config.data[r.choice].dataset}};
    j["quantity"] = quantity_name(r.response_quantity);
    j["provenance"] = provenance_name(r.provenance);
    j["samples"] = r.time_s.size();
    j["samples_fitted"] = fitted;
    j[si_key(r.response_quantity, "peak")] = rounded(r.peak);
    j[si_key(r.response_quantity, "rms_residual")] = rounded(r.rms_residual);
    if (r.rms_outside) {
      j[si_key(r.response_quantity, "rms_residual_outside")] = rounded(*r.rms_outside);
    }
    if (const auto count = std::count(r.censored.begin(), r.censored.end(), true); count > 0) {
      j["samples_censored"] = count;
    }
    if (const auto count = std::count(r.outlier.begin(), r.outlier.end(), true); count > 0) {
      j["outliers_left_out"] = count;
    }
    if (r.not_predicted > 0) j["samples_not_predicted"] = r.not_predicted;
    j["share_inside_prediction_band"] = or_null(r.share_inside);
    if (r.correlation) j["correlation"] = correlation_json(*r.correlation);
    return j;
  });
}

Json hypotheses_json(const FitResult& result) {
  return array_json(result.hypotheses, [&](const HypothesisResult& h) {
    Json j{{"name", h.hypothesis.name}, {"deviance", rounded(h.minimum.deviance)}};
    j["rise"] = rounded(h.rise);
    j["p_value"] = rounded(h.p_value);
    j["excluded"] = h.excluded;
    j["parameters"] = parameter_values(result, h.minimum.natural);
    j["summary"] = h.summary;
    return j;
  });
}

Json assumptions_json(const FitConfig& config) {
  return array_json(config.data, [&](const DataChoice& d) {
    Json j{{"dataset", d.dataset}, {"protocol", protocol_kind_name(d.protocol.kind)}};
    if (d.protocol.kind == ProtocolChoice::Kind::ramp_hold) {
      j["rate_m_per_s"] = rounded(d.protocol.rate_m_per_s);
      if (d.protocol.rate_provenance) {
        j["rate_provenance"] = provenance_name(*d.protocol.rate_provenance);
      }
    }
    if (d.protocol.operating_depth) {
      const Dimension depth = quantity_dimension(config.law.value().drive);
      j[si_key("operating_depth", depth)] = rounded(*d.protocol.operating_depth);
    }
    if (d.stiffness_per_modulus_m) {
      j["stiffness_per_modulus_m"] = rounded(*d.stiffness_per_modulus_m);
    }
    j["noise"] = noise_kind_name(d.noise.kind);
    if (d.noise.shape != ErrorShape::normal) {
      j["noise_distribution"] = error_shape_name(d.noise.shape);
    }
    if (d.noise.shape == ErrorShape::student_t) {
      j["noise_degrees_of_freedom"] = rounded(d.noise.degrees_of_freedom);
    }
    if (!d.sigma_b.empty()) {
      j["noise_relative_parameter"] = d.sigma_b;
    } else if (uses_relative(d.noise.kind)) {
      j["noise_relative"] = rounded(d.noise.relative);
    }
    if (d.noise.angle_rad) j["noise_angle_rad"] = rounded(*d.noise.angle_rad);
    if (!d.sigma_a.empty()) {
      j["noise_absolute_parameter"] = d.sigma_a;
    } else if (d.noise.absolute > 0.0) {
      j["noise_absolute_SI"] = rounded(d.noise.absolute);
    }
    j["noise_scale"] = d.noise.scale_known ? "known" : "estimated";
    return j;
  });
}

}  // namespace

namespace {

/// -2 ln L and the criteria; null where there is no likelihood.
void add_likelihood(Json& j, const std::optional<Likelihood>& likelihood) {
  const auto value = [&](double Likelihood::*member) {
    return likelihood ? Json(rounded((*likelihood).*member)) : Json(nullptr);
  };
  j["minus_two_log_likelihood"] = value(&Likelihood::minus_two_log);
  j["AIC"] = value(&Likelihood::aic);
  j["AICc"] = likelihood ? or_null(likelihood->aicc) : Json(nullptr);
  j["BIC"] = value(&Likelihood::bic);
  if (likelihood) j["parameters_counted"] = likelihood->parameters;
}

}  // namespace

Json to_json(const FitResult& result) {
  Json j{{"title", result.config.title},
         {"model", result.config.law ? law_name(*result.config.law) : result.config.model}};
  if (result.config.law) {
    const LawSpec& law = *result.config.law;
    j[si_key(law.drive, "reference")] = rounded(law.reference);
    j["coefficients_depend_on_reference"] = depends_on_reference(law);
  }
  j["choices"] = assumptions_json(result.config);
  j["values_fitted"] = result.value_count;
  j["bands_fitted"] = result.band_count;
  j["chi_square"] = rounded(result.chi_square);
  j["deviance"] = rounded(result.best.deviance);
  j["degrees_of_freedom"] = result.degrees_of_freedom;
  j["chi_square_p_value"] = or_null(result.chi_square_p);
  j["variance_factor"] = rounded(result.variance_factor);
  add_likelihood(j, result.likelihood);
  if (result.correlation) {
    j["residual_correlation"] = correlation_json(*result.correlation);
    j["residual_correlation"]["inflation"] = rounded(result.inflation);
    if (result.noise) {
      const NoiseOfEstimates& noise = *result.noise;
      j["noise_of_estimates"] = {{"phi", rounded(noise.phi)},
                                 {"step_s", rounded(noise.step_s)},
                                 {"beyond", rounded(noise.beyond)},
                                 {"summary", noise.summary}};
      j["noise_of_estimates"]["parameters"] = array_json(noise.of, [&](const NoiseOfEstimate& e) {
        return Json{{"degrees_of_freedom", rounded(e.degrees)},
                    {"bias_of_rounding_in_standard_errors",
                     e.variance_ratio > 0.0 ? Json(rounded(e.bias / std::sqrt(e.variance_ratio)))
                                            : Json(nullptr)}};
      });
    }
  }
  j["confidence_level"] = result.config.level;
  Json parameters = Json::array();
  for (std::size_t i = 0; i < result.parameters.size(); ++i) {
    parameters.push_back(parameter_json(result.parameters[i], result.config.parameters[i],
                                        deviance_at_limit(result, i)));
    if (result.bootstrap) {
      parameters.back()["bootstrap"] = bootstrap_json(result.bootstrap->parameters[i]);
    }
  }
  j["parameters"] = std::move(parameters);
  j["linearised"] = linearised_json(result);
  j["starts"] = {{"run", result.starts_run},       {"looked_at", starts_looked_at(result)},
                 {"failed", result.starts_failed}, {"agreeing_to_5_digits", result.starts_agreeing},
                 {"seed", result.config.seed},     {"summary", result.waterfall.summary}};
  j["starts"]["end_deviances"] =
      array_json(result.waterfall.deviances, [](double v) { return rounded(v); });
  if (result.bootstrap) j["bootstrap"] = bootstrap_json(*result.bootstrap);
  j["minima"] = minima_json(result);
  j["hypotheses"] = hypotheses_json(result);
  j["data"] = data_json(result);
  j["recordings"] = recordings_json(result);
  if (result.adequacy) j["adequacy"] = files::to_json(*result.adequacy);
  j["remarks"] = remarks_json(result.remarks);
  return j;
}

}  // namespace tpm::fit
