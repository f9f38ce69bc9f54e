// Declared in tpm/fit/predict/law_prediction.hpp.
// Output of a prediction: JSON, terminal, CSV.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/show/table_document.hpp"

namespace tpm::fit {
namespace {

std::string unit_suffix(Dimension dimension) {
  const std::string unit(si_symbol(dimension));
  return unit.empty() ? "" : "_" + unit;
}

Json numbers(const std::vector<double>& values) {
  return array_json(values, [](double v) { return or_null(v); });
}

std::string drive_key(const LawPrediction& p) {
  if (p.drive_kind == Drive::force) {
    return p.spec.response == Quantity::contact_force ? "load_N" : si_key(p.spec.response);
  }
  return p.spec.drive == Quantity::relative_length ? "relative_length" : "depth_m";
}

Json comparison_json(const PredictionComparison& c, double peak, const std::string& suffix) {
  Json json{{"samples", c.samples}};
  if (c.samples == 0) return json;
  json["rms" + suffix] = rounded(c.rms);
  json["largest" + suffix] = rounded(c.largest);
  json["rms_over_peak"] = rounded(c.rms / peak);
  json["largest_over_peak"] = rounded(c.largest / peak);
  if (c.share_in_reading_band) {
    json["share_in_reading_band"] = rounded(*c.share_in_reading_band);
  }
  return json;
}

std::string comparison_words(const char* what, const PredictionComparison& c, double peak) {
  if (c.samples == 0) return {};
  std::string text =
      fmt::format("{}, {} samples: rms {} % of the peak, largest {} %", what, c.samples,
                  significant(100.0 * c.rms / peak, 3), significant(100.0 * c.largest / peak, 3));
  if (c.share_in_reading_band) {
    text += fmt::format("; {} % in the band for new readings",
                        significant(100.0 * *c.share_in_reading_band, 3));
  }
  return text + "\n";
}

std::string placement_words(const LawPrediction& p) {
  const char* whose = p.placement == Placement::surface ? "none: depths count from the surface"
                      : p.placement == Placement::fitted
                          ? "of the fit"
                          : "found for this recording, material fixed";
  return fmt::format("contact {}, offset {} ({})\n",
                     sized_text(quantity_dimension(p.spec.drive), p.contact, 4),
                     sized_text(quantity_dimension(p.spec.response), p.offset, 4), whose);
}

/// Of a table of the answer: the unit in which its largest value is read most easily.
Unit table_unit(const LawPrediction& p) {
  double largest = 0.0;
  for (const double value : p.response) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  return sized_unit(shown_unit(p.response_dimension()), largest);
}

}  // namespace

Json to_json(const LawPrediction& p) {
  const Dimension dimension = p.response_dimension();
  const std::string suffix = unit_suffix(dimension);
  Json json{{"law", law_name(p.spec)},
            {"level", p.level},
            {"quantile_of_the_standard_error", rounded(p.quantile)},
            {"bands_from", p.samples > 0 ? "samples" : "derivatives"},
            {"placement", placement_name(p.placement)}};
  if (p.organ_spheres > 0) json["organ_spheres"] = p.organ_spheres;
  if (p.samples > 0) json["samples"] = p.samples;
  json["contact" + unit_suffix(quantity_dimension(p.spec.drive))] = rounded(p.contact);
  json["offset" + unit_suffix(quantity_dimension(p.spec.response))] = rounded(p.offset);
  json["time_s"] = numbers(p.time_s);
  json[drive_key(p)] = numbers(p.imposed);
  json["mean" + suffix] = numbers(p.response);
  json["standard_error" + suffix] = numbers(p.standard_error);
  json["mean_band" + suffix] = {{"lower", numbers(p.mean_lower)}, {"upper", numbers(p.mean_upper)}};
  if (!p.reading_lower.empty()) {
    json["reading_band" + suffix] = {{"lower", numbers(p.reading_lower)},
                                     {"upper", numbers(p.reading_upper)}};
  }
  if (p.recording) {
    const PredictedRecording& r = *p.recording;
    json["recording"] = {{"name", r.name},
                         {"peak" + suffix, rounded(r.peak)},
                         {"observed" + suffix, numbers(r.observed)},
                         {"fitted", comparison_json(r.fitted, r.peak, suffix)},
                         {"not_fitted", comparison_json(r.held_out, r.peak, suffix)},
                         {"after_the_hold", comparison_json(r.outside, r.peak, suffix)}};
  }
  json["remarks"] = remarks_json(p.remarks);
  return json;
}

std::string to_csv(const LawPrediction& p) {
  const std::string suffix = unit_suffix(p.response_dimension());
  NumberColumns columns{{"time_s", p.time_s},
                        {drive_key(p), p.imposed},
                        {"mean" + suffix, p.response},
                        {"standard_error" + suffix, p.standard_error},
                        {"mean_lower" + suffix, p.mean_lower},
                        {"mean_upper" + suffix, p.mean_upper}};
  if (!p.reading_lower.empty()) {
    columns.emplace_back("reading_lower" + suffix, p.reading_lower);
    columns.emplace_back("reading_upper" + suffix, p.reading_upper);
  }
  std::vector<double> was_fitted;
  if (p.recording) {
    was_fitted.assign(p.recording->was_fitted.begin(), p.recording->was_fitted.end());
    columns.emplace_back("observed" + suffix, p.recording->observed);
    columns.emplace_back("was_fitted", was_fitted);
  }
  constexpr int kDigits = 9;
  return numbers_csv(columns, kDigits);
}

std::string to_terminal_text(const LawPrediction& p) {
  constexpr std::size_t kRows = 12;
  const Unit unit = table_unit(p);
  std::string text = fmt::format(
      "{}: {}\n{}{} % bands, {}\n\n", p.subject(), law_words(p.spec), placement_words(p),
      significant(100.0 * p.level, 4),
      p.samples > 0 ? fmt::format("from {} laws drawn from the fit's covariance", p.samples)
                    : fmt::format("{} standard errors", significant(p.quantile, 4)));
  text += fmt::format("{:>10} {:>12} {:>25}{}\n", "time s", fmt::format("mean {}", unit.symbol),
                      "band of the mean",
                      p.reading_lower.empty() ? "" : fmt::format(" {:>25}", "band for a reading"));
  const auto pair = [&](double lower, double upper) {
    return fmt::format(" {:>25}", fmt::format("{} .. {}", significant(lower / unit.to_si, 4),
                                              significant(upper / unit.to_si, 4)));
  };
  const std::size_t n = p.time_s.size();
  for (std::size_t row = 0; row < std::min(n, kRows); ++row) {
    const std::size_t i = n <= kRows ? row : row * (n - 1) / (kRows - 1);
    text += fmt::format("{:>10} {:>12}", significant(p.time_s[i], 4),
                        significant(p.response[i] / unit.to_si, 4));
    text += pair(p.mean_lower[i], p.mean_upper[i]);
    if (!p.reading_lower.empty()) text += pair(p.reading_lower[i], p.reading_upper[i]);
    text += "\n";
  }
  if (p.recording) {
    const PredictedRecording& r = *p.recording;
    text += "\n" + comparison_words("fitted", r.fitted, r.peak) +
            comparison_words("not fitted", r.held_out, r.peak) +
            comparison_words("after the hold", r.outside, r.peak);
  }
  for (const Remark& remark : p.remarks) text += fmt::format("! {}\n", remark.text);
  return text;
}

}  // namespace tpm::fit
