#include "tpm/report/function_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/core/text.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/report/draw.hpp"
#include "tpm/report/fit_csv.hpp"
#include "tpm/report/fit_report.hpp"
#include "tpm/report/recording_report.hpp"
#include "tpm/store/file.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::report {
namespace {

std::string spaced_name(Quantity quantity) {
  std::string words(quantity_name(quantity));
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

}  // namespace

Figure step_response_figure(const FitResult& fit, std::size_t choice) {
  std::vector<const FittedDatum*> readings;
  for (const FittedDatum& d : fit.data) {
    if (d.datum.choice == choice && d.datum.time_s > 0.0) readings.push_back(&d);
  }
  const Quantity quantity = fit.data.front().datum.quantity;
  const Unit unit = shown_unit(quantity_dimension(quantity));
  Series measured;
  measured.kind = Series::Kind::points;
  measured.label = spaced_name(quantity);
  Series law = line("law", {}, {});
  std::vector<std::pair<double, double>> along;
  for (const FittedDatum* d : readings) {
    measured.provenance = provenance_name(d->datum.provenance);
    along.emplace_back(d->datum.time_s, d->predicted / unit.to_si);
    if (!(*d->datum.value > 0.0)) continue;
    measured.x.push_back(d->datum.time_s);
    measured.y.push_back(*d->datum.value / unit.to_si);
    // A bar below 0 would leave the axis.
    measured.sd.push_back(std::min(d->reading_sd, 0.99 * *d->datum.value) / unit.to_si);
  }
  std::sort(along.begin(), along.end());
  for (const auto& [time, value] : along) {
    law.x.push_back(time);
    law.y.push_back(value);
  }
  Panel panel{
      "", {"time", "s", true, {}, {}}, {spaced_name(quantity), unit.symbol, true, {}, {}}, {}};
  if (!measured.x.empty()) panel.series.push_back(std::move(measured));
  panel.series.push_back(std::move(law));
  Figure figure;
  const std::string name =
      std::filesystem::path(fit.config.data.at(choice).dataset).stem().string();
  figure.id = fmt::format("fit_{}", name);
  figure.title = fmt::format("{}: {}", name, law_name(fit.config.law.value()));
  figure.caption = fmt::format(
      "{} after a unit step at time 0, and the fitted law {}; bars are standard deviations.",
      spaced_name(quantity), law_name(*fit.config.law));
  figure.panels = {std::move(panel)};
  return figure;
}

std::vector<std::string> write_function_report(const std::filesystem::path& folder,
                                               const MaterialFunction& function,
                                               const Selection& selection) {
  const FitResult& fit = selection.candidates[selection.recommended].fit;
  std::vector<Figure> figures;
  if (std::holds_alternative<Spectrum>(function.data)) {
    figures.push_back(spectrum_figure(fit, 0));
  } else {
    figures.push_back(step_response_figure(fit, 0));
  }
  figures.push_back(selection_figure(selection));
  figures.push_back(waterfall_figure(fit));
  std::vector<std::string> files{"config.json", "selection.json", "law.json", "laws.csv"};
  write_file(folder / files[0], to_text(config_json(seen_from(folder, fit.config))));
  write_file(folder / files[1], to_text(to_json(selection)));
  write_law(folder / files[2], fitted_law(fit));
  write_file(folder / files[3], laws_csv(selection));
  for (std::string& name : write_fit_csv(folder, fit)) files.push_back(std::move(name));
  const std::vector<std::string> drawn = write_figures(folder, figures);
  files.insert(files.end(), drawn.begin(), drawn.end());
  return files;
}

}  // namespace tpm::report
