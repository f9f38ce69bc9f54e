#include "tpm/files/import/pack.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/time_range.hpp"
#include "tpm/files/hdf5/hdf5_members.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"
#include "tpmkit/version.hpp"

namespace tpm::files {
namespace {

constexpr const char* kCommand = "data pack";
constexpr const char* kRowUnit = "SI unit of the row's own unit";

double or_missing(const std::optional<double>& value) {
  return value.value_or(std::numeric_limits<double>::quiet_NaN());
}

/// The member of a curve's JSON and of its group that holds the rows.
std::string_view rows_member(std::string_view kind) {
  if (kind == "points") return "data";
  if (kind == "recording") return "samples";
  return kind == "spectrum" ? "readings" : "values";
}

/// Writes one curve's group.
class GroupWriter {
 public:
  GroupWriter(Hdf5Writer& file, const CurveHeader& header, std::string_view kind)
      : file_(file), group_("/curves/" + header.id) {
    file_.group(group_);
    members({{"kind", kind},
             {"title", header.title},
             {"citation", header.citation},
             {"doi", header.doi},
             {"specimen", header.specimen},
             {"note", header.note},
             {"sha256", header.sha256}});
    const ProbeShape& probe = header.probe;
    Json said;
    if (!probe.shape.empty()) said["shape"] = probe.shape;
    if (probe.diameter_m) said["diameter_m"] = *probe.diameter_m;
    if (probe.provenance) said["provenance"] = provenance_name(*probe.provenance);
    if (!said.is_null()) members({{"probe", said}});
    rows_ = fmt::format("{}/{}", group_, rows_member(kind));
    file_.group(rows_);
  }

  void members(const Json& object) { write_members(file_, group_, object); }
  void members_of_rows(const Json& object) { write_members(file_, rows_, object); }

  void numbers(const std::string& name, std::string_view quantity, std::string_view unit,
               const std::vector<double>& values) {
    const std::string path = rows_ + "/" + name;
    file_.numbers(path, values);
    file_.attribute(path, "quantity", std::string(quantity));
    file_.attribute(path, "unit", unit.empty() ? "1" : std::string(unit));
    const bool gaps =
        std::any_of(values.begin(), values.end(), [](double value) { return std::isnan(value); });
    if (gaps) file_.attribute(path, "missing", "NaN");
  }

  /// Under si_key(quantity, part).
  void numbers(Quantity quantity, const std::vector<double>& values, std::string_view part = {}) {
    numbers(si_key(quantity, part), quantity_name(quantity),
            si_symbol(quantity_dimension(quantity)), values);
  }

  template <typename Rows, typename Member>
  void texts(const std::string& name, const Rows& rows, Member member) {
    std::vector<std::string> values;
    values.reserve(rows.size());
    for (const auto& row : rows) values.emplace_back(std::invoke(member, row));
    file_.texts(rows_ + "/" + name, values);
  }

