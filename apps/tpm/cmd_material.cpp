// tpm material: a fitted law on an organ.

#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "option_kinds.hpp"
#include "protocol_options.hpp"
#include "recording_options.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/predict/organ_material.hpp"
#include "tpm/fit/sample_digest.hpp"
#include "tpm/fit/show/organ_material_report.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpm/organ/scene/protocol_file.hpp"
#include "tpm/organ/scene/scene_keys.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::app {
namespace {

struct MaterialCommand {
  std::string law, scene;
  RecordingOptions recordings;  ///< its file may also hold a protocol
  PlacementArguments held;
  RampOptions ramp;
  bool fit_times = false;
  std::string stiffening = "automatic";
  std::string intervals = "law";
  std::string folder, output;
};

OrganMaterialOptions material_options(const MaterialCommand& command) {
  OrganMaterialOptions options;
  options.fit_times = command.fit_times;
  if (command.stiffening != "automatic") options.stiffens = command.stiffening != "none";
  options.branches_stiffen = command.stiffening == "all";
  options.intervals = of_option([&] { return parse_intervals(command.intervals, "--intervals"); });
  return options;
}

/// Those of the recordings or the protocol named, else that of the scene.
std::vector<MaterialMotion> chosen_motions(const MaterialCommand& command, const LawFile& law,
                                           const Json& scene) {
  const RampOptions& ramp = command.ramp;
  const bool none = ramp.depth.empty() && ramp.rate.empty() && ramp.hold.empty() &&
                    command.recordings.files.empty();
  if (none) {
    require_nothing_held(command.held);
    if (!has_protocol(scene)) {
      throw Error(ExitCode::usage, "RECORDING", "neither given nor a protocol in the scene",
                  "the recording that was fitted, or --depth, --rate and --hold");
    }
    const ProtocolFile own = parse_protocol_file(scene, command.scene);
    return {motion_of_protocol(own.protocol, own.times_s)};
  }
  if (const auto file = chosen_protocol(ramp, command.recordings.files)) {
    require_nothing_held(command.held);
    return {motion_of_protocol(file->protocol, file->times_s)};
  }
  const std::vector<PreparedRecording> recordings = read_recordings(command.recordings);
  PredictionOptions held;
  hold_placement(command.held, command.recordings, recordings, held.contact, held.zero);
  return mapped<MaterialMotion>(recordings, [&](const PreparedRecording& recording) {
    return motion_of_recording(law, recording, held);
  });
}

/// The session that was written, or the scene where the loop cannot have its bonds; without a
/// folder, the command that writes them.
std::string next_of_material(const MaterialCommand& command, const Session& session) {
  if (command.folder.empty()) return same_command(session, "--folder on_organ");
  const std::filesystem::path folder = command.folder;
  if (command.stiffening == "all") {
    return fmt::format("tpm predict {} --depth '2 mm' --rate '2 mm/s' --hold '3 s'",
                       shell_word((folder / "scene.json").string()));
  }
  return fmt::format("tpm hil run {} -o {}", shell_word((folder / "session.json").string()),
                     shell_word((folder / "session.tpmrec").string()));
}

int run_material(const MaterialCommand& command, const Session& session) {
  will_write_into(command.folder, {"scene.json", "session.json", "material.json", "material.csv",
                                   "figures.json", "material.svg", "material.png", "material.pdf"});
  if (command.intervals == "profiles") {
    will_write_into(command.folder,
                    {"material_profiles.svg", "material_profiles.png", "material_profiles.pdf"});
  }
  const LawFile law = read_law(command.law);
  const Json scene = checked(read_json(command.scene), scene_kind(), command.scene);
  require_one_protocol(scene, DocumentPlace{command.scene});
  OrganMaterial result =
      put_on_organ(law, chosen_motions(command, law, scene), scene, command.scene,
                   std::filesystem::path(command.scene).parent_path(), material_options(command));
  result.samples_sha256 = sample_digests(read_json(command.law));
  if (!command.output.empty()) deliver(to_text(result.scene), command.output);
  std::vector<std::string> files;
  if (!command.folder.empty()) files = write_organ_material_report(command.folder, result);
  const std::string next = next_of_material(command, session);
  if (session.json()) {
    Json json = to_json(result);
    add_end(json, command.folder, files, next);
    if (!command.output.empty()) json["files"].push_back(command.output);
    write_output(answer_text(session, std::move(json)));
    return 0;
  }
  std::string text = to_terminal_text(result);
  if (!files.empty()) text += written(session, command.folder, files);
  write_output(text + next_line(next));
  return 0;
}

}  // namespace

void add_material_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand(
      "material",
      "Put a fitted law on an organ: find the bonds' material that responds like the law");
  auto options = std::make_shared<MaterialCommand>();
  add_fitted_law(*command, options->law);
  command
      ->add_option("SCENE", options->scene,
                   "An organ (JSON scene); its material is replaced, its regions stay")
      ->required();
  command->add_option(
      "PROTOCOL|RECORDING", options->recordings.files,
      "The motion: recordings, each with a contact and an offset of its own, or a JSON "
      "file with a block protocol; default: the scene's");
  add_ramp_options(*command, options->ramp);
  command->add_flag("--fit-times", options->fit_times,
                    "Fit relaxation times, too, instead of keeping the law's");
  command
      ->add_option(
          "--stiffening", options->stiffening,
          "Which part of a bond stiffens with its elongation: equilibrium, all (the branches, too: "
          "not for tpm hil), none, or automatic: equilibrium if the law stiffens with depth")
      ->check(one_of_words({"automatic", "equilibrium", "all", "none"}))
      ->capture_default_str();
  command
      ->add_option(
          "--intervals", options->intervals,
          "Source of the intervals: law: fit to the law's force, intervals from its covariance; "
          "readings: fit to "
          "the recordings, intervals from their scatter by derivatives; profiles: the same "
          "by likelihood profiles (minutes)")
      ->check(one_of_words({"law", "readings", "profiles"}))
      ->capture_default_str();
  add_folder_option(
      *command, options->folder,
      ": scene.json, session.json (for tpm hil run), material.json, material.csv and the figure");
  command->add_option("-o,--output", options->output, "File to write (the scene)");
  add_recording_options(*command, options->recordings);
  add_placement_options(*command, options->held);
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm fit recording.csv --folder fitted\n"
      "  tpm material fitted/law.json configs/liver_scene.json recording.csv --folder on_liver\n"
      "  tpm hil run on_liver/session.json -o on_liver.tpmrec && tpm hil verify on_liver.tpmrec");
  set_run(*command, session, [options, &session] { return run_material(*options, session); });
}

}  // namespace tpm::app
