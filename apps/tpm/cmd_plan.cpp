// tpm plan: the cheapest model for a scene.
#include <fmt/format.h>
#include <cstdio>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "option_kinds.hpp"
#include "plan_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/plan/show/plan_report.hpp"
#include "tpm/show/json_table_csv.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace fs = std::filesystem;

void add_plan_options(CLI::App& command, PlanChoice& choice) {
  command
      .add_option("--tolerance", choice.tolerance,
                  "Largest error of the model, in parts of the peak, such as 1% or 0.01; jnd: what "
                  "a hand can feel; data: the data uncertainty (with --budget-file)")
      ->capture_default_str();
  command.add_option("--budget-file", choice.budget,
                     "budget.json of tpm budget, for --tolerance data");
  command
      .add_option(
          "--outputs", choice.outputs,
          "Quantity that the tolerance concerns: force (the response) or field (displacements)")
      ->check(one_of_words({"force", "field"}))
      ->capture_default_str();
  command.add_option("--loop-rate", choice.rate,
                     "Rate of the servo loop, such as \"1 kHz\": every period needs its answer");
  command.add_option("--wall", choice.wall,
                     "Computing time per simulated time, such as \"0.1 s per s\"");
  command.add_option("--costs", choice.costs,
                     "Times of operations: a file of --calibrate, or nominal; default: this "
                     "machine's, if it was calibrated");
}

namespace {

/// No finer than the data uncertainty, and no coarser than a plan may be.
void set_tolerance_of_data(PlanRequest& request, const PlanChoice& choice) {
  if (choice.budget.empty()) {
    throw Error(ExitCode::usage, "--tolerance data", "without a budget",
                "--budget-file budget.json, as tpm budget --folder writes it");
  }
  constexpr double kMost = 0.5, kLeast = 1e-6;
  const double part = tolerance_of_data(read_json(choice.budget), choice.budget);
  request.tolerance = std::clamp(part, kLeast, kMost);
  request.tolerance_source = fmt::format("the data uncertainty, {} % of the peak, after {}",
                                         significant(100.0 * part, 3), choice.budget);
}

}  // namespace

PlanRequest plan_request(const PlanChoice& choice) {
  PlanRequest request;
  if (choice.tolerance == "data") {
    set_tolerance_of_data(request, choice);
  } else if (choice.budget.empty()) {
    set_tolerance(request, choice.tolerance);
  } else {
    throw Error(ExitCode::usage, "--budget-file", "without --tolerance data", "both or none");
  }
  if (choice.outputs == "field") request.measure = {PlanOutput::field, 0.0};
  if (!choice.rate.empty()) {
    const double rate = option_quantity(choice.rate, Dimension::frequency, "--loop-rate");
    if (!(rate >= 1.0 && rate <= 1e6)) {
      throw Error(ExitCode::usage, "--loop-rate", fmt::format("'{}'", printable(choice.rate)),
                  "a servo rate of 1 Hz to 1 MHz");
    }
    request.budget.rate_Hz = rate;
  }
  if (!choice.wall.empty()) {
    request.budget.wall_s_per_s = of_option([&] { return parse_wall_budget(choice.wall); });
  }
  if (choice.costs.empty()) {
    const fs::path usual = usual_costs_file();
    if (!usual.empty() && fs::exists(usual)) request.costs = read_costs(usual);
  } else if (choice.costs != "nominal") {
    request.costs = read_costs(choice.costs);
  }
  return request;
}

Plan planned(const ExperimentScene& scene, PlanRequest request) {
  Progress progress("planning", 6);
  std::string doing;
  request.progress = [&](const std::string& what) {
    doing = what;
    progress.advance();
  };
  if (progress.is_shown()) {
    request.run_progress = [&, shown = -1](double share) mutable {
      const int percent = static_cast<int>(100.0 * share);
      if (percent == shown) return;
      shown = percent;
      fmt::print(stderr, "\r\033[Kplanning: {}, a run with masses at {} %", doing, percent);
      std::fflush(stderr);
    };
    request.expected = [](const ExpectedPlanWork& work) {
      fmt::print(stderr, "\r{}", expected_plan_text(work));
    };
  }
  return make_plan(scene, request);
}