 private:
  Hdf5Writer& file_;
  std::string group_, rows_;
};

template <typename Row>
std::vector<double> gather(const std::vector<Row>& rows, std::optional<double> Row::*member) {
  std::vector<double> values;
  values.reserve(rows.size());
  for (const Row& row : rows) values.push_back(or_missing(row.*member));
  return values;
}

void write(Hdf5Writer& file, const PointSet& points) {
  GroupWriter group(file, points.header, "points");
  const Quantity observed = observable_quantity(points.observable);
  group.members({{"observable", quantity_name(observed)},
                 {"time_origin", time_origin_name(points.time_origin)}});
  if (points.time_provenance) {
    group.members({{"time_provenance", provenance_name(*points.time_provenance)}});
  }
  // A depth is imposed or observed.
  if (observed != Quantity::indentation_depth) {
    group.numbers(Quantity::indentation_depth, gather(points.data, &Datum::depth_m));
  }
  group.numbers(Quantity::load, gather(points.data, &Datum::load_N));
  group.numbers(Quantity::time, gather(points.data, &Datum::time_s));
  group.numbers(observed, gather(points.data, &Datum::value));
  group.numbers(observed, gather(points.data, &Datum::lower), "lower");
  group.numbers(observed, gather(points.data, &Datum::upper), "upper");
  group.numbers(observed, gather(points.data, &Datum::sd), "sd");
  group.texts("label", points.data, &Datum::label);
  group.texts("provenance", points.data,
              [](const Datum& datum) { return provenance_name(datum.provenance); });
  group.texts("where", points.data, &Datum::where);
  group.texts("note", points.data, &Datum::note);
}

void write(Hdf5Writer& file, const Recording& recording) {
  GroupWriter group(file, recording.header, "recording");
  const Quantity response = recording.response_quantity;
  group.members({{"provenance", provenance_name(recording.provenance)}});
  group.members_of_rows({{"response_key", si_key(response)}});
  if (!recording.time_s.empty()) group.numbers(Quantity::time, recording.time_s);
  if (!recording.drive.empty()) {
    group.members_of_rows({{"drive_key", si_key(recording.drive_quantity)}});
    group.numbers(recording.drive_quantity, recording.drive);
  }
  group.numbers(response, recording.response);
  if (!recording.response_sd.empty()) group.numbers(response, recording.response_sd, "sd");
}

void write(Hdf5Writer& file, const Spectrum& spectrum) {
  GroupWriter group(file, spectrum.header, "spectrum");
  const SpectrumQuantities quantities = spectrum_quantities(spectrum.dimension);
  group.members({{"provenance", provenance_name(spectrum.provenance)}});
  group.members_of_rows({{"response_key", si_key(quantities.storage)}});
  group.numbers(Quantity::frequency, spectrum.frequency_Hz);
  group.numbers(quantities.storage, spectrum.storage);
  group.numbers(quantities.loss, spectrum.loss);
  if (!spectrum.storage_sd.empty()) group.numbers(quantities.storage, spectrum.storage_sd, "sd");
  if (!spectrum.loss_sd.empty()) group.numbers(quantities.loss, spectrum.loss_sd, "sd");
}

void write(Hdf5Writer& file, const ValueSet& set) {
  GroupWriter group(file, set.header, "values");
  group.texts("name", set.values, &NamedValue::name);
  group.texts("quantity", set.values, &NamedValue::quantity);
  group.texts("unit", set.values, [](const NamedValue& value) { return value.unit.symbol; });
  const auto numbers = [&](const char* name, std::optional<double> NamedValue::*member) {
    group.numbers(name, "see dataset quantity", kRowUnit, gather(set.values, member));
  };
  numbers("value", &NamedValue::value);
  numbers("lower", &NamedValue::lower);
  numbers("upper", &NamedValue::upper);
  numbers("plus_minus", &NamedValue::plus_minus);
  group.texts("provenance", set.values,
              [](const NamedValue& value) { return provenance_name(value.provenance); });
  group.texts("where", set.values, &NamedValue::where);
  group.texts("formula", set.values, &NamedValue::formula);
  group.texts("note", set.values, &NamedValue::note);
}

/// Reads one curve's group.
class GroupReader {
 public:
  GroupReader(const Hdf5Reader& file, std::string file_name, const std::string& id)
      : file_(file),
        where_(fmt::format("{}: /curves/{}", file_name, id)),
        group_("/curves/" + id),
        kind_(attribute("kind")),
        rows_(fmt::format("{}/{}", group_, rows_member(kind_))) {}

  [[nodiscard]] const std::string& where() const { return where_; }
  [[nodiscard]] const std::string& kind() const { return kind_; }

  [[nodiscard]] std::string attribute(const char* name) const { return text(group_, name); }
  [[nodiscard]] std::optional<Provenance> provenance(const std::string& word) const {
    if (word.empty()) return std::nullopt;
    return parse_provenance(word, where_);
  }
  [[nodiscard]] ProbeShape probe() const {
    const std::string probe = group_ + "/probe";
    if (!file_.has(probe)) return {};
    ProbeShape shape{text(probe, "shape"), std::nullopt, provenance(text(probe, "provenance"))};
    if (file_.has_attribute(probe, "diameter_m")) {
      shape.diameter_m = file_.number_attribute(probe, "diameter_m");
    }
    return shape;
  }
  [[nodiscard]] bool has(const std::string& name) const { return file_.has(rows_ + "/" + name); }
  /// Of the column that an attribute of the rows names; none without the attribute.
  [[nodiscard]] std::optional<Quantity> quantity(const char* key) const {
    const std::string column = text(rows_, key);
    if (column.empty()) return std::nullopt;
    return parse_quantity_name(file_.attribute(rows_ + "/" + column, "quantity"), where_);
  }
  [[nodiscard]] Quantity response_quantity() const {
    if (const auto found = quantity("response_key")) return *found;
    throw bad_input(where_, "does not name its response", "a file that tpm data pack wrote");
  }

  /// All columns of a group have one length; a cut or edited file may not.
  [[nodiscard]] std::vector<double> numbers(const std::string& name) {
    std::vector<double> values = file_.numbers(rows_ + "/" + name);
    require_length(name, values.size());
    return values;
  }
  [[nodiscard]] std::vector<std::string> texts(const std::string& name) {
    std::vector<std::string> values = file_.texts(rows_ + "/" + name);
    require_length(name, values.size());
    return values;
  }

