#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tpm/accuracy/runner.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpm/show/document.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::accuracy {

/// Problems that were run, and settings of the runs.
struct BenchmarkRecord {
  std::vector<BenchmarkResult> results;
  BenchmarkOptions options;
  std::map<std::string, Json> runs;  ///< of each problem when, where and how long; with times only
};

/// One line per setting, failures included; SI units in the column names. Without times the columns
/// of wall time are left out, and two runs give the same bytes.
[[nodiscard]] std::string benchmark_csv(const BenchmarkResult& result, bool timing);

/// The same for a program (docs/accuracy.md lists the keys).
[[nodiscard]] Json to_json(const BenchmarkRecord& record);

/// Keys that such a record may hold.
[[nodiscard]] const FileKind& benchmark_kind();

/// The problems that are there already, and what has to be run to have them all.
struct KeptBenchmark {
  BenchmarkRecord record;
  std::vector<BenchmarkEntry> missing;
};

/// Takes from a folder what an earlier run has left there: of one that was interrupted
/// kBenchmarkPart, else benchmark.json; nothing if neither is there.
/// @param named problems that are run in any case; none: those that are not there
/// Throws Error(usage) if they were run with other options, Error(input) where the file is not what
/// to_json writes.
[[nodiscard]] KeptBenchmark keep_benchmark(const std::filesystem::path& folder,
                                           const BenchmarkOptions& options,
                                           std::span<const std::string> named);

/// Measurements so far, in the folder of a run that goes on.
inline constexpr const char* kBenchmarkPart = "benchmark.part.json";

/// Adds a result, or puts it in the place of an earlier one, in the order of benchmark_entries().
void put_result(BenchmarkRecord& record, BenchmarkResult result, Json run);

/// For each problem error against wall time and, without times too, against counts. Settings that
/// fail stand in a band above the panel.
[[nodiscard]] std::vector<Figure> benchmark_figures(const BenchmarkRecord& record);

/// The cheapest point of a curve whose error is at most `error`: by wall time, without times by
/// evaluations of forces; null if none.
[[nodiscard]] const BenchmarkPoint* cheapest_within(const BenchmarkResult& result,
                                                    const std::string& curve, double error);

/// The curves of a result in order of appearance.
[[nodiscard]] std::vector<std::string> curves_of(const BenchmarkResult& result);

/// "step 1 ms", "tolerance 1e-06"; empty for a method without settings.
[[nodiscard]] std::string setting_words(const BenchmarkPoint& point);

/// Writes report.md, report.html, benchmark.json, a CSV for each problem, figures.json and
/// figures/*.{svg,pdf} into `folder`, and report.run.json, which says when and where. Without times
/// all but the last are the same from run to run.
/// @param python from find_drawing_python()
void write_benchmark(const BenchmarkRecord& record, const std::filesystem::path& folder,
                     const std::string& python);

}  // namespace tpm::accuracy
