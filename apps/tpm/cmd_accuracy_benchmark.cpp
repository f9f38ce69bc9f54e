// tpm accuracy benchmark: error against cost of every method on named problems.

#include <chrono>
#include <filesystem>
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "tpm/accuracy/runner.hpp"
#include "tpm/accuracy/show/benchmark_report.hpp"
#include "tpm/accuracy/show/speed_record.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/writable.hpp"
#include "tpm/haptics/show/formulation_list.hpp"
#include "tpm/show/draw.hpp"
#include "tpm/show/run_record.hpp"
#include "tpm/work/progress.hpp"

namespace tpm::app {
namespace {

struct BenchmarkChoice {
  std::vector<std::string> problems;
  std::string folder = "out/accuracy";
  std::string repeats = "20";
  bool no_timing = false;
  bool keep = false;
  bool list = false;
  std::string record;
  std::string commit = "unknown";
};

/// Says names and summaries as text, or returns them for JSON.
Json list_entries(const auto& entries, int width, const Session& session) {
  Json json = Json::array();
  for (const auto& entry : entries) {
    json.push_back({{"name", entry.name}, {"summary", entry.summary}});
    if (!session.json()) say("{:<{}} {}\n", entry.name, width, entry.summary);
  }
  return json;
}

int list_problems(const Session& session) {
  Json json = list_entries(benchmark_entries(), 18, session);
  if (session.json()) {
    say("{}", answer_text(session, Json{{"problems", std::move(json)},
                                        {"formulations", formulations_json()}}));
  } else {
    say("\nFormulations:\n{}", formulations_text());
  }
  return 0;
}

/// A line for each problem: which method is the cheapest within 1 %, and how much failed.
void print_summary(const BenchmarkRecord& record) {
  constexpr double kAim = 1e-2;
  for (const BenchmarkResult& result : record.results) {
    const BenchmarkPoint* best = nullptr;
    std::size_t failed = 0;
    for (const BenchmarkPoint& p : result.points) failed += p.failed() ? 1 : 0;
    for (const std::string& curve : curves_of(result)) {
      const BenchmarkPoint* point = cheapest_within(result, curve, kAim);
      if (point == nullptr || !point->times) continue;
      if (best == nullptr || point->times->median_s < best->times->median_s) best = point;
    }
    say("{}: {} settings, {} failed; reference known to {}", result.name, result.points.size(),
        failed, significant(result.reference.floor, 2));
    if (best != nullptr) {
      const std::string setting = setting_words(*best);
      say("; cheapest within 1 %: {}{}, {} ms", best->curve(),
          setting.empty() ? "" : " (" + setting + ")", significant(1e3 * best->times->median_s, 3));
    }
    say("\n");
  }
}

int list_works(const Session& session) {
  Json json = list_entries(speed_works(), 22, session);
  if (session.json()) say("{}", answer_text(session, Json{{"works", std::move(json)}}));
  return 0;
}

/// Measures named pieces of work by processor time, and appends them to a file.
int record_speed(const BenchmarkChoice& choice, const Session& session) {
  if (choice.list) return list_works(session);
  if (choice.no_timing || choice.keep) {
    throw Error(ExitCode::usage, "--append-to", "with --no-timing or --keep", "neither of them");
  }
  SpeedOptions options;
  options.repeats = static_cast<int>(parse_whole_number(choice.repeats, "--repetitions", 1));
  const std::vector<SpeedWork> works = chosen_speed_works(choice.problems);
  will_update({choice.record});
  Progress progress("measuring", works.size() * static_cast<std::size_t>(options.repeats));
  const std::vector<SpeedRow> rows = measure_speed(works, options, [&] { progress.advance(); });
  const SpeedOrigin origin{choice.commit};
  append_speed_record(choice.record, rows, origin);
  if (session.json()) {
    Json json = speed_json(rows, origin);
    add_end(json, {}, {choice.record}, {});
    say("{}", answer_text(session, std::move(json)));
    return 0;
  }
  say("{}appended to {}\n", speed_text(rows), choice.record);
  return 0;
}

int benchmark(const BenchmarkChoice& choice, const Session& session) {
  if (!choice.record.empty()) return record_speed(choice, session);
  if (choice.list) return list_problems(session);
  BenchmarkRecord record;
  record.options.repeats = static_cast<int>(parse_whole_number(choice.repeats, "--repetitions", 1));
  record.options.timing = !choice.no_timing;
  std::vector<BenchmarkEntry> entries = chosen_benchmarks(choice.problems);
  const std::string python = find_drawing_python();  // before minutes of work, not after
  will_write_into(choice.folder, {"report.html", "report.md", "figures.json"},
                  session.folder_naming());
  require_writable_folder(choice.folder);
  const std::filesystem::path part = std::filesystem::path(choice.folder) / kBenchmarkPart;
  will_update({part, std::filesystem::path(choice.folder) / "benchmark.json"});
  if (choice.keep) {
    KeptBenchmark kept = keep_benchmark(choice.folder, record.options, choice.problems);
    record = std::move(kept.record);
    entries = std::move(kept.missing);
  }
  for (const BenchmarkEntry& entry : entries) {
    const auto start = std::chrono::steady_clock::now();
    const BenchmarkProblem problem = entry.make();
    Progress progress(std::string(entry.name), problem.settings.size());
    BenchmarkResult result = run_benchmark(problem, record.options, [&] { progress.advance(); });
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    put_result(record, std::move(result), run_record({{problem.name, took.count()}}));
    write_file(part, to_text(to_json(record)));
  }
  write_benchmark(record, choice.folder, python);
  const std::string next = next_of_pictures(choice.folder);
  if (session.json()) {
    std::vector<std::string> files{"report.html", "report.md", "benchmark.json"};
    for (const BenchmarkResult& result : record.results) files.push_back(result.name + ".csv");
    files.emplace_back(python.empty() ? "figures.json" : "figures");
    Json json = to_json(record);
    add_end(json, choice.folder, files, next);
    say("{}", answer_text(session, std::move(json)));
    return 0;
  }
  print_summary(record);
  say("written to {}: report.html, report.md, benchmark.json, a CSV for each problem, "
      "{}\n{}",
      choice.folder, python.empty() ? "figures.json" : "figures", next_line(next));
  return 0;
}

}  // namespace

void add_benchmark_command(CLI::App& accuracy, Session& session) {
  CLI::App* command = accuracy.add_subcommand(
      "benchmark", "Error against cost of every method at many settings, on named problems");
  auto choice = std::make_shared<BenchmarkChoice>();
  command->add_option("PROBLEM", choice->problems, "Names of problems (default: all; see --list)");
  add_folder_option(*command, choice->folder)->capture_default_str();
  command
      ->add_option("--repetitions", choice->repeats,
                   "Number of repetitions: runs of each setting that completes")
      ->capture_default_str();
  command->add_flag("--no-timing", choice->no_timing,
                    "Errors and counts only, each run once: the same bytes from run to run");
  command->add_flag("--keep", choice->keep,
                    "Keep what the folder holds: run the problems that are missing there, or those "
                    "named; resumes an interrupted run");
  command->add_flag("--list", choice->list,
                    "List what can be named, and do nothing: problems and formulations, with "
                    "--append-to the pieces of work");
  command->add_option("--append-to", choice->record,
                      "CSV file to append to: instead, measure named pieces of work (all, or those "
                      "given in place of problems) by processor time, a row for each");
  command
      ->add_option("--commit", choice->commit,
                   "Commit that the program was built from: with --append-to")
      ->capture_default_str();
  add_format_option(*command, session);
  command->footer(
      "Run it on an otherwise idle machine. Example:\n"
      "  tpm accuracy benchmark --folder reports/accuracy\n"
      "  tpm accuracy benchmark --folder reports/accuracy --keep\n"
      "  tpm accuracy benchmark bond_paper organ_poke --repetitions 50\n"
      "  tpm accuracy benchmark --append-to speed.csv --commit $(git rev-parse --short HEAD)");
  set_run(*command, session, [choice, &session] { return benchmark(*choice, session); });
}

}  // namespace tpm::app
