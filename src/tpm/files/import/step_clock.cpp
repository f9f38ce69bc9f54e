#include "tpm/files/import/step_clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

const ImportedColumn* time_of(const ImportedSeries& series) {
  const auto found = std::find_if(series.columns.begin(), series.columns.end(), [](const auto& c) {
    return c.quantity == Quantity::time && c.bound == Bound::value;
  });
  return found == series.columns.end() ? nullptr : &*found;
}

bool holds_step_response(const ImportedSeries& series) {
  return std::any_of(
      series.columns.begin(), series.columns.end(),
      [](const ImportedColumn& column) { return is_step_response(column.quantity); });
}

/// The ratio of the large values (nine tenths are smaller) to the small ones.
double spread_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t tenth = values.size() / 10;
  return values[values.size() - 1 - tenth] / values[tenth];
}

template <typename T>
void keep_rows(std::vector<T>& values, std::size_t first, std::size_t end) {
  if (values.empty()) return;
  values.erase(values.begin() + static_cast<std::ptrdiff_t>(end), values.end());
  values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(first));
}

/// Rows in which a step is not yet reached: it rises from the first sample on, and is kept within
/// 2 % from there. Nothing if it is not kept.
std::optional<std::size_t> rows_before_kept(const std::vector<double>& values,
                                            const std::vector<double>& times) {
  constexpr double kKept = 0.02;   // of its mean, from the smallest to the largest
  constexpr double kSoon = 1e-3;   // of the time
  constexpr double kBegun = 0.05;  // of the step: a recording that begins below shows its ramp
  double low = values.back(), high = low;
  std::size_t first = values.size();
  for (; first > 0; --first) {
    const double next = values[first - 1];
    const double lower = std::min(low, next), upper = std::max(high, next);
    if (!(lower * upper > 0.0) || upper - lower > kKept * std::abs(0.5 * (lower + upper))) break;
    low = lower;
    high = upper;
  }
  if (first == 0) return 0;
  if (first == values.size()) return std::nullopt;
  const double step = values[first];
  for (std::size_t i = 0; i < first; ++i) {
    if (!(values[i] / step > (i == 0 ? kBegun : values[i - 1] / step))) return std::nullopt;
  }
  const bool soon = times[first] <= kSoon * times.back();
  return soon && counts_from_step(times) ? std::optional(first) : std::nullopt;
}

/// Time at which half of a step is reached, which rises from 0 at time 0.
double half_risen(const std::vector<double>& values, const std::vector<double>& times,
                  std::size_t rising) {
  const double half = 0.5 * values[rising];
  double before = 0.0, at = 0.0;
  std::size_t i = 0;
  for (; std::abs(values[i]) < std::abs(half); ++i) {
    before = values[i];
    at = times[i];
  }
  return at + (times[i] - at) * (half - before) / (values[i] - before);
}

/// True if a reading relaxes from a row on: the mean of its last quarter is clearly smaller.
bool relaxes(const std::vector<double>& values, std::size_t from) {
  constexpr double kClearly = 0.95;
  const std::size_t last = std::max<std::size_t>((values.size() - from) / 4, 1);
  const double sum =
      std::accumulate(values.end() - static_cast<std::ptrdiff_t>(last), values.end(), 0.0);
  return sum / static_cast<double>(last) / values[from] < kClearly;
}

}  // namespace

