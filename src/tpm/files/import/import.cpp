#include "tpm/files/import/import.hpp"

#include <fmt/format.h>
#include <utf8.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/assemble.hpp"
#include "tpm/files/import/file_kind.hpp"
#include "tpm/files/import/import_digitizer.hpp"
#include "tpm/files/import/import_jpk.hpp"
#include "tpm/files/import/import_machine.hpp"
#include "tpm/files/import/importer.hpp"
#include "tpm/files/zip_archive.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

bool looks_like_json(std::string_view bytes) {
  const auto first = bytes.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && bytes[first] == '{';
}

const DigitizedAxis& required_axis(const std::optional<DigitizedAxis>& axis, char name,
                                   const std::string& file) {
  if (axis) return *axis;
  throw bad_input(file, fmt::format("a digitised file does not say what its {} axis shows", name),
                  fmt::format("--{0}-quantity QUANTITY:UNIT, such as --{0}-quantity {1}", name,
                              name == 'x' ? "time:s" : "contact_force:N"));
}

/// Digitised points come in the order of the clicks; a curve over time is read along time.
void sort_along(std::vector<double>& x, std::vector<double>& y,
                std::vector<ImportFinding>& findings) {
  if (std::is_sorted(x.begin(), x.end())) return;
  std::vector<std::size_t> order(x.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&x](std::size_t a, std::size_t b) { return x[a] < x[b]; });
  const auto arranged = [&order](const std::vector<double>& values) {
    std::vector<double> result;
    result.reserve(values.size());
    for (const std::size_t i : order) result.push_back(values[i]);
    return result;
  };
  x = arranged(x);
  y = arranged(y);
  findings.push_back({"order", "points were put in order of x"});
}

ImportedSeries digitized_series(DigitizedDataset dataset, const std::string& file,
                                const ImportOptions& options) {
  const DigitizedAxis& x = required_axis(options.x, 'x', file);
  const DigitizedAxis& y = required_axis(options.y, 'y', file);
  ImportedSeries series;
  series.name = dataset.name;
  if (!dataset.name.empty()) series.findings.push_back({"dataset", printable(dataset.name)});
  if (x.quantity == Quantity::time) sort_along(dataset.x, dataset.y, series.findings);
  for (const auto& [name, axis] : {std::pair{"x axis", &x}, std::pair{"y axis", &y}}) {
    series.findings.push_back(
        {name, fmt::format("{}{}{}", quantity_name(axis->quantity),
                           axis->unit.symbol.empty() ? "" : ", ", axis->unit.symbol)});
  }
  series.columns.push_back({x.quantity, x.unit, Bound::value, std::move(dataset.x), false});
  series.columns.push_back({y.quantity, y.unit, Bound::value, std::move(dataset.y), false});
  return series;
}

std::vector<ImportedSeries> datasets_series(std::vector<DigitizedDataset> datasets,
                                            const std::string& file, const ImportOptions& options) {
  std::vector<std::string> names;
  std::vector<ImportedSeries> all;
  for (DigitizedDataset& dataset : datasets) {
    names.push_back(dataset.name);
    if (!options.dataset.empty() && dataset.name != options.dataset) continue;
    if (dataset.x.empty() && options.dataset.empty()) continue;
    if (dataset.x.empty()) throw bad_input(file, "the dataset has no points", "a digitised curve");
    all.push_back(digitized_series(std::move(dataset), file, options));
  }
  if (!all.empty()) return all;
  if (options.dataset.empty()) throw bad_input(file, "no dataset has points", "a digitised curve");
  constexpr std::size_t kMostOfName = 200;  // names are to be typed
  throw bad_input(file,
                  fmt::format("no dataset '{}'{}", printable(options.dataset),
                              did_you_mean(options.dataset, names)),
                  listed(names, [](const std::string& name) {
                    return fmt::format("'{}'", printable(name, kMostOfName));
                  }));
}

using AllSeries = std::vector<ImportedSeries>;

/// Moved, not copied as the items of a list would be.
AllSeries only(ImportedSeries series) {
  AllSeries all;
  all.push_back(std::move(series));
  return all;
}

