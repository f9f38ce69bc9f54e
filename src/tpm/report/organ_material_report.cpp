#include "tpm/report/organ_material_report.hpp"

#include <fmt/format.h>

#include "tpm/core/text.hpp"
#include "tpm/report/draw.hpp"
#include "tpm/store/file.hpp"

namespace tpm {
namespace {

Series less(const OrganMaterial& m, const char* label, const std::vector<double>& force,
            const std::vector<double>& target) {
  Series s;
  s.kind = Series::Kind::points;
  s.label = label;
  s.provenance = "derived";
  for (std::size_t i = 0; i < force.size(); ++i) {
    s.x.push_back(1e3 * m.depth_m[i]);
    s.y.push_back(100.0 * (force[i] - target[i]) / m.peak_N);
  }
  return s;
}

}  // namespace

Figure organ_material_figure(const OrganMaterial& m) {
  Figure figure;
  figure.id = "material";
  figure.title = fmt::format("{} put on an organ", m.law);
  figure.caption = fmt::format(
      "The contact of the organ with the fitted bonds answers within {} % of the law's peak ({} % "
      "rms); the start by correspondence within {} %.",
      significant(100.0 * m.organ.largest, 3), significant(100.0 * m.organ.rms, 3),
      significant(100.0 * m.start.largest, 3));
  Panel forces;
  forces.x = {"time", "s", false, {}, {}};
  forces.y = {"contact force", "N", false, {}, {}};
  if (!m.measured_N.empty()) {
    Series readings = line("recording", m.time_s, m.measured_N);
    readings.kind = Series::Kind::points;
    readings.provenance = "measured";
    forces.series.push_back(std::move(readings));
  }
  const auto add = [&](const char* label, const std::vector<double>& force) {
    Series s = line(label, m.time_s, force);
    s.provenance = "model";
    forces.series.push_back(std::move(s));
  };
  add("law", m.law_N);
  add("organ, by correspondence", m.correspondence_N);
  add("organ, fitted", m.organ_N);
  Panel misses;
  misses.x = {"depth", "mm", false, {}, {}};
  misses.y = {"organ less law, of the peak", "%", false, {}, {}};
  misses.series = {less(m, "by correspondence less law", m.correspondence_N, m.law_N),
                   less(m, "fitted less law", m.organ_N, m.law_N)};
  figure.panels = {std::move(forces), std::move(misses)};
  return figure;
}

std::vector<std::string> write_organ_material_report(const std::filesystem::path& folder,
                                                     const OrganMaterial& result) {
  std::vector<std::string> files{"scene.json", "session.json", "material.json", "material.csv"};
  write_file(folder / files[0], to_text(result.scene));
  write_file(folder / files[1], to_text(result.session));
  write_file(folder / files[2], to_text(to_json(result)));
  write_file(folder / files[3], to_csv(result));
  const auto drawn = write_figures(folder, {organ_material_figure(result)});
  files.insert(files.end(), drawn.begin(), drawn.end());
  return files;
}

}  // namespace tpm
