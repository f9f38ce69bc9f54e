#include "tpm/accuracy/show/benchmark_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/draw.hpp"
#include "tpmkit/units.hpp"

namespace tpm::accuracy {
namespace {

constexpr std::array<double, 4> kAims{1e-2, 1e-3, 1e-4, 1e-6};
constexpr std::array<double, 2> kServoPeriods_s{1e-3, 2.5e-4};

std::string seconds_words(double seconds) {
  const auto in = [&](double unit, const char* name) {
    return fmt::format("{} {}", significant(seconds / unit, 3), name);
  };
  if (seconds < 1e-6) return in(1e-9, "ns");
  if (seconds < 1e-3) return in(1e-6, "us");
  return seconds < 1.0 ? in(1e-3, "ms") : in(1.0, "s");
}

std::string percent_words(double error) {
  return fmt::format("{} %", significant(100.0 * error, 2));
}

double cost_of(const BenchmarkPoint& point) {
  return point.times ? point.times->median_s : static_cast<double>(point.work.rates);
}

std::string reference_words(const BenchmarkResult& result) {
  const BenchmarkReference& r = result.reference;
  const std::string peak =
      result.unit.empty() ? "the peak"
                          : fmt::format("the peak of {} {}", significant(r.peak, 4), result.unit);
  if (r.exact) {
    return fmt::format("Reference: {}, exact; {} differs from it by {} of {} and checks it.",
                       r.first.words, r.second.words, significant(r.agreement, 2), peak);
  }
  return fmt::format(
      "Reference: {}. {} checks that method itself; the two differ by {} of {}, so errors are told "
      "down to {}, ten times that.",
      r.first.words, r.second.words, significant(r.agreement, 2), peak, significant(r.floor, 2));
}

/// Cell of the cheapest point within an error: "36.7 us/s (400 us)".
std::string cheapest_words(const BenchmarkResult& result, const BenchmarkPoint& point) {
  const std::string cost =
      point.times ? fmt::format("{}/s", seconds_words(point.times->median_s / result.simulated_s))
                  : std::to_string(point.work.rates);
  if (point.parameter.empty()) return cost;
  return fmt::format(
      "{} ({})", cost,
      point.parameter == "step_s" ? seconds_words(point.value) : significant(point.value, 3));
}

/// Curves of which some setting completed; failure_table names the others.
Table aims_table(const BenchmarkResult& result, bool timing) {
  Table table{timing ? "Wall time per simulated second of the cheapest setting within an error"
                     : "Evaluations of the cheapest setting within an error",
              {{"method"}}};
  for (const double aim : kAims) table.columns.push_back({percent_words(aim), true});
  table.columns.push_back({"least error", true});
  for (const std::string& curve : curves_of(result)) {
    const BenchmarkPoint* best = nullptr;
    for (const BenchmarkPoint& p : result.points) {
      if (p.curve() != curve || p.failed()) continue;
      if (best == nullptr || p.error < best->error) best = &p;
    }
    if (best == nullptr) continue;
    std::vector<Cell> row{{curve}};
    const BenchmarkPoint* before = nullptr;
    for (const double aim : kAims) {
      const BenchmarkPoint* point = cheapest_within(result, curve, aim);
      if (point == nullptr) {
        row.push_back({"-", Tone::fair});
      } else {
        row.push_back({point == before ? "same" : cheapest_words(result, *point)});
      }
      before = point;
    }
    row.push_back({(best->below_floor ? "< " : "") + significant(best->error, 2)});
    table.rows.push_back(std::move(row));
  }
  return table;
}

const BenchmarkPoint* with_step(const BenchmarkResult& result, const std::string& curve,
                                double step_s) {
  for (const BenchmarkPoint& p : result.points) {
    if (p.curve() == curve && p.step_s && std::abs(*p.step_s - step_s) < 1e-9 * step_s) return &p;
  }
  return nullptr;
}

/// Adds the result of a method at one servo rate.
void add_servo_cells(std::vector<Cell>& row, const BenchmarkPoint* point, double period_s) {
  if (point == nullptr) {
    row.insert(row.end(), {{"-"}, {"-"}});
    return;
  }
  row.push_back(point->failed() ? Cell{spaced(point->end), Tone::bad}
                                : Cell{percent_words(point->error)});
  if (!point->times || point->failed() || point->work.steps == 0) {
    row.push_back({"-"});
    return;
  }
  const double step_s = point->step_times
                            ? point->step_times->p99_s
                            : point->times->median_s / static_cast<double>(point->work.steps);
  const bool fits = step_s <= period_s;
  row.push_back({fmt::format("{}{}", seconds_words(step_s), fits ? "" : ", too slow"),
                 fits ? Tone::good : Tone::bad});
}

Table servo_table(const BenchmarkResult& result) {
  Table table{"At servo rate: error, and wall time of a step",
              {{"method"},
               {"error at 1 kHz", true},
               {"a step", true},
               {"error at 4 kHz", true},
               {"a step", true}}};
  for (const std::string& curve : curves_of(result)) {
    std::vector<Cell> row{{curve}};
    bool any = false;
    for (const double period_s : kServoPeriods_s) {
      const BenchmarkPoint* point = with_step(result, curve, period_s);
      any = any || (point != nullptr && point->end != "not_applicable");
      add_servo_cells(row, point, period_s);
    }
    if (any) table.rows.push_back(std::move(row));
  }
  return table;
}

Table failure_table(const BenchmarkResult& result) {
  Table table{"What failed", {{"method"}, {"how"}, {"settings"}, {"reason of the first"}}};
  for (const std::string& curve : curves_of(result)) {
    std::vector<std::string> ends;
    for (const BenchmarkPoint& p : result.points) {
      const bool known = std::find(ends.begin(), ends.end(), p.end) != ends.end();
      if (p.curve() == curve && p.failed() && !known) ends.push_back(p.end);
    }
    for (const std::string& end : ends) {
      std::vector<std::string> settings;
      std::string reason;
      for (const BenchmarkPoint& p : result.points) {
        if (p.curve() != curve || p.end != end) continue;
        if (settings.empty()) reason = p.reason;
        settings.push_back(p.parameter.empty() ? "all" : setting_words(p));
      }
      const std::string from_to =
          settings.size() == 1
              ? settings.front()
              : fmt::format("{}: {} to {}", settings.size(), settings.front(), settings.back());
      table.rows.push_back({{curve}, {spaced(end), Tone::bad}, {from_to}, {reason}});
    }
  }
  return table;
}

std::string error_words(double error, bool below_floor) {
  return (below_floor ? "< " : "") + percent_words(error);
}

/// The worst of a curve over its settings.
struct WorstOf {
  bool failed = false, below_floor = true;
  double error = 0.0, median_s = 0.0, p99_s = 0.0, build_s = 0.0;
};

WorstOf worst_of(const BenchmarkResult& result, const std::string& curve) {
  WorstOf worst;
  for (const BenchmarkPoint& p : result.points) {
    if (p.curve() != curve) continue;
    worst.failed = worst.failed || p.failed();
    worst.below_floor = worst.below_floor && p.below_floor;
    worst.error = std::max(worst.error, p.error);
    worst.build_s = std::max(worst.build_s, p.build_s);
    if (!p.step_times) continue;
    worst.median_s = std::max(worst.median_s, p.step_times->median_s);
    worst.p99_s = std::max(worst.p99_s, p.step_times->p99_s);
  }
  return worst;
}

Cell against(double value, double target, const std::string& words,
             const std::string& target_words) {
  if (target == 0.0) return {words};
  return {fmt::format("{} (at most {})", words, target_words),
          value <= target ? Tone::good : Tone::bad};
}

/// The largest error and times of each model over its relaxation times.
Table targets_table(const BenchmarkResult& result, bool timing) {
  Table table{"The largest over all relaxation times, and what is asked for",
              {{"model"}, {"error", true}}};
  if (timing) {
    for (const char* title : {"a step, median", "a step, 99th percentile", "built in"}) {
      table.columns.push_back({title, true});
    }
  }
  for (const std::string& curve : curves_of(result)) {
    const WorstOf worst = worst_of(result, curve);
    const auto named = std::ranges::find(result.targets, curve, &BenchmarkTarget::curve);
    const BenchmarkTarget target = named == result.targets.end() ? BenchmarkTarget{} : *named;
    std::vector<Cell> row{{curve}};
    row.push_back(worst.failed ? Cell{"fails", Tone::bad}
                               : against(worst.error, target.error,
                                         error_words(worst.error, worst.below_floor),
                                         percent_words(target.error)));
    const auto add = [&](double value_s, double most_s) {
      row.push_back(against(value_s, most_s, seconds_words(value_s), seconds_words(most_s)));
    };
    if (timing) {
      add(worst.median_s, target.step_median_s);
      add(worst.p99_s, target.step_p99_s);
      add(worst.build_s, target.build_s);
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// One column for each setting that any curve has.
Table settings_table(const BenchmarkResult& result, const std::string& caption,
                     const std::function<std::string(const BenchmarkPoint&)>& words) {
  Table table{caption, {{"model"}}};
  std::vector<double> values;
  for (const BenchmarkPoint& p : result.points) {
    if (std::find(values.begin(), values.end(), p.value) != values.end()) continue;
    values.push_back(p.value);
    table.columns.push_back({setting_words(p), true});
  }
  for (const std::string& curve : curves_of(result)) {
    std::vector<Cell> row(1 + values.size(), Cell{"-"});
    row.front() = {curve};
    bool any = false;
    for (const BenchmarkPoint& p : result.points) {
      const std::string text = p.curve() == curve ? words(p) : "";
      if (text.empty()) continue;
      const auto place = std::find(values.begin(), values.end(), p.value) - values.begin();
      row[1 + static_cast<std::size_t>(place)] = {text};
      any = true;
    }
    if (any) table.rows.push_back(std::move(row));
  }
  return table;
}

/// Of a problem with targets: errors, times, and what the models claim of their errors.
void add_model_tables(Document& document, const BenchmarkResult& result, bool timing) {
  document.table(targets_table(result, timing));
  document.table(
      settings_table(result, "Error at each relaxation time",
                     [](const BenchmarkPoint& p) { return error_words(p.error, p.below_floor); }));
  document.table(settings_table(
      result,
      "Claimed over true error: the median over all times of comparison, and how often the claim "
      "was not less than the error",
      [](const BenchmarkPoint& p) {
        return p.claims ? fmt::format("{}; {} %", significant(p.claims->median, 2),
                                      significant(100.0 * p.claims->covered, 3))
                        : std::string();
      }));
}

/// Adds the captions of the figures of all problems once, without missing figures.
void add_captions(Document& document, const std::vector<Figure>& figures) {
  std::vector<Cell> items;
  for (const bool counts : {false, true}) {
    const Figure* longest = nullptr;
    for (const Figure& figure : figures) {
      if (figure.id.ends_with("_counts") != counts) continue;
      if (longest == nullptr || figure.caption.size() > longest->caption.size()) longest = &figure;
    }
    if (longest != nullptr) {
      items.push_back(
          {fmt::format("Error against {}. {}", counts ? "work" : "wall time", longest->caption)});
    }
  }
  if (!items.empty()) document.bullets(std::move(items));
}

void add_pictures(Document& document, const std::vector<Figure>& figures, const std::string& id) {
  for (const Figure& figure : figures) {
    if (figure.id == id || figure.id == id + "_counts") {
      document.picture({figure.id, figure.title, ""});
    }
  }
}

std::string introduction(const BenchmarkOptions& options) {
  std::string text =
      "Every method at many settings on named problems. The error is the largest absolute "
      "difference "
      "of the response to the reference over the protocol, divided by the largest response; 1 % is "
      "1e-2 in the charts. No method is its own reference. In a table the step or the tolerance of "
      "a "
      "setting stands in parentheses; 'same': the setting to the left meets this error, too. Every "
      "setting of a problem stands in the CSV file of its name.";
  if (!options.timing) return text + " Made with `--no-timing`: counts, and no clock.";
  return text + fmt::format(
                    " Wall times are medians of {} repeats of each setting that completes, on one "
                    "thread, with the model set up beforehand; runs below {} are repeated within a "
                    "repeat. A setting that failed was run once. The machine is in "
                    "`report.run.json`.",
                    options.repeats, seconds_words(options.least_repeat_s));
}

/// The setting of each curve that first meets an error, over all problems.
/// @param figures of benchmark_figures
Document benchmark_document(const BenchmarkRecord& record, const std::vector<Figure>& figures) {
  Document document{"Speed against accuracy", "What `tpm accuracy benchmark` measured"};
  document.paragraph(introduction(record.options));
  add_captions(document, figures);
  for (const BenchmarkResult& result : record.results) {
    document.heading(2, fmt::format("{} (`{}`)", result.title, result.name));
    document.paragraph(result.text);
    document.paragraph(reference_words(result));
    add_pictures(document, figures, result.name);
    if (result.targets.empty()) {
      document.table(aims_table(result, record.options.timing));
      Table servo = servo_table(result);
      if (!servo.rows.empty()) document.table(std::move(servo));
    } else {
      add_model_tables(document, result, record.options.timing);
    }
    Table failures = failure_table(result);
    if (!failures.rows.empty()) document.table(std::move(failures));
  }
  typeset(document);
  return document;
}

}  // namespace

std::vector<std::string> curves_of(const BenchmarkResult& result) {
  return each_once(result.points, &BenchmarkPoint::curve);
}

std::string setting_words(const BenchmarkPoint& point) {
  if (point.parameter == "step_s") return fmt::format("step {}", seconds_words(point.value));
  if (point.parameter == "relaxation_time_s") {
    return fmt::format("relaxing in {}", seconds_words(point.value));
  }
  if (point.parameter.empty()) return "";
  return fmt::format("{} {}", point.parameter, significant(point.value, 3));
}

const BenchmarkPoint* cheapest_within(const BenchmarkResult& result, const std::string& curve,
                                      double error) {
  const BenchmarkPoint* cheapest = nullptr;
  for (const BenchmarkPoint& p : result.points) {
    if (p.curve() != curve || p.failed() || p.error > error) continue;
    if (cheapest == nullptr || cost_of(p) < cost_of(*cheapest)) cheapest = &p;
  }
  return cheapest;
}

void write_benchmark(const BenchmarkRecord& record, const std::filesystem::path& folder,
                     const std::string& python) {
  for (const BenchmarkResult& result : record.results) {
    write_file(folder / (result.name + ".csv"), benchmark_csv(result, record.options.timing));
  }
  write_file(folder / "benchmark.json", to_text(to_json(record)));
  std::filesystem::remove(folder / kBenchmarkPart);
  const std::vector<Figure> figures = benchmark_figures(record);
  write_report(folder, benchmark_document(record, figures), figures, python, {},
               Json{{"problems", record.runs}});
}

}  // namespace tpm::accuracy
