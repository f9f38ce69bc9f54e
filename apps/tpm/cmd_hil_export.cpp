// tpm hil export: a recording for other programs.

#include <memory>
#include <utility>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "hil_options.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/session/recording_export.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

struct ExportChoice {
  std::string recording, output;
};

int export_hil(const ExportChoice& choice, const Session& session) {
  const HilRecording recording = read_recording(choice.recording);
  export_recording(recording, sha256_hex(read_file(choice.recording)), choice.output);
  if (session.json()) {
    Json json{{"file", choice.output},
              {"rows", recording.rows.size()},
              {"whole", recording.whole()},
              {"damaged_rows", recording.damaged},
              {"cause", recording.cause()},
              {"remarks", remarks_json(recording_remarks(recording))},
              {"simulated_device", recording.simulated()}};
    add_end(json, {}, {choice.output}, {});
    say("{}", answer_text(session, std::move(json), {{"recording_whole", recording.whole()}}));
  } else {
    std::string text = device_line(recording) + "\n";
    for (const Remark& remark : recording_remarks(recording)) text += remark.text + "\n";
    say("{}wrote {}: {} rows\n", text, choice.output, recording.rows.size());
  }
  return exit_code(recording.whole());
}

}  // namespace

void add_hil_export_command(CLI::App& hil, Session& session) {
  CLI::App* command = hil.add_subcommand("export", "Write a recording as HDF5");
  auto choice = std::make_shared<ExportChoice>();
  add_session_recording(*command, choice->recording);
  command->add_option("-o,--output", choice->output, "File to write (HDF5)")->required();
  add_format_option(*command, session);
  command->footer("Example:\n  tpm hil export session.tpmrec -o session.h5");
  set_run(*command, session, [choice, &session] { return export_hil(*choice, session); });
}

}  // namespace tpm::app
