#include "data_text.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/show/table_document.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace {

using TextTable = std::vector<std::vector<std::string>>;

Unit shown_unit_of(Quantity quantity) {
  return shown_unit(quantity_dimension(quantity));
}

std::string title(Quantity quantity, const std::string& extra = {}) {
  return with_unit(fmt::format("{}{}", quantity_short_name(quantity), extra),
                   shown_unit_of(quantity));
}

std::string cell(const std::optional<double>& si, double to_si) {
  return si ? significant(*si / to_si, 6) : std::string();
}

/// "0.32", "0.07 - 0.18", "5.5 +- 1.6", "up to 50".
std::string reading(const std::optional<double>& value, const std::optional<double>& lower,
                    const std::optional<double>& upper, double to_si) {
  if (value) return cell(value, to_si);
  if (lower && upper) return fmt::format("{} - {}", cell(lower, to_si), cell(upper, to_si));
  if (upper) return "up to " + cell(upper, to_si);
  return lower ? "from " + cell(lower, to_si) : std::string();
}

/// Columns without any entry say nothing.
TextTable without_empty_columns(const TextTable& rows) {
  TextTable kept(rows.size());
  for (std::size_t c = 0; c < rows.front().size(); ++c) {
    const bool filled =
        std::any_of(rows.begin() + 1, rows.end(), [c](const auto& row) { return !row[c].empty(); });
    if (!filled) continue;
    for (std::size_t r = 0; r < rows.size(); ++r) kept[r].push_back(rows[r][c]);
  }
  return kept;
}

std::string points_text(const PointSet& points) {
  const Quantity observed = observable_quantity(points.observable);
  const bool force = points.observable == Observable::contact_force;
  const double to_si = shown_unit_of(observed).to_si;
  const std::string band = " (or band)";
  TextTable table{{force ? title(Quantity::indentation_depth) : title(Quantity::load), "label",
                   title(Quantity::time), title(observed, band), title(observed, " sd"),
                   "provenance", "where", "note"}};
  for (const Datum& datum : points.data) {
    table.push_back({force ? cell(datum.depth_m, 1e-3) : cell(datum.load_N, 1.0), datum.label,
                     cell(datum.time_s, 1.0), reading(datum.value, datum.lower, datum.upper, to_si),
                     cell(datum.sd, to_si), std::string(provenance_name(datum.provenance)),
                     datum.where, datum.note});
  }
  std::string text;
  if (points.time_origin != TimeOrigin::none) {
    text += fmt::format("time counts from: {}{}\n", time_origin_name(points.time_origin),
                        points.time_provenance
                            ? fmt::format(" ({})", provenance_name(*points.time_provenance))
                            : "");
  }
  return text + aligned(without_empty_columns(table));
}

std::string recording_text(const Recording& recording, bool all_rows) {
  constexpr std::size_t kEnds = 5;  // samples shown at either end of a long recording
  const std::size_t size = recording.response.size();
  TextTable table{{title(Quantity::time), title(recording.drive_quantity),
                   title(recording.response_quantity), title(recording.response_quantity, " sd"),
                   "provenance"}};
  const auto at = [](const std::vector<double>& values, std::size_t i, double to_si) {
    return values.empty() ? std::string() : significant(values[i] / to_si, 6);
  };
  const double drive_si = shown_unit_of(recording.drive_quantity).to_si;
  const double response_si = shown_unit_of(recording.response_quantity).to_si;
  for (std::size_t i = 0; i < size; ++i) {
    if (!all_rows && size > 2 * kEnds && i == kEnds) {
      table.push_back({"", "", "", "", fmt::format("... {} more", size - 2 * kEnds)});
      i = size - kEnds;
    }
    table.push_back({at(recording.time_s, i, 1.0), at(recording.drive, i, drive_si),
                     at(recording.response, i, response_si),
                     at(recording.response_sd, i, response_si),
                     std::string(provenance_name(recording.provenance))});
  }
  return aligned(without_empty_columns(table));
}

std::string spectrum_text(const Spectrum& spectrum) {
  const SpectrumQuantities quantities = spectrum_quantities(spectrum.dimension);
  const double to_si = shown_unit(spectrum.dimension).to_si;
  TextTable table{{title(Quantity::frequency), title(quantities.storage),
                   title(quantities.storage, " sd"), title(quantities.loss),
                   title(quantities.loss, " sd"), "provenance"}};
  const auto at = [to_si](const std::vector<double>& values, std::size_t i) {
    return values.empty() ? std::string() : significant(values[i] / to_si, 6);
  };
  for (std::size_t i = 0; i < spectrum.frequency_Hz.size(); ++i) {
    table.push_back({significant(spectrum.frequency_Hz[i], 6), at(spectrum.storage, i),
                     at(spectrum.storage_sd, i), at(spectrum.loss, i), at(spectrum.loss_sd, i),
                     std::string(provenance_name(spectrum.provenance))});
  }
  return aligned(without_empty_columns(table));
}

std::string values_text(const ValueSet& set) {
  TextTable table{{"name", "quantity", "value", "unit", "provenance", "where", "formula", "note"}};
  for (const NamedValue& value : set.values) {
    std::string number = reading(value.value, value.lower, value.upper, value.unit.to_si);
    if (value.plus_minus) number += " +- " + cell(value.plus_minus, value.unit.to_si);
    table.push_back({value.name, value.quantity, number, value.unit.symbol,
                     std::string(provenance_name(value.provenance)), value.where, value.formula,
                     value.note});
  }
  return aligned(without_empty_columns(table));
}

