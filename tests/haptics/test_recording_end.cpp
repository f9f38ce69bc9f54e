// How a session ended, in everything that is made of its recording.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "hil_scenes.hpp"
#include "run_in.hpp"
#include "support/remarks.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/row_log.hpp"
#include "tpm/haptics/session/recording_export.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/show/hil_report.hpp"
#include "tpm/haptics/show/view_recording.hpp"
#include "tpm/haptics/verify/verify.hpp"
#include "tpmkit/session.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;

/// A recording of the first seconds of a session.
HilRecording ended_recording(const test::TempFolder& folder, double lasts_s) {
  SessionRunOptions options;
  options.recording = folder / "whole.tpmrec";
  (void)run_session(test::parsed(test::short_session()), {}, options);
  HilRecording recording = read_recording(options.recording);
  recording.rows.resize(static_cast<std::size_t>(1e3 * lasts_s));
  return recording;
}

/// As tpm hil run writes it.
void put_recording(const HilRecording& recording, const std::string& file) {
  RowLogWriter log(file, to_text(recording.header), sizeof(ServoRecord));
  for (const ServoRecord& row : recording.rows) log.append(&row);
  if (recording.closed) {
    log.close(to_text(recording.closing));
  } else {
    log.flush();
  }
}

/// With the header and the closing record that it has now.
HilRecording read_again(const HilRecording& recording, const test::TempFolder& folder) {
  put_recording(recording, folder / "changed.tpmrec");
  return read_recording(folder / "changed.tpmrec");
}

struct SaidOfRecording {
  std::string text, brief, page, view;
  Json json, report;
  std::vector<std::string> exported;
};

SaidOfRecording everything_said_of(const HilRecording& recording, const test::TempFolder& folder) {
  const Verification v = verify(recording);
  write_hil_report(recording, v, folder / "page", "");
  export_recording(recording, "", folder / "r.h5");
  put_recording(recording, folder / "viewed.tpmrec");
  show::ViewOptions plain;
  plain.organ = false;
  const Hdf5Reader file(folder / "r.h5");
  return {verification_text(recording, v),
          to_text(short_answer(recording, v)),
          read_file(folder / "page/report.md"),
          view_recording(folder / "viewed.tpmrec", "", plain).description.dump(),
          verification_json(recording, v),
          read_json(folder / "page/report.json"),
          file.has("/remarks/text") ? file.texts("/remarks/text") : std::vector<std::string>()};
}

bool is_among(const std::vector<std::string>& lines, const std::string& words) {
  for (const std::string& line : lines) {
    if (line.find(words) != std::string::npos) return true;
  }
  return false;
}

std::vector<std::string> texts_in(const Json& answer) {
  std::vector<std::string> texts;
  for (const Json& remark : answer.at("remarks")) texts.push_back(remark.at("text"));
  return texts;
}

void check_that_all_say(const SaidOfRecording& said, const std::string& words) {
  CAPTURE(words);
  CHECK_THAT(said.text, Contains(words));
  CHECK_THAT(said.brief, Contains("! " + words));
  CHECK_THAT(said.page, Contains(words));
  CHECK_THAT(said.view, Contains(words));
  CHECK(is_among(texts_in(said.json), words));
  CHECK(is_among(texts_in(said.report), words));
  CHECK(is_among(said.exported, words));
}

TEST_CASE("A recording that was cut off is verified as far as it goes, and is not whole") {
  const test::TempFolder folder;
  HilRecording recording = ended_recording(folder, 2.5);
  recording.closed = false;
  recording = read_again(recording, folder);
  const SaidOfRecording said = everything_said_of(recording, folder);
  check_that_all_say(said, "the recording is cut off at 2.499 s of ");
  CHECK(said.json.at("whole") == false);
  CHECK(said.json.at("cause") == "cut off");
  CHECK(said.json.at("all").at("peak_N") > 0.3);
  CHECK_THAT(said.brief, Contains("2.499 s of 10.5 s"));

  put_recording(recording, folder / "cut.tpmrec");
  const SessionCheck check = verify_session(folder / "cut.tpmrec");
  CHECK_FALSE(check.whole);
  CHECK(test::has_remark(check.remarks, "cut_off"));
  for (const char* const command : {"hil verify cut.tpmrec", "hil export cut.tpmrec -o cut.h5"}) {
    CAPTURE(command);
    const test::ProgramRun run = test::run_in(folder, command);
    CHECK(run.code == 1);
    CHECK_THAT(run.said, Contains("the recording is cut off at 2.499 s"));
  }
  const test::ProgramRun json = test::run_in(folder, "hil verify cut.tpmrec --format json");
  CHECK(json.code == 1);
  const Json verdict = Json::parse(json.said).at("verdicts").at(0);
  CHECK(verdict.at("code") == "recording_whole");
  CHECK(verdict.at("holds") == false);
  CHECK(Hdf5Reader(folder / "cut.h5").numbers("/rows/time_s").size() == recording.rows.size());
}

