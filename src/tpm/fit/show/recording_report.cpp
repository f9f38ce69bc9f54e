#include "tpm/fit/show/recording_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/sample_digest.hpp"
#include "tpm/fit/show/fit_csv.hpp"
#include "tpm/fit/show/view_fit.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::fit {
namespace {

/// The law where the recording was not fitted: what it predicts.
constexpr const char* kOutsideLabel = "fitted law, outside the fitted window";

/// More points than this only make the file heavy.
constexpr std::size_t kMostDrawn = 4000;

struct Units {
  Unit drive, response;
};

Units units_of(const RecordingFit& r) {
  return {shown_unit(quantity_dimension(r.drive_quantity)),
          shown_unit(quantity_dimension(r.response_quantity))};
}

/// Takes every k-th sample for which `wanted` holds and that has a value (a law may not predict).
template <class Wanted>
Series sampled(Series series, const RecordingFit& r, const std::vector<double>& x, double x_unit,
               const std::vector<double>& y, double y_unit, const Wanted& wanted) {
  const std::size_t stride = 1 + r.time_s.size() / kMostDrawn;
  for (std::size_t i = 0; i < r.time_s.size(); i += stride) {
    if (!wanted(i) || !std::isfinite(y[i])) continue;
    series.add(x[i] / x_unit, y[i] / y_unit);
  }
  return series;
}

Series measured(const char* label, const RecordingFit& r) {
  return {.kind = Series::Kind::points,
          .label = label,
          .provenance = std::string(provenance_name(r.provenance))};
}

/// Where 95 % (or the fit's level) of new readings would fall.
void add_band(Panel& panel, const RecordingFit& r, double y_unit) {
  if (r.lower.size() != r.time_s.size()) return;
  Series band{.kind = Series::Kind::band, .label = "prediction band", .provenance = "model"};
  const std::size_t stride = 1 + r.time_s.size() / kMostDrawn;
  for (std::size_t i = 0; i < r.time_s.size(); i += stride) {
    if (!r.fitted[i] || !std::isfinite(r.lower[i]) || !std::isfinite(r.upper[i])) continue;
    band.add_range(r.time_s[i], r.lower[i] / y_unit, r.upper[i] / y_unit);
  }
  add_if_any(panel, std::move(band));
}

Panel response_panel(const RecordingFit& r, bool over_time) {
  const Units units = units_of(r);
  Panel panel;
  const std::vector<double>& x = over_time ? r.time_s : r.drive;
  const double x_unit = over_time ? 1.0 : units.drive.to_si;
  panel.x = {over_time ? "time" : spaced(quantity_name(r.drive_quantity)),
             over_time ? "s" : units.drive.symbol};
  panel.y = {spaced(quantity_name(r.response_quantity)), units.response.symbol};
  const double y_unit = units.response.to_si;
  const auto inside = [&](std::size_t i) { return r.fitted[i]; };
  const auto outside = [&](std::size_t i) { return !r.fitted[i]; };
  add_if_any(panel,
             sampled(measured("readings, fitted", r), r, x, x_unit, r.observed, y_unit, inside));
  add_if_any(panel, sampled(measured("readings, not fitted", r), r, x, x_unit, r.observed, y_unit,
                            outside));
  if (over_time) add_band(panel, r, y_unit);
  add_if_any(panel, sampled(line("fitted law", {}, {}), r, x, x_unit, r.predicted, y_unit, inside));
  if (over_time) {
    add_if_any(panel,
               sampled(line(kOutsideLabel, {}, {}), r, x, x_unit, r.predicted, y_unit, outside));
  }
  return panel;
}

Panel residual_panel(const RecordingFit& r) {
  Panel panel{.x = {"time", "s"}, .y = {"residual over peak", "%"}};
  std::vector<double> residual(r.observed.size());
  for (std::size_t i = 0; i < residual.size(); ++i) residual[i] = r.predicted[i] - r.observed[i];
  Series s{.kind = Series::Kind::points, .label = "law less reading", .provenance = "derived"};
  add_if_any(panel, sampled(std::move(s), r, r.time_s, 1.0, residual, 0.01 * r.peak,
                            [&](std::size_t i) { return r.fitted[i]; }));
  return panel;
}

Series laws_at(const Selection& s, bool bic, bool recommended) {
  Series series{.kind = Series::Kind::points,
                .label = recommended ? "recommended" : "law",
                .provenance = "derived"};
  for (std::size_t i = 0; i < s.candidates.size(); ++i) {
    const Candidate& c = s.candidates[i];
    if (c.failed || (i == s.recommended) != recommended) continue;
    series.add(c.parameters - 1, bic ? c.delta_bic : 100.0 * c.rms_over_peak);
  }
  return series;
}

/// The configuration with its data sets as a file in the folder finds them.
FitConfig seen_from(const std::filesystem::path& folder, FitConfig config) {
  for (DataChoice& data : config.data) {
    const std::filesystem::path path(data.dataset);
    if (path.has_extension() && path.is_relative()) {
      data.dataset = std::filesystem::absolute(path)
                         .lexically_relative(std::filesystem::absolute(folder))
                         .generic_string();
    }
  }
  return config;
}

/// What a provenance means to somebody who has not read of it.
std::string origin_words(Provenance provenance) {
  if (provenance == Provenance::assumed) return "assumed: chosen or computed, not measured";
  return std::string(provenance_name(provenance));
}

/// Where the readings behind a figure come from: "data: meat.csv [measured]".
std::string data_words(const FitResult& fit) {
  std::vector<std::string> words;
  for (const RecordingFit& r : fit.recordings) {
    words.push_back(fmt::format(
        "{} [{}]", std::filesystem::path(fit.config.data[r.choice].dataset).filename().string(),
        origin_words(r.provenance)));
  }
  return words.empty() ? "" : fmt::format("data: {}", fmt::join(words, ", "));
}

/// Each law's residual and BIC over its number of parameters, the recommended one marked.
Figure selection_figure(const Selection& selection) {
  Figure figure{"selection", "Which law",
                fmt::format("Every law that was fitted: residual, and BIC above the best with "
                            "{:.0f} independent readings, "
                            "over the number of estimated parameters. The recommended law is {}.",
                            selection.effective_count,
                            law_name(selection.candidates[selection.recommended].law))};
  Panel residual;
  residual.x = {"estimated parameters", ""};
  residual.y = {"rms residual over peak", "%", true};
  // Beyond 10 the evidence against a law is very strong: what matters lies within 30.
  constexpr double kLargestBic = 30.0;
  Panel bic{
      .x = residual.x,
      .y = {.quantity = "BIC above the best", .unit = "", .lower = 0.0, .upper = kLargestBic}};
  for (const bool recommended : {false, true}) {
    add_if_any(residual, laws_at(selection, false, recommended));
    add_if_any(bic, laws_at(selection, true, recommended));
  }
  figure.panels = {std::move(residual), std::move(bic)};
  return figure;
}

}  // namespace

