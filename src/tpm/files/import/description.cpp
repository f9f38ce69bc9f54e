#include "tpm/files/import/description.hpp"

#include <fmt/format.h>

#include <array>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

constexpr auto kBounds = std::to_array<Word<Bound>>(
    {{Bound::value, "value"}, {Bound::lower, "lower"}, {Bound::upper, "upper"}, {Bound::sd, "sd"}});

std::string text_of(const Json& object, const char* key) {
  return object.contains(key) ? object.at(key).get<std::string>() : std::string();
}

std::optional<Provenance> provenance_of(const Json& object, const std::string& where) {
  if (!object.contains("provenance")) return std::nullopt;
  return parse_provenance(object.at("provenance").get<std::string>(), where + "/provenance");
}

/// A header such as force_mN must not be described as newtons.
void require_unit_of_name(const std::string& name, const Unit& unit, const std::string& where) {
  const auto cut = name.rfind('_');
  if (cut == std::string::npos || !is_unit(name.substr(cut + 1))) return;
  const Unit named = parse_unit(name.substr(cut + 1), where);
  if (named.symbol == unit.symbol) return;
  throw bad_input(where,
                  fmt::format("unit '{}' but the column is named in {}", unit.symbol, named.symbol),
                  "the same unit in both");
}

ColumnDescription read_column(const std::string& name, const Json& json, const std::string& file) {
  const std::string where = fmt::format("{}: key /columns/{}", file, name);
  ColumnDescription column;
  column.quantity = parse_quantity_name(json.at("quantity").get<std::string>(), where);
  column.unit = parse_unit(text_of(json, "unit"), quantity_dimension(column.quantity), where);
  require_unit_of_name(name, column.unit, where);
  if (json.contains("bound"))
    column.bound = parse_word(kBounds, "bound", text_of(json, "bound"), where);
  column.provenance = provenance_of(json, where);
  column.note = text_of(json, "note");
  return column;
}

ProbeShape read_probe(const Json& json, const std::string& file) {
  ProbeShape probe;
  probe.shape = text_of(json, "shape");
  if (json.contains("diameter")) {
    const std::string where = file + ": key /probe/diameter";
    probe.diameter_m = parse_quantity(text_of(json, "diameter"), Dimension::length, where);
    if (*probe.diameter_m <= 0) throw bad_input(where, "is not positive", "a length above 0");
  }
  probe.provenance = provenance_of(json, file + ": key /probe");
  return probe;
}

void require_keys_of_kind(const CurveDescription& description, const std::string& file) {
  const std::string& kind = description.kind;
  const bool fixed_columns = kind == "values";
  const std::string in_file = fmt::format("stands in a file of kind {}", kind);
  if (fixed_columns != description.columns.empty()) {
    throw bad_input(file + ": key /columns", fixed_columns ? in_file : "is missing",
                    fixed_columns ? "no columns: the columns of values are fixed"
                                  : "a description of each numeric column");
  }
  const bool observes = kind == "points" || kind == "recording";
  if (observes != description.observable.has_value()) {
    throw bad_input(file + ": key /observable", observes ? "is missing" : in_file,
                    observes ? "the quantity that was observed" : "no observable");
  }
  if (kind != "recording" && !description.segments.empty()) {
    throw bad_input(file + ": key /segments", in_file, "segments of a recording only");
  }
  const bool whole = kind == "recording" || kind == "spectrum";
  if (whole != description.provenance.has_value()) {
    throw bad_input(
        file + ": key /provenance", whole ? "is missing" : "stands at the top",
        whole ? fmt::format("where the {} comes from", kind) : "a provenance in each row");
  }
}

std::vector<RecordedSegment> read_segments(const Json& json) {
  std::vector<RecordedSegment> segments;
  for (const Json& segment : json) {
    segments.push_back({text_of(segment, "kind"), text_of(segment, "control"),
                        segment.at("samples").get<std::size_t>()});
  }
  return segments;
}

/// A key is written only where there is something to say.
void put(Json& object, const char* key, std::string_view text) {
  if (!text.empty()) object[key] = text;
}

