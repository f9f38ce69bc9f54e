#include "tpm/paper/printed_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/printed_number.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/model.hpp"

namespace tpm::paper {
namespace {

using fit::ModelVerdict;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Closed forms; the creep's is a quadrature over depth.
constexpr double kRounding = 1e-9;

/// A number in a unit, "63 mN".
std::string in_unit_of(double si, const Unit& unit) {
  return with_unit(significant(si / unit.to_si, 2), unit);
}

/// Standard uncertainty of a number of which so many digits are printed: half a unit of the last,
/// rectangular.
double u_of_digits(double si, const Unit& unit) {
  const PrintedNumber printed = parse_printed(shortest(rounded(si / unit.to_si, 6)), "data");
  return 0.5 * printed.last_digit * unit.to_si / std::sqrt(3.0);
}

/// The place of the range that is nearest to S.
double nearest_measured(const PrintedComparison& c) {
  return std::clamp(c.simulated, c.low, c.high);
}

/// For a verdict that an unstated part of u_D could change: how large it may be.
/// @param room_for_U between |E| and R
std::string unless_unstated(const PrintedComparison& c, double room_for_U, const char* words) {
  const double slack = room_for_U / c.e.coverage;
  const double room = slack * slack - c.e.u_val * c.e.u_val;
  return fmt::format("{} {}", words, in_unit_of(std::sqrt(std::max(room, 0.0)), c.unit));
}

}  // namespace

void judge_printed(PrintedComparison& c, double share) {
  fit::CombinedUncertainty u_val;
  u_val.add(c.u_num, kInfinity);
  u_val.add(c.u_input, c.e.degrees);
  u_val.add(c.u_D, kInfinity);
  c.e.u_val = u_val.u();
  c.e.degrees = u_val.degrees();
  c.e.coverage = fit::coverage_factor(c.e.degrees);
  const double U = c.e.expanded();
  const double nearest = nearest_measured(c);
  c.e.error = c.simulated - nearest;
  c.not_adequate_below = std::max(0.0, (std::abs(c.e.error) - U) / nearest);
  // |S - D| + U in parts of D is largest at an end of the range.
  c.adequate_from = 0.0;
  for (const double end : {c.low, c.high}) {
    c.adequate_from = std::max(c.adequate_from, (std::abs(c.simulated - end) + U) / end);
  }
  if (share < c.not_adequate_below) {
    c.verdict = ModelVerdict::not_adequate;
    c.remark = unless_unstated(c, std::abs(c.e.error) - share * nearest,
                               "unless the unstated part of u_D exceeds");
  } else if (share >= c.adequate_from && c.took_part_in_choice) {
    c.verdict = ModelVerdict::residual;
    c.remark = "x = 30 mm was chosen by this number among others";
  } else if (share >= c.adequate_from) {
    c.verdict = ModelVerdict::adequate;
    const double room = std::min(share * c.low - std::abs(c.simulated - c.low),
                                 share * c.high - std::abs(c.simulated - c.high));
    c.remark = unless_unstated(c, room, "as long as the unstated part of u_D is below");
  } else {
    c.verdict = ModelVerdict::undetermined;
    const double limit = share * nearest;
    if (c.is_range() && 0.5 * (c.high - c.low) > limit) {
      c.remark = fmt::format("{}{}; the readings behind it would decide", kOnlyARange,
                             in_unit_of(c.high - c.low, c.unit));
    } else {
      c.remark = fit::what_must_shrink(
          c.e, limit, {{"u_input (parameters)", c.u_input}, {"u_D (printed digits)", c.u_D}},
          c.unit);
    }
  }
}

namespace {

/// One datum of the print, still without S.
PrintedComparison printed_datum(const Datum& datum, Observable observable) {
  PrintedComparison c;
  const bool force = observable == Observable::contact_force;
  c.unit = parse_unit(force ? "N" : "mm", "printed data");
  c.low = datum.value ? *datum.value : datum.lower.value();
  c.high = datum.value ? *datum.value : datum.upper.value();
  c.u_D = u_of_digits(c.high, c.unit);
  c.imposed = datum.depth_m ? *datum.depth_m : datum.load_N.value();
  const std::string at = datum.depth_m ? fmt::format("{:.4g} mm", *datum.depth_m * 1e3)
                                       : fmt::format("{:.4g} N", datum.load_N.value());
  if (!datum.depth_m) {
    c.experiment = "creep";
    c.quantity = "depth after 300 s under " + at;
  } else if (datum.time_s) {
    c.experiment = "relaxation";
    c.quantity = (datum.label == "peak" ? "peak force at " : "force after 30 s at ") + at;
  } else {
    c.experiment = "static";
    c.quantity = "equilibrium force at " + at;
  }
  return c;
}

/// The element's answer to the experiment of a datum.
/// @param rate of the ramp; none: a step
double response_of(const TpmParameters& p, const Datum& datum, std::optional<double> rate) {
  const auto model = make_closed_form();
  const auto answer = [&](const Protocol& protocol, double time_s) {
    const std::vector<double> times{time_s};
    return model->respond(protocol, times, to_vector(p), Want::values).value[0];
  };
  if (!datum.depth_m) return answer(creep(datum.load_N.value(), kInfinity), datum.time_s.value());
  if (!datum.time_s) return answer(step_and_hold(*datum.depth_m, kInfinity), kInfinity);
  if (!rate) return answer(step_and_hold(*datum.depth_m, kInfinity), *datum.time_s);
  const double ramp_s = *datum.depth_m / *rate;
  return answer(ramp_and_hold(*datum.depth_m, *rate, *datum.time_s + 1.0), ramp_s + *datum.time_s);
}

/// The printed parameters, which are stated without uncertainty.
void add_printed(std::vector<PrintedComparison>& all, const TpmParameters& p, const PointSet& set,
                 const std::string& words, std::optional<double> rate, double share) {
  for (const Datum& datum : set.data) {
    PrintedComparison c = printed_datum(datum, set.observable);
    c.parameters = words;
    c.printed_parameters = true;
    c.simulated = response_of(p, datum, rate);
    c.u_num = kRounding * std::abs(c.simulated);
    c.e.degrees = kInfinity;
    c.took_part_in_choice = c.experiment == "relaxation";  // Sec. 4.2: "close ... when x=30mm"
    judge_printed(c, share);
    all.push_back(std::move(c));
  }
}

/// Factor on standard deviations: the size of the noise is what the residuals tell, since the 10 %
/// of the fit are assumed.
double residual_scale(const fit::FitResult& fit) {
  return std::sqrt(fit.chi_square / fit.degrees_of_freedom);
}

/// The readings of a data set of a fit, in the order of the set.
std::vector<const fit::FittedDatum*> readings_of(const fit::FitResult& fit, std::size_t choice) {
  std::vector<const fit::FittedDatum*> readings;
  for (const fit::FittedDatum& d : fit.data) {
    if (d.datum.choice == choice) readings.push_back(&d);
  }
  return readings;
}

/// One reading against a fit that did not see it.
PrintedComparison against_fit(const fit::FitResult& fit, const fit::FittedDatum& fitted,
                              const Datum& datum, Observable observable, std::string words) {
  PrintedComparison c = printed_datum(datum, observable);
  c.parameters = std::move(words);
  c.simulated = fitted.predicted;
  c.u_num = kRounding * std::abs(c.simulated);
  c.u_input = residual_scale(fit) * fitted.predicted_sd.value_or(0.0);
  c.e.degrees = fit.degrees_of_freedom;
  return c;
}

/// Each relaxation reading by the fit that left its depth out.
void add_held_out(std::vector<PrintedComparison>& all, const PointSet& relaxation,
                  const fit::FitStudy& study, double share) {
  for (const fit::HeldOutFit& held : study.held_out) {
    const auto readings = readings_of(held.result, 0);
    for (std::size_t i = 0; i < readings.size(); ++i) {
      if (!readings[i]->datum.held_out) continue;
      PrintedComparison c = against_fit(held.result, *readings[i], relaxation.data.at(i),
                                        relaxation.observable, "fitted to the other depths");
      judge_printed(c, share);
      all.push_back(std::move(c));
    }
  }
}

/// Half the spread of S over the variants of a fit (ramp rate, kind of noise), rectangular.
double u_of_assumptions(const fit::FitStudy& study, const Datum& datum) {
  double least = kInfinity, most = -kInfinity;
  for (const fit::FitVariant& variant : study.variants) {
    const TpmParameters p =
        from_vector(fit::fitted_element(variant.result.config, variant.result.best.natural));
    const double simulated = response_of(p, datum, {});
    least = std::min(least, simulated);
    most = std::max(most, simulated);
  }
  return most > least ? 0.5 * (most - least) / std::sqrt(3.0) : 0.0;
}

/// The fit of all relaxation readings with static and creep data beside it, which it predicts.
fit::FitResult fit_with_bands_beside(fit::FitConfig config) {
  config.hypotheses.clear();
  config.profiles = false;
  for (const auto& [dataset, kind] : {std::pair("evren_static", fit::ProtocolChoice::Kind::static_),
                                      std::pair("amy_creep", fit::ProtocolChoice::Kind::creep)}) {
    fit::DataChoice choice = config.data.front();
    choice.dataset = dataset;
    choice.protocol = {};
    choice.protocol.kind = kind;
    choice.hold_out = {fit::Selector{}};  // all of it
    config.data.push_back(std::move(choice));
  }
  return fit::run_fit(config);
}

void add_bands(std::vector<PrintedComparison>& all, const fit::FitResult& fit, std::size_t choice,
               const PointSet& set, const fit::FitStudy& study, double share) {
  const auto readings = readings_of(fit, choice);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    PrintedComparison c =
        against_fit(fit, *readings[i], set.data.at(i), set.observable, "fitted to relaxation");
    c.u_input = std::hypot(c.u_input, u_of_assumptions(study, set.data.at(i)));
    judge_printed(c, share);
    all.push_back(std::move(c));
  }
}

Json quantity_or_null(double value) {
  return std::isfinite(value) ? Json(value) : Json();
}

}  // namespace

