// Declared in tpm/fit/fit.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/fit_flags.hpp"
#include "tpm/fit/show/fit_answer.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm::fit {
namespace {

std::string interval_text(const ParameterResult& p, const Unit& unit) {
  if (p.verdict == Verdict::not_profiled) return "-";
  return fmt::format("{} .. {}", limit_text(p, false, unit), limit_text(p, true, unit));
}

std::string parameter_table(const FitResult& result) {
  std::string text =
      fmt::format("{:<10} {:>12} {:>12}  {:<24} {:<8} {}\n", "parameter", "estimate", "std. error",
                  fmt::format("{:.4g} % interval", 100.0 * result.config.level), "unit", "verdict");
  for (const ParameterResult& p : result.parameters) {
    const Unit unit = sized_unit(p.parameter.unit, size_of(p));
    text += fmt::format(
        "{:<10} {:>12} {:>12}  {:<24} {:<8} {}\n", p.parameter.name,
        estimate_text(p.estimate, size_of(p), unit),
        p.standard_error ? significant(*p.standard_error / unit.to_si, kErrorDigits) : "-",
        interval_text(p, unit), unit.symbol, verdict_text(p));
  }
  return text;
}

std::string data_table(const FitResult& result) {
  std::size_t width = 14;
  for (const FittedDatum& d : result.data) width = std::max(width, d.datum.label.size());
  std::string text = fmt::format("{:<18} {:<{}} {:>18} {:>10} {:>8}  {:<10} {}\n", "data set",
                                 "reading", width, "observed", "model", "z", "provenance", "");
  for (const FittedDatum& d : result.data) {
    const Unit unit = sized_unit(shown_unit(quantity_dimension(d.datum.quantity)),
                                 d.datum.value ? *d.datum.value : *d.datum.upper);
    const std::string observed =
        d.datum.value ? with_unit(significant(*d.datum.value / unit.to_si, 4), unit)
                      : with_unit(fmt::format("{}-{}", significant(*d.datum.lower / unit.to_si, 3),
                                              significant(*d.datum.upper / unit.to_si, 3)),
                                  unit);
    text += fmt::format("{:<18} {:<{}} {:>18} {:>10} {:>8.2f}  {:<10} {}\n",
                        result.config.data[d.datum.choice].dataset, d.datum.label, width, observed,
                        significant(d.predicted / unit.to_si, 4), d.standardised,
                        provenance_name(d.datum.provenance), d.datum.held_out ? "held out" : "");
  }
  return text;
}

std::string minima_table(const FitResult& result) {
  const std::size_t looked_at = starts_looked_at(result);
  std::string text;
  if (looked_at > static_cast<std::size_t>(std::max(result.starts_run, 0))) {
    text = fmt::format("{} starts looked at; followed: ", looked_at);
  }
  text += fmt::format(
      "{} starts, {} failed, {} end at the best minimum: their deviances agree to 5 digits\n",
      result.starts_run, result.starts_failed, result.starts_agreeing);
  for (const DistinctMinimum& m : result.minima) {
    text += fmt::format("  deviance {:<12} {:>3} starts:", significant(m.minimum.deviance, 6),
                        m.starts);
    for (std::size_t i = 0; i < m.low.size(); ++i) {
      const FitParameter& p = result.parameters[i].parameter;
      const Unit unit = sized_unit(p.unit, std::max(std::abs(m.low[i]), std::abs(m.high[i])));
      const std::string low = significant(m.low[i] / unit.to_si, 4);
      const std::string high = significant(m.high[i] / unit.to_si, 4);
      text +=
          fmt::format(" {} {}", p.name, with_unit(low == high ? low : low + " to " + high, unit));
      text += i + 1 < m.low.size() ? "," : "\n";
    }
  }
  return text + result.waterfall.summary + "\n";
}

/// "liver.csv: 500 of 600 samples fitted, rms residual 1.2 mN (0.4 % of the peak), ..."
std::string recording_line(const FitResult& result, const RecordingFit& r) {
  const Unit unit = shown_unit(quantity_dimension(r.response_quantity));
  const auto shown = [&](double si) { return sized_text(unit, si, 3); };
  std::string text = fmt::format(
      "{}: {} of {} samples fitted, rms residual {}", result.config.data[r.choice].dataset,
      std::count(r.fitted.begin(), r.fitted.end(), true), r.time_s.size(), shown(r.rms_residual));
  if (r.peak > 0.0) {
    text += fmt::format(" ({} % of the peak)", significant(100.0 * r.rms_residual / r.peak, 3));
  }
  if (r.rms_outside) text += fmt::format(", {} outside the window", shown(*r.rms_outside));
  if (const auto count = std::ranges::count(r.censored, true); count > 0) {
    text += fmt::format(", {} at a limit of the force cell (censored)", count);
  }
  if (const auto count = std::ranges::count(r.outlier, true); count > 0) {
    text += fmt::format(", {} outlier{} left out", count, count == 1 ? "" : "s");
  }
  if (r.not_predicted > 0) text += fmt::format(", {} samples not predicted", r.not_predicted);
  if (r.share_inside) {
    text += fmt::format(", {} % within the {:.4g} % prediction band",
                        significant(100.0 * *r.share_inside, 3), 100.0 * result.config.level);
  }
  if (r.correlation) text += "; " + r.correlation->summary;
  return text + "\n";
}

/// Noise that chi-square was computed with, if its size was estimated.
std::string noise_line(const FitResult& result) {
  const bool known = std::all_of(result.config.data.begin(), result.config.data.end(),
                                 [](const DataChoice& d) { return d.noise.scale_known; });
  if (known || result.degrees_of_freedom <= 0) return {};
  return fmt::format(
      "the size of the noise is estimated: {} times the standard deviations that chi-square was "
      "counted with\n",
      significant(std::sqrt(result.variance_factor), 4));
}

std::string likelihood_line(const Likelihood& l) {
  return fmt::format("-2 ln L {}, AIC {}, AICc {}, BIC {} with {} parameters\n",
                     significant(l.minus_two_log, 6), significant(l.aic, 6),
                     l.aicc ? significant(*l.aicc, 6) : "-", significant(l.bic, 6), l.parameters);
}

std::string bootstrap_table(const FitResult& result) {
  const BootstrapResult& b = result.bootstrap.value();
  std::string text = b.summary + "\n";
  for (std::size_t i = 0; i < b.parameters.size(); ++i) {
    const ParameterResult& fitted = result.parameters[i];
    const Unit unit = sized_unit(fitted.parameter.unit, size_of(fitted));
    const BootstrapParameter& p = b.parameters[i];
    const auto interval = [&](const BootstrapInterval& limits) {
      return fmt::format("{} .. {}", significant(limits.lower / unit.to_si, 4),
                         significant(limits.upper / unit.to_si, 4));
    };
    text += fmt::format("  {:<10} std. error {}, percentile {}, BCa {} {}\n", p.name,
                        significant(p.standard_error / unit.to_si, kErrorDigits),
                        interval(p.percentile), p.bca ? interval(*p.bca) : "-", unit.symbol);
  }
  return text + "\n";
}

/// Recordings have hundreds of readings; a terminal wants a sentence.
constexpr std::size_t kMostRows = 40;

}  // namespace

