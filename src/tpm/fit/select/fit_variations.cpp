#include "tpm/fit/select/fit_variations.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/curve_file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr std::array kRates_m_per_s{1e-3, 2e-3, 4e-3};
constexpr std::array kNoises{NoiseKind::relative_to_datum, NoiseKind::log,
                             NoiseKind::relative_to_model};

bool is_ramp(const DataChoice& data) {
  return data.protocol.kind == ProtocolChoice::Kind::ramp_hold;
}

FitConfig with_assumptions(FitConfig config, double rate_m_per_s, NoiseKind noise) {
  for (DataChoice& data : config.data) {
    if (!is_ramp(data)) continue;
    data.protocol.rate_m_per_s = rate_m_per_s;
    data.protocol.rate_provenance = Provenance::assumed;
    data.noise.kind = noise;
  }
  return config;
}

FitConfig without_depth(FitConfig config, double depth_m) {
  for (DataChoice& data : config.data) {
    Selector selector;
    selector.depth_m = depth_m;
    data.hold_out.push_back(selector);
  }
  config.hypotheses.clear();  // they are tested once, on all of the data
  return config;
}

/// Depths of the ramp-and-hold data sets, rising.
std::set<double> tested_depths(const FitConfig& config) {
  std::set<double> depths;
  for (const DataChoice& data : config.data) {
    if (!is_ramp(data)) continue;
    for (const Datum& datum : load_points(data.dataset).data) {
      if (datum.depth_m) depths.insert(*datum.depth_m);
    }
  }
  return depths;
}

/// Evenly spaced in theta over the stretch that the interval search walked, each point refitted
/// from the one before, from the minimum outwards.
DrawnProfile drawn_profile(const ExperimentResiduals& residuals, const FitResult& fit,
                           std::size_t index) {
  constexpr int kIntervalsPerSide = 24;
  const auto& walked = fit.parameters[index].profile.points;
  const auto parameters = mapped<FitParameter>(fit.parameters, &ParameterResult::parameter);
  const FitParameter& own = parameters[index];
  FixedMask fixed(parameters.size(), false);
  fixed[index] = true;

  DrawnProfile drawn{index, {{fit.best.natural[index], fit.best.deviance}}};
  const double best = own.theta(fit.best.natural[index]);
  for (const double end : {walked.front().natural, walked.back().natural}) {
    std::vector<double> start = fit.best.natural;
    for (int i = 1; i <= kIntervalsPerSide; ++i) {
      const double there = best + (own.theta(end) - best) * i / kIntervalsPerSide;
      start[index] = std::clamp(own.natural(there), own.lower, own.upper);
      const Minimum minimum = minimise(residuals, parameters, start, fixed);
      if (!minimum.usable || end == fit.best.natural[index]) break;
      start = minimum.natural;
      drawn.points.push_back({start[index], minimum.deviance});
    }
  }
  std::ranges::sort(drawn.points, {}, &ProfilePoint::natural);
  return drawn;
}

}  // namespace

FitStudy run_fit_study(const FitConfig& config) {
  const std::set<double> depths = tested_depths(config);
  if (depths.empty()) {
    throw bad_input(config.title, "no data set is a ramp-and-hold", "at least one");
  }
  FitStudy study;
  Progress progress("fitting", 1 + kRates_m_per_s.size() * kNoises.size() + depths.size());
  study.reference = run_fit(config);
  const ExperimentResiduals residuals(config);
  for (std::size_t i = 0; i < study.reference.parameters.size(); ++i) {
    if (study.reference.parameters[i].profile.points.empty()) continue;
    study.profiles.push_back(drawn_profile(residuals, study.reference, i));
  }
  progress.advance();
  for (const double rate : kRates_m_per_s) {
    for (const NoiseKind noise : kNoises) {
      study.variants.push_back({rate, noise, run_fit(with_assumptions(config, rate, noise))});
      progress.advance();
    }
  }
  for (const double depth : depths) {
    study.held_out.push_back({depth, run_fit(without_depth(config, depth))});
    progress.advance();
  }
  return study;
}

Json variants_json(const FitStudy& study) {
  Json list = array_json(study.variants, [](const FitVariant& v) {
    Json item{{"rate_m_per_s", v.rate_m_per_s}, {"noise", noise_kind_name(v.noise)}};
    item["fit"] = to_json(v.result);
    return item;
  });
  return Json{{"variants", std::move(list)}};
}

Json held_out_json(const FitStudy& study) {
  return Json{{"held_out", array_json(study.held_out, [](const HeldOutFit& h) {
                 return Json{{"depth_m", rounded(h.depth_m)}, {"fit", to_json(h.result)}};
               })}};
}

}  // namespace tpm::fit
