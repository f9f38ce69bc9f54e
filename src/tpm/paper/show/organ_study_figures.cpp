// Declared in tpm/paper/show/organ_study_report.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/paper/show/organ_study_report.hpp"

namespace tpm::paper {
namespace {

using Kind = ProtocolChoice::Kind;

const StudyData* data_of(const OrganStudy& study, Kind kind) {
  for (const StudyData& data : study.data) {
    if (data.protocol.kind == kind) return &data;
  }
  return nullptr;
}

std::vector<std::size_t> conditions_of(const OrganStudy& study, Kind kind) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < study.config.conditions.size(); ++i) {
    if (study.config.conditions[i].kind == kind) places.push_back(i);
  }
  return places;
}

/// Different values of a member among conditions, rising.
std::vector<double> values_of(const OrganStudy& study, const std::vector<std::size_t>& conditions,
                              double StudyCondition::*member) {
  auto values =
      mapped<double>(conditions, [&](std::size_t c) { return study.config.conditions[c].*member; });
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

bool same(double a, double b) {
  return std::abs(a - b) <= 1e-9 * std::abs(b);
}

std::vector<double> times(std::vector<double> values, double factor) {
  for (double& v : values) v *= factor;
  return values;
}

void add_curve(Panel& panel, const StudyCurve& curve, const std::string& label, double x_factor,
               double y_factor) {
  if (!curve.failure.empty()) return;
  panel.series.push_back(line(label, times(curve.x, x_factor), times(curve.response, y_factor)));
}

/// Why curves are missing from a figure, to be added to its caption.
std::string missing_words(const OrganStudy& study, const StudyCurves& set,
                          const std::vector<std::size_t>& conditions) {
  std::string text;
  for (const std::size_t c : conditions) {
    for (std::size_t t = 0; t < study.config.tissues.size(); ++t) {
      const std::string& failure = set.at(c, t).failure;
      if (failure.empty()) continue;
      text += fmt::format(" No curve of '{}' ({}): {}.", study.config.tissues[t].name, set.material,
                          failure);
    }
  }
  return text;
}

/// The readings of a data set that were taken under a condition; none: all.
/// @param place of a datum on the x axis
template <class Applies, class Place>
Series readings(const StudyData& data, double y_factor, Applies applies, Place place) {
  Series s{.kind = Series::Kind::points, .label = data.points.header.id};
  if (data.points.time_provenance == Provenance::assumed) s.assumed = "time";
  for (const Datum& d : data.points.data) {
    if (!applies(d)) continue;
    s.provenance = std::string(provenance_name(d.provenance));
    s.x.push_back(place(d));
    if (d.is_band()) {
      s.kind = Series::Kind::bracket;
      s.lower.push_back(*d.lower * y_factor);
      s.upper.push_back(*d.upper * y_factor);
    } else {
      s.y.push_back(*d.value * y_factor);
    }
  }
  return s;
}

std::string lettered(std::size_t i, const std::string& text) {
  return fmt::format("({}) {}", static_cast<char>('a' + static_cast<int>(i)), text);
}

/// The curves that figures set side by side: at the first material, and each tissue at its own.
std::vector<const StudyCurves*> shown_sets(const OrganStudy& study) {
  return {&study.curves.front(), &study.curves.back()};
}

std::string set_words(const StudyCurves& set) {
  return set.parameters ? fmt::format("one material, {}", set.material)
                        : fmt::format("each tissue's {}", set.material);
}

Figure static_figure(const OrganStudy& study, std::size_t condition) {
  const StudyCondition& c = study.config.conditions[condition];
  Figure figure{
      "static", "Static force against depth",
      "At equilibrium. Compare Fig. 6 of the paper. The bands are ranges over "
      "three pigs; between them nothing is known. Of a fit that meets every band the curve is "
      "one of many."};
  const StudyData* data = data_of(study, Kind::static_);
  for (const StudyCurves* set : shown_sets(study)) {
    Panel panel{lettered(figure.panels.size(), set_words(*set)),
                {"indentation depth", "mm", false, 0.0, 1.05e3 * c.depth_m},
                {"contact force", "N", false, 0.0}};
    for (std::size_t t = 0; t < study.config.tissues.size(); ++t) {
      add_curve(panel, set->at(condition, t), study.config.tissues[t].name, 1e3, 1.0);
    }
    if (data != nullptr) {
      panel.series.push_back(readings(
          *data, 1.0, [](const Datum&) { return true; },
          [](const Datum& d) { return 1e3 * d.depth_m.value_or(0.0); }));
    }
    figure.caption += missing_words(study, *set, {condition});
    figure.panels.push_back(std::move(panel));
  }
  return figure;
}

/// Ramp and hold in a panel per tissue.
/// @param label of a condition's curve; empty: not shown
template <class Label>
std::vector<Panel> ramp_panels(const OrganStudy& study, const StudyCurves& set,
                               const std::vector<std::size_t>& conditions, Label label) {
  std::vector<Panel> panels;
  double highest = 0.0;
  double longest = 0.0;
  for (std::size_t t = 0; t < study.config.tissues.size(); ++t) {
    Panel panel{lettered(t, study.config.tissues[t].name),
                {"time since first contact", "s", false, 0.0},
                {"contact force", "N", false, 0.0}};
    for (const std::size_t c : conditions) {
      const std::string text = label(study.config.conditions[c]);
      const StudyCurve& curve = set.at(c, t);
      if (text.empty() || !curve.failure.empty()) continue;
      add_curve(panel, curve, text, 1.0, 1.0);
      highest = std::max(highest, *std::max_element(curve.response.begin(), curve.response.end()));
      longest = std::max(longest, curve.x.back());
    }
    panels.push_back(std::move(panel));
  }
  for (Panel& panel : panels) {
    panel.x.upper = 1.03 * longest;
    panel.y.upper = 1.08 * highest;  // of all tissues: forces are compared across panels
  }
  return panels;
}

Figure relaxation_figure(const OrganStudy& study, const StudyCurves& set, const std::string& id) {
  const auto conditions = conditions_of(study, Kind::ramp_hold);
  const auto rates = values_of(study, conditions, &StudyCondition::rate_m_per_s);
  const StudyData* data = data_of(study, Kind::ramp_hold);
  // That of the readings, as is assumed; without data the fastest.
  const double rate = data != nullptr ? data->protocol.rate_m_per_s : rates.back();
  Figure figure{id, fmt::format("Relaxation at every depth, {}", set_words(set)),
                fmt::format("Ramps of {} mm/s, then held. The readings are the peak and the end of "
                            "each depth (Tables 1 to 4 of the paper); that they come from this "
                            "ramp rate is assumed.",
                            significant(1e3 * rate, 4)),
                ramp_panels(study, set, conditions, [&](const StudyCondition& c) {
                  return same(c.rate_m_per_s, rate)
                             ? fmt::format("{} mm", significant(1e3 * c.depth_m, 4))
                             : std::string();
                })};
  for (Panel& panel : figure.panels) {
    if (data == nullptr) continue;
    panel.series.push_back(readings(
        *data, 1.0, [](const Datum&) { return true; },
        [&](const Datum& d) { return d.depth_m.value_or(0.0) / rate + d.time_s.value_or(0.0); }));
    const Series& points = panel.series.back();
    panel.y.upper = std::max(*panel.y.upper, 1.08 * *std::ranges::max_element(points.y));
  }
  figure.caption += missing_words(study, set, conditions);
  return figure;
}

Figure rates_figure(const OrganStudy& study, const StudyCurves& set) {
  const auto conditions = conditions_of(study, Kind::ramp_hold);
  const auto depths = values_of(study, conditions, &StudyCondition::depth_m);
  const double depth = depths[(depths.size() - 1) / 2];
  return {
      "rates",
      fmt::format("{} mm reached at each rate, {}", significant(1e3 * depth, 4), set_words(set)),
      "Compare Fig. 10 of the paper. The model's own curves; no measurement belongs to them. "
      "The other depths are in `curves.csv`.",
      ramp_panels(study, set, conditions, [&](const StudyCondition& c) {
        return same(c.depth_m, depth) ? fmt::format("{} mm/s", significant(1e3 * c.rate_m_per_s, 4))
                                      : std::string();
      })};
}

Figure creep_figure(const OrganStudy& study, std::size_t condition, std::size_t number) {
  const StudyCondition& c = study.config.conditions[condition];
  Figure figure{fmt::format("creep_{}", number),
                fmt::format("Creep under {} N", significant(c.load_N, 4)),
                "Compare Figs. 8 and 9 of the paper. That the band belongs to the end of the creep "
                "is assumed. The bands do not tell eta1: the course in (b) is one of many, its end "
                "is what is fitted."};
  const StudyData* data = data_of(study, Kind::creep);
  for (const StudyCurves* set : shown_sets(study)) {
    Panel panel{lettered(figure.panels.size(), set_words(*set)),
                {"time under load", "s", false, -0.02 * c.duration_s, 1.06 * c.duration_s},
                {"indentation depth", "mm", false, 0.0}};
    for (std::size_t t = 0; t < study.config.tissues.size(); ++t) {
      add_curve(panel, set->at(condition, t), study.config.tissues[t].name, 1.0, 1e3);
    }
    if (data != nullptr) {
      Series band = readings(
          *data, 1e3, [&](const Datum& d) { return d.load_N && same(*d.load_N, c.load_N); },
          [&](const Datum& d) { return d.time_s.value_or(c.duration_s); });
      if (!band.x.empty()) panel.series.push_back(std::move(band));
    }
    figure.caption += missing_words(study, *set, {condition});
    figure.panels.push_back(std::move(panel));
  }
  return figure;
}

}  // namespace

std::vector<Figure> organ_study_figures(const OrganStudy& study) {
  auto figures = mapped<Figure>(conditions_of(study, Kind::static_),
                                [&](std::size_t c) { return static_figure(study, c); });
  if (!conditions_of(study, Kind::ramp_hold).empty()) {
    figures.push_back(relaxation_figure(study, study.curves.front(), "relaxation_one_material"));
    figures.push_back(relaxation_figure(study, study.curves.back(), "relaxation_own_fit"));
    figures.push_back(rates_figure(study, study.curves.back()));
  }
  std::size_t number = 0;
  for (const std::size_t c : conditions_of(study, Kind::creep)) {
    figures.push_back(creep_figure(study, c, ++number));
  }
  // A panel in which no tissue has an answer shows nothing.
  for (Figure& figure : figures) {
    std::erase_if(figure.panels, [](const Panel& panel) { return panel.series.empty(); });
  }
  return figures;
}

}  // namespace tpm::paper
