#include "tpm/haptics/session/recording_keys.hpp"

#include "tpm/files/keys/more_types.hpp"

namespace tpm::haptics {
namespace {

constexpr double kLargestWhole = 9007199254740991.0;  // 2^53 - 1

KeyForm required_text(const char* name, const char* sentence) {
  return required_key(name, text().form, sentence);
}

KeyForm optional_text(const char* name, const char* sentence) {
  return optional_key(name, text().form, sentence);
}

FormPtr count_form() {
  return whole<std::int64_t>(0, kLargestWhole).form;
}

/// Nanoseconds of a clock: more than doubles count.
FormPtr nanoseconds_form() {
  return whole<std::int64_t>(-9.2e18, 9.2e18).form;
}

template <class T>
Key<T> text_key(const char* name, std::string T::*member, const char* sentence) {
  return key(name, member, text(), sentence);
}

/// Recordings of an earlier tpm have the text alone.
ValueType<Remark> remark_or_text() {
  const ValueType<Remark> type = remark();
  return {
      either_form({type.form, text().form}),
      [read = type.read](const Json& value, const DocumentPlace& place) {
        return value.is_string() ? Remark{"uncoded", value.get<std::string>()} : read(value, place);
      },
      type.write};
}

const Block<RecordedDevice>& recorded_device_block() {
  using D = RecordedDevice;
  static const Block<D> block(
      "recorded_device", "the device of a recording",
      {required(text_key("kind", &D::kind, "virtual, replay or the maker's")),
       required(text_key("name", &D::name, "of the model")),
       required(text_key("serial", &D::serial, "number")),
       required(text_key("firmware", &D::firmware, "its version")),
       required(text_key("library_version", &D::library_version, "of the maker's library")),
       required(text_key("communication_mode", &D::communication_mode, "how it is connected")),
       unread<D>("left_handed", flag().form, "its configuration"),
       unread<D>("hardware", flag().form, "no simulated device"),
       required(key("assumptions", &D::assumptions, list(remark_or_text()),
                    "what was assumed of a simulated device"))});
  return block;
}

FormPtr candidate_form() {
  const FormPtr number_or_null = or_null(number().form);
  return with_others(object_form(
      "plan_candidate", "a model that a plan looked at",
      {required_text("name", "of the model"), required_key("period_s", number_or_null, "of a step"),
       required_key("claimed_error", number_or_null, "in parts of the peak force"),
       required_key("verified_error", number_or_null, "of its check"),
       optional_key("feasible", flag().form, "accurate and fast enough"),
       required_text("reason", "why it was taken or not")}));
}

FormPtr recorded_plan_form() {
  return or_null(with_others(object_form(
      "recorded_plan", "what a planned model was picked from",
      {required_text("choice", "the model that was picked"),
       required_key("tolerance", number().form, "in parts of the peak force"),
       optional_text("tolerance_source", "where the tolerance comes from"),
       required_key("rate_Hz", number().form, "of the loop"),
       optional_text("reference", "what errors are relative to"),
       optional_key("peak_N", number().form, "force of the reference"),
       optional_key("masses_left_out", or_null(number().form), "error of leaving out the masses"),
       required_key("candidates", list_form(candidate_form(), 0), "what was looked at")})));
}

const Block<RecordedModel>& recorded_model_block() {
  static const Block<RecordedModel> block(
      "recorded_model", "what was stepped in the loop",
      {required(text_key("name", &RecordedModel::name, "of the model")),
       required(text_key("error_bound", &RecordedModel::error_bound,
                         "what is known of its distance from the reference")),
       key("instantaneous_stiffness_N_per_m", &RecordedModel::stiffness_N_per_m, number(),
           "at the first touch"),
       key("plan", &RecordedModel::plan, as_json(recorded_plan_form()), "of a planned model")});
  return block;
}

/// Null where nothing was known.
ValueType<std::optional<RecordedRendering>> rendering_type() {
  using R = RecordedRendering;
  static const Block<R> block(
      "recorded_rendering",
      "what was known before the session of how stiff a contact could be rendered",
      {required(text_key("verdict", &R::verdict, "in a word")),
       required(key("passive", &R::passive, flag(), "the contact")),
       required(key("stable", &R::stable, flag(), "the contact")),
       key("remarks", &R::remarks, list(remark()), "that were made"),
       key("warnings", &R::warnings, list(text()),
           "their texts, in recordings of an earlier tpm")});
  return {or_null(with_others(block.form())),
          [](const Json& value, const DocumentPlace& place) {
            return value.is_null() ? std::nullopt : std::optional(block.made(value, place));
          },
          [](const std::optional<R>& value) { return value ? block.write(*value) : Json(); }};
}

const Block<SessionNotes>& notes_block() {
  static const Block<SessionNotes> block(
      "notes", "who took part",
      {text_key("date", &SessionNotes::date, "of the session"),
       text_key("operator_code", &SessionNotes::operator_code, "a code, no name"),
       text_key("subject_code", &SessionNotes::subject_code, "a code, no name")});
  return block;
}

const Block<RecordedTimes>& times_block() {
  static const Block<RecordedTimes> block(
      "time_quantiles", "quantiles of a time",
      {required(key("p50_s", &RecordedTimes::p50_s, number(), "median")),
       required(key("p99_s", &RecordedTimes::p99_s, number(), "of 99 %")),
       required(key("p999_s", &RecordedTimes::p999_s, number(), "of 99.9 %")),
       required(key("max_s", &RecordedTimes::max_s, number(), "largest"))});
  return block;
}

}  // namespace

const Block<RecordingHeader>& recording_header_block() {
  using H = RecordingHeader;
  static const FormPtr clock = or_null(
      object_form("opened", "when the recording was opened; null in virtual time",
                  {optional_key("opened_monotonic_ns", nanoseconds_form(), "CLOCK_MONOTONIC"),
                   optional_text("opened_utc", "date and time")}));
  static const Block<H> block(
      "hil_recording", "",
      {required(unread<H>(
           "format",
           one_of({"tpm hil recording 1", "tpm hil recording 2", "tpm hil recording 3"}).form,
           "of the rows")),
       required(text_key("version", &H::version, "of the tpm that recorded")),
       key("simulated_device", &H::simulated_device, flag(), "no hardware moved"),
       required(key("device", &H::device, recorded_device_block().type(), "what was held")),
       required(key("time", &H::time, one_of({"real", "virtual"}), "on the clock or not")),
       required(
           key("model", &H::model, recorded_model_block().type(), "what was stepped in the loop")),
       unread<H>("clock", clock, "in real time"),
       key("notes", &H::notes, notes_block().type(), "of people"),
       key("rendering", &H::rendering, rendering_type(), "what was known of the contact"),
       key("surface_by_phase_m", &H::surface_by_phase_m, list(list(number())),
           "depth of the organ's surface at even parts of each phase, m"),
       required(key("session", &H::session, as_json(map_form(any("").form)),
                    "the session with its law or scene written out"))});
  return block;
}

const FileKind& recording_header_kind() {
  static const FileKind kind{
      "hil_recording", "The header of a recorded session of tpm hil",
      "What stands before the rows of a .tpmrec file: the session, the device, the model in the "
      "loop. Keys of earlier versions are read as well",
      recording_header_block().form()};
  return kind;
}

const Block<RecordingClosing>& recording_closing_block() {
  using C = RecordingClosing;
  static const FormPtr clock =
      object_form("first_cycle", "in real time: cycle n began n periods after cycle 0",
                  {optional_key("first_cycle_monotonic_ns", nanoseconds_form(),
                                "CLOCK_MONOTONIC of the machine that ran the session"),
                   optional_text("first_cycle_utc", "date and time")});
  static const FormPtr marker =
      object_form("marker", "set by the operator during the session; the row has the flag marked",
                  {required_key("cycle", count_form(), "of the row"),
                   required_key("by", one_of({"key", "button"}).form, "a key is known to 20 ms")});
  static const Block<C> block(
      "hil_closing", "",
      {required(text_key("cause", &C::cause, "why the session ended")),
       text_key("detail", &C::detail, "in words"), unread<C>("cycles", count_form(), "of the loop"),
       unread<C>("counts", map_form(count_form()), "of guards and limits"),
       required(key("dropped_records", &C::dropped_records, whole<std::uint64_t>(0, kLargestWhole),
                    "rows that found no room")),
       required(key("device_error", &C::device_error, whole<int>(-2147483648.0, 2147483647.0),
                    "number of the device's error; 0: none")),
       required(text_key("device_error_text", &C::device_error_text, "the same in words")),
       unread<C>("forces_off", text().form, "how forces were ended"),
       key("host", &C::host, text(), "the machine, in real time"),
       key("scheduling", &C::scheduling, text(), "of the servo thread"),
       key("woke_late", &C::woke_late, times_block().type(), "after the planned instant"),
       key("busy", &C::busy, times_block().type(), "of a cycle"),
       unread<C>("stop_took_s", number().form, "until forces were off"),
       unread<C>("clock", clock, "in real time"),
       unread<C>("markers", list_form(marker, 0), "set by the operator"),
       key("device_findings", &C::device_findings, list(remark()),
           "what the device noticed and what did not end the session; docs/haptics.md lists the "
           "codes, a "
           "device of a caller's own may have others")});
  return block;
}

const FileKind& recording_closing_kind() {
  static const FileKind kind{
      "hil_closing", "The closing record of a recorded session of tpm hil",
      "What stands behind the rows of a .tpmrec file whose session came to an end",
      recording_closing_block().form()};
  return kind;
}

}  // namespace tpm::haptics
