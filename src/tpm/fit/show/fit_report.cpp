#include "tpm/fit/show/fit_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tpm/base/evenly.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/likelihood/oscillation.hpp"
#include "tpm/fit/sample_digest.hpp"
#include "tpm/fit/show/fit_csv.hpp"
#include "tpm/fit/show/recording_report.hpp"
#include "tpm/fit/show/view_fit.hpp"
#include "tpm/show/draw.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

bool is_storage(Quantity quantity) {
  return quantity == Quantity::storage_modulus || quantity == Quantity::storage_stiffness;
}

std::vector<const FittedDatum*> readings_of(const FitResult& fit, std::size_t choice) {
  std::vector<const FittedDatum*> readings;
  for (const FittedDatum& d : fit.data) {
    if (d.datum.choice == choice && d.datum.frequency_Hz && d.datum.value) readings.push_back(&d);
  }
  return readings;
}

/// The readings of one part that a logarithmic axis can show, fitted or held out.
Series measured_part(const std::vector<const FittedDatum*>& readings, bool storage, bool held_out,
                     double unit) {
  Series s{
      .kind = Series::Kind::points,
      .label = fmt::format("{}{}", storage ? "storage" : "loss", held_out ? ", not fitted" : "")};
  for (const FittedDatum* d : readings) {
    const FitDatum& datum = d->datum;
    if (is_storage(datum.quantity) != storage || datum.held_out != held_out) continue;
    s.provenance = std::string(provenance_name(datum.provenance));
    if (!(*datum.value > 0.0)) continue;
    s.add(*datum.frequency_Hz, *datum.value / unit);
    // A bar below 0 would leave the axis.
    s.sd.push_back(std::min(d->reading_sd, 0.99 * *datum.value) / unit);
  }
  return s;
}

/// Storage and loss of the fitted law over the frequencies of the readings and a little beyond.
std::array<Series, 2> law_lines(const FitResult& fit, std::size_t choice,
                                const std::vector<const FittedDatum*>& readings, double unit) {
  constexpr std::size_t kPoints = 200;
  constexpr double kBeyond = 1.2;
  double low = std::numeric_limits<double>::infinity();
  double high = 0.0;
  for (const FittedDatum* d : readings) {
    low = std::min(low, *d->datum.frequency_Hz / kBeyond);
    high = std::max(high, *d->datum.frequency_Hz * kBeyond);
  }
  Spectrum grid;
  grid.dimension = quantity_dimension(readings.front()->datum.quantity);
  grid.frequency_Hz = evenly_in_log(low, high, kPoints);
  Oscillation oscillation = oscillation_of(fit.config, fit.config.data[choice], grid);
  for (const auto part : {Oscillation::Part::storage, Oscillation::Part::loss}) {
    for (std::size_t i = 0; i < kPoints; ++i) oscillation.readings.push_back({i, part});
  }
  const Response law =
      respond(oscillation, model_parameters(fit.config, fit.best.natural, choice), Want::values);
  std::array<Series, 2> lines{line("law, storage", {}, {}), line("law, loss", {}, {})};
  for (std::size_t i = 0; i < 2 * kPoints; ++i) {
    const double value = law.value[static_cast<Eigen::Index>(i)];
    if (!(value > 0.0)) continue;
    Series& s = lines[i / kPoints];
    s.add(grid.frequency_Hz[i % kPoints], value / unit);
  }
  return lines;
}

/// The recording's result for a parameter of the common law; null if it was not fitted.
const ParameterResult* result_of(const SpecimenRow& row, const std::string& parameter) {
  if (!row.fit) return nullptr;
  for (std::size_t i = 0; i < row.place.size(); ++i) {
    if (row.fit->parameters[i].parameter.name == parameter) return &row.parameter(i);
  }
  return nullptr;
}

/// A range of the pooled parameter over all specimens.
Series pooled_band(const PooledParameter& p, const EffectInterval& range, std::string label,
                   double last) {
  const double unit = p.parameter.unit.to_si;
  Series band{.kind = Series::Kind::band, .label = std::move(label), .provenance = "derived"};
  band.x = {0.5, last};
  band.lower.assign(2, p.parameter.natural(range.lower) / unit);
  band.upper.assign(2, p.parameter.natural(range.upper) / unit);
  return band;
}

Panel specimen_panel(const SpecimenStudy& study, const PooledParameter& p) {
  const double unit = p.parameter.unit.to_si;
  const double last = static_cast<double>(study.rows.size()) + 0.5;
  Panel panel{"",
              {"recording", "", false, 0.5, last},
              {p.parameter.name, p.parameter.unit.symbol, p.parameter.scale == Scale::log}};
  Series interval{.kind = Series::Kind::bracket, .label = "its interval", .provenance = "derived"};
  Series estimate{
      .kind = Series::Kind::points, .label = "estimate of a recording", .provenance = "derived"};
  const bool logarithmic = panel.y.logarithmic;
  for (std::size_t i = 0; i < study.rows.size(); ++i) {
    const ParameterResult* r = result_of(study.rows[i], p.parameter.name);
    if (r == nullptr || (logarithmic && !(r->estimate > 0.0))) continue;
    estimate.add(static_cast<double>(i + 1), r->estimate / unit);
    if (!r->lower || !r->upper || (logarithmic && !(*r->lower > 0.0))) continue;
    interval.add_range(static_cast<double>(i + 1), *r->lower / unit, *r->upper / unit);
  }
  const double mean = p.parameter.natural(p.effects.mean) / unit;
  Series typical = line("typical specimen", {0.5, last}, {mean, mean}, "derived");
  if (p.effects.new_specimen) {
    panel.series.push_back(pooled_band(p, *p.effects.new_specimen, "a new specimen", last));
  } else if (p.effects.tau_squared && *p.effects.tau_squared > 0.0) {
    const double sd = std::sqrt(*p.effects.tau_squared);
    panel.series.push_back(pooled_band(p, {p.effects.mean - sd, p.effects.mean + sd},
                                       "spread between specimens (one sd)", last));
  }
  panel.series.push_back(pooled_band(p, p.effects.interval, "interval of the typical one", last));
  panel.series.push_back(std::move(typical));
  if (!interval.x.empty()) panel.series.push_back(std::move(interval));
  if (!estimate.x.empty()) panel.series.push_back(std::move(estimate));
  return panel;
}