  template <typename Row>
  void numbers(const std::string& name, std::vector<Row>& rows,
               std::optional<double> Row::*member) {
    const std::vector<double> values = numbers(name);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!std::isnan(values[i])) rows[i].*member = values[i];
    }
  }
  template <typename Row>
  void texts(const std::string& name, std::vector<Row>& rows, std::string Row::*member) {
    std::vector<std::string> values = texts(name);
    for (std::size_t i = 0; i < values.size(); ++i) rows[i].*member = std::move(values[i]);
  }
  template <typename Row>
  void provenances(std::vector<Row>& rows) {
    const std::vector<std::string> words = texts("provenance");
    for (std::size_t i = 0; i < words.size(); ++i) {
      rows[i].provenance = parse_provenance(words[i], where_);
    }
  }

 private:
  void require_length(const std::string& name, std::size_t found) {
    if (!length_) length_ = found;
    if (found == *length_) return;
    throw bad_input(where_, fmt::format("{} has {} rows", name, found),
                    fmt::format("{} as in its other datasets", *length_));
  }

  [[nodiscard]] std::string text(const std::string& group, const char* name) const {
    return file_.has_attribute(group, name) ? file_.attribute(group, name) : std::string();
  }

  const Hdf5Reader& file_;
  std::string where_;
  std::string group_;
  std::string kind_;
  std::string rows_;
  std::optional<std::size_t> length_;
};

CurveHeader read_header(const GroupReader& group, const std::string& id) {
  CurveHeader header;
  header.id = id;
  header.title = group.attribute("title");
  header.citation = group.attribute("citation");
  header.doi = group.attribute("doi");
  header.specimen = group.attribute("specimen");
  header.note = group.attribute("note");
  header.sha256 = group.attribute("sha256");
  header.probe = group.probe();
  return header;
}

Error bad_row(const GroupReader& group, std::size_t row, const RowFault& fault) {
  return bad_input(fmt::format("{}: {} {}", group.where(), fault.column, row), fault.what,
                   fault.expected);
}

/// A column. Throws Error(bad_input) for the first number that is none.
std::vector<double> finite(GroupReader& group, const std::string& column) {
  std::vector<double> values = group.numbers(column);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) throw bad_row(group, i, {column, "not a number", "a number"});
  }
  return values;
}

std::vector<double> finite_if_any(GroupReader& group, const std::string& column) {
  return group.has(column) ? finite(group, column) : std::vector<double>{};
}

/// A column of standard deviations, if there is one.
std::vector<double> deviations(GroupReader& group, const std::string& column) {
  std::vector<double> values = finite_if_any(group, column);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] >= 0.0) continue;
    throw bad_row(group, i, {column, fmt::format("{} is negative", values[i]), "at least 0"});
  }
  return values;
}

PointSet read_points(GroupReader& group, CurveHeader header) {
  PointSet points;
  points.header = std::move(header);
  const bool force = group.attribute("observable") == quantity_name(Quantity::contact_force);
  points.observable = force ? Observable::contact_force : Observable::indentation_depth;
  const Quantity observed = observable_quantity(points.observable);
  points.time_origin = parse_time_origin(group.attribute("time_origin"), group.where());
  points.time_provenance = group.provenance(group.attribute("time_provenance"));
  points.data.resize(group.numbers(si_key(observed)).size());
  if (force) group.numbers(si_key(Quantity::indentation_depth), points.data, &Datum::depth_m);
  group.numbers(si_key(Quantity::load), points.data, &Datum::load_N);
  group.numbers(si_key(Quantity::time), points.data, &Datum::time_s);
  group.numbers(si_key(observed), points.data, &Datum::value);
  group.numbers(si_key(observed, "lower"), points.data, &Datum::lower);
  group.numbers(si_key(observed, "upper"), points.data, &Datum::upper);
  group.numbers(si_key(observed, "sd"), points.data, &Datum::sd);
  group.texts("label", points.data, &Datum::label);
  group.provenances(points.data);
  group.texts("where", points.data, &Datum::where);
  group.texts("note", points.data, &Datum::note);
  for (std::size_t i = 0; i < points.data.size(); ++i) {
    if (const auto fault = find_datum_fault(points.data[i], points.observable)) {
      throw bad_row(group, i, *fault);
    }
  }
  return points;
}

