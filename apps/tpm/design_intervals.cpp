// Declared in design_options.hpp.
#include <algorithm>
#include <chrono>

#include "answer.hpp"
#include "design_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/design/coverage.hpp"
#include "tpm/show/json_table_csv.hpp"

namespace tpm::app {

std::uint64_t design_seed(const std::string& text) {
  if (text == "clock") {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return static_cast<std::uint64_t>(now.count()) % 1'000'000'007U;
  }
  return parse_whole_number(text, "--seed", 0);
}

int check_intervals(const DesignOptions& options, const Session& session) {
  const auto csv = csv_beside(options.output, session);
  const FitConfig config = read_fit_config(options.design);
  const std::string sets = options.repetitions.empty() ? "2000" : options.repetitions;
  const CoverageResult result =
      check_coverage(config, static_cast<int>(parse_whole_number(sets, "--repetitions", 1)),
                     design_seed(options.seed));
  Json json = tpm::fit::to_json(result);
  const std::string next = "tpm fit " + shell_word(options.design);
  add_end(json, {}, {}, next);
  constexpr double kSuspicious = 0.001;
  const bool covered = std::ranges::none_of(
      result.parameters, [](const ParameterCoverage& p) { return p.p_value < kSuspicious; });
  deliver(session.json() ? answer_text(session, json, {{"coverage_as_stated", covered}})
                         : to_terminal_text(result) + next_line(next),
          options.output);
  deliver_csv(json_table_csv(Json::array({json}), "/parameters"), csv);
  return exit_code(covered);
}

}  // namespace tpm::app