std::string numbered_recordings(const SpecimenStudy& study) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < study.rows.size(); ++i) {
    const SpecimenRow& row = study.rows[i];
    names.push_back(fmt::format("{} {}{}{}", i + 1,
                                std::filesystem::path(row.name).filename().string(),
                                row.specimen.empty() ? "" : fmt::format(" [{}]", row.specimen),
                                row.fit ? "" : " (not fitted)"));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

Figure spectrum_figure(const FitResult& fit, std::size_t choice) {
  const DataChoice& data = fit.config.data.at(choice);
  const auto readings = readings_of(fit, choice);
  if (readings.empty()) throw bad_input(data.dataset, "no spectrum in the fit", "oscillations");
  const std::string name = std::filesystem::path(data.dataset).stem().string();
  const Dimension dimension = quantity_dimension(readings.front()->datum.quantity);
  const Unit unit = shown_unit(dimension);
  const auto hidden = std::count_if(readings.begin(), readings.end(),
                                    [](const FittedDatum* d) { return !(*d->datum.value > 0.0); });
  Figure figure{
      figure_id("spectrum", name), fmt::format("{}: {}", name, law_name(fit.config.law.value())),
      fmt::format(
          "Storage and loss of small oscillations over their frequency, and the fitted law {}; "
          "bars "
          "are standard deviations.{}",
          law_name(*fit.config.law),
          hidden > 0 ? fmt::format(" {} readings are not above 0 and not drawn.", hidden) : "")};
  Panel panel{
      "",
      {"frequency", "Hz", true},
      {dimension == Dimension::stress ? "modulus" : "dynamic stiffness", unit.symbol, true}};
  for (const bool held_out : {false, true}) {
    for (const bool storage : {true, false}) {
      add_if_any(panel, measured_part(readings, storage, held_out, unit.to_si));
    }
  }
  for (Series& s : law_lines(fit, choice, readings, unit.to_si)) add_if_any(panel, std::move(s));
  figure.panels = {std::move(panel)};
  return figure;
}

std::vector<Figure> specimen_figures(const SpecimenStudy& study) {
  constexpr std::size_t kPanels = 3;
  std::vector<Figure> figures;
  for (std::size_t i = 0; i < study.pooled.size(); ++i) {
    if (i % kPanels == 0) {
      Figure figure{
          fmt::format("specimens{}", i == 0 ? "" : fmt::format("_{}", 1 + i / kPanels)),
          fmt::format("{} recordings: {}", study.rows.size(), law_name(study.law)),
          fmt::format(
              "Each recording fitted by itself, and what they have in common (random effects). "
              "An estimate without a bar has an interval that is open.{} Recordings: {}.",
              depends_on_reference(study.law) ? fmt::format(" The {}.", reference_words(study.law))
                                              : std::string(),
              numbered_recordings(study))};
      figures.push_back(std::move(figure));
    }
    figures.back().panels.push_back(specimen_panel(study, study.pooled[i]));
  }
  return figures;
}

std::vector<std::string> write_fit_report(const std::filesystem::path& folder,
                                          const FitResult& fit) {
  std::vector<Figure> figures;
  for (std::size_t i = 0; i < fit.recordings.size(); ++i) {
    figures.push_back(recording_figure(fit, i));
  }
  for (std::size_t i = 0; i < fit.config.data.size(); ++i) {
    const bool oscillation = fit.config.data[i].protocol.kind == ProtocolChoice::Kind::oscillation;
    if (oscillation) figures.push_back(spectrum_figure(fit, i));
  }
  figures.push_back(waterfall_figure(fit));
  std::vector<std::string> files = write_fit_csv(folder, fit);
  if (!no_law_because(fit.config)) {
    files.push_back("law.json");
    write_file(folder / files.back(), to_text(law_document(fit)));
  }
  const Json answer = to_json(fit);
  files.emplace_back("answer.json");
  write_file(folder / files.back(), to_text(answer));
  const ViewPage page = fit_page(answer, to_json(figures), folder / files.back());
  files.emplace_back("fit.html");
  write_file(folder / files.back(), page.html());
  return write_figures(folder, figures, std::move(files));
}

std::vector<std::string> write_specimen_report(const std::filesystem::path& folder,
                                               const SpecimenStudy& study,
                                               const std::optional<ContactGeometry>& probe) {
  write_file(folder / "specimens.json", to_text(to_json(study)));
  write_file(folder / "specimens.csv", specimens_csv(study, probe));
  write_file(folder / "pooled.csv", pooled_csv(study));
  std::vector<std::string> files{"specimens.json", "specimens.csv", "pooled.csv"};
  std::vector<Figure> figures = specimen_figures(study);
  for (const SpecimenRow& row : study.rows) {
    if (row.fit) figures.push_back(recording_figure(*row.fit, 0));
  }
  return write_figures(folder, figures, std::move(files));
}

}  // namespace tpm::fit
