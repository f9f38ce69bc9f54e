#include "tpm/files/import/recording_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "tpm/files/delimited.hpp"
#include "tpm/files/import/assemble.hpp"
#include "tpm/files/import/reading_options.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/curve_file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace fs = std::filesystem;
namespace {

fs::path with_ending(fs::path path, const char* ending) {
  return path.replace_extension(ending);
}

/// A description and its rows stand side by side; an id has neither ending nor file.
bool is_described(const fs::path& path) {
  std::error_code none;  // its name may be too long where that of the rows is not
  if (path.extension() == ".csv") return fs::exists(with_ending(path, ".json"), none);
  if (path.extension() == ".json") return fs::exists(with_ending(path, ".csv"), none);
  return !fs::exists(path, none) && !path.has_extension();
}

bool says_something_about_columns(const ImportOptions& options) {
  return options.format != "auto" || says_how_to_read(options) || options.contact_force_N ||
         options.x || options.y || !options.dataset.empty() || options.depth_m || options.load_N;
}

/// The kind that a description names; an id is one of the shipped curves.
std::string curve_kind_of(const fs::path& path) {
  if (!path.has_extension()) return std::string(curve_kind(load_curve(path.string())));
  return read_json(with_ending(path, ".json")).value("kind", "");
}

RecordingFile read_described(const fs::path& path, const ImportOptions& options) {
  if (says_something_about_columns(options)) {
    throw bad_input(path.string(), "has a description beside it, which says what its columns are",
                    "no import options, or a file without a description");
  }
  RecordingFile result{load_recording(path.string()), {}};
  const Recording& recording = result.recording;
  const auto found = [&result](const char* what, std::string value) {
    result.findings.push_back({what, std::move(value)});
  };
  found("format", "described");
  if (!recording.drive.empty())
    found("drive", std::string(quantity_name(recording.drive_quantity)));
  found("response", std::string(quantity_name(recording.response_quantity)));
  found("rows", std::to_string(recording.response.size()));
  found("provenance", std::string(provenance_name(recording.provenance)));
  return result;
}

/// Throws if there are several datasets and none was chosen.
void require_one(const ImportedFile& imported, const std::string& file) {
  if (imported.series.size() == 1) return;
  constexpr std::size_t kMostOfName = 200, kMostOfAll = 2000;  // names are to be typed
  std::string names;
  for (const ImportedSeries& series : imported.series) {
    names += fmt::format("{}'{}'", names.empty() ? "" : ", ", printable(series.name, kMostOfName));
  }
  throw bad_input(file, fmt::format("holds {} curves", imported.series.size()),
                  fmt::format("--dataset with one of {}", printable(names, kMostOfAll)));
}

/// The importer would make readings of separate experiments out of such a curve.
void require_no_imposed_value(const ImportOptions& options, const std::string& file) {
  if (!options.depth_m && !options.load_N) return;
  throw bad_input(file, "with an imposed depth or load its rows are readings, not a recording",
                  "tpm data import, which writes points, or no --depth and --load");
}

/// Rows without a number are left out before anything asks how many there are: says which.
void require_samples(const RecordingFile& read, const std::string& file) {
  constexpr std::size_t kLeast = 3;
  const std::size_t size = read.recording.response.size();
  if (size >= kLeast) return;
  for (const ImportFinding& finding : read.findings) {
    if (finding.what != "missing") continue;
    throw bad_input(file, fmt::format("{} samples ({})", size, finding.value),
                    fmt::format("at least {} rows of numbers", kLeast));
  }
}

std::string described_label(const fs::path& path, std::string_view key) {
  const fs::path description = with_ending(path, ".json");
  const Json json = read_json(description);
  const auto value = json.find(std::string(key));
  if (value != json.end() && value->is_string()) return value->get<std::string>();
  if (value != json.end() && value->is_number()) return value->dump();
  throw bad_input(description.string(), fmt::format("no text or number '{}'", printable(key)),
                  "a key that every description has");
}

}  // namespace

std::string columns_words(const std::vector<ImportFinding>& findings) {
  std::string words;
  for (const ImportFinding& finding : findings) {
    if (!finding.told) continue;
    words +=
        fmt::format("{}{}: {}", words.empty() ? "read as " : "; ", finding.what, finding.value);
  }
  return words;
}

