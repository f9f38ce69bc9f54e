#include "tpm/curve/import.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "tpm/core/enum_names.hpp"
#include "tpm/core/text.hpp"
#include "tpm/curve/assemble.hpp"
#include "tpm/curve/import_digitizer.hpp"
#include "tpm/curve/import_jpk.hpp"
#include "tpm/curve/import_machine.hpp"
#include "tpm/store/file.hpp"
#include "tpm/store/zip_archive.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
namespace {

constexpr auto kFormats = std::to_array<Word<ImportFormat>>({
    {ImportFormat::automatic, "auto"},
    {ImportFormat::machine, "machine"},
    {ImportFormat::wpd_csv, "wpd-csv"},
    {ImportFormat::wpd_json, "wpd-json"},
    {ImportFormat::engauge, "engauge"},
    {ImportFormat::jpk, "jpk"},
});

bool looks_like_json(std::string_view bytes) {
  const auto first = bytes.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && bytes[first] == '{';
}

std::vector<ImportFinding> text_findings(const DelimitedTable& table, ImportFormat format) {
  return {{"format", std::string(import_format_name(format))},
          {"encoding", std::string(encoding_name(table.encoding))},
          {"separator", std::string(separator_name(table.separator))},
          {"decimal sign", table.decimal_comma ? "comma" : "point"}};
}

const DigitizedAxis& required_axis(const std::optional<DigitizedAxis>& axis, char name,
                                   const std::string& file) {
  if (axis) return *axis;
  throw bad_input(file, fmt::format("a digitised file does not say what its {} axis shows", name),
                  fmt::format("--{} QUANTITY:UNIT, such as --{} {}", name, name,
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
                                const ImportOptions& options, std::vector<ImportFinding> findings) {
  const DigitizedAxis& x = required_axis(options.x, 'x', file);
  const DigitizedAxis& y = required_axis(options.y, 'y', file);
  ImportedSeries series;
  series.name = dataset.name;
  series.findings = std::move(findings);
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
                                            const std::string& file, const ImportOptions& options,
                                            const std::vector<ImportFinding>& findings) {
  std::string names;
  std::vector<ImportedSeries> all;
  for (DigitizedDataset& dataset : datasets) {
    names += fmt::format("{}'{}'", names.empty() ? "" : ", ", printable(dataset.name));
    if (!options.dataset.empty() && dataset.name != options.dataset) continue;
    if (dataset.x.empty() && options.dataset.empty()) continue;
    if (dataset.x.empty()) throw bad_input(file, "the dataset has no points", "a digitised curve");
    all.push_back(digitized_series(std::move(dataset), file, options, findings));
  }
  if (!all.empty()) return all;
  if (options.dataset.empty()) throw bad_input(file, "no dataset has points", "a digitised curve");
  throw bad_input(file, fmt::format("no dataset '{}'", printable(options.dataset)), names);
}

ImportedFile import_table(const DelimitedTable& table, const std::string& file,
                          const ImportOptions& options) {
  ImportFormat format = options.format;
  if (format == ImportFormat::automatic) {
    format = recognize_digitizer(table).value_or(ImportFormat::machine);
  }
  std::vector<ImportFinding> findings = text_findings(table, format);
  ImportedFile imported;
  if (format == ImportFormat::machine) {
    ImportedSeries series = read_machine(table, file, options);
    series.findings.insert(series.findings.begin(), findings.begin(), findings.end());
    imported.series.push_back(std::move(series));
    return imported;
  }
  imported.usual = Provenance::digitized;
  imported.series = datasets_series(
      format == ImportFormat::wpd_csv ? read_wpd_csv(table, file) : read_engauge(table, file), file,
      options, findings);
  return imported;
}

void require_no_jpk_options(const ImportOptions& options, const std::string& file) {
  if (!options.spring_constant_N_per_m && options.segments.empty()) return;
  throw bad_input(file, "is no JPK force file",
                  "--spring-constant and --segments only for such a file (.jpk-force)");
}

}  // namespace

std::string_view import_format_name(ImportFormat format) noexcept {
  return entry_of(kFormats, format).text;
}

ImportFormat parse_import_format(std::string_view text, std::string_view where) {
  return parse_word(kFormats, "format", text, where);
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
  const std::string file = path.string();
  const std::string bytes = read_file(path);
  if (options.format == ImportFormat::jpk ||
      (options.format == ImportFormat::automatic && looks_like_zip(bytes))) {
    ImportedFile imported;
    imported.series.push_back(read_jpk(bytes, file, options));
    imported.series.front().findings.insert(imported.series.front().findings.begin(),
                                            {"format", "jpk"});
    imported.sha256 = sha256_hex(bytes);
    return imported;
  }
  require_no_jpk_options(options, file);
  const bool json = options.format == ImportFormat::wpd_json ||
                    (options.format == ImportFormat::automatic && looks_like_json(bytes));
  ImportedFile imported;
  if (json) {
    imported.usual = Provenance::digitized;
    imported.series =
        datasets_series(read_wpd_json(bytes, file), file, options, {{"format", "wpd-json"}});
  } else {
    DelimitedOptions text = options.text;
    text.ragged = true;  // headers and columns of unequal length; each reader checks its own rows
    imported = import_table(parse_delimited(bytes, file, text), file, options);
  }
  imported.sha256 = sha256_hex(bytes);
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

}  // namespace tpm
