
#include <algorithm>
#include <chrono>
#include <memory>

#include "command.hpp"
#include "tpm/fit/coverage.hpp"
#include "tpm/fit/show/fit_csv.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

struct CoverageOptions {
  std::string config;
  std::string sets = "2000";
  std::string seed = "0";
  std::string output;
};

std::uint64_t seed_of(const std::string& text) {
  if (text == "clock") {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return static_cast<std::uint64_t>(now.count()) % 1'000'000'007U;
  }
  return parse_whole_number(text, "--seed", 0);
}

int coverage(const CoverageOptions& options, const Session& session) {
  const auto csv = csv_beside(options.output, session);
  const FitConfig config = read_fit_config(options.config);
  const auto sets = static_cast<int>(parse_whole_number(options.sets, "--sets", 1));
  const CoverageResult result = check_coverage(config, sets, seed_of(options.seed));
  deliver(session.json() ? to_text(to_json(result)) : to_terminal_text(result), options.output);
  deliver_csv(coverage_csv(result), csv);
  constexpr double kSuspicious = 0.001;
  return exit_code(std::ranges::none_of(
      result.parameters, [](const ParameterCoverage& p) { return p.p_value < kSuspicious; }));
}

}  // namespace

void add_coverage_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand(
      "coverage",
      "Check the intervals of a fit by simulation: how often do they contain the true values?");
  auto options = std::make_shared<CoverageOptions>();
  command
      ->add_option("CONFIG", options->config,
                   "Configuration of tpm fit; its start values are the true values")
      ->required();
  command->add_option("--sets", options->sets, "Number of simulated data sets")
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Seed, 0 or more, or 'clock'")
      ->capture_default_str();
  add_output_option(*command, options->output);
  add_format_option(*command, session);
  command->footer(
      "Exit code 1 if a coverage differs from its level at the 0.1 % level (exact binomial test).\n"
      "Example:\n  tpm coverage configs/coverage_absolute.json --sets 2000 --seed 0");
  set_run(*command, session, [options, &session] { return coverage(*options, session); });
}

}  // namespace tpm::app