std::string recording_label(const fs::path& path, std::string_view key,
                            const ImportOptions& options) {
  if (is_described(path)) return described_label(path, key);
  const DelimitedTable table = read_delimited(path, options.text);
  std::optional<std::size_t> column;
  std::string label;
  for (const DelimitedRow& row : table.rows) {
    if (!column) {
      const auto title = std::find(row.fields.begin(), row.fields.end(), key);
      if (title != row.fields.end()) column = static_cast<std::size_t>(title - row.fields.begin());
      continue;
    }
    // Units may stand between the titles and the samples.
    const auto numbers = std::count_if(row.fields.begin(), row.fields.end(), [&](auto field) {
      return is_number(field, table.decimal_comma);
    });
    if (numbers < 2 || *column >= row.fields.size()) continue;
    const std::string_view field = row.fields[*column];
    if (label.empty()) label = std::string(field);
    if (field == label && !field.empty()) continue;
    throw bad_input(fmt::format("{}, line {}", path.string(), row.line),
                    fmt::format("'{}' in the column '{}' that began with '{}'", printable(field),
                                printable(key), printable(label)),
                    "one value in all samples");
  }
  if (!label.empty()) return label;
  throw bad_input(path.string(), fmt::format("no column is called '{}'", printable(key)),
                  "a column that every recording has, or a name pattern with one group, ()");
}

MeasuredFile read_measured_file(const fs::path& path, const ImportOptions& options) {
  const std::string file = path.string();
  if (file == "-") {
    throw bad_input("-", "is no file", "a file, or /dev/stdin for what a pipe brings");
  }
  if (is_described(path)) {
    if (curve_kind_of(path) == "spectrum") return SpectrumFile{load_spectrum(file)};
    return read_described(path, options);
  }
  require_no_imposed_value(options, file);
  ImportedFile imported = import_series(path, options);
  require_one(imported, file);
  ImportedSeries& series = imported.series.front();
  const std::string name = printable(series.name, 200);
  const auto name_it = [&](CurveHeader& header) {
    header.id = path.stem().string();
    if (header.title.empty()) header.title = name.empty() ? header.id : name;
    header.sha256 = imported.sha256;
  };
  if (holds_spectrum(series)) {
    std::vector<ImportFinding> findings = series.findings;
    const bool from_angle = series.from_angle;
    Spectrum spectrum = assemble_spectrum(std::move(series), file, options, imported.usual);
    name_it(spectrum.header);
    return SpectrumFile{std::move(spectrum), std::move(findings), from_angle};
  }
  RecordingFile result = assemble_recording(std::move(series), file, options, imported.usual);
  require_samples(result, file);
  name_it(result.recording.header);
  return result;
}

void require_time_and_drive(const RecordingFile& read, const std::string& file) {
  const Recording& recording = read.recording;
  const bool timed = !recording.time_s.empty();
  const bool driven = !recording.drive.empty() || is_step_response(recording.response_quantity);
  const auto others = std::ranges::find(read.findings, "not used", &ImportFinding::what);
  if (timed == driven) return;
  const bool stress = timed && recording.response_quantity == Quantity::stress;
  if (others == read.findings.end() && !stress) return;
  std::string expected;
  if (others != read.findings.end()) {
    expected = fmt::format("{} with one of {}", timed ? "--drive" : "--time", others->value);
  }
  if (stress) {
    expected += fmt::format("{}--response-quantity relaxation_modulus for a G(t) or E(t)",
                            expected.empty() ? "" : "; or ");
  }
  throw bad_input(file,
                  timed ? "no column is recognised as a depth, displacement, strain or length"
                        : "no column is recognised as time",
                  expected);
}

RecordingFile read_recording_file(const fs::path& path, const ImportOptions& options) {
  MeasuredFile measured = read_measured_file(path, options);
  if (auto* file = std::get_if<RecordingFile>(&measured)) return std::move(*file);
  throw bad_input(path.string(), "holds a spectrum (storage and loss over frequency)",
                  "a recording");
}

Spectrum read_spectrum_file(const fs::path& path, const ImportOptions& options) {
  MeasuredFile measured = read_measured_file(path, options);
  if (auto* file = std::get_if<SpectrumFile>(&measured)) return std::move(file->spectrum);
  throw bad_input(path.string(), "holds a recording", "a spectrum: frequency, storage and loss");
}

}  // namespace tpm::files
