#include "tpm/fit/show/fit_csv.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/show/table_document.hpp"

namespace tpm::fit {
namespace {

constexpr int kCells = 6;  // significant digits, as in JSON

std::string cell(double value) {
  return std::isfinite(value) ? significant(value, kCells) : std::string();
}

std::string cell(const std::optional<double>& value) {
  return value ? cell(*value) : std::string();
}

/// The depth at which coefficients are secants; empty where they do not depend on one.
std::string reference_cell(const std::optional<LawSpec>& law) {
  return law && depends_on_reference(*law) ? cell(law->reference) : std::string();
}

/// "depth_reference_m", or "reference" of a law of stress.
std::string reference_column(const std::optional<LawSpec>& law) {
  return law ? si_key(law->drive, "reference") : std::string("depth_reference_m");
}

std::vector<std::string> parameter_columns(const std::optional<LawSpec>& law) {
  return {"parameter",   "SI_unit",     "estimate", "standard_error",
          "lower",       "upper",       "level",    reference_column(law),
          "lower_bound", "upper_bound", "at_bound", "verdict"};
}

std::vector<std::string> parameter_cells(const FitResult& fit, const ParameterResult& p,
                                         const std::string& name) {
  return {name,
          si_unit(p.parameter),
          cell(p.estimate),
          cell(p.standard_error),
          cell(p.lower),
          cell(p.upper),
          cell(fit.config.level),
          reference_cell(fit.config.law),
          cell(p.parameter.lower),
          cell(p.parameter.upper),
          p.at_lower_bound   ? "lower"
          : p.at_upper_bound ? "upper"
                             : "no",
          verdict_text(p)};
}

/// Each sample of a recording with the law's answer and its prediction band.
std::string samples_csv(const FitResult& fit, std::size_t recording) {
  const RecordingFit& r = fit.recordings.at(recording);
  const bool banded = r.lower.size() == r.time_s.size();
  std::string text =
      csv_line({"time_s", si_key(r.drive_quantity), si_key(r.response_quantity, "observed"),
                si_key(r.response_quantity, "law"), si_key(r.response_quantity, "band_lower"),
                si_key(r.response_quantity, "band_upper"), "role", "provenance"});
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    text += csv_line(
        {significant(r.time_s[i], 9), significant(r.drive[i], 9), significant(r.observed[i], 9),
         std::isfinite(r.predicted[i]) ? significant(r.predicted[i], 9) : "",
         banded ? cell(r.lower[i]) : "", banded ? cell(r.upper[i]) : "",
         r.fitted[i] ? "fitted" : "not_fitted", std::string(provenance_name(r.provenance))});
  }
  return text;
}

}  // namespace

std::string parameters_csv(const FitResult& fit) {
  std::string text = csv_line(parameter_columns(fit.config.law));
  for (const ParameterResult& p : fit.parameters) {
    text += csv_line(parameter_cells(fit, p, p.parameter.name));
  }
  return text;
}

std::string readings_csv(const FitResult& fit) {
  std::string text =
      csv_line({"dataset", "label", "frequency_Hz", "time_s", "quantity", "SI_unit", "observed",
                "band_lower", "band_upper", "law", "sd", "role", "provenance"});
  for (const FittedDatum& d : fit.data) {
    const FitDatum& datum = d.datum;
    text += csv_line({fit.config.data[datum.choice].dataset, datum.label, cell(datum.frequency_Hz),
                      datum.frequency_Hz ? std::string() : cell(datum.time_s),
                      std::string(quantity_name(datum.quantity)),
                      std::string(si_symbol(quantity_dimension(datum.quantity))),
                      datum.value ? significant(*datum.value, 9) : std::string(), cell(datum.lower),
                      cell(datum.upper), significant(d.predicted, 9), cell(d.reading_sd),
                      datum.held_out ? "held_out" : "fitted",
                      std::string(provenance_name(datum.provenance))});
  }
  return text;
}

std::string laws_csv(const Selection& selection) {
  std::string text =
      csv_line({"law", "recommended", "parameters_estimated", "rms_over_peak", "delta_bic",
                "delta_aicc", "identified", "held_out_rms_over_peak", "reason"});
  for (std::size_t i = 0; i < selection.candidates.size(); ++i) {
    const Candidate& c = selection.candidates[i];
    std::string held;
    for (const HeldOut& h : c.held_out) {
      held += (held.empty() ? "" : " ") + cell(h.rms_over_peak);
    }
    text +=
        csv_line({law_name(c.law), i == selection.recommended ? "yes" : "no",
                  c.failed ? "" : std::to_string(c.parameters - 1),
                  c.failed ? "" : cell(c.rms_over_peak), c.failed ? "" : cell(c.delta_bic),
                  c.failed ? "" : cell(c.delta_aicc), c.identified ? "yes" : "no", held, c.reason});
  }
  return text;
}

