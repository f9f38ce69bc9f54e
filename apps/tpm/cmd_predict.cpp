// tpm predict: the answer of a fitted law, or of an organ with its material, with the band of its
// uncertainty; or storage and loss of a law over frequency.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "law_spectrum.hpp"
#include "protocol_options.hpp"
#include "recording_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/other_kind.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/fit/predict/organ_prediction.hpp"
#include "tpm/fit/show/prediction_report.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::app {
namespace {

struct PredictOptions {
  std::string law;
  RecordingOptions recordings;  ///< its file may also hold a protocol
  PlacementArguments held;
  RampOptions ramp;
  std::string level, placement, samples, seed = "0";
  std::string frequencies;
  std::string folder, output;
};

PredictionOptions prediction_options(const PredictOptions& options) {
  PredictionOptions chosen;
  if (!options.level.empty()) chosen.level = parse_share(options.level, "--level");
  if (!options.placement.empty()) {
    chosen.placement = of_option([&] { return parse_placement(options.placement, "--placement"); });
  }
  if (!options.samples.empty()) {
    constexpr std::uint64_t kFewest = 100;
    chosen.samples = static_cast<int>(parse_whole_number(options.samples, "--draws", kFewest));
  }
  chosen.seed = parse_whole_number(options.seed, "--seed", 0);
  return chosen;
}

/// Depths in m would be taken for strains or relative lengths.
void require_law_of_depth(const LawFile& law, const std::string& file) {
  if (law.spec.drive == Quantity::indentation_depth) return;
  throw bad_input(file,
                  fmt::format("a law of {}, which no protocol of depths or loads imposes",
                              quantity_name(law.spec.drive)),
                  "--frequencies, or a recording of the motion");
}

/// That of a law, or of an organ that stands for it.
LawPrediction answer_of(const std::string& subject, const std::optional<ProtocolFile>& file,
                        const std::optional<PreparedRecording>& recording,
                        const PredictionOptions& options) {
  if (is_organ_document(read_json_of(subject, "law"))) {
    const OrganOfLaw organ = read_organ_of_law(subject);
    return file ? predict_organ(organ, file->protocol, file->times_s, options)
                : predict_organ(organ, *recording, options);
  }
  const LawFile law = read_law(subject);
  if (file) require_law_of_depth(law, subject);
  return file ? predict_law(law, file->protocol, file->times_s, options)
              : predict_recording(law, *recording, options);
}

/// Storage and loss have no protocol and no band.
void require_only_frequencies(const PredictOptions& options) {
  const auto refuse = [](const char* given) {
    throw Error(ExitCode::usage, "--frequencies", fmt::format("beside {}", given),
                "a law and --depth only: no protocol, no recording, no band");
  };
  if (!options.recordings.files.empty()) refuse("a file");
  for (const auto& [text, name] :
       {std::pair{&options.ramp.rate, "--rate"}, std::pair{&options.ramp.hold, "--hold"},
        std::pair{&options.held.contact, "--contact"}, std::pair{&options.held.zero, "--zero"},
        std::pair{&options.level, "--level"}, std::pair{&options.placement, "--placement"},
        std::pair{&options.samples, "--draws"}, std::pair{&options.folder, "--folder"}}) {
    if (!text->empty()) refuse(name);
  }
}

/// A comparison with readings, where there are some; else the law where it is used.
std::string next_of_prediction(const PredictOptions& options, const LawPrediction& prediction) {
  const std::string subject = shell_word(options.law);
  if (prediction.recording) {
    return fmt::format("tpm validate {} {}", subject, shell_word(options.recordings.files.front()));
  }
  if (is_organ_document(read_json_of(options.law, "law"))) return "tpm plan " + subject;
  return next_with_law(options.law, prediction.spec);
}

int predict(const PredictOptions& options, const Session& session) {
  if (!options.frequencies.empty()) {
    require_only_frequencies(options);
    return write_spectrum({options.law, options.frequencies, options.ramp.depth, options.output},
                          session);
  }
  will_write_into(options.folder, {"prediction.csv", "prediction.json", "figures.json"});
  const auto csv = csv_beside(options.output, session);
  PredictionOptions chosen = prediction_options(options);
  const auto file = chosen_protocol(options.ramp, options.recordings.files);
  std::optional<PreparedRecording> recording;
  if (file) {
    require_nothing_held(options.held);
  } else {
    recording = read_recordings(options.recordings).front();
    hold_placement(options.held, options.recordings, std::span(&*recording, 1), chosen.contact,
                   chosen.zero);
  }
  const LawPrediction prediction = answer_of(options.law, file, recording, chosen);
  const Json json = to_json(prediction);
  const std::string next = next_of_prediction(options, prediction);
  std::vector<std::string> files;
  if (!options.folder.empty()) {
    files = write_prediction_report(options.folder, prediction, json);
  }
  std::string text;
  if (session.json()) {
    Json ended = json;
    add_end(ended, options.folder, files, next);
    text = answer_text(session, std::move(ended));
  } else {
    text = to_terminal_text(prediction);
    if (!files.empty()) text += written(session, options.folder, files);
    text += next_line(next);
  }
  deliver(text, options.output);
  deliver_csv(to_csv(prediction), csv);
  return 0;
}

}  // namespace

