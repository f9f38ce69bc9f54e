#include "tpm/haptics/session/recording.hpp"

#include <fmt/format.h>

#include <cstring>
#include <limits>

#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/document_place.hpp"
#include "tpm/files/row_log.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

namespace tpm::haptics {
namespace {

constexpr const char* kFormat = "tpm hil recording 3";

/// Bytes of a row in the formats that are read; 0: none of them.
std::size_t row_bytes_of(std::string_view format) {
  if (format == kFormat) return sizeof(ServoRecord);
  if (format == "tpm hil recording 2") return kSecondRowBytes;
  return format == "tpm hil recording 1" ? kFirstRowBytes : 0;
}

Json times_json(const TimeHistogram& times) {
  return {{"p50_s", times.quantile_s(0.5)},
          {"p99_s", times.quantile_s(0.99)},
          {"p999_s", times.quantile_s(0.999)},
          {"max_s", times.max_s()}};
}

void set_surface(HilSession& session, std::vector<std::vector<double>> by_phase,
                 const std::string& where) {
  if (by_phase.size() != session.phases.size()) {
    throw bad_input(where, "has surfaces for another number of phases", "one list for each");
  }
  for (std::size_t i = 0; i < by_phase.size(); ++i) {
    session.phases[i].surface_m = std::move(by_phase[i]);
  }
}

/// Empty where a header says none.
std::string format_of(const Json& header) {
  if (!header.is_object() || !header.contains("format")) return {};
  const Json& format = header.at("format");
  return format.is_string() ? format.get<std::string>() : std::string();
}

/// A recording holds its tissue and its motion: names of files would be looked for beside whoever
/// reads it.
void require_written_out(const Json& session, const DocumentPlace& place) {
  const auto refuse = [](const DocumentPlace& at) {
    return bad_input(at.where, "is the name of a file",
                     "what the file held, as tpm hil run writes it");
  };
  for (const char* key : {"law", "scene"}) {
    const Json model = session.value("model", Json());
    if (!model.is_object() || !model.contains(key) || !model.at(key).is_string()) continue;
    throw refuse(place.key("model").key(key));
  }
  const Json motion = session.value("motion", Json());
  if (motion.is_object() && motion.contains("recording")) {
    throw refuse(place.key("motion").key("recording"));
  }
}

/// Of a session in real time.
void require_times(const RecordingClosing& closing, const DocumentPlace& place) {
  const auto require = [&](const char* key, bool there) {
    if (there || !closing.scheduling) return;
    throw bad_input(place.key(key).where, "is missing", "it beside 'scheduling'");
  };
  require("host", closing.host.has_value());
  require("woke_late", closing.woke_late.has_value());
  require("busy", closing.busy.has_value());
}

/// "1.66 s of 6.5 s"
std::string end_words(const HilRecording& recording) {
  return fmt::format("{} s of {} s", significant(recording.end_s(), 6),
                     significant(recording.session.duration_s(), 6));
}

}  // namespace

Json to_json(const ServoCounts& counts) {
  return {{"time_guards", counts.time_guards},
          {"saturations", counts.saturations},
          {"force_limited", counts.force_limited},
          {"slipped", counts.slipped},
          {"ramping_in", counts.ramping_in},
          {"damped", counts.damped},
          {"beyond_model", counts.beyond_model},
          {"late", counts.late},
          {"missed", counts.missed},
          {"most_consecutive_missed", counts.most_consecutive_missed},
          {"most_late_of_1000", counts.most_late}};
}

Json to_json(const DeviceIdentity& device) {
  return {{"kind", device.kind},
          {"name", device.name},
          {"serial", device.serial},
          {"firmware", device.firmware},
          {"library_version", device.library_version},
          {"communication_mode", to_string(device.link)},
          {"left_handed", device.left_handed},
          {"hardware", device.hardware},
          {"assumptions", remarks_json(device.assumptions)}};
}

Json recording_header(const HilSession& session, const DeviceIdentity& device,
                      const LoopModel& model, bool real_time, const SessionNotes& notes,
                      const Json& rendering) {
  Json said = parse_json(session.text, "session");
  if (session.law) {
    said["model"]["law"] = files::to_json(*session.law);
  } else {
    said["model"]["scene"] = session.scene;
  }
  Json surface = Json::array();
  for (const SessionPhase& phase : session.phases) surface.push_back(phase.surface_m);
  Json clock;  // null in virtual time: the same bytes each time
  if (real_time) {
    const std::int64_t opened_ns = now_ns();
    clock = {{"opened_monotonic_ns", opened_ns}, {"opened_utc", utc_of(opened_ns)}};
  }
  return {{"format", kFormat},
          {"clock", clock},
          {"version", version()},
          {"simulated_device", !device.hardware},
          {"device", to_json(device)},
          {"time", real_time ? "real" : "virtual"},
          {"model",
           {{"name", model.name},
            {"error_bound", model.error_bound},
            {"instantaneous_stiffness_N_per_m", model.stiffness_N_per_m},
            {"plan", model.plan}}},
          {"notes",
           {{"date", notes.date},
            {"operator_code", notes.operator_code},
            {"subject_code", notes.subject_code}}},
          {"rendering", rendering},
          {"surface_by_phase_m", std::move(surface)},
          {"session", std::move(said)}};
}

Json recording_closing(const ServoOutcome& outcome) {
  Json json{{"cause", to_string(outcome.cause)},
            {"detail", outcome.detail},
            {"cycles", outcome.cycles},
            {"counts", to_json(outcome.counts)},
            {"dropped_records", outcome.dropped_records},
            {"device_error", outcome.device.error},
            {"device_error_text", std::string(outcome.device.error_text)},
            {"forces_off", to_string(outcome.device.forces_off)}};
  if (!outcome.real_time) return json;
  json["host"] = host_line();
  json["scheduling"] = outcome.scheduling;
  json["woke_late"] = times_json(outcome.woke_late);
  json["busy"] = times_json(outcome.busy);
  json["stop_took_s"] = outcome.stop_took_s;
  if (outcome.first_cycle_monotonic_ns != 0) {
    json["clock"] = {{"first_cycle_monotonic_ns", outcome.first_cycle_monotonic_ns},
                     {"first_cycle_utc", utc_of(outcome.first_cycle_monotonic_ns)}};
  }
  return json;
}

double HilRecording::end_s() const {
  return rows.empty() ? 0.0 : time_s(rows.back());
}

double HilRecording::time_s(const ServoRecord& row) const {
  return static_cast<double>(row.cycle) * session.servo.period_s;
}

double HilRecording::commanded_N(const ServoRecord& row) const {
  return -session.servo.push.dot(
      Eigen::Vector3d(row.commanded_N[0], row.commanded_N[1], row.commanded_N[2]));
}

HilRecording read_recording(const std::filesystem::path& file) {
  const RowLog log = read_row_log(file);
  const DocumentPlace at_header{file.string() + ": header"};
  HilRecording recording;
  recording.name = file.filename().string();
  Json header = parse_json(log.header, at_header.where);
  const std::size_t row_bytes = row_bytes_of(format_of(header));
  if (row_bytes == 0 || log.row_bytes != row_bytes) {
    throw bad_input(file.string(), "is a recording of another version of tpm", kFormat);
  }
  recording.header = checked(std::move(header), recording_header_kind(), at_header.where);
  recording.opened = recording_header_block().made(recording.header, at_header);
  const std::string at_session = at_header.where + ": session";
  require_written_out(recording.opened.session, DocumentPlace{at_session});
  // A recorded session did fit into its device.
  DeviceLimits boundless = limits_of("omega7");
  boundless.reach_m = std::numeric_limits<double>::infinity();
  boundless.stop_along_x_m = 0.0;
  recording.session = parse_session(recording.opened.session, at_session, {}, boundless);
  if (recording.opened.surface_by_phase_m) {
    set_surface(recording.session, *recording.opened.surface_by_phase_m,
                at_header.key("surface_by_phase_m").where);
  }
  recording.rows.resize(log.rows);
  for (std::size_t i = 0; i < log.rows; ++i) {
    std::memcpy(&recording.rows[i], log.bytes.data() + i * row_bytes, row_bytes);
  }
  if (recording.session.servo.surface_before_hand_m && log.rows > 0) {
    const Eigen::Map<const Eigen::Vector3d> hand_m(recording.rows.front().position_m);
    recording.session.servo.surface_m =
        hand_m + *recording.session.servo.surface_before_hand_m * recording.session.servo.push;
  }
  recording.closed = log.closed;
  recording.damaged = log.damaged;
  if (log.closed) {
    const DocumentPlace at{file.string() + ": closing record"};
    recording.closing =
        checked(parse_json(log.closing, at.where), recording_closing_kind(), at.where);
    recording.ended = recording_closing_block().made(recording.closing, at);
    require_times(recording.ended, at);
  }
  return recording;
}

std::string damage_line(const HilRecording& recording) {
  if (recording.damaged > 0) {
    return fmt::format(
        "the recording is damaged: {} of {} rows are not as they were written, and "
        "left out{}",
        recording.damaged, recording.rows.size() + recording.damaged,
        recording.closed ? "" : "; it has no closing record");
  }
  if (recording.closed) return "";
  return fmt::format("the recording is cut off at {}: no closing record says how the session ended",
                     end_words(recording));
}

std::string early_end_line(const HilRecording& recording) {
  if (!recording.closed || recording.cause() == to_string(StopCause::finished)) return "";
  const RecordingClosing& closing = recording.ended;
  return fmt::format(
      "the session ended early, at {}: {}{}{}", end_words(recording),
      recording.cause() == to_string(StopCause::signal) ? "stopped by a signal, such as Ctrl-C"
                                                        : recording.cause(),
      closing.detail.empty() ? "" : ": " + closing.detail,
      closing.device_error == 0 ? ""
                                : fmt::format(" (the device said: error {}, {})",
                                              closing.device_error, closing.device_error_text));
}

std::vector<Remark> recording_remarks(const HilRecording& recording) {
  std::vector<Remark> remarks;
  const auto add = [&](const char* code, std::string line) {
    if (!line.empty()) remarks.push_back({code, std::move(line)});
  };
  add(recording.damaged > 0 ? "damaged" : "cut_off", damage_line(recording));
  add("ended_early", early_end_line(recording));
  if (!recording.closed) return remarks;
  if (const auto dropped = recording.ended.dropped_records; dropped > 0) {
    add("rows_dropped",
        fmt::format("{} rows found no room while the session ran, and are missing", dropped));
  }
  for (const DeviceFinding& finding : recording.ended.device_findings) {
    add("device_finding", "the device noticed: " + finding.text);
  }
  return remarks;
}

std::string device_line(const HilRecording& recording) {
  const RecordedDevice& device = recording.opened.device;
  if (!recording.simulated()) {
    return fmt::format("{}, serial {}, firmware {}, library {}, communication {}", device.name,
                       device.serial, device.firmware, device.library_version,
                       device.communication_mode);
  }
  return fmt::format("SIMULATED DEVICE, no hardware: {} ({}, communication {})", device.name,
                     device.kind, device.communication_mode);
}

}  // namespace tpm::haptics
