#include "tpm/fit/show/fit_csv.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/json_table_csv.hpp"
#include "tpm/show/table_document.hpp"

namespace tpm::fit {
namespace {

std::string cell(double value) {
  return std::isfinite(value) ? significant(value, kResultDigits) : std::string();
}

std::string cell(const std::optional<double>& value) {
  return value ? cell(*value) : std::string();
}

/// Rows with what all of them depend on: the level and, of a secant, the depth of reference.
Json with_conditions(Json rows, double level, const std::optional<LawSpec>& law) {
  for (Json& row : rows) {
    row["confidence_level"] = level;
    if (law && depends_on_reference(*law)) {
      row[si_key(law->drive, "reference")] = rounded(law->reference);
    }
  }
  return rows;
}

Json parameter_rows(const FitResult& fit) {
  return with_conditions(to_json(fit).at("parameters"), fit.config.level, fit.config.law);
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
  return json_table_csv(parameter_rows(fit));
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
  Json laws = to_json(selection).at("laws");
  for (std::size_t i = 0; i < laws.size(); ++i) {
    laws[i]["recommended"] = i == selection.recommended;
    laws[i]["held_out_rms_over_peak"] =
        array_json(laws[i].value("held_out", Json::array()),
                   [](const Json& held_out) { return held_out.at("rms_over_peak"); });
  }
  return json_table_csv(laws);
}

std::string specimens_csv(const SpecimenStudy& study, const std::optional<ContactGeometry>& probe) {
  Json rows = Json::array();
  for (const SpecimenRow& row : study.rows) {
    if (!row.fit) continue;
    const auto add = [&](const Json& of) {
      Json& added = rows.emplace_back(Json{{"recording", row.name}, {"specimen", row.specimen}});
      added.update(of);
    };
    const Json parameters = parameter_rows(*row.fit);
    for (std::size_t i = 0; i < row.place.size(); ++i) {
      Json pooled_as = parameters[row.place[i]];
      pooled_as["name"] = parameters[i].at("name");
      add(pooled_as);
    }
    if (!probe) continue;
    const YoungModuli moduli = young_moduli(*row.fit, *probe, false);
    for (Json& modulus :
         with_conditions(to_json(moduli).at("moduli"), moduli.level, row.fit->config.law)) {
      modulus["SI_unit"] = std::exchange(modulus["unit"], nullptr);
      modulus.erase("unit");
      add(modulus);
    }
  }
  return json_table_csv(rows, {}, {"recording", "specimen", "name", "SI_unit"});
}

std::string pooled_csv(const SpecimenStudy& study) {
  return json_table_csv(with_conditions(to_json(study).at("pooled"), study.level, study.law));
}

std::string moduli_csv(const YoungModuli& moduli) {
  Json all = to_json(moduli);
  Json rows = std::move(all["moduli"]);
  all.erase("moduli");
  all.erase("remarks");
  for (Json& row : rows) row.update(all);
  return json_table_csv(rows);
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
