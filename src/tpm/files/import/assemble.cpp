#include "tpm/files/import/assemble.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <numeric>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/base/time_range.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

std::string header_of(const ImportedColumn& column) {
  std::string header(quantity_short_name(column.quantity));
  if (column.bound != Bound::value) header.append("_").append(bound_name(column.bound));
  if (!column.unit.symbol.empty()) header.append("_").append(column.unit.symbol);
  return header;
}

/// Numbers stay as they were read; where zero was moved, the noise of the subtraction is cut off.
std::string number_text(const ImportedColumn& column, std::size_t row) {
  return column.shifted ? significant(column.values[row], 12) : shortest(column.values[row]);
}

std::string with_unit(double value, const Unit& unit) {
  return fmt::format("{}{}{}", significant(value, 6), unit.symbol.empty() ? "" : " ", unit.symbol);
}

const ImportedColumn* find(const ImportedSeries& series, Quantity quantity,
                           Bound bound = Bound::value) {
  const auto found = std::find_if(series.columns.begin(), series.columns.end(),
                                  [quantity, bound](const auto& column) {
                                    return column.quantity == quantity && column.bound == bound;
                                  });
  return found == series.columns.end() ? nullptr : &*found;
}

/// The last column with values: the importers put what was observed after what was imposed.
const ImportedColumn& observed(const ImportedSeries& series) {
  return *std::find_if(series.columns.rbegin(), series.columns.rend(),
                       [](const auto& column) { return column.bound == Bound::value; });
}

std::string place(const ImportedSeries& series, const std::string& file, std::size_t row) {
  if (row < series.lines.size()) return fmt::format("{}:{}", file, series.lines[row]);
  return series.name.empty() ? file : fmt::format("{}: dataset '{}'", file, printable(series.name));
}

/// Why times go back at many rows, if they do: a table that was sorted by another column, or whose
/// newest row comes first. Empty where they go back here and there, as a clock does that restarts.
std::string order_of_rows(const std::vector<double>& times, const std::string& unit) {
  constexpr std::size_t kFewest = 4;  // steps that go back
  constexpr double kMany = 0.1;       // of all steps
  std::size_t back = 0;
  bool rises = false;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i] < times[i - 1]) ++back;
    if (times[i] > times[i - 1]) rises = true;
  }
  if (back < kFewest || static_cast<double>(back) < kMany * static_cast<double>(times.size()))
    return {};
  if (!rises) {
    return fmt::format("the newest row comes first, from {} {} down to {} {}",
                       shortest(times.front()), unit, shortest(times.back()), unit);
  }
  return fmt::format("the rows are not in the order of time, which goes back {} times", back);
}

void require_times(const ImportedSeries& series, const std::string& file) {
  const ImportedColumn* time = find(series, Quantity::time);
  if (time == nullptr) return;
  for (std::size_t i = 0; i < time->values.size(); ++i) {
    if (is_time_in_range(time->values[i] * time->unit.to_si)) continue;
    throw bad_input(place(series, file, i),
                    fmt::format("time {} {}", shortest(time->values[i]), time->unit.symbol),
                    kTimeRange);
  }
  const std::string order = order_of_rows(time->values, time->unit.symbol);
  for (std::size_t i = 1; i < time->values.size(); ++i) {
    if (time->values[i] > time->values[i - 1]) continue;
    const std::string step =
        fmt::format("time {} {} does not follow {} {}", shortest(time->values[i]),
                    time->unit.symbol, shortest(time->values[i - 1]), time->unit.symbol);
    if (series.lines.empty())
      throw bad_input(place(series, file, i), step, "strictly increasing times");
    if (order.empty()) {
      throw bad_input(place(series, file, i), step,
                      "strictly increasing times: another --time COLUMN, or a file for each part "
                      "before and after this line");
    }
    throw bad_input(place(series, file, i), fmt::format("{}: {}", step, order),
                    "strictly increasing times: the rows sorted by their time, or another --time "
                    "COLUMN");
  }
}

double mean_of_rows(const std::vector<double>& values, std::size_t first, std::size_t end) {
  return std::accumulate(values.begin() + static_cast<std::ptrdiff_t>(first),
                         values.begin() + static_cast<std::ptrdiff_t>(end), 0.0) /
         static_cast<double>(end - first);
}

