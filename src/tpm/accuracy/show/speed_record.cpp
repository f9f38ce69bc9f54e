#include "tpm/accuracy/show/speed_record.hpp"

#include <fmt/format.h>

#include "tpm/base/text.hpp"
#include "tpm/files/delimited.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/run_record.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {
namespace {

constexpr std::string_view kColumns =
    "work,commit,tpm_version,compiler,processor,finished_at_UTC,repeats,times_per_repeat,"
    "processor_median_s,processor_lower_quartile_s,processor_upper_quartile_s,processor_least_s,"
    "calibration_s,ratio\n";
constexpr int kSpeedDigits = 4;

Json row_json(const SpeedRow& row) {
  const auto seconds = [](double s) { return rounded(s, kSpeedDigits); };
  return {{"work", row.work},
          {"repeats", row.repeats},
          {"times_per_repeat", row.times_per_repeat},
          {"processor_median_s", seconds(row.median_s)},
          {"processor_lower_quartile_s", seconds(row.lower_quartile_s)},
          {"processor_upper_quartile_s", seconds(row.upper_quartile_s)},
          {"processor_least_s", seconds(row.least_s)},
          {"calibration_s", seconds(row.calibration_s)},
          {"ratio", seconds(row.ratio)}};
}

}  // namespace

void append_speed_record(const std::filesystem::path& file, const std::vector<SpeedRow>& rows,
                         const SpeedOrigin& origin) {
  std::string text(kColumns);
  if (std::filesystem::exists(file)) {
    text = read_file(file);
    if (!text.starts_with(kColumns)) {
      throw bad_input(file.string(), "no speed record of this version",
                      fmt::format("a first row {}", kColumns.substr(0, kColumns.size() - 1)));
    }
    if (!text.ends_with('\n')) text += '\n';
  }
  const Json run = run_record({});
  const auto word = [&](const char* key) { return quoted_field(run.at(key).get<std::string>()); };
  for (const SpeedRow& row : rows) {
    const auto seconds = [](double s) { return significant(s, kSpeedDigits); };
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", row.work,
                        quoted_field(origin.commit), word("tpm_version"), word("compiler"),
                        word("processor"), word("finished_at_UTC"), row.repeats,
                        row.times_per_repeat, seconds(row.median_s), seconds(row.lower_quartile_s),
                        seconds(row.upper_quartile_s), seconds(row.least_s),
                        seconds(row.calibration_s), seconds(row.ratio));
  }
  write_file(file, text);
}

Json speed_json(const std::vector<SpeedRow>& rows, const SpeedOrigin& origin) {
  return {
      {"commit", origin.commit}, {"run", run_record({})}, {"works", array_json(rows, row_json)}};
}

std::string speed_text(const std::vector<SpeedRow>& rows) {
  std::string text = fmt::format("{:<22} {:>12} {:>12} {:>12} {:>12}\n", "work", "median, ms",
                                 "quartiles", "", "to the loop");
  for (const SpeedRow& row : rows) {
    text += fmt::format("{:<22} {:>12} {:>12} {:>12} {:>12}\n", row.work,
                        significant(1e3 * row.median_s, kSpeedDigits),
                        significant(1e3 * row.lower_quartile_s, kSpeedDigits),
                        significant(1e3 * row.upper_quartile_s, kSpeedDigits),
                        significant(row.ratio, kSpeedDigits));
  }
  return text;
}

}  // namespace tpm::accuracy