void add_predict_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand(
      "predict",
      "Predict the response to a protocol or a recording's motion, with an uncertainty band, or "
      "storage and loss over frequency");
  auto options = std::make_shared<PredictOptions>();
  add_law_or_scene(*command, options->law)->required();
  command
      ->add_option("PROTOCOL|RECORDING", options->recordings.files,
                   "A JSON file with a block protocol (a scene, or schemas/protocol.schema.json), "
                   "or a recording whose motion is answered and whose readings are compared")
      ->expected(0, 1);
  add_ramp_options(*command, options->ramp);
  command->get_option("--depth")->description(
      "Depth of the indentation: instead of a file, a ramp to this depth, \"4 mm\"; with "
      "--frequencies the depth about which "
      "the tissue oscillates (default: the law's reference)");
  command->add_option(
      "--frequencies", options->frequencies,
      "Frequencies of storage and loss of the law, small oscillations: instead of a "
      "protocol, \"1 Hz, 10 Hz\", or \"0.001 Hz : 100 Hz : 16\" for 16 at "
      "equal ratios");
  command->add_option("--level", options->level,
                      "Confidence level, 0.9 or 90%: of the bands (default: that of the fit)");
  command
      ->add_option("--placement", options->placement,
                   "Contact and zero: surface (0), fitted (those of the fit) or own "
                   "(found for the recording); default: surface for a protocol, fitted for a "
                   "recording that was fitted, own for another")
      ->each(reads_word(parse_placement, "--placement"));
  add_placement_options(*command, options->held);
  add_draws_option(*command, options->samples, "bands from these, instead of from derivatives");
  add_seed_option(*command, options->seed, ": the draws")->capture_default_str();
  add_folder_option(*command, options->folder, ": prediction.csv, prediction.json and the figure");
  add_output_option(*command, options->output);
  add_recording_options(*command, options->recordings);
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm fit recording.csv --folder fitted\n"
      "  tpm predict fitted/law.json --depth \"4 mm\" --rate \"2 mm/s\" --hold \"30 s\"\n"
      "  tpm predict fitted/law.json other.csv --folder predicted\n"
      "  tpm predict on_liver/scene.json --depth \"4 mm\" --rate \"2 mm/s\" --hold \"30 s\"\n"
      "  tpm predict law.json --frequencies \"0.01 Hz : 1000 Hz : 31\"\n"
      "Whether the law is right for a recording: tpm validate");
  set_run(*command, session, [options, &session] { return predict(*options, session); });
}

}  // namespace tpm::app
