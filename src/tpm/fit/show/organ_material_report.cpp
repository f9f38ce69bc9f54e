#include "tpm/fit/show/organ_material_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/show/fit_figures.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::fit {
namespace {

Series less(const OrganMaterial& m, const char* label, std::vector<double> MaterialCourse::*force) {
  Series s{.kind = Series::Kind::points, .label = label, .provenance = "derived"};
  for (const MaterialCourse& c : m.courses) {
    for (std::size_t i = 0; i < c.time_s.size(); ++i) {
      s.add(1e3 * c.depth_m[i], 100.0 * ((c.*force)[i] - c.law_N[i]) / m.peak_N);
    }
  }
  return s;
}

Panel force_panel(const MaterialCourse& c, bool titled) {
  Panel forces;
  if (titled) forces.title = c.name;
  forces.x = {"time", "s"};
  forces.y = {"contact force", "N"};
  if (!c.measured_N.empty()) {
    forces.series.push_back(
        line("recording", c.time_s, c.measured_N, std::string(provenance_name(c.provenance))));
    forces.series.back().kind = Series::Kind::points;
  }
  forces.series.push_back(line("law", c.time_s, c.law_N));
  forces.series.push_back(line("organ, by correspondence", c.time_s, c.correspondence_N));
  forces.series.push_back(line("organ, fitted", c.time_s, c.organ_N));
  return forces;
}

/// The points of a profile and more between them: the signed root of the rise is nearly straight
/// there, and the rise itself is not.
std::vector<ProfilePoint> between_profile_points(const ParameterResult& result, double least) {
  constexpr int kParts = 8;
  const std::vector<ProfilePoint>& points = result.profile.points;
  const auto root = [&](const ProfilePoint& p) {
    return std::copysign(std::sqrt(std::max(0.0, p.deviance - least)), p.natural - result.estimate);
  };
  std::vector<ProfilePoint> finer;
  for (std::size_t i = 1; i < points.size(); ++i) {
    for (int part = 0; part < kParts; ++part) {
      const double t = static_cast<double>(part) / kParts;
      const double r = std::lerp(root(points[i - 1]), root(points[i]), t);
      finer.push_back({std::lerp(points[i - 1].natural, points[i].natural, t), least + r * r});
    }
  }
  if (!points.empty()) finer.push_back(points.back());
  return finer;
}

Panel material_profile_panel(const ReadingsFit& readings, const ParameterResult& result) {
  const FitParameter& p = result.parameter;
  Panel panel{"",
              {p.name, p.unit.symbol, p.scale == Scale::log},
              {"rise of the deviance / limit", "", false, 0.0, 1.6}};
  const double least = readings.fit.best.deviance;
  panel.series = profile_series(result, between_profile_points(result, least), least,
                                {readings.level, readings.rise, readings.rise});
  return panel;
}

/// Forces of law, organ and recording over time, and what the organ misses over depth.
Figure organ_material_figure(const OrganMaterial& m) {
  Figure figure{
      "material", fmt::format("{} put on an organ", m.law),
      fmt::format("The contact of the organ with the fitted bonds answers within {} % of the law's "
                  "peak ({} % "
                  "rms); the start by correspondence within {} %.",
                  significant(100.0 * m.organ.largest, 3), significant(100.0 * m.organ.rms, 3),
                  significant(100.0 * m.start.largest, 3))};
  for (const MaterialCourse& c : m.courses) {
    figure.panels.push_back(force_panel(c, m.courses.size() > 1));
  }
  Panel misses{.x = {"depth", "mm"},
               .y = {"organ less law, of the peak", "%"},
               .series = {less(m, "by correspondence less law", &MaterialCourse::correspondence_N),
                          less(m, "fitted less law", &MaterialCourse::organ_N)}};
  figure.panels.push_back(std::move(misses));
  return figure;
}

/// Nothing if no profiles were walked.
std::vector<Figure> material_figures(const OrganMaterial& m) {
  std::vector<Figure> figures{organ_material_figure(m)};
  if (m.intervals != MaterialIntervals::profiles) return figures;
  Figure figure{
      "material_profiles", fmt::format("Profiles of {} on an organ", m.law),
      "Each parameter of the bonds is held, and the others, contacts and offsets among them, are "
      "fitted again to the readings."};
  for (std::size_t i = 0; i < m.parameters.size(); ++i) {
    const ParameterResult& p = m.readings->fit.parameters[i];
    if (!p.profile.points.empty()) figure.panels.push_back(material_profile_panel(*m.readings, p));
  }
  figures.push_back(std::move(figure));
  return figures;
}

}  // namespace

std::vector<std::string> write_organ_material_report(const std::filesystem::path& folder,
                                                     const OrganMaterial& result) {
  std::vector<std::string> files{"scene.json", "session.json", "material.json", "material.csv"};
  write_file(folder / files[0], to_text(result.scene));
  write_file(folder / files[1], to_text(result.session));
  write_file(folder / files[2], to_text(to_json(result)));
  write_file(folder / files[3], to_csv(result));
  return write_figures(folder, material_figures(result), std::move(files));
}

}  // namespace tpm::fit