TEST_CASE("A session that a fault ended is recorded as a whole, and everything says how it ended") {
  const test::TempFolder folder;
  HilRecording recording = ended_recording(folder, 2.0);
  recording.rows.back().stop = StopCause::watchdog;
  recording.closing["cause"] = to_string(StopCause::watchdog);
  recording.closing["detail"] = "no command for 8 ms";
  recording.closing["device_error"] = 7;
  recording.closing["device_error_text"] = "timeout";
  recording.closing["dropped_records"] = 3;
  recording.closing["device_findings"] = remarks_json(
      std::vector<Remark>{{"force_differs", "the service reported 0.5 N where 1 N was commanded"}});
  recording = read_again(recording, folder);
  const SaidOfRecording said = everything_said_of(recording, folder);
  check_that_all_say(said,
                     "the session ended early, at 1.999 s of 10.5 s: watchdog of the device: no "
                     "command for 8 ms (the device said: error 7, timeout)");
  check_that_all_say(said,
                     "the device noticed: the service reported 0.5 N where 1 N was commanded");
  check_that_all_say(said, "3 rows found no room");
  CHECK(said.json.at("whole") == true);
  CHECK(said.json.at("cause") == "watchdog of the device");
  CHECK(said.json.at("detail") == "no command for 8 ms");
  CHECK(said.json.at("device_findings") == recording.closing.at("device_findings"));
  CHECK(said.report.at("cause") == "watchdog of the device");

  put_recording(recording, folder / "ended.tpmrec");
  for (const char* const command :
       {"hil verify ended.tpmrec", "hil export ended.tpmrec -o ended.h5"}) {
    const test::ProgramRun run = test::run_in(folder, command);
    CHECK(run.code == 0);
    CHECK_THAT(run.said, Contains("the session ended early, at 1.999 s of 10.5 s: watchdog"));
  }
}

TEST_CASE("A session that its user stopped is whole, and a finished one has nothing to say") {
  const test::TempFolder folder;
  HilRecording recording = ended_recording(folder, 2.0);
  CHECK(recording_remarks(recording).empty());
  recording.closing["cause"] = to_string(StopCause::signal);
  recording = read_again(recording, folder);
  CHECK(recording.whole());
  CHECK(recording_remarks(recording) ==
        std::vector<Remark>{{"ended_early",
                             "the session ended early, at 1.999 s of 10.5 s: stopped by a signal, "
                             "such as Ctrl-C"}});
  recording.rows.resize(1);
  CHECK_THROWS_WITH(verify(recording),
                    Contains("holds no motion; the session ended early, at 0 s"));
}

TEST_CASE("A session that never touched the tissue has nothing to compare") {
  const test::TempFolder folder;
  const HilRecording recording = ended_recording(folder, 0.5);
  const Verification v = verify(recording);
  CHECK(v.all.peak_N == 0.0);
  CHECK(v.all.max_N == 0.0);
  REQUIRE(v.remarks.size() == 1);
  CHECK(v.remarks.front().code == "no_contact");
  const std::string text = verification_text(recording, v);
  CHECK_THAT(text, Contains("no contact") && !Contains("CV_"));
  const Verification touched = verify(ended_recording(folder, 2.0));
  CHECK(touched.remarks.empty());
}

TEST_CASE("Every cause of an end has its word in an export") {
  const test::TempFolder folder;
  export_recording(ended_recording(folder, 0.1), "", folder / "r.h5");
  const std::vector<std::string> causes = Hdf5Reader(folder / "r.h5").texts("/causes");
  REQUIRE(causes.size() == static_cast<std::size_t>(StopCause::damping) + 1);
  CHECK(causes.back() == "damped for too long");
  for (const std::string& cause : causes) CHECK(cause != "unknown");
}

}  // namespace
}  // namespace tpm::haptics