Figure recording_figure(const FitResult& fit, std::size_t recording) {
  const RecordingFit& r = fit.recordings.at(recording);
  const std::string name = std::filesystem::path(fit.config.data[r.choice].dataset).stem().string();
  const std::string law = fit.config.law ? law_name(*fit.config.law) : fit.config.model;
  Figure figure{figure_id("fit", name), fmt::format("{}: {}", name, law),
                fmt::format("{} and the law {}, driven by the measured {}; rms residual {} % of "
                            "the peak where fitted.",
                            spaced(quantity_name(r.response_quantity)), law,
                            spaced(quantity_name(r.drive_quantity)),
                            significant(100.0 * r.rms_residual / r.peak, 3))};
  if (r.not_predicted > 0) {
    figure.caption += fmt::format(
        " The law's line ends where it predicts nothing: {} samples beyond.", r.not_predicted);
  }
  for (const ParameterResult& p : fit.parameters) {
    if (!p.nuisance || !(p.at_lower_bound || p.at_upper_bound)) continue;
    const double bound = p.at_upper_bound ? p.parameter.upper : p.parameter.lower;
    figure.caption += fmt::format(" The fit presses on a bound of {} ({}): it holds only there.",
                                  p.parameter.name, in_unit(p.parameter, bound));
  }
  figure.panels = {response_panel(r, true), response_panel(r, false), residual_panel(r)};
  return figure;
}

Figure waterfall_figure(const FitResult& fit) {
  Figure figure{"waterfall", "Where the starts ended",
                fmt::format("Deviance of the end of each start that was followed, sorted: {}.",
                            fit.waterfall.summary)};
  Panel panel{.x = {"start, sorted", ""}, .y = {"deviance above the best", ""}};
  Series ends{.kind = Series::Kind::points, .label = "end of a start", .provenance = "model"};
  for (std::size_t i = 0; i < fit.waterfall.deviances.size(); ++i) {
    ends.add(static_cast<double>(i + 1),
             fit.waterfall.deviances[i] - fit.waterfall.deviances.front());
  }
  // Ends that agree are drawn as such: what rounding leaves between them does not fill the axis.
  const Waterfall& w = fit.waterfall;
  if (!w.deviances.empty() && w.deviances.back() - w.deviances.front() <= w.margin) {
    panel.y.lower = 0.0;
    panel.y.upper = w.margin;
  }
  add_if_any(panel, std::move(ends));
  figure.panels = {std::move(panel)};
  return figure;
}

std::vector<std::string> write_selection(const std::filesystem::path& folder,
                                         const Selection& selection, std::vector<Figure> figures) {
  const FitResult& fit = selection.candidates[selection.recommended].fit;
  figures.push_back(selection_figure(selection));
  figures.push_back(waterfall_figure(fit));
  for (Figure& figure : figures) figure.note = data_words(fit);
  std::vector<std::string> files{"config.json", "selection.json", "law.json", "laws.csv"};
  write_file(folder / files[0], to_text(config_json(seen_from(folder, fit.config))));
  write_file(folder / files[1], to_text(to_json(selection)));
  write_file(folder / files[2], to_text(law_document(fit)));
  write_file(folder / files[3], laws_csv(selection));
  for (std::string& name : write_fit_csv(folder, fit)) files.push_back(std::move(name));
  files.emplace_back("fit.html");
  write_file(folder / files.back(),
             fit_page(to_json(selection), to_json(figures), folder / "law.json").html());
  return write_figures(folder, figures, std::move(files));
}

std::vector<std::string> write_recording_report(const std::filesystem::path& folder,
                                                const Selection& selection) {
  const FitResult& fit = selection.candidates[selection.recommended].fit;
  std::vector<Figure> figures;
  for (std::size_t i = 0; i < fit.recordings.size(); ++i) {
    figures.push_back(recording_figure(fit, i));
    figures.back().id =
        fmt::format("{}{}", i == 0 ? "fit" : "fit_", i == 0 ? "" : fmt::format("{}", i + 1));
  }
  return write_selection(folder, selection, std::move(figures));
}

}  // namespace tpm::fit
