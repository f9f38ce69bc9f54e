#include "tpm/files/import/pack.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/base/time_range.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

constexpr const char* kFormat = "tpmkit curves 1";
constexpr const char* kRowUnit = "SI unit of the row's own unit";

double or_missing(const std::optional<double>& value) {
  return value.value_or(std::numeric_limits<double>::quiet_NaN());
}

/// Writes one curve's group.
class GroupWriter {
 public:
  GroupWriter(Hdf5Writer& file, const CurveHeader& header, std::string_view kind)
      : file_(file), group_("/curves/" + header.id) {
    file_.group(group_);
    attribute("kind", kind);
    attribute("title", header.title);
    attribute("citation", header.citation);
    attribute("doi", header.doi);
    attribute("specimen", header.specimen);
    attribute("note", header.note);
    attribute("sha256", header.sha256);
    attribute("probe_shape", header.probe.shape);
    if (header.probe.diameter_m) attribute("probe_diameter_m", shortest(*header.probe.diameter_m));
    if (header.probe.provenance) {
      attribute("probe_provenance", provenance_name(*header.probe.provenance));
    }
  }

  void attribute(const std::string& name, std::string_view text) {
    if (!text.empty()) file_.attribute(group_, name, std::string(text));
  }

  void numbers(const std::string& name, std::string_view quantity, std::string_view unit,
               const std::vector<double>& values) {
    const std::string path = group_ + "/" + name;
    file_.numbers(path, values);
    file_.attribute(path, "quantity", std::string(quantity));
    file_.attribute(path, "unit", unit.empty() ? "1" : std::string(unit));
    const bool gaps =
        std::any_of(values.begin(), values.end(), [](double value) { return std::isnan(value); });
    if (gaps) file_.attribute(path, "missing", "NaN");
  }

  void numbers(const std::string& name, Quantity quantity, const std::vector<double>& values) {
    numbers(name, quantity_name(quantity), si_symbol(quantity_dimension(quantity)), values);
  }

  template <typename Rows, typename Member>
  void texts(const std::string& name, const Rows& rows, Member member) {
    std::vector<std::string> values;
    values.reserve(rows.size());
    for (const auto& row : rows) values.emplace_back(std::invoke(member, row));
    file_.texts(group_ + "/" + name, values);
  }

 private:
  Hdf5Writer& file_;
  std::string group_;
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
  group.attribute("observable", quantity_name(observed));
  group.attribute("time_origin", time_origin_name(points.time_origin));
  if (points.time_provenance) {
    group.attribute("time_provenance", provenance_name(*points.time_provenance));
  }
  group.numbers("depth", Quantity::indentation_depth, gather(points.data, &Datum::depth_m));
  group.numbers("load", Quantity::load, gather(points.data, &Datum::load_N));
  group.numbers("time", Quantity::time, gather(points.data, &Datum::time_s));
  group.numbers("value", observed, gather(points.data, &Datum::value));
  group.numbers("lower", observed, gather(points.data, &Datum::lower));
  group.numbers("upper", observed, gather(points.data, &Datum::upper));
  group.numbers("sd", observed, gather(points.data, &Datum::sd));
  group.texts("label", points.data, &Datum::label);
  group.texts("provenance", points.data,
              [](const Datum& datum) { return provenance_name(datum.provenance); });
  group.texts("where", points.data, &Datum::where);
  group.texts("note", points.data, &Datum::note);
}

void write(Hdf5Writer& file, const Recording& recording) {
  GroupWriter group(file, recording.header, "recording");
  group.attribute("provenance", provenance_name(recording.provenance));
  if (!recording.time_s.empty()) group.numbers("time", Quantity::time, recording.time_s);
  if (!recording.drive.empty()) {
    group.numbers("drive", recording.drive_quantity, recording.drive);
  }
  group.numbers("response", recording.response_quantity, recording.response);
  if (!recording.response_sd.empty()) {
    group.numbers("response_sd", recording.response_quantity, recording.response_sd);
  }
}

