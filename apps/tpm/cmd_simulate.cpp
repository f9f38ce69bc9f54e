// tpm simulate: run what a scene says is done to its tissue.
#include <fmt/format.h>

#include <csignal>
#include <filesystem>
#include <memory>

#include "command.hpp"
#include "tpm/core/error.hpp"
#include "tpm/core/progress.hpp"
#include "tpm/core/units.hpp"
#include "tpm/report/simulation_figures.hpp"
#include "tpm/report/simulation_report.hpp"
#include "tpm/simulate/simulation_file.hpp"

namespace tpm::app {
namespace fs = std::filesystem;
namespace {

struct SimulateChoice {
  std::string scene;
  std::string output = "simulation.h5";
  std::string figures;
  bool beside_mass_spring = false;
  std::string checkpoint_every = "5 s";
};

/// What a signal handler may touch has to be of static storage.
volatile std::sig_atomic_t interrupt_seen = 0;

/// While this lives, the first interrupt from the keyboard is remembered and a second one kills.
class InterruptWatch {
 public:
  InterruptWatch() {
    struct sigaction action {};
    action.sa_handler = [](int) { interrupt_seen = 1; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, &before_);
  }
  ~InterruptWatch() { sigaction(SIGINT, &before_, nullptr); }
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;
  [[nodiscard]] static bool seen() { return interrupt_seen != 0; }

 private:
  struct sigaction before_ {};
};

SimulationRun run_watched(const ExperimentScene& scene, const RunNetwork& network,
                          const SimulateChoice& choice, const char* what, const fs::path& name) {
  const InterruptWatch interrupts;
  std::optional<Progress> progress;
  SimulationControls controls;
  controls.progress = [&](std::size_t done, std::size_t total) {
    if (!progress) {
      progress.emplace(what, total);
      progress->advance(done);
    } else {
      progress->advance();
    }
  };
  controls.interrupted = InterruptWatch::seen;
  controls.checkpoint = name;
  controls.checkpoint_every_s =
      parse_quantity(choice.checkpoint_every, Dimension::time, "--checkpoint-every");
  if (!(controls.checkpoint_every_s >= 0.0)) {
    throw Error(ExitCode::usage, "--checkpoint-every", choice.checkpoint_every, "0 s or more");
  }
  controls.note = [](const std::string& text) { fmt::print(stderr, "tpm: {}\n", text); };
  return simulate(scene, network, controls);
}

int simulate_and_report(const SimulateChoice& choice, const Session& session) {
  const ExperimentScene scene = read_experiment(choice.scene);
  const RunNetwork network = network_to_run(scene);
  const SimulationRun run =
      run_watched(scene, network, choice, "simulating", choice.output + ".checkpoint");
  std::vector<std::string> files{choice.output};
  files.push_back(write_simulation(scene, network, run, choice.output).string());
  if (!choice.figures.empty()) {
    std::vector<FiguredRun> runs{{&scene, &network, &run}};
    ExperimentScene msm_scene = scene;
    std::optional<RunNetwork> msm;
    std::optional<SimulationRun> msm_run;
    if (choice.beside_mass_spring && !scene.formulation.mass_spring) {
      msm_scene.formulation.mass_spring = true;
      msm.emplace(network_to_run(msm_scene));
      msm_run.emplace(run_watched(msm_scene, *msm, choice, "mass-spring model", {}));
      runs.push_back({&msm_scene, &*msm, &*msm_run});
    }
    for (const std::string& name : write_simulation_figures(choice.figures, runs)) {
      files.push_back((fs::path(choice.figures) / name).string());
    }
  }
  if (session.json()) {
    Json json = simulation_json(scene, run);
    json["files"] = files;
    fmt::print("{}", to_text(json));
  } else {
    fmt::print("{}wrote {}\n", simulation_text(scene, run), fmt::join(files, ", "));
  }
  return 0;
}

/// Being stopped is not an error of the run: its line, and the exit code that shells expect.
int run_command(const SimulateChoice& choice, const Session& session) {
  try {
    return simulate_and_report(choice, session);
  } catch (const Interrupted& stop) {
    constexpr int kInterrupted = 130;
    fmt::print(stderr, "tpm: {}\n", stop.what());
    return kInterrupted;
  }
}

}  // namespace

void add_simulate_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("simulate", "Push or load an organ as a scene says; HDF5, XDMF, pictures");
  auto choice = std::make_shared<SimulateChoice>();
  command->add_option("SCENE", choice->scene, "JSON scene (schemas/scene.schema.json)")->required();
  command->add_option("-o,--output", choice->output, "HDF5 file; an XDMF goes beside it")
      ->capture_default_str();
  command->add_option("--figures", choice->figures, "Folder for pictures (PNG, SVG)");
  command->add_flag("--beside-mass-spring", choice->beside_mass_spring,
                    "Also run the mass-spring model, and draw both (with --figures)");
  command
      ->add_option("--checkpoint-every", choice->checkpoint_every,
                   "Time between checkpoints, such as \"5 s\"")
      ->capture_default_str();
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm simulate configs/liver_indentation.json -o results.h5 --figures pictures\n"
      "An interrupted run goes on from its last checkpoint when the same command is given again.");
  command->callback([choice, &session] {
    session.run = [choice, &session] { return run_command(*choice, session); };
  });
}

}  // namespace tpm::app