/// Rows at even times that a coarse clock rounded or truncated get these times back, but for what
/// the clock itself is late: all its stamps then lie within one of its steps of a straight line
/// over the rows. A mean of rows would round off the corners of a drive and the contact.
/// @param time  in order
/// @param stamps  different times in it, fewer than rows
/// @returns what was found; none where the rows are not even, or too few tell
std::optional<ImportFinding> spread_even_rows(ImportedColumn& time, std::size_t stamps) {
  constexpr std::size_t kFewestStamps = 20;  // a pause or a second rate does not hide among them
  constexpr double kFewestRepeated = 0.1;    // of the rows: one marker's double row is no clock
  constexpr double kSlack = 1.02;  // of a step: the line is fitted, and stamps are rounded
  const auto rows = static_cast<Eigen::Index>(time.values.size());
  const std::size_t repeated = time.values.size() - stamps;
  if (stamps < kFewestStamps ||
      static_cast<double>(repeated) < kFewestRepeated * static_cast<double>(rows)) {
    return std::nullopt;
  }
  const Eigen::Map<const Eigen::ArrayXd> clock(time.values.data(), rows);
  double step = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 1; i < rows; ++i) {
    if (clock[i] > clock[i - 1]) step = std::min(step, clock[i] - clock[i - 1]);
  }
  const Eigen::ArrayXd place = Eigen::ArrayXd::LinSpaced(rows, 0.0, static_cast<double>(rows - 1));
  const Eigen::ArrayXd from_middle = place - place.mean();
  const double period = (from_middle * clock).sum() / from_middle.square().sum();
  const Eigen::ArrayXd off = clock - period * place;
  if (off.maxCoeff() - off.minCoeff() > kSlack * step) return std::nullopt;
  const double first = clock[0];
  for (Eigen::Index i = 0; i < rows; ++i) {
    time.values[static_cast<std::size_t>(i)] = first + period * place[i];
  }
  time.shifted = true;  // computed: not the digits of the file
  return ImportFinding::told_of(
      "repeated times",
      fmt::format("{} of {} rows have the time of the row before: the clock counts in steps of {}, "
                  "and all stamps fit rows at even times, one every {}; these are the times",
                  repeated, rows, with_unit(step, time.unit), with_unit(period, time.unit)));
}

/// A clock that is coarser than the sampling stamps several rows alike: even rows get their times
/// back, others become one, their mean. Standard deviations stay as they are: what a machine states
/// need not be independent.
void resolve_repeated_times(ImportedSeries& series) {
  const auto time = std::ranges::find(series.columns, Quantity::time, &ImportedColumn::quantity);
  if (time == series.columns.end() || series.lines.empty() || !series.segments.empty()) return;
  const std::vector<double> stamps = time->values;
  if (stamps.size() < 2 || !std::ranges::is_sorted(stamps)) return;
  std::vector<std::size_t> begin{0};
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    if (stamps[i] != stamps[i - 1]) begin.push_back(i);
  }
  if (begin.size() == stamps.size() || begin.size() < 2) return;
  if (auto even = spread_even_rows(*time, begin.size())) {
    series.findings.push_back(std::move(*even));
    return;
  }
  begin.push_back(stamps.size());
  std::vector<int> lines;
  for (std::size_t k = 0; k + 1 < begin.size(); ++k) lines.push_back(series.lines[begin[k]]);
  for (ImportedColumn& column : series.columns) {
    std::vector<double> means;
    for (std::size_t k = 0; k + 1 < begin.size(); ++k) {
      means.push_back(mean_of_rows(column.values, begin[k], begin[k + 1]));
    }
    column.shifted = column.shifted || column.quantity != Quantity::time;
    column.values = std::move(means);
  }
  series.lines = std::move(lines);
  series.findings.push_back(
      {"repeated times",
       fmt::format("{} of {} rows have the time of the row before: rows of one time became one, "
                   "their mean",
                   stamps.size() - series.lines.size(), stamps.size()),
       true});
}

void require_not_negative(const ImportedSeries& series, const std::string& file, Quantity quantity,
                          Bound bound) {
  const ImportedColumn* column = find(series, quantity, bound);
  if (column == nullptr) return;
  const auto found = std::find_if(column->values.begin(), column->values.end(),
                                  [](double value) { return value < 0.0; });
  if (found == column->values.end()) return;
  throw bad_input(place(series, file, static_cast<std::size_t>(found - column->values.begin())),
                  fmt::format("{}{} {} is negative", quantity_name(quantity),
                              bound == Bound::sd ? " standard deviation" : "", shortest(*found)),
                  "at least 0");
}

void add_time_findings(const ImportedColumn& time, std::vector<ImportFinding>& findings) {
  findings.push_back(
      {"time range", fmt::format("{} to {}", with_unit(time.values.front(), time.unit),
                                 with_unit(time.values.back(), time.unit))});
  if (time.values.size() < 2) return;
  double shortest_step = time.values[1] - time.values[0];
  double longest_step = shortest_step;
  for (std::size_t i = 2; i < time.values.size(); ++i) {
    const double step = time.values[i] - time.values[i - 1];
    shortest_step = std::min(shortest_step, step);
    longest_step = std::max(longest_step, step);
  }
  constexpr double kEven = 1e-6;  // exports repeat rounding noise of this relative size
  const bool even = longest_step - shortest_step <= kEven * longest_step;
  findings.push_back(
      {"sampling", even ? fmt::format("every {}", with_unit(shortest_step, time.unit))
                        : fmt::format("every {} to {}", with_unit(shortest_step, time.unit),
                                      with_unit(longest_step, time.unit))});
}

