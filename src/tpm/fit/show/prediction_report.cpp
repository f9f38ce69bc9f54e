#include "tpm/fit/show/prediction_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kMostBandPoints = 4000;  // more only make the file heavy

std::size_t stride_of(const LawPrediction& p) {
  return 1 + p.time_s.size() / kMostBandPoints;
}

Series band(const LawPrediction& p, const char* label, const std::vector<double>& lower,
            const std::vector<double>& upper, double unit) {
  Series s{.kind = Series::Kind::band, .label = label, .provenance = "model"};
  for (std::size_t i = 0; i < lower.size(); i += stride_of(p)) {
    if (!std::isfinite(lower[i]) || !std::isfinite(upper[i])) continue;
    s.add_range(p.time_s[i], lower[i] / unit, upper[i] / unit);
  }
  return s;
}

Series prediction_readings(const LawPrediction& p, bool fitted, double unit, bool residual) {
  const PredictedRecording& r = p.recording.value();
  Series s{.kind = Series::Kind::points,
           .label = fitted ? "readings, fitted" : "readings, not fitted",
           .provenance = std::string(residual ? "derived" : provenance_name(r.provenance))};
  for (std::size_t i = 0; i < r.observed.size(); i += stride_of(p)) {
    if (r.was_fitted[i] != fitted || !std::isfinite(p.response[i])) continue;
    s.add(p.time_s[i], (residual ? p.response[i] - r.observed[i] : r.observed[i]) / unit);
  }
  return s;
}

/// The mean with both bands over time, beside the recording if there is one; then prediction less
/// measurement.
Figure prediction_figure(const LawPrediction& p) {
  const Quantity answer = p.drive_kind == Drive::force ? p.spec.drive : p.spec.response;
  const Unit unit = shown_unit(p.response_dimension());
  Figure figure{
      "prediction", fmt::format("{}: predicted {}", p.subject(), spaced(quantity_name(answer))),
      fmt::format(
          "The {} answer with the {} % band of its mean and the {} % band for one new reading.",
          p.organ_spheres > 0 ? "organ's" : "law's", significant(100.0 * p.level, 3),
          significant(100.0 * p.level, 3))};
  Panel panel{.x = {"time", "s"}, .y = {spaced(quantity_name(answer)), unit.symbol}};
  add_if_any(panel,
             band(p, "band for a new reading", p.reading_lower, p.reading_upper, unit.to_si));
  add_if_any(panel, band(p, "band of the mean", p.mean_lower, p.mean_upper, unit.to_si));
  if (p.recording) {
    for (const bool fitted : {true, false})
      add_if_any(panel, prediction_readings(p, fitted, unit.to_si, false));
  }
  Series mean = line("mean", {}, {});
  for (std::size_t i = 0; i < p.time_s.size(); i += stride_of(p)) {
    if (!std::isfinite(p.response[i])) continue;
    mean.add(p.time_s[i], p.response[i] / unit.to_si);
  }
  add_if_any(panel, std::move(mean));
  figure.panels.push_back(std::move(panel));
  if (!p.recording) return figure;
  Panel residual{.x = {"time", "s"}, .y = {"prediction less measured, of the peak", "%"}};
  const auto about_zero = [&](const std::vector<double>& limit) {
    std::vector<double> shifted;
    for (std::size_t i = 0; i < limit.size(); ++i) shifted.push_back(limit[i] - p.response[i]);
    return shifted;
  };
  const double percent = 0.01 * p.recording->peak;
  add_if_any(residual, band(p, "band for a new reading", about_zero(p.reading_lower),
                            about_zero(p.reading_upper), percent));
  add_if_any(residual, band(p, "band of the mean", about_zero(p.mean_lower),
                            about_zero(p.mean_upper), percent));
  for (const bool fitted : {true, false})
    add_if_any(residual, prediction_readings(p, fitted, percent, true));
  figure.panels.push_back(std::move(residual));
  return figure;
}

}  // namespace

std::vector<std::string> write_prediction_report(const std::filesystem::path& folder,
                                                 const LawPrediction& prediction,
                                                 const Json& answer) {
  std::vector<std::string> files{"prediction.csv", "prediction.json"};
  write_file(folder / files[0], to_csv(prediction));
  write_file(folder / files[1], to_text(answer));
  return write_figures(folder, {prediction_figure(prediction)}, std::move(files));
}

}  // namespace tpm::fit
