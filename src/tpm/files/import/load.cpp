// Declared in tpmkit/curve_file.hpp.
#include "tpmkit/curve_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpm/base/time_range.hpp"
#include "tpm/files/delimited.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/description.hpp"
#include "tpm/files/import/rows.hpp"
#include "tpm/files/require_exists.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
using namespace files;

namespace fs = std::filesystem;
namespace {

struct CurveFiles {
  fs::path description;
  fs::path rows;
};

/// The curves of the data folder: its CSV files (claims about papers stand there as JSON alone).
std::vector<std::string> known_ids() {
  std::vector<std::string> ids;
  for (const auto& entry : fs::directory_iterator(share_dir() / "data")) {
    if (entry.path().extension() == ".csv") ids.push_back(entry.path().stem().string());
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

CurveFiles find_files(const std::string& path_or_id) {
  fs::path path = path_or_id;
  if (path.extension() == ".csv" || path.extension() == ".json") {
    CurveFiles files{fs::path(path).replace_extension(".json"),
                     fs::path(path).replace_extension(".csv")};
    require_exists(path);
    std::error_code none;
    if (path.extension() == ".csv" && !fs::exists(files.description, none)) {
      throw bad_input(
          path.string(), "has no description beside it",
          fmt::format("{} (tpm data import writes one)", files.description.filename().string()));
    }
    return files;
  }
  const auto ids = known_ids();
  if (std::find(ids.begin(), ids.end(), path_or_id) == ids.end()) {
    throw bad_input(path_or_id,
                    "is neither a curve file nor a known curve" + did_you_mean(path_or_id, ids),
                    fmt::format("a .csv or .json file, or one of {}", fmt::join(ids, ", ")));
  }
  const fs::path stem = share_dir() / "data" / path_or_id;
  return {stem.string() + ".json", stem.string() + ".csv"};
}

std::optional<Provenance> time_provenance(const CurveDescription& description) {
  for (const auto& [name, column] : description.columns) {
    if (column.quantity == Quantity::time) return column.provenance;
  }
  return std::nullopt;
}

Observable parse_observable(const CurveDescription& description, const std::string& file) {
  for (const Observable o : {Observable::contact_force, Observable::indentation_depth}) {
    if (observable_quantity(o) == description.observable) return o;
  }
  throw bad_input(
      file + ": key /observable",
      fmt::format("'{}' in a file of kind points", quantity_name(description.observable.value())),
      "contact_force or indentation_depth");
}

void require_time_origin(const PointSet& points, const CurveRows& rows) {
  const bool timed = rows.has(Quantity::time);
  if (timed == (points.time_origin != TimeOrigin::none)) return;
  throw bad_input(rows.file(),
                  timed ? "has times but its description says time_origin none"
                        : "has no times but its description gives a time_origin",
                  timed ? "time_origin end_of_ramp or load_applied" : "no time_origin");
}

PointSet read_points(const CurveDescription& description, const CurveRows& rows,
                     const std::string& description_file) {
  PointSet points;
  points.header = description.header;
  points.observable = parse_observable(description, description_file);
  points.time_origin = description.time_origin;
  points.time_provenance = time_provenance(description);
  require_time_origin(points, rows);
  const Quantity observed = observable_quantity(points.observable);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    Datum datum;
    datum.line = rows.line(i);
    datum.label = rows.text(i, "label");
    if (points.observable == Observable::contact_force) {
      datum.depth_m = rows.at_least(i, Quantity::indentation_depth, Bound::value, 0.0);
    } else {
      datum.load_N = rows.at_least(i, Quantity::load, Bound::value, 0.0);
    }
    datum.time_s = rows.at_least(i, Quantity::time, Bound::value, 0.0);
    datum.value = rows.number(i, observed, Bound::value);
    datum.lower = rows.number(i, observed, Bound::lower);
    datum.upper = rows.number(i, observed, Bound::upper);
    datum.sd = rows.at_least(i, observed, Bound::sd, 0.0);
    datum.provenance = rows.provenance(i);
    datum.where = rows.text(i, "where");
    datum.note = rows.text(i, "note");
    if (const auto fault = find_datum_fault(datum, points.observable)) {
      throw bad_input(fmt::format("{}:{}", rows.file(), datum.line), fault->what, fault->expected);
    }
    points.data.push_back(std::move(datum));
  }
  return points;
}

/// The column that is neither time nor the observable; a recording has at most one.
std::optional<Quantity> find_drive(const CurveDescription& description, const std::string& file) {
  std::set<Quantity> others;
  for (const auto& [name, column] : description.columns) {
    if (column.quantity != Quantity::time && column.quantity != description.observable) {
      others.insert(column.quantity);
    }
  }
  if (others.size() > 1) {
    throw bad_input(file + ": key /columns", "more than one quantity besides time and observable",
                    "time, what was imposed and what was observed");
  }
  if (others.empty()) return std::nullopt;
  return *others.begin();
}

void require_times(const CurveRows& rows, const std::vector<double>& time_s) {
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    if (is_time_in_range(time_s[i])) continue;
    throw bad_input(rows.place(i, Quantity::time, Bound::value),
                    fmt::format("time {} s", shortest(time_s[i])), kTimeRange);
  }
  for (std::size_t i = 1; i < time_s.size(); ++i) {
    if (time_s[i] <= time_s[i - 1]) {
      throw bad_input(rows.place(i, Quantity::time, Bound::value),
                      fmt::format("time {} s does not follow {} s", time_s[i], time_s[i - 1]),
                      "strictly increasing times");
    }
  }
}

std::vector<double> optional_sd(const CurveRows& rows, Quantity quantity) {
  if (!rows.has(quantity, Bound::sd)) return {};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    static_cast<void>(rows.at_least(i, quantity, Bound::sd, 0.0));
  }
  return rows.full_column(quantity, Bound::sd);
}