namespace {

struct PlanCommand {
  std::string scene, output;
  std::string spheres, scene_output;
  std::size_t most_spheres = SpheresRequest{}.most;
  bool calibrate = false;
  bool brief = false;
  bool thorough = false;
  bool estimate = false;
  bool verbose = false;
  PlanChoice choice;
};

int calibrate(const PlanCommand& command, const Session& session) {
  const bool named = !command.choice.costs.empty() && command.choice.costs != "nominal";
  const fs::path file = named ? fs::path(command.choice.costs) : usual_costs_file();
  if (file.empty()) {
    throw Error(ExitCode::environment, "--calibrate", "neither HOME nor XDG_CACHE_HOME is set",
                "a file after --costs");
  }
  const OperationCosts costs = measured_costs();
  write_costs(costs, file);
  Json seconds = Json::object();
  for (const OperationEntry& entry : operation_table()) {
    seconds[std::string(entry.text)] = costs.seconds[static_cast<std::size_t>(entry.meaning)];
  }
  if (session.json()) {
    Json json{{"seconds_per_operation", seconds}, {"file", file.string()}};
    add_end(json, {}, {file.string()}, {});
    say("{}", answer_text(session, std::move(json)));
    return 0;
  }
  for (const auto& [name, value] : seconds.items()) {
    say("{:<16} {:>8} ns\n", name, significant(1e9 * value.get<double>(), 2));
  }
  say("wrote {}\n", file.string());
  return 0;
}

/// Number of spheres and the scene with them; the file's own scene if none was asked for.
struct PlannedScene {
  std::optional<SpheresPlan> spheres;
  std::optional<ExperimentScene> scene;  ///< none: no number of spheres is enough
};

PlannedScene planned_scene(const PlanCommand& command) {
  if (command.spheres.empty()) {
    if (!command.scene_output.empty()) {
      throw Error(ExitCode::usage, "--write-scene", "without --sphere-tolerance", "both or none");
    }
    return {std::nullopt, read_experiment(command.scene)};
  }
  if (!command.scene_output.empty()) will_write({command.scene_output});
  SpheresRequest request;
  request.tolerance = parse_share(command.spheres, "--sphere-tolerance");
  request.most = command.most_spheres;
  const fs::path file = command.scene;
  const RefilledScene refilled(read_json(file), command.scene, file.parent_path());
  Progress progress("numbers of spheres", 0);
  request.tried = [&] { progress.advance(); };
  PlannedScene planned{plan_spheres(refilled, request), std::nullopt};
  if (!planned.spheres->choice) return planned;
  const RefilledScene::Filling& filling = planned.spheres->chosen().filling;
  planned.scene = refilled.scene(filling);
  if (!command.scene_output.empty()) {
    Json document = refilled.document(filling);
    Json& organ = document["organ"];
    if (organ.contains("mesh")) {  // its path is relative to the scene
      organ["mesh"] = fs::relative(file.parent_path() / organ.at("mesh").get<std::string>(),
                                   fs::absolute(command.scene_output).parent_path())
                          .generic_string();
    }
    write_file(command.scene_output, to_text(document));
  }
  return planned;
}

/// Runs the pick; where none meets the budget, the scene is planned without it.
std::string next_of_plan(const PlanCommand& command, const Plan& plan, const Session& session) {
  const PlanChoice& choice = command.choice;
  if (!command.spheres.empty() && command.scene_output.empty()) {
    return same_command(session, "--write-scene planned.json");
  }
  const std::string scene =
      shell_word(command.spheres.empty() ? command.scene : command.scene_output);
  std::string options = " --tolerance " + shell_word(choice.tolerance);
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) options += fmt::format(" {} {}", name, shell_word(value));
  };
  add("--budget-file", choice.budget);
  if (choice.outputs != "force") add("--outputs", choice.outputs);
  if (!plan.choice) {
    if (plan.without_budget) return fmt::format("tpm plan {}{}", scene, options);
    return fmt::format("tpm simulate {}", scene);
  }
  add("--loop-rate", choice.rate);
  add("--wall", choice.wall);
  add("--costs", choice.costs);
  return fmt::format("tpm simulate {} --planned{} -o planned.h5", scene, options);
}

/// --write-scene, if a number of spheres was asked for.
std::vector<std::string> written_scenes(const PlanCommand& command, const PlannedScene& chosen) {
  if (!chosen.spheres || command.scene_output.empty()) return {};
  return {command.scene_output};
}

