#include "tpm/accuracy/show/speed_record.hpp"

#include <fmt/format.h>

#include "tpm/base/lists.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/result_table.hpp"
#include "tpm/show/run_record.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {
namespace {

const ResultTable<SpeedRow>& speed_table() {
  using Row = SpeedRow;
  using Of = ResultColumn<Row>;
  constexpr double kMilli = 1e-3;
  constexpr int kDigits = 4, kWidth = 12;
  static const ResultTable<Row> table(
      {Of("work", &Row::work).shown("work", -22), Of("repeats", &Row::repeats),
       Of("times_per_repeat", &Row::times_per_repeat),
       Of("processor_median_s", &Row::median_s, kDigits).shown("median, ms", kWidth, kMilli),
       Of("processor_lower_quartile_s", &Row::lower_quartile_s, kDigits)
           .shown("quartiles", kWidth, kMilli),
       Of("processor_upper_quartile_s", &Row::upper_quartile_s, kDigits).shown("", kWidth, kMilli),
       Of("processor_least_s", &Row::least_s, kDigits),
       Of("calibration_s", &Row::calibration_s, kDigits),
       Of("ratio", &Row::ratio, kDigits).shown("to the loop", kWidth)});
  return table;
}

}  // namespace

void append_speed_record(const std::filesystem::path& file, const std::vector<SpeedRow>& rows,
                         const SpeedOrigin& origin) {
  const auto with_origin = [](std::vector<std::string> cells, const std::vector<std::string>& of) {
    cells.insert(cells.begin() + 1, of.begin(), of.end());
    return csv_line(cells);
  };
  const std::vector<std::string> origin_keys{"commit", "tpm_version", "compiler", "processor",
                                             "finished_at_UTC"};
  const std::string head = with_origin(speed_table().keys(), origin_keys);
  std::string text = head;
  if (std::filesystem::exists(file)) {
    text = read_file(file);
    if (!text.starts_with(head)) {
      throw bad_input(file.string(), "no speed record of this version",
                      fmt::format("a first row {}", head.substr(0, head.size() - 1)));
    }
    if (!text.ends_with('\n')) text += '\n';
  }
  Json run = run_record({});
  run["commit"] = origin.commit;
  const auto words = mapped<std::string>(origin_keys, [&](const auto& key) { return run.at(key); });
  for (const SpeedRow& row : rows) text += with_origin(speed_table().csv_cells(row), words);
  write_file(file, text);
}

Json speed_json(const std::vector<SpeedRow>& rows, const SpeedOrigin& origin) {
  return {{"commit", origin.commit}, {"run", run_record({})}, {"works", speed_table().list(rows)}};
}

std::string speed_text(const std::vector<SpeedRow>& rows) {
  return speed_table().text(rows);
}

}  // namespace tpm::accuracy