void write(Hdf5Writer& file, const Spectrum& spectrum) {
  GroupWriter group(file, spectrum.header, "spectrum");
  const SpectrumQuantities quantities = spectrum_quantities(spectrum.dimension);
  group.attribute("provenance", provenance_name(spectrum.provenance));
  group.numbers("frequency", Quantity::frequency, spectrum.frequency_Hz);
  group.numbers("storage", quantities.storage, spectrum.storage);
  group.numbers("loss", quantities.loss, spectrum.loss);
  if (!spectrum.storage_sd.empty()) {
    group.numbers("storage_sd", quantities.storage, spectrum.storage_sd);
  }
  if (!spectrum.loss_sd.empty()) group.numbers("loss_sd", quantities.loss, spectrum.loss_sd);
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
        group_("/curves/" + id) {}

  [[nodiscard]] const std::string& where() const { return where_; }

  [[nodiscard]] std::string attribute(const char* name) const {
    return file_.has_attribute(group_, name) ? file_.attribute(group_, name) : std::string();
  }
  [[nodiscard]] std::optional<Provenance> provenance(const char* name) const {
    const std::string word = attribute(name);
    if (word.empty()) return std::nullopt;
    return parse_provenance(word, where_);
  }
  [[nodiscard]] bool has(const std::string& name) const { return file_.has(group_ + "/" + name); }
  [[nodiscard]] Quantity quantity(const std::string& name) const {
    return parse_quantity_name(file_.attribute(group_ + "/" + name, "quantity"), where_);
  }

  /// All columns of a group have one length; a cut or edited file may not.
  [[nodiscard]] std::vector<double> numbers(const std::string& name) {
    std::vector<double> values = file_.numbers(group_ + "/" + name);
    require_length(name, values.size());
    return values;
  }
  [[nodiscard]] std::vector<std::string> texts(const std::string& name) {
    std::vector<std::string> values = file_.texts(group_ + "/" + name);
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

  const Hdf5Reader& file_;
  std::string where_;
  std::string group_;
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
  header.probe.shape = group.attribute("probe_shape");
  if (const std::string diameter = group.attribute("probe_diameter_m"); !diameter.empty()) {
    header.probe.diameter_m = parse_number(diameter, group.where());
  }
  header.probe.provenance = group.provenance("probe_provenance");
  return header;
}

Error bad_row(const GroupReader& group, std::size_t row, const RowFault& fault) {
  return bad_input(fmt::format("{}: {} {}", group.where(), fault.column, row), fault.what,
                   fault.expected);
}

/// A column. Throws Error(bad_input) for the first number that is none.
std::vector<double> finite(GroupReader& group, const char* column) {
  std::vector<double> values = group.numbers(column);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) throw bad_row(group, i, {column, "not a number", "a number"});
  }
  return values;
}

std::vector<double> finite_if_any(GroupReader& group, const char* column) {
  return group.has(column) ? finite(group, column) : std::vector<double>{};
}

/// A column of standard deviations, if there is one.
std::vector<double> deviations(GroupReader& group, const char* column) {
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
  points.time_origin = parse_time_origin(group.attribute("time_origin"), group.where());
  points.time_provenance = group.provenance("time_provenance");
  points.data.resize(group.numbers("value").size());
  group.numbers("depth", points.data, &Datum::depth_m);
  group.numbers("load", points.data, &Datum::load_N);
  group.numbers("time", points.data, &Datum::time_s);
  group.numbers("value", points.data, &Datum::value);
  group.numbers("lower", points.data, &Datum::lower);
  group.numbers("upper", points.data, &Datum::upper);
  group.numbers("sd", points.data, &Datum::sd);
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
  recording.response = finite(group, "response");
  recording.response_quantity = group.quantity("response");
  recording.time_s = finite_if_any(group, "time");
  if (group.has("drive")) {
    recording.drive = finite(group, "drive");
    recording.drive_quantity = group.quantity("drive");
  }
  recording.response_sd = deviations(group, "response_sd");
  if (recording.response.empty()) throw bad_input(group.where(), "has no rows", "one at least");
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    if (is_time_in_range(recording.time_s[i])) continue;
    throw bad_row(group, i,
                  {"time", fmt::format("time {} s", recording.time_s[i]), std::string(kTimeRange)});
  }
  for (std::size_t i = 1; i < recording.time_s.size(); ++i) {
    if (recording.time_s[i] > recording.time_s[i - 1]) continue;
    throw bad_row(group, i,
                  {"time",
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
  spectrum.dimension = quantity_dimension(group.quantity("storage"));
  spectrum.frequency_Hz = finite(group, "frequency");
  spectrum.storage = finite(group, "storage");
  spectrum.loss = finite(group, "loss");
  spectrum.storage_sd = deviations(group, "storage_sd");
  spectrum.loss_sd = deviations(group, "loss_sd");
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
  file.attribute("/", "format", kFormat);
  file.group("/curves");
  for (const Curve& curve : curves) {
    std::visit([&file](const auto& kind) { write(file, kind); }, curve);
  }
  file.commit();
}

std::vector<Curve> unpack_curves(const std::filesystem::path& path) {
  const Hdf5Reader file(path);
  if (!file.has_attribute("/", "format") || file.attribute("/", "format") != kFormat) {
    throw bad_input(path.string(), "is HDF5 but holds no curves",
                    "a file that tpm data pack wrote");
  }
  std::vector<Curve> curves;
  for (const std::string& id : file.members("/curves")) {
    GroupReader group(file, path.string(), id);
    CurveHeader header = read_header(group, id);
    const std::string kind = group.attribute("kind");
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