Recording read_recording(GroupReader& group, CurveHeader header) {
  Recording recording;
  recording.header = std::move(header);
  recording.provenance = parse_provenance(group.attribute("provenance"), group.where());
  recording.response_quantity = group.response_quantity();
  recording.response = finite(group, si_key(recording.response_quantity));
  recording.time_s = finite_if_any(group, "time_s");
  if (const auto drive = group.quantity("drive_key")) {
    recording.drive = finite(group, si_key(*drive));
    recording.drive_quantity = *drive;
  }
  recording.response_sd = deviations(group, si_key(recording.response_quantity, "sd"));
  if (recording.response.empty()) throw bad_input(group.where(), "has no rows", "one at least");
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    if (is_time_in_range(recording.time_s[i])) continue;
    throw bad_row(
        group, i,
        {"time_s", fmt::format("time {} s", recording.time_s[i]), std::string(kTimeRange)});
  }
  for (std::size_t i = 1; i < recording.time_s.size(); ++i) {
    if (recording.time_s[i] > recording.time_s[i - 1]) continue;
    throw bad_row(group, i,
                  {"time_s",
                   fmt::format("time {} s does not follow {} s", recording.time_s[i],
                               recording.time_s[i - 1]),
                   "strictly increasing times"});
  }
  return recording;
}

Spectrum read_spectrum(GroupReader& group, CurveHeader header) {
  Spectrum spectrum;
  spectrum.header = std::move(header);
  spectrum.provenance = parse_provenance(group.attribute("provenance"), group.where());
  spectrum.dimension = quantity_dimension(group.response_quantity());
  const SpectrumQuantities quantities = spectrum_quantities(spectrum.dimension);
  spectrum.frequency_Hz = finite(group, si_key(Quantity::frequency));
  spectrum.storage = finite(group, si_key(quantities.storage));
  spectrum.loss = finite(group, si_key(quantities.loss));
  spectrum.storage_sd = deviations(group, si_key(quantities.storage, "sd"));
  spectrum.loss_sd = deviations(group, si_key(quantities.loss, "sd"));
  if (const auto fault =
          find_spectrum_fault(spectrum.frequency_Hz, spectrum.storage, spectrum.loss)) {
    throw bad_row(group, fault->row, {"row", fault->what, fault->expected});
  }
  return spectrum;
}

ValueSet read_values(GroupReader& group, CurveHeader header) {
  ValueSet set;
  set.header = std::move(header);
  set.values.resize(group.texts("name").size());
  group.texts("name", set.values, &NamedValue::name);
  group.texts("quantity", set.values, &NamedValue::quantity);
  const std::vector<std::string> units = group.texts("unit");
  for (std::size_t i = 0; i < units.size(); ++i) {
    set.values[i].unit = parse_unit(units[i], group.where());
  }
  group.numbers("value", set.values, &NamedValue::value);
  group.numbers("lower", set.values, &NamedValue::lower);
  group.numbers("upper", set.values, &NamedValue::upper);
  group.numbers("plus_minus", set.values, &NamedValue::plus_minus);
  group.provenances(set.values);
  group.texts("where", set.values, &NamedValue::where);
  group.texts("formula", set.values, &NamedValue::formula);
  group.texts("note", set.values, &NamedValue::note);
  for (std::size_t i = 0; i < set.values.size(); ++i) {
    if (const auto fault = find_value_fault(set.values[i])) throw bad_row(group, i, *fault);
  }
  return set;
}

}  // namespace

void pack_curves(const std::filesystem::path& path, const std::vector<Curve>& curves) {
  std::set<std::string> ids;
  for (const Curve& curve : curves) {
    const std::string& id = curve_header(curve).id;
    if (!ids.insert(id).second) {
      throw bad_input(id, "two curves have this id", "different file names");
    }
  }
  Hdf5Writer file(path);
  write_members(file, "/", {{"command", kCommand}, {"version", version()}});
  file.group("/curves");
  for (const Curve& curve : curves) {
    std::visit([&file](const auto& kind) { write(file, kind); }, curve);
  }
  file.commit();
}

std::vector<Curve> unpack_curves(const std::filesystem::path& path) {
  const Hdf5Reader file(path);
  if (!file.has_attribute("/", "command") || file.attribute("/", "command") != kCommand) {
    throw bad_input(path.string(), "is HDF5 but holds no curves",
                    "a file that tpm data pack wrote");
  }
  std::vector<Curve> curves;
  for (const std::string& id : file.members("/curves")) {
    GroupReader group(file, path.string(), id);
    CurveHeader header = read_header(group, id);
    const std::string& kind = group.kind();
    if (kind == "points") {
      curves.emplace_back(read_points(group, std::move(header)));
    } else if (kind == "recording") {
      curves.emplace_back(read_recording(group, std::move(header)));
    } else if (kind == "spectrum") {
      curves.emplace_back(read_spectrum(group, std::move(header)));
    } else if (kind == "values") {
      curves.emplace_back(read_values(group, std::move(header)));
    } else {
      throw bad_input(group.where(), fmt::format("unknown kind '{}'", printable(kind)),
                      "points, recording, spectrum or values");
    }
  }
  return curves;
}

}  // namespace tpm::files