std::string specimens_csv(const SpecimenStudy& study, const std::optional<ContactGeometry>& probe) {
  std::vector<std::string> columns{"recording", "specimen"};
  for (std::string& column : parameter_columns(study.law)) columns.push_back(std::move(column));
  std::string text = csv_line(columns);
  for (const SpecimenRow& row : study.rows) {
    for (std::size_t i = 0; row.fit && i < row.place.size(); ++i) {
      std::vector<std::string> cells{row.name, row.specimen};
      for (std::string& c :
           parameter_cells(*row.fit, row.parameter(i), row.fit->parameters[i].parameter.name)) {
        cells.push_back(std::move(c));
      }
      text += csv_line(cells);
    }
    if (!row.fit || !probe) continue;
    for (const YoungModulus& m : young_moduli(*row.fit, *probe, false).moduli) {
      text += csv_line({row.name, row.specimen, m.name, m.unit, cell(m.estimate),
                        cell(m.standard_error), cell(m.lower), cell(m.upper),
                        cell(row.fit->config.level), reference_cell(row.fit->config.law), "", "",
                        "", m.verdict});
    }
  }
  return text;
}

std::string pooled_csv(const SpecimenStudy& study) {
  std::string text =
      csv_line({"parameter", "SI_unit", "typical", "lower", "upper", "new_specimen_lower",
                "new_specimen_upper", "level", reference_column(study.law), "specimens",
                "recordings_left_out", "spread_p_value", "I_squared", "summary"});
  for (const PooledParameter& p : study.pooled) {
    const RandomEffects& e = p.effects;
    const auto natural = [&](double theta) { return cell(p.parameter.natural(theta)); };
    text += csv_line({p.parameter.name, si_unit(p.parameter), natural(e.mean),
                      natural(e.interval.lower), natural(e.interval.upper),
                      e.new_specimen ? natural(e.new_specimen->lower) : "",
                      e.new_specimen ? natural(e.new_specimen->upper) : "", cell(study.level),
                      reference_cell(study.law), std::to_string(e.specimens),
                      std::to_string(p.left_out), cell(e.q_p_value), cell(e.i_squared), e.summary});
  }
  return text;
}

std::string coverage_csv(const CoverageResult& result) {
  std::string text = csv_line({"parameter", "level", "data_sets", "failed", "covered", "coverage",
                               "open_intervals", "binomial_p_value", "seed"});
  for (const ParameterCoverage& p : result.parameters) {
    text += csv_line({p.name, cell(result.level), std::to_string(result.sets),
                      std::to_string(result.failed), std::to_string(p.covered),
                      cell(static_cast<double>(p.covered) / result.sets),
                      std::to_string(p.one_sided), cell(p.p_value), std::to_string(result.seed)});
  }
  return text;
}

std::string recovery_csv(std::span<const RecoveryResult> results) {
  std::string text = csv_line({"law", "noise_over_peak", "margin", "trials", "returned",
                               "equivalent", "larger", "failed", "fulfilled", "seed"});
  for (const RecoveryResult& r : results) {
    for (const ChoiceCount& c : r.choices) {
      text += csv_line({law_name(r.law), cell(r.noise), cell(c.margin), std::to_string(c.trials),
                        std::to_string(c.returned), std::to_string(c.equivalent),
                        std::to_string(c.larger), std::to_string(r.failed),
                        c.fulfilled() ? "yes" : "no", std::to_string(r.seed)});
    }
  }
  return text;
}

std::string moduli_csv(const YoungModuli& moduli) {
  std::string text = csv_line({"modulus", "of", "SI_unit", "estimate", "standard_error", "lower",
                               "upper", "level", "interval_from", "depth_reference_m",
                               "poisson_ratio", "poisson_ratio_provenance", "geometry", "verdict"});
  for (const YoungModulus& m : moduli.moduli) {
    text += csv_line({m.name, m.of, m.unit, cell(m.estimate), cell(m.standard_error), cell(m.lower),
                      cell(m.upper), cell(moduli.level), m.basis, cell(moduli.reference_m),
                      cell(moduli.poisson_ratio), moduli.poisson_assumed ? "assumed" : "given",
                      moduli.geometry, m.verdict});
  }
  return text;
}

std::vector<std::string> write_fit_csv(const std::filesystem::path& folder, const FitResult& fit) {
  std::vector<std::string> files{"parameters.csv"};
  write_file(folder / files.front(), parameters_csv(fit));
  if (!fit.data.empty()) {
    files.emplace_back("readings.csv");
    write_file(folder / files.back(), readings_csv(fit));
  }
  for (std::size_t i = 0; i < fit.recordings.size(); ++i) {
    files.push_back(i == 0 ? "samples.csv" : fmt::format("samples_{}.csv", i + 1));
    write_file(folder / files.back(), samples_csv(fit, i));
  }
  return files;
}

}  // namespace tpm::fit
