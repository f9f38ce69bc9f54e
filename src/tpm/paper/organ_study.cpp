#include "tpm/paper/organ_study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "tpm/base/text.hpp"
#include "tpm/work/give_up.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {
namespace {

using Kind = ProtocolChoice::Kind;

constexpr int kStaticIntervals = 32;
constexpr int kRampIntervals = 16;
constexpr int kHoldIntervals = 40;
constexpr double kFirstOfHold = 1e-3;  // of its length: from there on evenly in the logarithm
constexpr double kForever = std::numeric_limits<double>::infinity();

/// From a time on, rising from the finest interval to the length of the hold.
void add_hold(std::vector<double>& times_s, double from_s, double length_s) {
  for (int i = 0; i <= kHoldIntervals; ++i) {
    times_s.push_back(
        from_s + length_s * std::pow(kFirstOfHold, 1.0 - static_cast<double>(i) / kHoldIntervals));
  }
}

/// Forces at equilibrium, each depth from rest.
void answer_static(const Model& model, const StudyCondition& c, const TpmVector& parameters,
                   StudyCurve& curve) {
  const auto force = [&](double depth_m) {
    if (depth_m == 0.0) return 0.0;
    const std::array<double, 1> end{kForever};
    return model.respond(step_and_hold(depth_m, kForever), end, parameters, Want::values).value[0];
  };
  for (int i = 0; i <= kStaticIntervals; ++i) {
    curve.x.push_back(c.depth_m * i / kStaticIntervals);
    curve.response.push_back(force(curve.x.back()));
  }
  for (const double depth : c.read_m) {
    curve.readings.push_back({significant(1e3 * depth, 4) + " mm", depth, force(depth), {}});
  }
}

void answer_in_time(const Model& model, const Protocol& protocol, const TpmVector& parameters,
                    const std::string& first_label, std::size_t first, StudyCurve& curve) {
  const Eigen::VectorXd response = model.respond(protocol, curve.x, parameters, Want::values).value;
  curve.response.assign(response.begin(), response.end());
  curve.readings = {{first_label, curve.x[first], curve.response[first], {}},
                    {"end", curve.x.back(), curve.response.back(), {}}};
}

void answer_ramp(const Model& model, const StudyCondition& c, const TpmVector& parameters,
                 StudyCurve& curve) {
  const Protocol protocol = ramp_and_hold(c.depth_m, c.rate_m_per_s, c.duration_s);
  const double ramp_s = c.depth_m / c.rate_m_per_s;
  for (int i = 0; i < kRampIntervals; ++i) curve.x.push_back(ramp_s * i / kRampIntervals);
  const std::size_t peak = curve.x.size();
  curve.x.push_back(ramp_s);
  add_hold(curve.x, ramp_s, c.duration_s);
  curve.x.back() = protocol.end_s();  // not a rounding error beyond it
  answer_in_time(model, protocol, parameters, "peak", peak, curve);
}

void answer_creep(const Model& model, const StudyCondition& c, const TpmVector& parameters,
                  StudyCurve& curve) {
  curve.x.push_back(0.0);
  add_hold(curve.x, 0.0, c.duration_s);
  curve.x.back() = c.duration_s;
  answer_in_time(model, creep(c.load_N, c.duration_s), parameters, "instantaneous", 0, curve);
}

StudyCurve answer(const Model& model, const StudyCondition& condition, const TpmVector& values) {
  StudyCurve curve, failed;
  failed.failure = gave_up([&] {
    const auto& answer_to = condition.kind == Kind::ramp_hold ? answer_ramp
                            : condition.kind == Kind::creep   ? answer_creep
                                                              : answer_static;
    answer_to(model, condition, values, curve);
  });
  return failed.failure.empty() ? curve : failed;
}

void compare_with_first(const StudyCurve& first, StudyCurve& curve) {
  for (std::size_t i = 0; i < std::min(first.readings.size(), curve.readings.size()); ++i) {
    curve.readings[i].against_first = curve.readings[i].response / first.readings[i].response - 1.0;
  }
}

/// The fit that an experiment's own material comes from: the one of that experiment alone.
std::optional<std::size_t> own_fit(const OrganStudyConfig& config, Kind kind) {
  for (std::size_t i = 0; i < config.fits.size(); ++i) {
    if (config.fits[i].experiment() == kind) return i;
  }
  return std::nullopt;
}

TissueFit fitted(const FitConfig& config, std::size_t fit, std::size_t tissue) {
  TissueFit made{fit, tissue, std::nullopt, {}};
  made.failure = gave_up([&] { made.result = run_fit(config); });
  return made;
}

/// The configurations of the fits, with what the materials hold as further hypotheses of the first
/// tissue's.
std::vector<StudyFit> with_materials(const OrganStudyConfig& config) {
  std::vector<StudyFit> fits = config.fits;
  for (const StudyMaterial& material : config.materials) {
    if (material.fixed.values.empty()) continue;
    fits[material.fit].configs.front().hypotheses.push_back(material.fixed);
  }
  return fits;
}

TpmVector parameters_of(const OrganStudy& study, const StudyMaterial& material) {
  const TissueFit& made = study.fit(material.fit, 0);
  if (!made.result) {
    throw Error(ExitCode::numerical, fmt::format("material '{}'", material.name),
                "its fit failed: " + made.failure);
  }
  const FitResult& fit = *made.result;
  std::span<const double> natural = fit.best.natural;
  for (const HypothesisResult& h : fit.hypotheses) {
    if (!material.fixed.values.empty() && h.hypothesis.name == material.fixed.name) {
      natural = h.minimum.natural;
    }
  }
  return fitted_element(fit.config, natural);
}

/// Of every experiment that is fitted alone.
std::vector<StudyData> data_of(const OrganStudyConfig& config) {
  std::vector<StudyData> data;
  for (const StudyFit& fit : config.fits) {
    if (!fit.experiment()) continue;
    const FitConfig& c = fit.configs.front();
    data.push_back({c.data.front().protocol, std::get<PointSet>(load_data(c).front())});
  }
  return data;
}

StudyCurves own_curves(const OrganStudy& study) {
  StudyCurves set{"own fit", std::nullopt, {}};
  for (std::size_t c = 0; c < study.config.conditions.size(); ++c) {
    const auto own = own_fit(study.config, study.config.conditions[c].kind);
    for (std::size_t t = 0; t < study.config.tissues.size(); ++t) {
      if (!own) {
        set.curves.push_back({t, c, {}, {}, {}, "no fit of this experiment alone"});
      } else if (const TissueFit& made = study.fit(*own, t); made.result) {
        const FitResult& fit = *made.result;
        set.curves.push_back(
            study_curve(study.config, c, t, fitted_element(fit.config, fit.best.natural)));
      } else {
        set.curves.push_back({t, c, {}, {}, {}, made.failure});
      }
    }
  }
  return set;
}

}  // namespace