/// Storage or loss, whatever their dimension.
const ImportedColumn* find_part(const ImportedSeries& series, Quantity SpectrumQuantities::*part) {
  for (const Dimension dimension : {Dimension::stress, Dimension::stiffness}) {
    const auto* column = find(series, spectrum_quantities(dimension).*part);
    if (column != nullptr) return column;
  }
  return nullptr;
}

void require_spectrum(const ImportedSeries& series, const std::string& file) {
  const ImportedColumn& frequency = *find(series, Quantity::frequency);
  const ImportedColumn* storage = find_part(series, &SpectrumQuantities::storage);
  const ImportedColumn* loss = find_part(series, &SpectrumQuantities::loss);
  if (storage == nullptr || loss == nullptr) {
    throw bad_input(file, "a frequency without both storage and loss",
                    "one table with the columns of all three");
  }
  if (storage->unit.dimension != loss->unit.dimension) {
    throw bad_input(file, "a modulus beside a stiffness", "storage and loss of one kind");
  }
  if (const auto fault = find_spectrum_fault(frequency.values, storage->values, loss->values)) {
    throw bad_input(place(series, file, fault->row), fault->what, fault->expected);
  }
}

void add_spectrum_measures(ImportedSeries& series) {
  const ImportedColumn& frequency = *find(series, Quantity::frequency);
  const auto [low, high] = std::minmax_element(frequency.values.begin(), frequency.values.end());
  series.findings.push_back({"rows", std::to_string(frequency.values.size())});
  series.findings.push_back(
      {"frequency range",
       fmt::format("{} to {}", with_unit(*low, frequency.unit), with_unit(*high, frequency.unit))});
}

void add_measures(ImportedSeries& series) {
  const ImportedColumn& response = observed(series);
  const ImportedColumn* time = find(series, Quantity::time);
  series.findings.push_back({"rows", std::to_string(response.values.size())});
  if (time != nullptr) add_time_findings(*time, series.findings);
  const auto peak = std::max_element(response.values.begin(), response.values.end());
  const auto row = static_cast<std::size_t>(peak - response.values.begin());
  std::string found = with_unit(*peak, response.unit);
  if (time != nullptr) found += " at " + with_unit(time->values[row], time->unit);
  series.findings.push_back({"peak", found});
}

/// A digitised curve with a known imposed quantity is a set of points that a model can answer.
bool becomes_points(const ImportedSeries& series, const ImportOptions& options) {
  if (options.format == "machine" || !series.lines.empty()) return false;
  const Quantity response = observed(series).quantity;
  const bool force = response == Quantity::contact_force;
  const bool depth = response == Quantity::indentation_depth;
  if (find(series, Quantity::time) == nullptr) {
    return (force && find(series, Quantity::indentation_depth) != nullptr) ||
           (depth && find(series, Quantity::load) != nullptr);
  }
  return (force && options.depth_m) || (depth && options.load_N);
}

void add_imposed(ImportedSeries& series, const std::string& file, const ImportOptions& options) {
  const bool timed = find(series, Quantity::time) != nullptr;
  if (timed && options.time_origin == TimeOrigin::none) {
    throw bad_input(file, "what the times count from is not known",
                    "--time-origin end_of_ramp or load_applied");
  }
  if (!timed) return;
  const std::size_t rows = observed(series).values.size();
  const bool force = observed(series).quantity == Quantity::contact_force;
  ImportedColumn imposed;
  imposed.quantity = force ? Quantity::indentation_depth : Quantity::load;
  imposed.unit = force ? parse_unit("mm", file) : parse_unit("N", file);
  const double si = force ? *options.depth_m : *options.load_N;
  imposed.values.assign(rows, si / imposed.unit.to_si);
  imposed.shifted = true;  // converted: not the digits of the file
  series.findings.push_back({"imposed", fmt::format("{} {}", quantity_name(imposed.quantity),
                                                    with_unit(imposed.values[0], imposed.unit))});
  series.columns.insert(series.columns.begin(), std::move(imposed));
}

