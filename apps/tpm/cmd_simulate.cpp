// tpm simulate: run what a scene says is done to its tissue.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <string_view>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "interrupt_watch.hpp"
#include "plan_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/json.hpp"
#include "tpm/files/replacement.hpp"
#include "tpm/haptics/show/formulation_list.hpp"
#include "tpm/organ/run/recorder.hpp"
#include "tpm/organ/run/simulation_file.hpp"
#include "tpm/organ/run/vtkhdf.hpp"
#include "tpm/plan/operations.hpp"
#include "tpm/plan/show/plan_report.hpp"
#include "tpm/plan/show/simulation_figures.hpp"
#include "tpm/plan/show/simulation_report.hpp"
#include "tpm/plan/show/trajectory_report.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace fs = std::filesystem;
namespace {

struct SimulateChoice {
  std::string scene;
  std::string output = "simulation.h5";
  std::string figures;
  bool beside_mass_spring = false;
  bool vtkhdf = false;
  std::string checkpoint_every = "5 s";
  bool planned = false;
  bool list = false;
  bool verbose = false;
  bool list_materials = false;
  PlanChoice plan;
};

/// A scene, the network it is run on, and what came of it.
struct Simulated {
  ExperimentScene scene;
  RunNetwork network;
  SimulationRun run;
  fs::path file, checkpoint;
};

double checkpoint_interval_s(const SimulateChoice& choice) {
  const double every =
      option_quantity(choice.checkpoint_every, Dimension::time, "--checkpoint-every");
  if (every > 0.0) return every;
  throw Error(ExitCode::usage, "--checkpoint-every", choice.checkpoint_every,
              "a time above 0 s, such as \"5 s\"");
}

SimulationRun run_watched(const ExperimentScene& scene, const RunNetwork& network,
                          double checkpoint_every_s, const fs::path& checkpoint) {
  const InterruptWatch interrupts;
  // Shown from the beginning: the first point of a large organ may take long.
  Progress progress(scene.formulation.mass_spring ? "mass-spring model" : "simulating",
                    times_to_watch(scene).size());
  SimulationControls controls;
  std::size_t before = 0;
  controls.progress = [&](std::size_t done, std::size_t /*total*/) {
    progress.advance(done - before);
    before = done;
  };
  controls.interrupted = InterruptWatch::seen;
  controls.checkpoint = checkpoint;
  controls.checkpoint_every_s = checkpoint_every_s;
  controls.note = [](const std::string& text) { tell_user("tpm: {}\n", text); };
  return simulate(scene, network, controls);
}

/// Adds the law that a scene keeps because it states none.
Json with_spacing_law(Json result, const ExperimentScene& scene) {
  for (const Remark& assumption : scene.tissue.network.organ.assumptions) {
    if (assumption.code == kSpacingLawKept) result["remarks"].push_back(remark_json(assumption));
  }
  return result;
}

/// The same beside the text, as `network build` says it; last, so that an error stands alone.
void tell_spacing_law(const ExperimentScene& scene, const Session& session) {
  if (session.json()) return;
  for (const Remark& assumption : scene.tissue.network.organ.assumptions) {
    if (assumption.code == kSpacingLawKept) tell_user("tpm: assumed: {}\n", assumption.text);
  }
}

/// Of large networks what the first output waits for: until then nothing says how long a run takes.
void tell_cost(const RunNetwork& network, const ExperimentScene& scene) {
  constexpr std::size_t kLarge = 2000;  // spheres; smaller ones take seconds
  constexpr double kWorthSaying_s = 1.0;
  constexpr double kOfProduct = 54.0;      // operations in a product of 3x3 blocks
  constexpr double kFactorisations = 1.0;  // at rest, for the first step too
  if (network.driven.spheres() < kLarge) return;
  const SolverChoice solver = choose_solver(network.driven.bonds, network.driven.constraints,
                                            {.solver = scene.formulation.solver});
  if (!solver.direct) return;
  const fs::path calibrated = usual_costs_file();
  const OperationCosts costs =
      !calibrated.empty() && fs::exists(calibrated) ? read_costs(calibrated) : nominal_costs();
  const double seconds = costs.seconds_of(
      OperationCount().add(Operation::factor_product, solver.operations / kOfProduct));
  if (seconds < kWorthSaying_s) return;
  tell_user(
      "tpm: {} spheres: a factorisation takes about {} s (costs of operations: {}), and a run of "
      "{} s at least {}: {} min or more\n",
      network.driven.spheres(), significant(seconds, 2), costs.source,
      significant(scene.protocol.end_s() - scene.protocol.start_s(), 3), kFactorisations,
      significant(kFactorisations * seconds / 60.0, 2));
}

Simulated simulated(ExperimentScene scene, fs::path file, double checkpoint_every_s) {
  (void)Replacement(file);  // before a long run, not after it: can the result be written?
  RunNetwork network = network_to_run(scene);
  tell_cost(network, scene);
  fs::path checkpoint = file.string() + ".checkpoint";
  SimulationRun run = run_watched(scene, network, checkpoint_every_s, checkpoint);
  return {std::move(scene), std::move(network), std::move(run), std::move(file),
          std::move(checkpoint)};
}

/// A result is HDF5 whatever its name is: a name that promises another kind of file is refused.
void require_result_name(const std::string& output) {
  constexpr auto kOthers = std::to_array<std::string_view>(
      {".csv", ".json", ".txt", ".html", ".png", ".svg", ".vtk", ".vtu", ".mat", ".xlsx"});
  if (std::ranges::find(kOthers, fs::path(output).extension().string()) == kOthers.end()) return;
  throw Error(ExitCode::usage, "-o " + output, "the result is HDF5, another kind of file",
              "a name such as results.h5");
}

/// "results.h5" becomes "results-mass_spring.h5".
fs::path mass_spring_file(const fs::path& file) {
  fs::path beside = file;
  return beside.replace_filename(
      fmt::format("{}-mass_spring{}", file.stem().string(), file.extension().string()));
}

/// All files that a run writes, before the first is read.
void announce_files(const SimulateChoice& choice, Naming naming) {
  std::vector<fs::path> results{choice.output};
  if (choice.beside_mass_spring) results.push_back(mass_spring_file(choice.output));
  for (std::size_t i = 0, results_alone = results.size(); i < results_alone; ++i) {
    const fs::path file = results[i];
    if (fs::path(file).replace_extension(".xdmf") == file ||
        (choice.vtkhdf && fs::path(file).replace_extension(".vtkhdf") == file)) {
      throw Error(ExitCode::usage, "-o " + choice.output, "its ending is that of a file beside it",
                  "a name such as results.h5");
    }
    results.push_back(fs::path(file).replace_extension(".xdmf"));
    if (choice.vtkhdf) results.push_back(fs::path(file).replace_extension(".vtkhdf"));
  }
  will_write(results, naming);
  will_write_into(choice.figures, {"pictures.json", "figures.json"});
}

std::vector<Simulated> simulate_all(const SimulateChoice& choice, ExperimentScene scene,
                                    Naming naming) {
  const double every_s = checkpoint_interval_s(choice);
  announce_files(choice, naming);
  will_update(
      {choice.output + ".checkpoint", mass_spring_file(choice.output).string() + ".checkpoint"});
  std::vector<Simulated> all;
  if (choice.beside_mass_spring) {
    if (scene.formulation.mass_spring) {
      throw Error(ExitCode::usage, "--beside-mass-spring",
                  "the scene runs the mass-spring model itself", "a scene of the tissue");
    }
    ExperimentScene msm = scene;
    msm.formulation.mass_spring = true;
    all.push_back(simulated(std::move(scene), choice.output, every_s));
    all.push_back(simulated(std::move(msm), mass_spring_file(choice.output), every_s));
  } else {
    all.push_back(simulated(std::move(scene), choice.output, every_s));
  }
  return all;
}

std::vector<std::string> write_all(const SimulateChoice& choice,
                                   const std::vector<Simulated>& all) {
  std::vector<std::string> files;
  std::vector<FiguredRun> figured;
  for (const Simulated& s : all) {
    files.push_back(s.file.string());
    files.push_back(write_simulation(s.scene, s.network, s.run, s.file).string());
    if (choice.vtkhdf) {
      fs::path vtkhdf = s.file;
      write_vtkhdf(s.scene, s.network, s.run, vtkhdf.replace_extension(".vtkhdf"));
      files.push_back(vtkhdf.string());
    }
    fs::remove(s.checkpoint);
    figured.push_back({&s.scene, &s.network, &s.run});
  }
  if (choice.figures.empty()) return files;
  for (const std::string& name : write_simulation_figures(choice.figures, figured)) {
    files.push_back((fs::path(choice.figures) / name).string());
  }
  return files;
}

std::string next_of_run(const SimulateChoice& choice) {
  return "tpm view " + shell_word(choice.output);
}

/// Runs a scene by a formulation that does not show whole states: the response, and displacements
/// where they are known.
int simulate_trajectory(const SimulateChoice& choice, const ExperimentScene& scene,
                        const Session& session) {
  if (choice.beside_mass_spring || choice.vtkhdf || !choice.figures.empty()) {
    throw Error(
        ExitCode::usage, "--folder, --vtkhdf or --beside-mass-spring",
        fmt::format("with the formulation '{}'", scene.formulation.kind),
        "a formulation that shows whole states: " +
            formulations_that([](const Formulation& f) { return f.as<StateRunner>() != nullptr; }));
  }
  (void)Replacement(choice.output);  // can the result be written?
  const std::vector<double> times = times_to_watch(scene);
  const Trajectory answer = run_scene(scene, times, scene.formulation.entry().can().field);
  write_scene_run(scene, times, answer, choice.output);
  say_with_files(session, with_spacing_law(scene_run_json(scene, times, answer), scene),
                 scene_run_text(scene, times, answer), {choice.output}, {});
  tell_spacing_law(scene, session);
  return 0;
}

int list_formulations(const Session& session) {
  say("{}", session.json() ? answer_text(session, Json{{"formulations", formulations_json()}})
                           : formulations_text());
  return 0;
}

int list_materials(const Session& session) {
  say("{}", session.json() ? answer_text(session, Json{{"shapes", shapes_json()}}) : shapes_text());
  return 0;
}

/// Adds the response of the mass-spring model below that of the tissue.
void add_beside(ShortAnswer& answer, const ShortAnswer& mass_spring) {
  const auto append = [](std::vector<std::string>& to, const std::vector<std::string>& lines,
                         const char* before) {
    for (const std::string& line : lines) to.push_back(before + line);
  };
  append(answer.conclusion, {mass_spring.conclusion.begin() + 1, mass_spring.conclusion.end()},
         "mass-spring model: ");
  append(answer.warnings, mass_spring.warnings, "mass-spring model: ");
}

int simulate_and_report(const SimulateChoice& choice, const Session& session) {
  ExperimentScene scene = read_experiment(choice.scene);
  require_runnable(scene);
  if (scene.formulation.entry().as<StateRunner>() == nullptr) {
    return simulate_trajectory(choice, scene, session);
  }
  const std::vector<Simulated> all = simulate_all(choice, std::move(scene), session.output_naming);
  const std::vector<std::string> files = write_all(choice, all);
  Json json;
  std::string text;
  ShortAnswer answer;
  for (const Simulated& s : all) {
    Json of_one = simulation_json(s.scene, s.network, s.run);
    (json.is_null() ? json : json["mass_spring"]) = std::move(of_one);
    text += simulation_text(s.scene, s.network, s.run);
    if (&s == &all.front()) {
      answer = short_answer(s.scene, s.network, s.run);
    } else {
      add_beside(answer, short_answer(s.scene, s.network, s.run));
    }
  }
  if (session.json() || choice.verbose) {
    say_with_files(session, with_spacing_law(std::move(json), all.front().scene), text, files,
                   next_of_run(choice));
    tell_spacing_law(all.front().scene, session);
    return 0;
  }
  answer.end.push_back(fmt::format("wrote {}", fmt::join(files, ", ")));
  end_answer(answer, "", {}, next_of_run(choice));
  say("{}", to_text(answer));
  tell_spacing_law(all.front().scene, session);
  return 0;
}

/// Plans the scene and runs the pick instead of the scene's formulation.
int simulate_planned(const SimulateChoice& choice, const Session& session) {
  if (choice.beside_mass_spring || choice.vtkhdf || !choice.figures.empty()) {
    throw Error(ExitCode::usage, "--planned", "with figures, --vtkhdf or --beside-mass-spring",
                "none of them: a planned model need not know the whole network");
  }
  (void)Replacement(choice.output);  // can the result be written?
  const ExperimentScene scene = read_experiment(choice.scene);
  PlanRequest request = plan_request(choice.plan);
  request.relevance = request.changes = false;
  const Plan plan = planned(scene, std::move(request));
  if (!plan.choice) {
    if (session.json() || choice.verbose) {
      say("{}", session.json() ? answer_text(session, plan_json(plan), {{"model_found", false}})
                               : plan_text(plan));
      return exit_code(false);
    }
    ShortAnswer answer = short_answer(plan);
    end_answer(answer, "", {}, "tpm simulate " + shell_word(choice.scene));
    say("{}", to_text(answer));
    return exit_code(false);
  }
  const std::vector<double> times = times_to_watch(scene);
  const Trajectory answer = run_planned(plan, scene, times);
  write_planned_run(plan, scene, times, answer, choice.output);
  if (session.json() || choice.verbose) {
    // Verbose: also which candidates were considered, and what the plan says of them.
    say_with_files(session, with_spacing_law(planned_run_json(plan, scene, times, answer), scene),
                   plan_text(plan) + "\n" + planned_run_text(plan, times, answer), {choice.output},
                   next_of_run(choice));
    tell_spacing_law(scene, session);
    return 0;
  }
  ShortAnswer brief = short_answer(plan, times, answer);
  brief.end.push_back(fmt::format("wrote {}", choice.output));
  end_answer(brief, "", {}, next_of_run(choice));
  say("{}", to_text(brief));
  tell_spacing_law(scene, session);
  return 0;
}

/// Being stopped is not an error of the run: its line, and the exit code that shells expect.
int run_command(const SimulateChoice& choice, const Session& session) {
  try {
    if (choice.list) return list_formulations(session);
    if (choice.list_materials) return list_materials(session);
    if (choice.scene.empty()) {
      throw Error(ExitCode::usage, "SCENE", "is missing", "a JSON scene, or --list-formulations");
    }
    if (choice.output != choice.scene) require_result_name(choice.output);
    if (choice.planned) return simulate_planned(choice, session);
    return simulate_and_report(choice, session);
  } catch (const Interrupted& stop) {
    tell_user("tpm: {}\n", stop.what());
    return InterruptWatch::exit_code();
  }
}

}  // namespace

