#include <fmt/format.h>

#include <memory>

#include "command.hpp"
#include "tpm/fit/gradient_check.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

struct GradientOptions {
  std::string config;
  std::string points = "3";
  std::string seed = "0";
};

int check(const GradientOptions& options, const Session& session) {
  GradientCheckOptions wanted;
  constexpr std::uint64_t kMostPoints = 1000;
  const std::uint64_t points = parse_whole_number(options.points, "--points", 0);
  if (points > kMostPoints) {
    throw Error(ExitCode::usage, "--points", fmt::format("{}", points),
                fmt::format("at most {}", kMostPoints));
  }
  wanted.random_points = static_cast<int>(points);
  wanted.seed = parse_whole_number(options.seed, "--seed", 0);
  const ExperimentResiduals function(read_fit_config(options.config));
  const GradientCheck result =
      check_gradient(function, searched_parameters(function.config()), wanted);
  say("{}", session.json() ? to_text(to_json(result)) : to_terminal_text(result));
  return exit_code(result.passed());
}

}  // namespace

void add_check_gradient_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand(
      "check-gradient", "Compare the derivatives of a fit with finite differences");
  auto options = std::make_shared<GradientOptions>();
  command->add_option("CONFIG", options->config, "Configuration of tpm fit")->required();
  command->add_option("--points", options->points, "Random points besides the start, 0 to 1000")
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Seed of the random points, 0 or more")
      ->capture_default_str();
  add_format_option(*command, session);
  command->footer(
      "Exit code 1 if a derivative is wrong, or more than half of them are undecided.\n"
      "Example:\n  tpm check-gradient configs/liver_relaxation.json");
  set_run(*command, session, [options, &session] { return check(*options, session); });
}

}  // namespace tpm::app