void require_whole_segments(const CurveDescription& description, std::size_t rows,
                            const std::string& description_file) {
  if (description.segments.empty()) return;
  std::size_t samples = 0;
  for (const RecordedSegment& segment : description.segments) samples += segment.samples;
  if (samples == rows) return;
  throw bad_input(description_file + ": key /segments", fmt::format("hold {} samples", samples),
                  fmt::format("the {} rows of the recording", rows));
}

Recording read_recording(const CurveDescription& description, const CurveRows& rows,
                         const std::string& description_file) {
  Recording recording;
  recording.header = description.header;
  recording.provenance = description.provenance.value();
  recording.response_quantity = description.observable.value();
  recording.response = rows.full_column(recording.response_quantity, Bound::value);
  if (rows.has(Quantity::time)) {
    recording.time_s = rows.full_column(Quantity::time, Bound::value);
    require_times(rows, recording.time_s);
  }
  if (const auto drive = find_drive(description, description_file)) {
    recording.drive_quantity = *drive;
    recording.drive = rows.full_column(*drive, Bound::value);
  }
  recording.response_sd = optional_sd(rows, recording.response_quantity);
  require_whole_segments(description, rows.size(), description_file);
  if (recording.time_s.empty() && recording.drive.empty()) {
    throw bad_input(rows.file(), "holds neither time nor an imposed quantity", "one of the two");
  }
  return recording;
}

/// Moduli or stiffnesses: the columns say which.
Dimension spectrum_dimension(const CurveDescription& description, const std::string& file) {
  std::set<Dimension> dimensions;
  for (const auto& [name, column] : description.columns) {
    const Dimension dimension = quantity_dimension(column.quantity);
    const SpectrumQuantities known = spectrum_quantities(dimension);
    if (column.quantity == known.storage || column.quantity == known.loss) {
      dimensions.insert(dimension);
    } else if (column.quantity != Quantity::frequency) {
      throw bad_input(
          fmt::format("{}: key /columns/{}", file, name),
          fmt::format("'{}' in a file of kind spectrum", quantity_name(column.quantity)),
          "frequency, and storage and loss modulus or stiffness");
    }
  }
  if (dimensions.size() == 1) return *dimensions.begin();
  throw bad_input(file + ": key /columns",
                  dimensions.empty() ? "neither a storage nor a loss" : "moduli beside stiffnesses",
                  "storage and loss, both moduli or both stiffnesses");
}

