// tpm hil verify, tpm hil report: was what the operator felt the model?

#include <memory>
#include <string>
#include <vector>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/haptics/show/hil_report.hpp"
#include "tpm/show/draw.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace {

struct VerifyChoice {
  std::string recording;
  std::string output = "hil_report";
  bool verbose = false;
  std::string motion_tolerance = "5 um", spacing = "10 ms", window = "10 s";
};

VerifyOptions options_of(const VerifyChoice& choice) {
  VerifyOptions options;
  options.motion_tolerance_m =
      option_quantity(choice.motion_tolerance, Dimension::length, "--motion-tolerance");
  options.spacing_s = option_quantity(choice.spacing, Dimension::time, "--compare-every");
  options.window_s = option_quantity(choice.window, Dimension::time, "--window");
  const auto require = [](bool holds, const char* option, const std::string& text,
                          const char* expected) {
    if (!holds) throw Error(ExitCode::usage, option, text, expected);
  };
  require(options.motion_tolerance_m > 0.0, "--motion-tolerance", choice.motion_tolerance,
          "a length above 0, such as 5 um");
  require(options.spacing_s > 0.0, "--compare-every", choice.spacing,
          "a time above 0, such as 10 ms");
  require(options.window_s >= 0.0, "--window", choice.window, "a time of 0 or more");
  return options;
}

/// The verification as JSON, with what ends its text.
std::string answer_of(const HilRecording& recording, const Verification& v, const Session& session,
                      const std::string& folder, const std::vector<std::string>& files,
                      const std::string& next) {
  Json json = verification_json(recording, v);
  add_end(json, folder, files, next);
  return answer_text(session, std::move(json), {{"recording_whole", recording.whole()}});
}

int verify_hil(const VerifyChoice& choice, const Session& session) {
  const HilRecording recording = read_recording(choice.recording);
  const Verification v = verify(recording, options_of(choice));
  const std::string next =
      fmt::format("tpm hil report {} --folder hil_report", shell_word(choice.recording));
  if (session.json()) {
    say("{}", answer_of(recording, v, session, {}, {}, next));
  } else if (choice.verbose) {
    say("{}", verification_text(recording, v));
  } else {
    ShortAnswer answer = short_answer(recording, v);
    end_answer(answer, "", {}, next);
    say("{}", to_text(answer));
  }
  // The rest of a damaged or truncated recording is verified, and the answer is still no. The
  // recording of a session that ended early is whole.
  return exit_code(recording.whole());
}

int report_hil(const VerifyChoice& choice, const Session& session) {
  will_write_into(choice.output, {"figures.json", "report.md", "report.html", "report.json"},
                  session.folder_naming());
  const std::string python = find_drawing_python();
  const HilRecording recording = read_recording(choice.recording);
  const Verification v = verify(recording, options_of(choice));
  write_hil_report(recording, v, choice.output, python);
  std::vector<std::string> files{"report.html", "report.md", "report.json", "figures.json"};
  if (!python.empty()) files.emplace_back("figures");  // else none were drawn
  const std::string next = "tpm view " + shell_word(choice.recording);
  if (session.json()) {
    say("{}", answer_of(recording, v, session, choice.output, files, next));
  } else {
    ShortAnswer answer = short_answer(recording, v);
    end_answer(answer, choice.output, files, next);
    say("{}", choice.verbose
                  ? verification_text(recording, v) + written(session, choice.output, files)
                  : to_text(answer));
  }
  return exit_code(recording.whole());
}

std::shared_ptr<VerifyChoice> add_choice(CLI::App& command, Session& session) {
  auto choice = std::make_shared<VerifyChoice>();
  add_session_recording(command, choice->recording);
  command
      .add_option("--motion-tolerance", choice->motion_tolerance,
                  "Tolerance of the recorded motion, which is thinned out for the reference")
      ->capture_default_str();
  command
      .add_option("--compare-every", choice->spacing, "Time between the instants that are compared")
      ->capture_default_str();
  command
      .add_option("--window", choice->window,
                  "Window of the cross-check by CVODE: from the start, of a ball over the surface "
                  "from the first touch")
      ->capture_default_str();
  add_format_option(command, session);
  return choice;
}

}  // namespace

void add_hil_verify_commands(CLI::App& hil, Session& session) {
  CLI::App* verify_command = hil.add_subcommand(
      "verify", "Compare the forces of a recording with the full network under the same motion");
  const auto to_verify = add_choice(*verify_command, session);
  add_verbose_option(*verify_command, to_verify->verbose,
                     "every cross-check and reading of the experiment");
  verify_command->footer("Example:\n  tpm hil verify session.tpmrec");
  set_run(*verify_command, session,
          [to_verify, &session] { return verify_hil(*to_verify, session); });

  CLI::App* report = hil.add_subcommand("report", "One page on a session, with figures");
  const auto to_report = add_choice(*report, session);
  add_verbose_option(*report, to_report->verbose,
                     "every cross-check and reading of the experiment");
  add_folder_option(*report, to_report->output)->capture_default_str();
  report->footer("Example:\n  tpm hil report session.tpmrec --folder hil_report");
  set_run(*report, session, [to_report, &session] { return report_hil(*to_report, session); });
}

}  // namespace tpm::app