std::optional<Kind> StudyFit::experiment() const {
  const std::vector<DataChoice>& data = configs.front().data;
  if (data.size() != 1) return std::nullopt;
  return data.front().protocol.kind;
}

const StudyCurve& StudyCurves::at(std::size_t condition, std::size_t tissue) const {
  for (const StudyCurve& curve : curves) {
    if (curve.condition == condition && curve.tissue == tissue) return curve;
  }
  throw std::out_of_range("no such curve");
}

StudyCurve study_curve(const OrganStudyConfig& config, std::size_t condition, std::size_t tissue,
                       const TpmVector& parameters) {
  const auto model = make_model(config.fits.front().configs.at(tissue));
  StudyCurve curve = answer(*model, config.conditions.at(condition), parameters);
  curve.condition = condition;
  curve.tissue = tissue;
  return curve;
}

StudyCurves curves_at(const OrganStudyConfig& config, const std::string& name,
                      const TpmVector& parameters) {
  StudyCurves set{name, parameters, {}};
  for (std::size_t c = 0; c < config.conditions.size(); ++c) {
    const std::size_t first = set.curves.size();
    for (std::size_t t = 0; t < config.tissues.size(); ++t) {
      set.curves.push_back(study_curve(config, c, t, parameters));
      if (t > 0) compare_with_first(set.curves[first], set.curves.back());
    }
  }
  return set;
}

OrganStudy run_organ_study(const OrganStudyConfig& config) {
  OrganStudy study{config, data_of(config), {}, {}};
  const std::vector<StudyFit> fits = with_materials(config);
  Progress progress("experiments",
                    config.fits.size() * config.tissues.size() + config.materials.size() + 1);
  for (std::size_t f = 0; f < config.fits.size(); ++f) {
    for (std::size_t t = 0; t < config.tissues.size(); ++t) {
      study.fits.push_back(fitted(fits[f].configs[t], f, t));
      progress.advance();
    }
  }
  for (const StudyMaterial& material : config.materials) {
    study.curves.push_back(curves_at(study.config, material.name, parameters_of(study, material)));
    progress.advance();
  }
  study.curves.push_back(own_curves(study));
  return study;
}

}  // namespace tpm::paper
