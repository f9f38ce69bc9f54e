#include "tpm/fit/show/function_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/fit/show/fit_report.hpp"
#include "tpm/fit/show/recording_report.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

/// Relaxation modulus or creep compliance over time, with the fitted law, on logarithmic axes.
/// @param choice place in the fit's data of such readings
Figure step_response_figure(const FitResult& fit, std::size_t choice) {
  std::vector<const FittedDatum*> readings;
  for (const FittedDatum& d : fit.data) {
    if (d.datum.choice == choice && d.datum.time_s > 0.0) readings.push_back(&d);
  }
  const Quantity quantity = fit.data.front().datum.quantity;
  const std::string measured_name = spaced(quantity_name(quantity));
  const Unit unit = shown_unit(quantity_dimension(quantity));
  Series measured{.kind = Series::Kind::points, .label = measured_name};
  Series law = line("law", {}, {});
  std::vector<std::pair<double, double>> along;
  for (const FittedDatum* d : readings) {
    measured.provenance = provenance_name(d->datum.provenance);
    along.emplace_back(d->datum.time_s, d->predicted / unit.to_si);
    if (!(*d->datum.value > 0.0)) continue;
    measured.add(d->datum.time_s, *d->datum.value / unit.to_si);
    // A bar below 0 would leave the axis.
    measured.sd.push_back(std::min(d->reading_sd, 0.99 * *d->datum.value) / unit.to_si);
  }
  std::sort(along.begin(), along.end());
  for (const auto& [time, value] : along) {
    law.add(time, value);
  }
  Panel panel{"", {"time", "s", true}, {measured_name, unit.symbol, true}};
  if (!measured.x.empty()) panel.series.push_back(std::move(measured));
  panel.series.push_back(std::move(law));
  const std::string name =
      std::filesystem::path(fit.config.data.at(choice).dataset).stem().string();
  return {
      figure_id("fit", name),
      fmt::format("{}: {}", name, law_name(fit.config.law.value())),
      fmt::format(
          "{} after a unit step at time 0, and the fitted law {}; bars are standard deviations.",
          measured_name, law_name(*fit.config.law)),
      {std::move(panel)}};
}

}  // namespace

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
  return write_selection(folder, selection, std::move(figures));
}

}  // namespace tpm::fit
