// tpm sweep: many experiments over the combinations of parameters that a file asks for.
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "interrupt_watch.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/show/run_record.hpp"
#include "tpm/sweep/sweep_ranks.hpp"
#include "tpm/sweep/sweep_reader.hpp"
#include "tpm/sweep/sweep_result.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace fs = std::filesystem;
namespace {

struct SweepChoice {
  std::string sweep;
  std::string output = "sweep.h5";
  std::string workers;
  std::string shard;                ///< "2/8"
  std::vector<std::string> shards;  ///< of merge: files
};

/// "results.h5" becomes "results.run.json".
fs::path beside(const fs::path& file, const char* ending) {
  fs::path other = file;
  return other.replace_extension(ending);
}

/// The end of a sweep: files, and the time of the HDF5 file alone.
struct WrittenSweep {
  CellTally tally;
  std::vector<std::string> files;
  double seconds = 0.0, cpu_seconds = 0.0;
};

void say_note(const std::string& text) {
  tell_user("tpm: {}\n", text);
}

/// @param ranks none: this process alone
SweepRun run_watched(const Sweep& sweep, BlockLog& log, SweepControls controls,
                     SweepRanks* ranks = nullptr) {
  const InterruptWatch interrupts;
  std::optional<Progress> progress;
  std::uint64_t before = 0;
  controls.progress = [&](std::uint64_t done, std::uint64_t blocks) {
    if (!progress) {
      progress.emplace("blocks of the sweep", blocks, done);
    } else {
      progress->advance(done - before);
    }
    before = done;
  };
  controls.interrupted = InterruptWatch::seen;
  return ranks != nullptr ? ranks->run(sweep, log, controls) : run_sweep(sweep, log, controls);
}

Json tally_json(const Sweep& sweep, const CellTally& tally) {
  return {{"cells", sweep.cells()},
          {"done", tally.done},
          {"skipped", tally.skipped},
          {"failed", tally.failed},
          {"reasons", tally.reasons}};
}

/// Wall times and what else changes from run to run.
Json sidecar(const Sweep& sweep, const SweepRun& run, const WrittenSweep& written) {
  Json record = run_record({{"computing", run.seconds}, {"writing", written.seconds}});
  record["workers"] = run.workers;
  record["blocks"] = run.blocks;
  record["blocks_found_in_the_log"] = run.resumed_blocks;
  record["cells_of_a_block"] = sweep.block_cells;
  record["cpu_seconds"] = {{"computing", rounded(run.cpu_seconds, 3)},
                           {"writing", rounded(written.cpu_seconds, 3)}};
  const double whole = run.cpu_seconds + written.cpu_seconds;
  if (run.resumed_blocks == 0 && whole > 0.0) {
    record["cells_per_cpu_second"] = rounded(static_cast<double>(run.cells) / whole, 3);
  }
  return record;
}

int stopped(BlockLog& log) {
  log.sync();
  tell_user("tpm: stopped; what was computed is in {}: the same command goes on\n",
            log.path().string());
  return InterruptWatch::exit_code();
}

WrittenSweep write_results(const Sweep& sweep, const SweepRun& run,
                           const std::vector<const BlockLog*>& logs, const fs::path& output,
                           int workers = 0) {
  WrittenSweep written;
  std::map<std::string, double> seconds;
  const std::clock_t cpu_start = std::clock();
  written.tally =
      timed(seconds, "writing", [&] { return write_sweep(sweep, logs, output, workers); });
  written.cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  written.seconds = seconds["writing"];
  written.files.push_back(output.string());
  if (write_sweep_csv(sweep, logs, beside(output, ".csv"))) {
    written.files.push_back(beside(output, ".csv").string());
  }
  write_file(beside(output, ".run.json"), to_text(sidecar(sweep, run, written)));
  written.files.push_back(beside(output, ".run.json").string());
  return written;
}

/// The command that looks at the results, or why cells have none.
std::string next_of_sweep(const CellTally& tally, const std::string& file) {
  return tally.done > 0 ? fmt::format("tpm sweep plot {}", shell_word(file))
                        : fmt::format("tpm sweep show {}", shell_word(file));
}

/// @param files  that were written: none if the results stood there already
/// @returns the exit code: a sweep of which no cell has an answer has none either
int print_results(const Sweep& sweep, const CellTally& tally, const fs::path& output,
                  const std::vector<std::string>& files, const Session& session) {
  std::string text = fmt::format("{} cells: {} done, {} skipped, {} failed\n", sweep.cells(),
                                 tally.done, tally.skipped, tally.failed);
  constexpr std::size_t kShown = 5;
  for (std::size_t i = 0; i < std::min(kShown, tally.reasons.size()); ++i) {
    text += fmt::format("- {}\n", printable(tally.reasons[i], 160));
  }
  if (tally.reasons.size() > kShown) {
    text += fmt::format("- and {} more reasons: /reasons\n", tally.reasons.size() - kShown);
  }
  say_with_files(session, tally_json(sweep, tally), text, files,
                 next_of_sweep(tally, output.string()));
  return exit_code(tally.done > 0 || tally.failed == 0);
}

/// "2/8": the second of eight.
Shard parse_shard(const std::string& text) {
  const std::size_t stroke = text.find('/');
  if (stroke == std::string::npos) {
    throw Error(ExitCode::usage, "--shard", fmt::format("'{}'", printable(text)),
                "I/N, the I-th of N, from 1 on");
  }
  const std::uint64_t index = parse_whole_number(text.substr(0, stroke), "--shard", 1);
  const std::uint64_t count = parse_whole_number(text.substr(stroke + 1), "--shard", 1);
  if (index <= count) return {index - 1, count};
  throw Error(ExitCode::usage, "--shard", fmt::format("part {} of {}", index, count),
              "I/N with I up to N");
}

fs::path shard_path(const fs::path& output, const Shard& shard) {
  return fmt::format("{}.shard-{}-of-{}", output.string(), shard.index + 1, shard.count);
}

/// "3-of-8": what follows the beginning of a shard's name. A file that another task is just writing
/// has a temporary name, with more behind it.
bool names_a_shard(std::string_view numbers) {
  const std::size_t between = numbers.find("-of-");
  if (between == std::string_view::npos) return false;
  const auto is_number = [](std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  };
  return is_number(numbers.substr(0, between)) && is_number(numbers.substr(between + 4));
}

/// Every file beside the output that is named as its shards are.
std::vector<std::string> shards_beside(const fs::path& output) {
  const std::string begin = output.filename().string() + ".shard-";
  const fs::path folder = output.parent_path();
  std::vector<std::string> files;
  std::error_code ec;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, ec)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(begin) && names_a_shard(std::string_view(name).substr(begin.size()))) {
      files.push_back((folder / name).string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Tasks of an array that are submitted again alone must cut the sweep as the first submission did:
/// the files that stand beside the output say into how many.
void require_same_count(const fs::path& output, const Shard& shard) {
  const std::string ending = fmt::format("-of-{}", shard.count);
  for (const std::string& file : shards_beside(output)) {
    if (file.ends_with(ending)) continue;
    throw Error(ExitCode::usage, fmt::format("--shard {}/{}", shard.index + 1, shard.count),
                fmt::format("{} is a shard of another number of shards", file),
                "the same number for all, or that file removed");
  }
}

/// The next shard, or their merging.
std::string next_of_shard(const Shard& shard, const std::string& sweep_file,
                          const fs::path& output) {
  const std::string words = shell_word(sweep_file), into = shell_word(output.string());
  if (shard.index + 1 == shard.count) return fmt::format("tpm sweep merge {} -o {}", words, into);
  return fmt::format("tpm sweep {} --shard {}/{} -o {}", words, shard.index + 2, shard.count, into);
}

int run_shard(const Sweep& sweep, const std::string& sweep_file, const fs::path& output,
              SweepControls controls, const Session& session) {
  require_same_count(output, controls.shard);
  const fs::path file = shard_path(output, controls.shard);
  will_write({file.string() + ".run.json"}, session.output_naming);
  const Shard shard = controls.shard;
  BlockLog log(file, sweep, say_note);
  const SweepRun run = run_watched(sweep, log, std::move(controls));
  if (run.interrupted) return stopped(log);
  log.sync();
  write_file(file.string() + ".run.json", to_text(sidecar(sweep, run, {})));
  const std::string next = next_of_shard(shard, sweep_file, output);
  if (session.json()) {
    Json json{{"file", file.string()}, {"blocks", run.blocks}};
    add_end(json, {}, {file.string(), file.string() + ".run.json"}, next);
    say("{}", answer_text(session, std::move(json)));
  } else {
    say("shard {} of {}: {} of {} blocks in {}\n{}", shard.index + 1, shard.count, run.blocks,
        sweep.blocks(), file.string(), next_line(next));
  }
  return 0;
}

/// All files that a sweep writes, before the first is read.
void announce_files(const fs::path& output, Naming naming) {
  for (const char* ending : {".csv", ".run.json"}) {
    const fs::path other = beside(output, ending);
    if (other == output) {
      throw Error(ExitCode::usage, "-o " + output.string(),
                  fmt::format("{} goes beside it", other.string()),
                  "a name that leaves that one free, such as results.h5");
    }
    will_write({other}, naming);
  }
}

/// Puts shards together.
int merge(const SweepChoice& choice, const Session& session) {
  const fs::path output = choice.output;
  announce_files(output, session.output_naming);
  const Sweep sweep = read_sweep(choice.sweep);
  const auto files = choice.shards.empty() ? shards_beside(output) : choice.shards;
  if (files.empty()) {
    throw bad_input(output.string(), "no shards beside it", "files of tpm sweep --shard I/N");
  }
  std::vector<BlockLog> logs;
  logs.reserve(files.size());
  for (const std::string& file : files) logs.push_back(BlockLog::to_read(file, sweep, say_note));
  std::vector<const BlockLog*> all;
  all.reserve(logs.size());
  SweepRun run;
  run.blocks = sweep.blocks();
  for (const BlockLog& log : logs) {
    all.push_back(&log);
    run.resumed_blocks += log.size();
  }
  std::uint64_t missing = 0;
  for (std::uint64_t b = 0; b < sweep.blocks(); ++b) {
    missing += std::ranges::none_of(logs, [b](auto& log) { return log.has(b); }) ? 1 : 0;
  }
  if (missing > 0) {
    throw bad_input(output.string(),
                    fmt::format("{} of {} blocks are in none of {} shards", missing, sweep.blocks(),
                                logs.size()),
                    "all shards, each run to its end");
  }
  const WrittenSweep written = write_results(sweep, run, all, output);
  return print_results(sweep, written.tally, output, written.files, session);
}

int run_command(const SweepChoice& choice, const Session& session) {
  if (choice.sweep.empty()) {
    throw Error(ExitCode::usage, "sweep", "no file",
                "tpm sweep SWEEP.json, or merge, show, plot, sensitivity, convergence, best");
  }
  const std::unique_ptr<SweepRanks> ranks = SweepRanks::of_this_run();
  const fs::path output = choice.output, log_file = log_path(output);
  announce_files(output, session.output_naming);
  const Sweep sweep = read_sweep(choice.sweep);
  if (ranks && !ranks->first()) {
    const InterruptWatch until_sent_home;
    ranks->serve(sweep);
    return 0;
  }
  will_update({output});  // a result that stands already is asked which sweep it holds
  // A log beside the result: a run was killed before all files were written.
  if (choice.shard.empty() && !fs::exists(log_file)) {
    if (fingerprint_of(output) == sweep.fingerprint) {
      tell_user("tpm: {} holds this sweep already\n", output.string());
      return print_results(sweep, SweepReader(output).tally(), output, {}, session);
    }
  }
  require_replaceable(output);
  SweepControls controls;
  if (!choice.workers.empty()) {
    constexpr std::uint64_t kMostWorkers = 1024;
    controls.workers =
        static_cast<int>(parse_whole_number(choice.workers, "--workers", 1, kMostWorkers));
  }
  if (!choice.shard.empty()) {
    if (ranks) {
      throw Error(ExitCode::usage, "--shard", "under mpirun", "one way of sharing the work");
    }
    controls.shard = parse_shard(choice.shard);
    return run_shard(sweep, choice.sweep, output, std::move(controls), session);
  }
  const int workers = controls.workers;
  BlockLog log(log_file, sweep, say_note);
  const SweepRun run = run_watched(sweep, log, std::move(controls), ranks.get());
  if (run.interrupted) return stopped(log);
  const WrittenSweep written = write_results(sweep, run, {&log}, output, workers);
  fs::remove(log_file);
  return print_results(sweep, written.tally, output, written.files, session);
}

}  // namespace

void add_sweep_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("sweep", "Many experiments over combinations of parameters; one HDF5");
  auto choice = std::make_shared<SweepChoice>();
  command->add_option("SWEEP", choice->sweep, "JSON sweep (schemas/sweep.schema.json)");
  command
      ->add_option("-o,--output", choice->output,
                   "File to write (HDF5); CSV and times go beside it")
      ->capture_default_str();
  command->add_option("--workers", choice->workers, "Threads, 1 to 1024 (default: all processors)");
  command->add_option("--shard", choice->shard,
                      "Part to compute, I/N: the I-th of N, into a file of its own for merge");
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm sweep configs/sweep_x_depth.json -o sweep.h5\n"
      "A stopped or killed sweep goes on where it was when the same command is given again.");
  CLI::App* merging = command->add_subcommand("merge", "Put the shards of a sweep together");
  merging->add_option("SWEEP", choice->sweep, "JSON sweep")->required();
  merging->add_option("SHARD", choice->shards,
                      "Files of shards (default: those beside the output)");
  merging
      ->add_option("-o,--output", choice->output,
                   "File to write (HDF5), as it was given to the shards")
      ->capture_default_str();
  add_format_option(*merging, session);
  merging->footer(
      "Example:\n  tpm sweep configs/sweep_x_depth.json --shard 1/2 -o sweep.h5\n"
      "  tpm sweep configs/sweep_x_depth.json --shard 2/2 -o sweep.h5\n"
      "  tpm sweep merge configs/sweep_x_depth.json -o sweep.h5");
  set_run(*merging, session, [choice, &session] { return merge(*choice, session); });
  add_sweep_views(*command, session);
  command->callback([command, choice, &session] {
    if (!command->get_subcommands().empty()) return;
    session.run = [choice, &session] { return run_command(*choice, session); };
  });
}

}  // namespace tpm::app