Spectrum read_spectrum(const CurveDescription& description, const CurveRows& rows,
                       const std::string& description_file) {
  Spectrum spectrum;
  spectrum.header = description.header;
  spectrum.provenance = description.provenance.value();
  spectrum.dimension = spectrum_dimension(description, description_file);
  const SpectrumQuantities quantities = spectrum_quantities(spectrum.dimension);
  spectrum.frequency_Hz = rows.full_column(Quantity::frequency, Bound::value);
  spectrum.storage = rows.full_column(quantities.storage, Bound::value);
  spectrum.loss = rows.full_column(quantities.loss, Bound::value);
  spectrum.storage_sd = optional_sd(rows, quantities.storage);
  spectrum.loss_sd = optional_sd(rows, quantities.loss);
  const auto fault = find_spectrum_fault(spectrum.frequency_Hz, spectrum.storage, spectrum.loss);
  if (fault) {
    throw bad_input(fmt::format("{}:{}", rows.file(), rows.line(fault->row)), fault->what,
                    fault->expected);
  }
  return spectrum;
}

}  // namespace

std::string_view curve_kind(const Curve& curve) noexcept {
  if (std::holds_alternative<PointSet>(curve)) return "points";
  if (std::holds_alternative<Recording>(curve)) return "recording";
  return std::holds_alternative<Spectrum>(curve) ? "spectrum" : "values";
}

const CurveHeader& curve_header(const Curve& curve) noexcept {
  if (const auto* points = std::get_if<PointSet>(&curve)) return points->header;
  if (const auto* recording = std::get_if<Recording>(&curve)) return recording->header;
  if (const auto* spectrum = std::get_if<Spectrum>(&curve)) return spectrum->header;
  return std::get_if<ValueSet>(&curve)->header;
}

std::size_t curve_size(const Curve& curve) noexcept {
  if (const auto* points = std::get_if<PointSet>(&curve)) return points->data.size();
  if (const auto* recording = std::get_if<Recording>(&curve)) return recording->response.size();
  if (const auto* spectrum = std::get_if<Spectrum>(&curve)) return spectrum->frequency_Hz.size();
  return std::get_if<ValueSet>(&curve)->values.size();
}

Curve load_curve(const std::string& path_or_id) {
  const CurveFiles files = find_files(path_or_id);
  CurveDescription description = read_description(files.description);
  const std::string bytes = read_file(files.rows);
  description.header.sha256 = sha256_hex(bytes);
  if (description.kind == "values") {
    return read_values(description.header, bytes, files.rows.string());
  }
  const CurveRows rows(bytes, files.rows.string(), description);
  const std::string description_file = files.description.string();
  if (description.kind == "points") return read_points(description, rows, description_file);
  if (description.kind == "spectrum") return read_spectrum(description, rows, description_file);
  return read_recording(description, rows, description_file);
}

namespace {

template <typename Kind>
Kind load_kind(const std::string& path_or_id, std::string_view wanted) {
  Curve curve = load_curve(path_or_id);
  if (auto* found = std::get_if<Kind>(&curve)) return std::move(*found);
  std::string expected = fmt::format("kind {}", wanted);
  // Whoever asks for a recording wants to fit this.
  if (wanted == "recording" && std::holds_alternative<PointSet>(curve)) {
    expected +=
        "; single readings are fitted through a configuration, such as: "
        "tpm fit configs/liver_all.json";
  } else if (wanted == "recording" && std::holds_alternative<ValueSet>(curve)) {
    expected += fmt::format("; values are only shown: tpm data show {}", shell_word(path_or_id));
  }
  throw bad_input(path_or_id, fmt::format("is a curve of kind {}", curve_kind(curve)), expected);
}

}  // namespace

PointSet load_points(const std::string& path_or_id) {
  return load_kind<PointSet>(path_or_id, "points");
}

Recording load_recording(const std::string& path_or_id) {
  return load_kind<Recording>(path_or_id, "recording");
}

ValueSet load_values(const std::string& path_or_id) {
  return load_kind<ValueSet>(path_or_id, "values");
}

Spectrum load_spectrum(const std::string& path_or_id) {
  return load_kind<Spectrum>(path_or_id, "spectrum");
}

std::vector<CurveSummary> list_curves() {
  std::vector<CurveSummary> list;
  for (const std::string& id : known_ids()) {
    const Curve curve = load_curve(id);
    list.push_back(
        {id, std::string(curve_kind(curve)), curve_size(curve), curve_header(curve).title});
  }
  return list;
}

}  // namespace tpm
