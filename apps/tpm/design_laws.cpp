// Declared in design_options.hpp.
#include <fmt/format.h>

#include <algorithm>

#include "answer.hpp"
#include "design_options.hpp"
#include "recording_options.hpp"
#include "tpm/fit/design/recovery.hpp"
#include "tpm/show/json_table_csv.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

/// Above 0 and below 1.
double parse_part(const std::string& text, const char* option, const char* expected) {
  const double part = option_number(text, option);
  if (part > 0.0 && part < 1.0) return part;
  throw Error(ExitCode::usage, option, fmt::format("'{}'", printable(text)), expected);
}

Json results_json(const std::vector<RecoveryResult>& results) {
  const auto law = [](const RecoveryResult& result) { return tpm::fit::to_json(result); };
  return Json{{"laws", array_json(results, law)}};
}

}  // namespace

int check_choice_of_law(const DesignOptions& options, const Session& session) {
  RecoveryOptions study;
  if (!options.noise.empty()) {
    study.noise = parse_part(options.noise, "--noise", "a part of the peak above 0 and below 1");
  }
  if (!options.repetitions.empty()) {
    study.trials = static_cast<int>(parse_whole_number(options.repetitions, "--repetitions", 1));
  }
  study.seed = design_seed(options.seed);
  for (const std::string& margin : options.margins) {
    study.margins.push_back(option_number(margin, "--margins"));
  }
  study.selection.laws = chosen_laws({}, options.family);
  const double order = parse_part(options.order.empty() ? "0.4" : options.order, "--order",
                                  "an order of a fractional element above 0 and below 1");
  const auto csv = csv_beside(options.output, session);
  std::vector<RecoveryResult> results;
  for (const LawSpec& law : chosen_laws(options.laws, options.family)) {
    results.push_back(recover(law, visible_parameters(law, order), study));
  }
  const Json json = results_json(results);
  const bool returned = std::ranges::all_of(results, &RecoveryResult::fulfilled);
  deliver(session.json() ? answer_text(session, json, {{"laws_returned", returned}})
                         : to_terminal_text(results),
          options.output);
  deliver_csv(json_table_csv(json.at("laws"), "/choices"), csv);
  return exit_code(returned);
}

}  // namespace tpm::app