void keep_time_window(ImportedSeries& series, const std::string& file,
                      const ImportOptions& options) {
  if (!options.from_s && !options.until_s && !options.step_time_s) return;
  const ImportedColumn* time = time_of(series);
  if (time == nullptr) {
    throw bad_input(file, "no column is recognised as time",
                    "--from-time, --until and --step-time only with times (--time COLUMN)");
  }
  const std::vector<double>& times = time->values;
  const double to_si = time->unit.to_si;
  double from_s = options.from_s.value_or(times.front() * to_si);
  if (options.step_time_s) from_s = std::max(from_s, *options.step_time_s);
  // Times are compared in the unit of the file, in which they have few digits.
  constexpr double kRounding = 1e-9;
  const double tolerance = kRounding * std::abs(times.back());
  const auto begin = std::find_if(times.begin(), times.end(),
                                  [&](double t) { return t >= from_s / to_si - tolerance; });
  const auto end = std::find_if(begin, times.end(), [&](double t) {
    return options.until_s && t > *options.until_s / to_si + tolerance;
  });
  if (end - begin < 2) {
    throw bad_input(
        file,
        fmt::format("fewer than 2 samples in the chosen times; the file holds {} s to "
                    "{} s",
                    significant(times.front() * to_si, 6), significant(times.back() * to_si, 6)),
        "--from-time, --until and --step-time within these");
  }
  const auto first = static_cast<std::size_t>(begin - times.begin());
  const auto last = static_cast<std::size_t>(end - times.begin());
  const std::size_t all = times.size();
  for (ImportedColumn& column : series.columns) keep_rows(column.values, first, last);
  keep_rows(series.lines, first, last);
  if (first > 0 || last < all) {
    series.findings.push_back(
        ImportFinding::told_of("window", fmt::format("{} of {} samples", last - first, all)));
  }
  if (!options.step_time_s || *options.step_time_s == 0.0) return;
  for (ImportedColumn& column : series.columns) {
    if (column.quantity != Quantity::time) continue;
    for (double& value : column.values) value -= *options.step_time_s / to_si;
    column.shifted = true;
  }
  series.findings.push_back(
      ImportFinding::told_of("step", fmt::format("at {} s of the file, from which the times count",
                                                 significant(*options.step_time_s, 9))));
}

std::size_t resolve_kept_step(ImportedSeries& series, const ImportOptions& options) {
  const auto column = [&](Quantity quantity) {
    return std::find_if(series.columns.begin(), series.columns.end(), [&](const auto& c) {
      return c.quantity == quantity && c.bound == Bound::value;
    });
  };
  const auto time = column(Quantity::time);
  const auto strain = column(Quantity::strain);
  const auto stress = column(Quantity::stress);
  const auto end = series.columns.end();
  const bool sd =
      std::any_of(series.columns.begin(), end, [](const auto& c) { return c.bound == Bound::sd; });
  if (time == end || strain == end || stress == end || sd || time->values.front() < 0.0) return 0;
  const auto loaded = rows_before_kept(stress->values, time->values);
  const auto strained = rows_before_kept(strain->values, time->values);
  const std::size_t before = strained.value_or(0);
  // A strain that comes to rest may be an answer, too; a stress that does so always may be.
  const bool rises = strained && before > 0 && loaded != 0U && relaxes(stress->values, before);
  const bool relaxation = rises || strained == 0U;
  if (!relaxation && loaded != 0U) return 0;
  ImportedColumn& answer = relaxation ? *stress : *strain;
  const ImportedColumn& step = relaxation ? *strain : *stress;
  for (std::size_t i = 0; i < answer.values.size(); ++i) {
    answer.values[i] *= answer.unit.to_si / (step.values[i] * step.unit.to_si);
  }
  answer.quantity = relaxation ? Quantity::relaxation_modulus : Quantity::creep_compliance;
  const Dimension dimension = quantity_dimension(answer.quantity);
  answer.unit = parse_unit(si_symbol(dimension), dimension, {});
  answer.shifted = true;
  series.findings.push_back(ImportFinding::told_of(
      "converted", relaxation ? "stress over the strain that is kept, to a relaxation modulus; "
                                "the times count from the step"
                              : "strain over the stress that is kept, to a creep compliance; the "
                                "times count from the step"));
  const std::size_t rising = rises ? before : 0;
  const bool shifted = rising > 0 && !options.step_time_s;
  const double begin = shifted ? half_risen(step.values, time->values, rising) : 0.0;
  for (double& t : time->values) t -= begin;
  time->shifted = time->shifted || shifted;
  series.columns.erase(relaxation ? strain : stress);
  if (rising == 0) return 0;
  const std::size_t rows = series.columns.front().values.size();
  for (ImportedColumn& c : series.columns) keep_rows(c.values, rising, rows);
  keep_rows(series.lines, rising, rows);
  series.findings.push_back(ImportFinding::told_of(
      "left out", fmt::format("the first {} rows, in which the strain still rises{}", rising,
                              shifted ? "; the times count from half of the step" : "")));
  return rising;
}