std::string csv_text(const ImportedSeries& series, std::string_view provenance) {
  std::string csv;
  for (const ImportedColumn& column : series.columns) {
    if (!csv.empty()) csv += ',';
    csv += header_of(column);
  }
  csv += provenance.empty() ? "\n" : ",provenance\n";
  for (std::size_t row = 0; row < series.columns.front().values.size(); ++row) {
    for (std::size_t c = 0; c < series.columns.size(); ++c) {
      if (c > 0) csv += ',';
      csv += number_text(series.columns[c], row);
    }
    csv += provenance.empty() ? "\n" : fmt::format(",{}\n", provenance);
  }
  return csv;
}

/// Checks the conditions of every kind of curve, and measures it.
void check_and_measure(ImportedSeries& series, const std::string& file) {
  if (holds_spectrum(series)) {
    require_spectrum(series, file);
    add_spectrum_measures(series);
    return;
  }
  resolve_repeated_times(series);
  require_times(series, file);
  require_not_negative(series, file, observed(series).quantity, Bound::sd);
  add_measures(series);
}

std::vector<double> in_si(ImportedColumn& column) {
  for (double& value : column.values) value *= column.unit.to_si;
  return std::move(column.values);
}

}  // namespace

bool holds_spectrum(const ImportedSeries& series) {
  return find(series, Quantity::frequency) != nullptr;
}

Spectrum assemble_spectrum(ImportedSeries series, const std::string& file,
                           const ImportOptions& options, Provenance usual) {
  check_and_measure(series, file);
  if (!holds_spectrum(series))
    throw bad_input(file, "holds no spectrum", "frequency, storage and loss");
  Spectrum spectrum;
  spectrum.header = options.header;
  spectrum.provenance = options.provenance.value_or(usual);
  for (ImportedColumn& column : series.columns) {
    const Dimension dimension = column.unit.dimension;
    if (column.quantity == Quantity::frequency) {
      spectrum.frequency_Hz = in_si(column);
    } else if (column.quantity == spectrum_quantities(dimension).storage) {
      spectrum.dimension = dimension;
      spectrum.storage = in_si(column);
    } else if (column.quantity == spectrum_quantities(dimension).loss) {
      spectrum.loss = in_si(column);
    }
  }
  return spectrum;
}

RecordingFile assemble_recording(ImportedSeries series, const std::string& file,
                                 const ImportOptions& options, Provenance usual) {
  check_and_measure(series, file);
  if (holds_spectrum(series)) {
    throw bad_input(file, "holds a spectrum (storage and loss over frequency)", "a recording");
  }
  RecordingFile result;
  Recording& recording = result.recording;
  recording.header = options.header;
  recording.provenance = options.provenance.value_or(usual);
  recording.response_quantity = observed(series).quantity;
  for (ImportedColumn& column : series.columns) {
    if (column.bound == Bound::sd) {
      recording.response_sd = in_si(column);
    } else if (column.quantity == Quantity::time) {
      recording.time_s = in_si(column);
    } else if (column.quantity == recording.response_quantity) {
      recording.response = in_si(column);
    } else {
      recording.drive_quantity = column.quantity;
      recording.drive = in_si(column);
    }
  }
  series.findings.push_back({"provenance", std::string(provenance_name(recording.provenance))});
  result.findings = std::move(series.findings);
  return result;
}

ImportedCurve assemble_curve(ImportedSeries series, const std::string& file,
                             const ImportOptions& options, Provenance usual) {
  check_and_measure(series, file);
  const Provenance provenance = options.provenance.value_or(usual);

  ImportedCurve curve;
  curve.name = series.name;
  curve.description.header = options.header;
  std::string& note = curve.description.header.note;
  if (!series.note.empty()) note += (note.empty() ? "" : "; ") + series.note;
  if (!holds_spectrum(series)) curve.description.observable = observed(series).quantity;
  if (becomes_points(series, options)) {
    curve.description.kind = "points";
    const bool timed = find(series, Quantity::time) != nullptr;
    curve.description.time_origin = timed ? options.time_origin : TimeOrigin::none;
    for (const Quantity imposed : {Quantity::time, Quantity::indentation_depth, Quantity::load}) {
      require_not_negative(series, file, imposed, Bound::value);
    }
    add_imposed(series, file, options);
    curve.csv = csv_text(series, provenance_name(provenance));
  } else {
    curve.description.kind = holds_spectrum(series) ? "spectrum" : "recording";
    curve.description.provenance = provenance;
    curve.description.segments = std::move(series.segments);
    curve.csv = csv_text(series, {});
  }
  for (const ImportedColumn& column : series.columns) {
    curve.description.columns.emplace(
        header_of(column),
        ColumnDescription{column.quantity, column.unit, column.bound, std::nullopt, {}});
  }
  series.findings.push_back({"kind", curve.description.kind});
  series.findings.push_back({"provenance", std::string(provenance_name(provenance))});
  curve.findings = std::move(series.findings);
  return curve;
}

}  // namespace tpm::files