Json probe_json(const ProbeShape& probe) {
  Json json = Json::object();
  put(json, "shape", probe.shape);
  if (probe.diameter_m) {
    json["diameter"] = fmt::format("{} mm", significant(*probe.diameter_m * 1e3, 12));
  }
  if (probe.provenance) json["provenance"] = provenance_name(*probe.provenance);
  return json;
}

Json column_json(const ColumnDescription& column) {
  Json json{{"quantity", quantity_name(column.quantity)}};
  put(json, "unit", column.unit.symbol);
  if (column.bound != Bound::value) json["bound"] = bound_name(column.bound);
  if (column.provenance) json["provenance"] = provenance_name(*column.provenance);
  put(json, "note", column.note);
  return json;
}

Json segments_json(const std::vector<RecordedSegment>& segments) {
  Json json = Json::array();
  for (const RecordedSegment& segment : segments) {
    Json item{{"kind", segment.kind}};
    put(item, "control", segment.control);
    item["samples"] = segment.samples;
    json.push_back(std::move(item));
  }
  return json;
}

}  // namespace

std::string_view bound_name(Bound bound) noexcept {
  return entry_of(kBounds, bound).text;
}

std::string segments_words(const std::vector<RecordedSegment>& segments) {
  std::string words;
  for (const RecordedSegment& segment : segments) {
    words += fmt::format("{}{} ({} samples{}{})", words.empty() ? "" : ", ", segment.kind,
                         segment.samples, segment.control.empty() ? "" : ", ", segment.control);
  }
  return words;
}

CurveDescription read_description(const std::filesystem::path& path) {
  const std::string file = path.string();
  const Json json = checked(read_json(path), "curve", file);
  CurveDescription description;
  CurveHeader& header = description.header;
  header.id = text_of(json, "id");
  if (header.id != path.stem().string()) {
    throw bad_input(file + ": key /id", fmt::format("'{}' is not the file's name", header.id),
                    fmt::format("'{}'", printable(path.stem().string())));
  }
  header.title = text_of(json, "title");
  header.citation = text_of(json, "citation");
  header.doi = text_of(json, "doi");
  header.specimen = text_of(json, "specimen");
  header.note = text_of(json, "note");
  if (json.contains("probe")) header.probe = read_probe(json.at("probe"), file);
  description.kind = text_of(json, "kind");
  if (json.contains("observable")) {
    description.observable = parse_quantity_name(text_of(json, "observable"), file);
  }
  if (json.contains("time_origin")) {
    description.time_origin = parse_time_origin(text_of(json, "time_origin"), file);
  }
  description.provenance = provenance_of(json, file + ": key ");
  if (json.contains("columns")) {
    for (const auto& [name, column] : json.at("columns").items()) {
      description.columns.emplace(name, read_column(name, column, file));
    }
  }
  if (json.contains("segments")) description.segments = read_segments(json.at("segments"));
  if (json.contains("instrument")) description.instrument = json.at("instrument");
  require_keys_of_kind(description, file);
  return description;
}

Json description_json(const CurveDescription& description) {
  const CurveHeader& header = description.header;
  Json json{{"id", header.id}, {"title", header.title}};
  put(json, "citation", header.citation);
  put(json, "doi", header.doi);
  put(json, "specimen", header.specimen);
  if (const Json probe = probe_json(header.probe); !probe.empty()) json["probe"] = probe;
  json["kind"] = description.kind;
  if (description.observable) json["observable"] = quantity_name(*description.observable);
  if (description.time_origin != TimeOrigin::none) {
    json["time_origin"] = time_origin_name(description.time_origin);
  }
  if (description.provenance) json["provenance"] = provenance_name(*description.provenance);
  if (!description.columns.empty()) {
    json["columns"] = Json::object();
    for (const auto& [name, column] : description.columns) {
      json["columns"][name] = column_json(column);
    }
  }
  if (!description.segments.empty()) json["segments"] = segments_json(description.segments);
  if (!description.instrument.is_null()) json["instrument"] = description.instrument;
  put(json, "note", header.note);
  return json;
}

}  // namespace tpm::files