void sort_shuffled_rows(ImportedSeries& series) {
  const ImportedColumn* time = time_of(series);
  if (time == nullptr || series.lines.empty() || !holds_step_response(series)) return;
  const std::vector<double>& times = time->values;
  std::size_t falls = 0;
  for (std::size_t i = 1; i < times.size(); ++i) falls += times[i] < times[i - 1] ? 1 : 0;
  constexpr std::size_t kRowsAFall = 4;  // specimens below each other fall less often
  if (falls == 0 || kRowsAFall * falls < times.size()) return;
  std::vector<std::size_t> order(times.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&times](std::size_t i) { return times[i]; });
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (times[order[i]] == times[order[i - 1]]) return;  // may be of two specimens
  }
  const auto sorted = [&order](const auto& values) {
    auto result = values;
    for (std::size_t i = 0; i < order.size(); ++i) result[i] = values[order[i]];
    return result;
  };
  series.lines = sorted(series.lines);
  for (ImportedColumn& column : series.columns) column.values = sorted(column.values);
  series.findings.push_back(
      ImportFinding::told_of("order", "the times stood in no order: rows sorted by them"));
}

void leave_out_zero_at_step(ImportedSeries& series) {
  constexpr std::size_t kFewest = 4;
  constexpr double kNearZero = 0.02;  // of the next reading: 0 and its noise
  const ImportedColumn* time = time_of(series);
  if (time == nullptr || !holds_step_response(series) || time->values.size() < kFewest) return;
  const auto answer = std::ranges::find_if(series.columns, [](const ImportedColumn& column) {
    return is_step_response(column.quantity) && column.bound == Bound::value;
  });
  const double first = answer->values[0], next = answer->values[1];
  const bool zero = time->values[0] == 0.0 && std::abs(first) <= kNearZero * next;
  if (!zero || !(time->values[1] > 0.0) || !(next > 0.0)) return;
  const std::string words = first == 0.0 ? std::string("the reading of 0 at 0 s")
                                         : fmt::format("the reading at 0 s ({} % of the next one)",
                                                       significant(100.0 * first / next, 2));
  const std::size_t rows = time->values.size();
  for (ImportedColumn& column : series.columns) keep_rows(column.values, 1, rows);
  keep_rows(series.lines, 1, rows);
  series.findings.push_back(
      ImportFinding::told_of("left out", words + ", taken as from before the step"));
}

bool counts_from_step(const std::vector<double>& times) {
  constexpr double kSteps = 2.0;  // of the sampling, after which a clock is late
  constexpr double kRounding = 1e-6;
  constexpr double kGeometric = 4.0;  // spread of the ratios of a rounded geometric progression
  if (times.size() < 2) return true;
  const double first_step = times[1] - times[0];
  if (times.front() <= kSteps * first_step * (1.0 + kRounding)) return true;
  std::vector<double> steps, ratios;
  for (std::size_t i = 1; i < times.size(); ++i) {
    steps.push_back(times[i] - times[i - 1]);
    ratios.push_back(steps.back() / times[i - 1]);
  }
  const double uniform = spread_of(std::move(steps)), geometric = spread_of(std::move(ratios));
  return geometric < kGeometric && geometric < uniform;
}

void require_step_clock(const ImportedSeries& series, const std::string& file,
                        const ImportOptions& options) {
  const bool step = holds_step_response(series);
  if (options.step_time_s) {
    if (step) return;
    throw bad_input(
        file, "holds no step: neither strain nor stress is kept from --step-time on",
        "--step-time only with G(t), J(t), or a strain or stress that is kept after it");
  }
  const ImportedColumn* time = time_of(series);
  if (!step || time == nullptr) return;
  std::vector<double> times = time->values;  // repeated readings have one
  times.erase(std::unique(times.begin(), times.end()), times.end());
  if (counts_from_step(times)) return;
  const double to_si = time->unit.to_si;
  throw bad_input(
      file,
      fmt::format("the first sample is {} s after the step, by a clock that ticks every {} s",
                  significant(times[0] * to_si, 6), significant((times[1] - times[0]) * to_si, 3)),
      fmt::format("--step-time with the time of the step on this clock, such as --step-time \"{} "
                  "s\"; --step-time \"0 s\" if it counts from the step",
                  significant((times[0] - (times[1] - times[0])) * to_si, 6)));
}

}  // namespace tpm::files