std::string header_text(const CurveHeader& header) {
  std::string text = fmt::format("{}: {}\n", header.id, header.title);
  const auto line = [&text](const char* name, const std::string& value) {
    if (!value.empty()) text += fmt::format("{}: {}\n", name, value);
  };
  line("citation", header.citation);
  line("doi", header.doi);
  line("specimen", header.specimen);
  std::string probe = header.probe.shape;
  if (header.probe.diameter_m) {
    probe += fmt::format("{}diameter {} mm", probe.empty() ? "" : ", ",
                         significant(*header.probe.diameter_m * 1e3, 6));
  }
  if (header.probe.provenance) {
    probe += fmt::format(" ({})", provenance_name(*header.probe.provenance));
  }
  line("probe", probe);
  line("note", header.note);
  return text;
}

void put(Json& json, const std::string& key, const std::optional<double>& value) {
  if (value) json[key] = *value;
}

void put(Json& json, const std::string& key, std::string_view text) {
  if (!text.empty()) json[key] = text;
}

Json header_json(const CurveHeader& header, std::string_view kind) {
  Json json{{"id", header.id}, {"kind", kind}, {"title", header.title}};
  put(json, "citation", header.citation);
  put(json, "doi", header.doi);
  put(json, "specimen", header.specimen);
  Json probe = Json::object();
  put(probe, "shape", header.probe.shape);
  put(probe, "diameter_m", header.probe.diameter_m);
  if (header.probe.provenance) put(probe, "provenance", provenance_name(*header.probe.provenance));
  if (!probe.empty()) json["probe"] = probe;
  put(json, "note", header.note);
  put(json, "sha256", header.sha256);
  return json;
}

Json datum_json(const Datum& datum, Quantity observed) {
  Json json = Json::object();
  put(json, "label", datum.label);
  put(json, "depth_m", datum.depth_m);
  put(json, "load_N", datum.load_N);
  put(json, "time_s", datum.time_s);
  put(json, si_key(observed), datum.value);
  put(json, si_key(observed, "lower"), datum.lower);
  put(json, si_key(observed, "upper"), datum.upper);
  put(json, si_key(observed, "sd"), datum.sd);
  json["provenance"] = provenance_name(datum.provenance);
  put(json, "where", datum.where);
  put(json, "note", datum.note);
  return json;
}

void add_json(Json& json, const PointSet& points) {
  const Quantity observed = observable_quantity(points.observable);
  json["observable"] = quantity_name(observed);
  json["time_origin"] = time_origin_name(points.time_origin);
  if (points.time_provenance) json["time_provenance"] = provenance_name(*points.time_provenance);
  json["data"] = Json::array();
  for (const Datum& datum : points.data) json["data"].push_back(datum_json(datum, observed));
}

void add_json(Json& json, const Recording& recording) {
  json["provenance"] = provenance_name(recording.provenance);
  Json samples = Json::object();
  if (!recording.time_s.empty()) samples["time_s"] = recording.time_s;
  if (!recording.drive.empty()) samples[si_key(recording.drive_quantity)] = recording.drive;
  samples[si_key(recording.response_quantity)] = recording.response;
  if (!recording.response_sd.empty()) {
    samples[si_key(recording.response_quantity, "sd")] = recording.response_sd;
  }
  json["samples"] = std::move(samples);
}

void add_json(Json& json, const Spectrum& spectrum) {
  const SpectrumQuantities quantities = spectrum_quantities(spectrum.dimension);
  json["provenance"] = provenance_name(spectrum.provenance);
  Json readings{{si_key(Quantity::frequency), spectrum.frequency_Hz},
                {si_key(quantities.storage), spectrum.storage},
                {si_key(quantities.loss), spectrum.loss}};
  if (!spectrum.storage_sd.empty()) {
    readings[si_key(quantities.storage, "sd")] = spectrum.storage_sd;
  }
  if (!spectrum.loss_sd.empty()) readings[si_key(quantities.loss, "sd")] = spectrum.loss_sd;
  json["readings"] = std::move(readings);
}

void add_json(Json& json, const ValueSet& set) {
  json["values"] = array_json(set.values, [](const NamedValue& value) {
    Json entry{{"name", value.name},
               {"quantity", value.quantity},
               {"unit_SI", si_symbol(value.unit.dimension)}};
    put(entry, "value", value.value);
    put(entry, "lower", value.lower);
    put(entry, "upper", value.upper);
    put(entry, "plus_minus", value.plus_minus);
    entry["provenance"] = provenance_name(value.provenance);
    put(entry, "where", value.where);
    put(entry, "formula", value.formula);
    put(entry, "note", value.note);
    return entry;
  });
}

}  // namespace

std::string curve_text(const Curve& curve, bool all_rows) {
  std::string text = header_text(curve_header(curve));
  if (const auto* points = std::get_if<PointSet>(&curve)) return text + points_text(*points);
  if (const auto* recording = std::get_if<Recording>(&curve)) {
    return text + recording_text(*recording, all_rows);
  }
  if (const auto* spectrum = std::get_if<Spectrum>(&curve)) return text + spectrum_text(*spectrum);
  return text + values_text(std::get<ValueSet>(curve));
}

Json curve_json(const Curve& curve) {
  Json json = header_json(curve_header(curve), curve_kind(curve));
  std::visit([&json](const auto& kind) { add_json(json, kind); }, curve);
  return json;
}

}  // namespace tpm::app
