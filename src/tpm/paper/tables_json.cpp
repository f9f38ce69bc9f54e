// Declared in tpm/paper/tables.hpp.
#include "tpm/paper/tables.hpp"

namespace tpm::paper {
namespace {

Json check_json(const DigitCheck& check, const Unit& unit, std::string_view si_suffix) {
  Json json;
  json["computed_" + std::string(si_suffix)] = check.computed * unit.to_si;
  json["verdict"] = verdict_name(check.verdict);
  json["difference_percent"] = check.difference_percent ? Json(*check.difference_percent) : Json();
  return json;
}

/// @param si_suffix unit of the key names, "Pa" or "N"
Json cell_json(const TableCell& cell, std::string_view si_suffix) {
  const std::string suffix(si_suffix);
  Json json;
  json["value_" + suffix] = cell.value;
  if (cell.printed) {
    const DigitCheck& check = cell.printed->from_computed_lambda1;
    const double to_si = cell.printed->unit.to_si;
    json["printed"] = check.printed.text;
    json["printed_unit"] = cell.printed->unit.symbol;
    json["window_width_" + suffix] = check.window_width() * to_si;
    json["window_percent"] = check.window_percent() ? Json(*check.window_percent()) : Json();
    json["from_computed_lambda1"] = check_json(check, cell.printed->unit, si_suffix);
    if (cell.printed->from_printed_lambda1) {
      json["from_printed_lambda1"] =
          check_json(*cell.printed->from_printed_lambda1, cell.printed->unit, si_suffix);
    }
  }
  if (cell.measured) {
    json["measured"] = cell.measured->text;
    json["measured_unit"] = cell.measured->unit.symbol;
    json["misfit_percent"] = cell.measured->misfit_percent;
  }
  return json;
}

Json row_json(const TableRow& row) {
  Json json;
  json["depth_m"] = row.depth_m;
  json["spacing_m"] = row.spacing_m;
  if (!row.printed_where.empty()) json["printed_where"] = row.printed_where;
  json["lambda1"] = cell_json(row.lambda1, "Pa");
  json["peak_force"] = cell_json(row.peak_force, "N");
  json["end_force"] = cell_json(row.end_force, "N");
  return json;
}

Json band_json(const BandRow& row) {
  Json json;
  json["depth_m"] = row.depth_m;
  json["spacing_m"] = row.spacing_m;
  json["printed_where"] = row.printed_where;
  json["lambda1"] = cell_json(row.lambda1, "Pa");
  json["equilibrium_force"] = cell_json(row.force, "N");
  json["band_printed"] = {row.band_low, row.band_high};
  json["band_unit"] = row.band_unit.symbol;
  json["band_low_N"] = row.band_low_N;
  json["band_high_N"] = row.band_high_N;
  json["inside"] = row.inside;
  return json;
}

Json counts_json(const CellCounts& counts) {
  return {{"cells", counts.cells},
          {"explained", counts.explained()},
          {"exact_by_rounding", counts.by_rounding},
          {"exact_by_truncation", counts.by_truncation},
          {"last_digit_off", counts.last_digit_off},
          {"differs", counts.differ}};
}

Json request_json(const TableRequest& request) {
  Json json;
  json["mode"] = request.mode == TableMode::as_printed ? "as_printed" : "consistent";
  const TpmVector values = to_vector(request.parameters);
  constexpr std::array<std::string_view, kTpmParameterCount> kKeys{
      "E1_Pa", "E2_Pa", "Eprime_Pa", "eta1_Pa_s", "", "A0_m2", "l0_m"};
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i != kSpacing) json[std::string(kKeys[i])] = values[i];
  }
  if (request.mode == TableMode::consistent) {
    json["rate_m_per_s"] = request.rate_m_per_s;
    json["rate_provenance"] = "assumed";
    json["hold_s"] = request.hold_s;
    json["hold_counts_from"] = "end of ramp (assumed)";
  }
  return json;
}

}  // namespace

Json to_json(const TablesResult& result) {
  Json json;
  json["request"] = request_json(result.request);
  json["rows"] = array_json(result.rows, row_json);
  json["static_bands"] = array_json(result.bands, band_json);
  json["summary"] = {
      {"lambda1", counts_json(result.summary.lambda1)},
      {"force_from_printed_lambda1", counts_json(result.summary.force_from_printed_lambda1)},
      {"force_from_computed_lambda1", counts_json(result.summary.force_from_computed_lambda1)}};
  return json;
}

}  // namespace tpm::paper