std::string to_terminal_text(const FitResult& result) {
  std::string text = result.config.title + "\n\n" + parameter_table(result);
  if (result.config.law && depends_on_reference(*result.config.law)) {
    text += reference_words(*result.config.law) + "\n";
  }
  text += "\n";
  text += fmt::format("chi-square {} from {} values{}, {} degrees of freedom",
                      significant(result.chi_square, 6), result.value_count,
                      result.band_count > 0 ? fmt::format(" and {} bands", result.band_count) : "",
                      result.degrees_of_freedom > 0 ? std::to_string(result.degrees_of_freedom)
                                                    : std::string("no"));
  if (result.chi_square_p) {
    text += fmt::format(", p = {}{}", significant(*result.chi_square_p, 2),
                        result.recordings.empty() ? "" : " if all samples were independent");
  }
  text += "\n" + noise_line(result);
  if (result.likelihood) text += likelihood_line(*result.likelihood);
  text += "\n";
  for (const ParameterResult& p : result.parameters) text += "- " + p.summary + "\n";
  for (const HypothesisResult& h : result.hypotheses) text += "- " + h.summary + "\n";
  if (!result.weakest_words.empty()) text += "- " + result.weakest_words + "\n";
  text += "\n" + minima_table(result) + "\n";
  if (result.bootstrap) text += bootstrap_table(result);
  for (const RecordingFit& r : result.recordings) text += recording_line(result, r);
  if (result.data.empty()) {
    // the recordings' lines say it all
  } else if (result.data.size() <= kMostRows) {
    text += data_table(result);
  } else {
    text += fmt::format("{} readings; --format json lists them\n", result.data.size());
  }
  for (const Remark& remark : result.remarks) text += "note: " + remark.text + "\n";
  for (const std::string& prior : prior_words(result, false)) text += "note: " + prior + "\n";
  return text;
}

}  // namespace tpm::fit
