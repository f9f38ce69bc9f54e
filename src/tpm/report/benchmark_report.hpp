#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tpm/benchmark/runner.hpp"
#include "tpm/report/document.hpp"
#include "tpm/report/figure.hpp"

namespace tpm {

/// What was run, and how.
struct BenchmarkRecord {
  std::vector<BenchmarkResult> results;
  BenchmarkOptions options;
};

/// One line per setting, failures included; SI units in the column names. Without times the columns
/// of wall time are left out, and two runs give the same bytes.
[[nodiscard]] std::string benchmark_csv(const BenchmarkResult& result, bool timing);

/// The same for a program (docs/benchmark.md lists the keys).
[[nodiscard]] Json to_json(const BenchmarkRecord& record);

/// For each problem error against wall time and, without times too, against counts. Settings that
/// fail stand in a band above the panel.
[[nodiscard]] std::vector<Figure> benchmark_figures(const BenchmarkRecord& record);

/// The setting of each curve that first meets an error, over all problems.
/// @param figures of benchmark_figures
[[nodiscard]] Document benchmark_document(const BenchmarkRecord& record,
                                          const std::vector<Figure>& figures);

/// The cheapest point of a curve whose error is at most `error`: by wall time, without times by
/// evaluations of forces; null if none.
[[nodiscard]] const BenchmarkPoint* cheapest_within(const BenchmarkResult& result,
                                                    const std::string& curve, double error);

/// The curves of a result in order of appearance.
[[nodiscard]] std::vector<std::string> curves_of(const BenchmarkResult& result);

/// "step 1 ms", "tolerance 1e-06"; empty for a method without settings.
[[nodiscard]] std::string setting_words(const BenchmarkPoint& point);

/// Writes report.md, report.html, benchmark.json, a CSV for each problem, figures.json and
/// figures/*.svg into `folder`, and report.run.json, which says when and where. Without times all
/// but the last are the same from run to run.
/// @param python from find_drawing_python()
/// @param seconds wall time of each problem
void write_benchmark(const BenchmarkRecord& record, const std::filesystem::path& folder,
                     const std::string& python, std::map<std::string, double> seconds);

}  // namespace tpm