/// The answer, with the number of spheres before it if that was asked for.
std::string answer_of_plan(const PlanCommand& command, const PlannedScene& chosen, const Plan& plan,
                           const Session& session) {
  if (command.verbose) {
    return (chosen.spheres ? spheres_text(*chosen.spheres) : std::string()) + plan_text(plan);
  }
  ShortAnswer answer = short_answer(plan);
  if (chosen.spheres) {
    answer.conclusion.insert(answer.conclusion.begin(), spheres_words(*chosen.spheres));
  }
  for (const std::string& file : written_scenes(command, chosen)) {
    answer.end.push_back("wrote " + file);
  }
  end_answer(answer, "", {}, next_of_plan(command, plan, session));
  return to_text(answer);
}

int run_plan(const PlanCommand& command, const Session& session) {
  if (command.calibrate) return calibrate(command, session);
  if (command.scene.empty()) {
    throw Error(ExitCode::usage, "SCENE", "is missing", "a JSON scene, or --calibrate");
  }
  const auto csv = csv_beside(command.output, session);
  PlanRequest request = plan_request(command.choice);
  request.relevance = request.changes = !command.brief;
  request.thorough = command.thorough;
  const PlannedScene chosen = planned_scene(command);
  if (!chosen.scene) {
    Json json{{"spheres_choice", spheres_json(*chosen.spheres)}};
    add_end(json, {}, {}, {});
    deliver(session.json() ? answer_text(session, json, {{"number_found", false}})
                           : spheres_text(*chosen.spheres),
            command.output);
    return exit_code(false);
  }
  if (command.estimate) {
    const ExpectedPlanWork work = expected_work(*chosen.scene, request);
    const std::string next = same_command(session, {}, "--estimate");
    Json json = expected_plan_json(work);
    add_end(json, {}, {}, next);
    deliver(session.json() ? answer_text(session, std::move(json))
                           : expected_plan_text(work) + next_line(next),
            command.output);
    return 0;
  }
  const Plan plan = planned(*chosen.scene, std::move(request));
  Json json = plan_json(plan);
  if (chosen.spheres) json["spheres_choice"] = spheres_json(*chosen.spheres);
  add_end(json, {}, written_scenes(command, chosen), next_of_plan(command, plan, session));
  deliver(session.json() ? answer_text(session, json, {{"model_found", plan.choice.has_value()}})
                         : answer_of_plan(command, chosen, plan, session),
          command.output);
  deliver_csv(json_table_csv(json.at("frontier")), csv);
  return exit_code(plan.choice.has_value());
}

}  // namespace

void add_plan_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("plan", "The cheapest model that a scene needs, verified");
  auto choice = std::make_shared<PlanCommand>();
  add_scene_argument(*command, choice->scene);
  add_plan_options(*command, choice->choice);
  command->add_option(
      "--sphere-tolerance", choice->spheres,
      "How far the number of spheres may be from the limit of many small ones, such "
      "as 10%: choose it first (spacing_law continuum)");
  command
      ->add_option("--most-spheres", choice->most_spheres,
                   "Largest number of spheres that is tried, with --sphere-tolerance")
      ->check(CLI::Range(200, 1'000'000))
      ->capture_default_str();
  command->add_option(
      "--write-scene", choice->scene_output,
      "Scene to write with the number of spheres that was chosen, with --sphere-tolerance");
  command->add_flag("--brief", choice->brief,
                    "Leave out what does not matter and the robustness margins");
  command
      ->add_flag("--thorough", choice->thorough,
                 "Try everything, also where that takes more than twice as long as the reference")
      ->excludes("--brief");
  command->add_flag("--estimate", choice->estimate,
                    "Print how long planning would take, from one coarse run, and end");
  command->add_flag("--calibrate", choice->calibrate,
                    "Measure what operations cost on this machine, and keep it");
  add_verbose_option(*command, choice->verbose,
                     "every candidate and number of spheres, the work of planning");
  command->add_option("-o,--output", choice->output,
                      "File to write (default: the terminal); beside JSON the candidates as .csv");
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm plan configs/plan/shallow.json --tolerance 1% --loop-rate \"1 kHz\"\n"
      "Exit code 1: no model meets tolerance and budget.");
  set_run(*command, session, [choice, &session] { return run_plan(*choice, session); });
}

}  // namespace tpm::app