// Asked in this order whether they recognise a file; the last takes what is left.
constexpr auto kImporters = std::to_array<Importer>({
    {"jpk", Provenance::measured, [](ImportInput& in) { return looks_like_zip(in.bytes()); },
     [](ImportInput& in) { return only(read_jpk(in.bytes(), in.file(), in.options())); }},
    {"wpd-json", Provenance::digitized, [](ImportInput& in) { return looks_like_json(in.bytes()); },
     [](ImportInput& in) {
       return datasets_series(read_wpd_json(in.bytes(), in.file()), in.file(), in.options());
     }},
    {"wpd-csv", Provenance::digitized, [](ImportInput& in) { return is_wpd_csv(in.table()); },
     [](ImportInput& in) {
       return datasets_series(read_wpd_csv(in.table(), in.file()), in.file(), in.options());
     }},
    {"engauge", Provenance::digitized, [](ImportInput& in) { return is_engauge(in.table()); },
     [](ImportInput& in) {
       return datasets_series(read_engauge(in.table(), in.file()), in.file(), in.options());
     }},
    {"machine", Provenance::measured, [](ImportInput& /*in*/) { return true; },
     [](ImportInput& in) { return only(read_machine(in.table(), in.file(), in.options())); }},
});

const Importer& importer_of(ImportInput& input) {
  const std::string& format = input.options().format;
  for (const Importer& importer : kImporters) {
    if (format == "auto" ? importer.recognizes(input) : importer.name == format) return importer;
  }
  throw unknown_word(input.file(), "unknown format", format, import_formats());
}

std::vector<ImportFinding> format_findings(const Importer& importer, ImportInput& input) {
  std::vector<ImportFinding> findings{{"format", std::string(importer.name)}};
  if (!input.is_table()) return findings;
  const DelimitedTable& table = input.table();
  const bool told = table.encoding == Encoding::latin1 && !input.options().text.latin1;
  findings.push_back(
      {"encoding",
       fmt::format("{}{}", encoding_name(table.encoding), told ? ", because it is not UTF-8" : ""),
       told});
  findings.push_back({"separator", std::string(separator_name(table.separator))});
  // A machine's samples tell their decimal sign, whatever stands above them.
  if (importer.name != "machine") {
    findings.push_back({"decimal sign", table.decimal_comma ? "comma" : "point"});
  }
  return findings;
}

}  // namespace

const DelimitedTable& ImportInput::table() {
  if (!table_) {
    DelimitedOptions text = options_.text;
    text.ragged = true;  // headers and columns of unequal length
    // Numbers are the same in both: only titles and units can differ.
    const bool marked = bytes_.starts_with("\xFF\xFE") || bytes_.starts_with("\xFE\xFF");
    if (!text.utf8 && !marked && !utf8::is_valid(bytes_)) text.latin1 = true;
    table_ = parse_delimited(bytes_, file_, text);
  }
  return *table_;
}

std::vector<std::string> import_formats() {
  std::vector<std::string> formats{"auto"};
  for (const Importer& importer : kImporters) formats.emplace_back(importer.name);
  return formats;
}

DigitizedAxis parse_axis(std::string_view text, std::string_view where) {
  const auto colon = text.find(':');
  DigitizedAxis axis;
  axis.quantity = parse_quantity_name(text.substr(0, colon), where);
  const std::string_view unit = colon == std::string_view::npos ? "" : text.substr(colon + 1);
  axis.unit = parse_unit(unit, quantity_dimension(axis.quantity), where);
  return axis;
}

ImportedFile import_series(const std::filesystem::path& path, const ImportOptions& options) {
  ImportInput input(read_file(path), path.string(), options);
  if (const auto other = find_other_kind(input.bytes(), input.file())) {
    throw bad_input(input.file(), other->what, other->expected);
  }
  const Importer& importer = importer_of(input);
  if (importer.name != "jpk" && !options.segments.empty()) {
    throw bad_input(input.file(), "is no JPK force file",
                    "--segments only for such a file (.jpk-force)");
  }
  const bool machine = importer.name == "machine";
  if (importer.name != "jpk" && !machine && options.spring_constant_N_per_m) {
    throw bad_input(input.file(), "is no force curve", "--spring-constant only for such a file");
  }
  if (!machine && (options.step_time_s || options.from_s || options.until_s || options.block)) {
    throw bad_input(input.file(), fmt::format("is a file of kind {}", importer.name),
                    "--step-time, --from-time, --until and --block only for tables of a machine");
  }
  ImportedFile imported;
  imported.usual = importer.usual;
  imported.series = importer.read(input);
  const std::vector<ImportFinding> findings = format_findings(importer, input);
  for (ImportedSeries& series : imported.series) {
    series.findings.insert(series.findings.begin(), findings.begin(), findings.end());
  }
  imported.sha256 = sha256_hex(input.bytes());
  return imported;
}

std::vector<ImportedCurve> import_curves(const std::filesystem::path& path,
                                         const ImportOptions& options) {
  ImportedFile imported = import_series(path, options);
  std::vector<ImportedCurve> curves;
  curves.reserve(imported.series.size());
  for (ImportedSeries& series : imported.series) {
    curves.push_back(assemble_curve(std::move(series), path.string(), options, imported.usual));
  }
  return curves;
}

}  // namespace tpm::files
