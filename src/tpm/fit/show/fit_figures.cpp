#include "tpm/fit/show/fit_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tpm/base/lists.hpp"
#include "tpm/fit/uncertainty.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

Axis parameter_axis(const FitParameter& p) {
  return {p.name, p.unit.symbol, p.scale != Scale::linear};
}

/// The declared noise scale holds for a fit only if it holds for each of its data sets.
bool scale_known(const FitConfig& config) {
  for (const DataChoice& d : config.data) {
    if (!d.noise.scale_known) return false;
  }
  return true;
}

/// Rise of the deviance at the limits of the confidence interval of one parameter.
double interval_rise(const FitResult& fit) {
  const Threshold threshold{fit.config.level, scale_known(fit.config), fit.value_count,
                            static_cast<int>(fit.parameters.size()), fit.inflation};
  return threshold.rise(fit.best.deviance);
}

Panel sensitivity_panel(const FitStudy& study, NoiseKind noise, const std::string& name,
                        double stated) {
  Series interval{.kind = Series::Kind::bracket, .provenance = "derived", .assumed = "ramp rate"};
  Series estimate{.kind = Series::Kind::points,
                  .label = "best fit",
                  .provenance = "derived",
                  .assumed = "ramp rate"};
  Axis axis;
  double unit = 1.0;
  for (const FitVariant& variant : study.variants) {
    if (variant.noise != noise) continue;
    const ParameterResult& p = parameter_of(variant.result, name);
    unit = p.parameter.unit.to_si;
    axis = parameter_axis(p.parameter);
    interval.label = fmt::format("{:.4g} % interval", 100.0 * variant.result.config.level);
    interval.add_range(variant.rate_m_per_s * 1e3, p.lower.value_or(p.parameter.lower) / unit,
                       p.upper.value_or(p.parameter.upper) / unit);
    estimate.add(variant.rate_m_per_s * 1e3, p.estimate / unit);
  }
  return {fmt::format("noise {}", noise_words(noise)),
          {"assumed ramp rate", "mm/s", false, 0.0, 5.0},
          std::move(axis),
          {std::move(interval), std::move(estimate),
           line("stated in the paper", {0.0, 5.0}, {stated / unit, stated / unit}, "text")}};
}

}  // namespace

std::vector<Series> profile_series(const ParameterResult& result,
                                   std::span<const ProfilePoint> points, double least,
                                   const ProfileLimit& at) {
  const double si = result.parameter.unit.to_si;
  Series profile = line("profile", {}, {});
  for (const ProfilePoint& point : points) {
    const double risen = point.deviance - least;
    if (risen > 2.0 * at.rise)
      continue;  // far above the limit it only squeezes the part that matters
    profile.add(point.natural / si, risen / at.unit);
  }
  Series limit =
      line(fmt::format("limit of the {:.4g} % interval", 100.0 * at.level),
           {profile.x.front(), profile.x.back()}, {at.rise / at.unit, at.rise / at.unit});
  return {std::move(profile),
          std::move(limit),
          {.kind = Series::Kind::points,
           .label = "best fit",
           .provenance = "derived",
           .x = {result.estimate / si},
           .y = {0.0}}};
}

const ParameterResult& parameter_of(const FitResult& fit, const std::string& name) {
  for (const ParameterResult& p : fit.parameters) {
    if (p.parameter.name == name) return p;
  }
  throw bad_input(fit.config.title, fmt::format("does not estimate '{}'", name));
}

std::string estimate_words(const FitResult& fit) {
  return listed(fit.parameters, [](const ParameterResult& p) {
    return fmt::format("{} = {}", p.parameter.name, in_unit(p.parameter, p.estimate));
  });
}

std::string noise_words(NoiseKind noise) {
  return spaced(noise_kind_name(noise));
}

Figure profile_figure(const FitStudy& study) {
  Figure figure{"fit_profiles", "Likelihood profiles",
                "Each parameter is held at a value and the others are fitted again. Where the "
                "curve stays below the limit, the data cannot tell the values apart."};
  const double rise = interval_rise(study.reference);
  for (const DrawnProfile& drawn : study.profiles) {
    const ParameterResult& result = study.reference.parameters[drawn.parameter];
    Panel panel{"", parameter_axis(result.parameter), {"rise of the deviance", "", false, 0.0}};
    panel.y.upper = 1.6 * rise;
    panel.series = profile_series(result, drawn.points, study.reference.best.deviance,
                                  {study.reference.config.level, rise});
    figure.panels.push_back(std::move(panel));
  }
  return figure;
}

Figure sensitivity_figure(const FitStudy& study, const std::string& parameter, double stated) {
  Figure figure{figure_id("fit_sensitivity", parameter),
                fmt::format("What {} depends on", parameter),
                "The ramp rate and the kind of noise are not stated in the paper. Each bar is the "
                "interval of one fit; a bar that ends at the edge of the searched range is open "
                "there."};
  for (const NoiseKind noise :
       {NoiseKind::relative_to_datum, NoiseKind::log, NoiseKind::relative_to_model}) {
    figure.panels.push_back(sensitivity_panel(study, noise, parameter, stated));
  }
  return figure;
}

}  // namespace tpm::fit