std::vector<PrintedComparison> compare_with_print(const PrintedExperiments& data,
                                                  const fit::FitStudy& study, double share) {
  constexpr double kAssumedRate = 4e-3;  // m/s
  std::vector<PrintedComparison> all;
  add_printed(all, data.printed, data.relaxation, "printed, step", {}, share);
  add_printed(all, data.printed, data.relaxation, "printed, ramp of 4 mm/s", kAssumedRate, share);
  add_held_out(all, data.relaxation, study, share);
  const fit::FitResult fit = fit_with_bands_beside(study.reference.config);
  add_printed(all, data.printed, data.static_bands, "printed", {}, share);
  add_bands(all, fit, study.reference.config.data.size(), data.static_bands, study, share);
  add_printed(all, data.printed, data.creep, "printed", {}, share);
  add_bands(all, fit, study.reference.config.data.size() + 1, data.creep, study, share);
  return all;
}

Json to_json(const std::vector<PrintedComparison>& comparisons, double share) {
  Json json{{"requirement_share", share}, {"comparisons", Json::array()}};
  for (const PrintedComparison& c : comparisons) {
    json["comparisons"].push_back(
        {{"experiment", c.experiment},
         {"parameters", c.parameters},
         {"quantity", c.quantity},
         {"imposed_SI", c.imposed},
         {"unit_SI", si_symbol(c.unit.dimension)},
         {"S", c.simulated},
         {"D", {c.low, c.high}},
         {"E", {c.simulated - c.high, c.simulated - c.low}},
         {"u_num", c.u_num},
         {"u_input", c.u_input},
         {"u_D_printed_digits", c.u_D},
         {"U", c.e.expanded()},
         {"k", c.e.coverage},
         {"verdict", fit::verdict_key(c.verdict)},
         {"not_adequate_below_share", quantity_or_null(c.not_adequate_below)},
         {"adequate_from_share", quantity_or_null(c.adequate_from)},
         {"remark", c.remark}});
  }
  return json;
}

}  // namespace tpm::paper