void add_simulate_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("simulate", "Push or load an organ as a scene says; HDF5, XDMF, pictures");
  auto choice = std::make_shared<SimulateChoice>();
  add_scene_argument(*command, choice->scene);
  command->add_option("-o,--output", choice->output, "File to write (HDF5); an XDMF goes beside it")
      ->capture_default_str();
  add_folder_option(*command, choice->figures, ": pictures (PNG, SVG)");
  command->add_flag("--beside-mass-spring", choice->beside_mass_spring,
                    "Also run the mass-spring model on the same spheres; figures show both");
  command->add_flag("--vtkhdf", choice->vtkhdf,
                    "Also write a .vtkhdf beside it, for ParaView from 5.12 on");
  command
      ->add_option("--checkpoint-every", choice->checkpoint_every,
                   "Time between checkpoints, such as \"5 s\"")
      ->capture_default_str();
  CLI::Option* planned = command->add_flag(
      "--planned", choice->planned,
      "Use the cheapest model that tpm plan finds, instead of the scene's formulation");
  command->add_flag("--list-formulations", choice->list,
                    "List what a scene's key 'formulation' can name, with what each can do");
  command->add_flag("--list-materials", choice->list_materials,
                    "List the shapes that a scene's keys 'potential' and 'kernel' can name");
  add_verbose_option(*command, choice->verbose, "contacts, equations, limits of every model");
  add_plan_options(*command, choice->plan);
  for (const char* of_plan :
       {"--tolerance", "--budget-file", "--outputs", "--loop-rate", "--wall", "--costs"}) {
    command->get_option(of_plan)->needs(planned);
  }
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm simulate configs/liver_indentation.json -o results.h5 --folder pictures\n"
      "An interrupted run resumes when the same command is given again.");
  set_run(*command, session, [choice, &session] { return run_command(*choice, session); });
}

}  // namespace tpm::app
