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

FormPtr recorded_device_form() {
  return object_form("recorded_device", "the device of a recording",
                     {required_text("kind", "virtual, replay or the maker's"),
                      required_text("name", "of the model"), required_text("serial", "number"),
                      required_text("firmware", "its version"),
                      required_text("library_version", "of the maker's library"),
                      required_text("communication_mode", "how it is connected"),
                      optional_key("left_handed", flag().form, "its configuration"),
                      optional_key("hardware", flag().form, "no simulated device"),
                      required_key("assumptions", list_form(text().form, 0),
                                   "what was assumed of a simulated device")});
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

FormPtr recorded_model_form() {
  return object_form(
      "recorded_model", "what was stepped in the loop",
      {required_text("name", "of the model"),
       required_text("error_bound", "what is known of its distance from the reference"),
       optional_key("instantaneous_stiffness_N_per_m", number().form, "at the first touch"),
       optional_key("plan", recorded_plan_form(), "of a planned model")});
}

FormPtr times_form() {
  return object_form("time_quantiles", "quantiles of a time",
                     {required_key("p50_s", number().form, "median"),
                      required_key("p99_s", number().form, "of 99 %"),
                      required_key("p999_s", number().form, "of 99.9 %"),
                      required_key("max_s", number().form, "largest")});
}

}  // namespace

const FileKind& recording_header_kind() {
  const auto made = [] {
    const FormPtr clock = or_null(
        object_form("opened", "when the recording was opened; null in virtual time",
                    {optional_key("opened_monotonic_ns", nanoseconds_form(), "CLOCK_MONOTONIC"),
                     optional_text("opened_utc", "date and time")}));
    const FormPtr notes = object_form(
        "notes", "who took part",
        {optional_text("date", "of the session"), optional_text("operator_code", "a code, no name"),
         optional_text("subject_code", "a code, no name")});
    const FormPtr rendering = or_null(with_others(object_form(
        "recorded_rendering",
        "what was known before the session of how stiff a contact could be rendered",
        {required_text("verdict", "in a word"), required_key("passive", flag().form, "the contact"),
         required_key("stable", flag().form, "the contact"),
         required_key("warnings", list_form(text().form, 0), "that were given")})));
    return FileKind{
        "hil_recording", "The header of a recorded session of tpm hil",
        "What stands before the rows of a .tpmrec file: the session, the device, the model in the "
        "loop. Keys of earlier versions are read as well",
        object_form(
            "hil_recording", "",
            {required_key(
                 "format",
                 one_of({"tpm hil recording 1", "tpm hil recording 2", "tpm hil recording 3"}).form,
                 "of the rows"),
             required_text("version", "of the tpm that recorded"),
             optional_key("simulated_device", flag().form, "no hardware moved; true if missing"),
             required_key("device", recorded_device_form(), "what was held"),
             required_key("time", one_of({"real", "virtual"}).form, "on the clock or not"),
             required_key("model", recorded_model_form(), "what was stepped in the loop"),
             optional_key("clock", clock, "in real time"),
             optional_key("notes", notes, "of people"),
             optional_key("rendering", rendering, "what was known of the contact"),
             optional_key("surface_by_phase_m", list_form(list_form(number().form, 0), 0),
                          "depth of the organ's surface at even parts of each phase, m"),
             required_key("session", map_form(any("").form),
                          "the session with its law or scene written out")})};
  };
  static const FileKind kind = made();
  return kind;
}

const FileKind& recording_closing_kind() {
  const auto made = [] {
    const FormPtr clock =
        object_form("first_cycle", "in real time: cycle n began n periods after cycle 0",
                    {optional_key("first_cycle_monotonic_ns", nanoseconds_form(),
                                  "CLOCK_MONOTONIC of the machine that ran the session"),
                     optional_text("first_cycle_utc", "date and time")});
    const FormPtr marker = object_form(
        "marker", "set by the operator during the session; the row has the flag marked",
        {required_key("cycle", count_form(), "of the row"),
         required_key("by", one_of({"key", "button"}).form, "a key is known to 20 ms")});
    const FormPtr finding = object_form(
        "device_finding", "of the device, that ended nothing",
        {required_text("code",
                       "its kind, as docs/haptics.md lists them; a device of a caller's own "
                       "may have others"),
         required_text("text", "in words, with its numbers")});
    return FileKind{
        "hil_closing", "The closing record of a recorded session of tpm hil",
        "What stands behind the rows of a .tpmrec file whose session came to an end",
        object_form(
            "hil_closing", "",
            {required_text("cause", "why the session ended"), optional_text("detail", "in words"),
             optional_key("cycles", count_form(), "of the loop"),
             optional_key("counts", map_form(count_form()), "of guards and limits"),
             required_key("dropped_records", count_form(), "rows that found no room"),
             required_key("device_error", whole<int>(-2147483648.0, 2147483647.0).form,
                          "number of the device's error; 0: none"),
             required_text("device_error_text", "the same in words"),
             optional_text("forces_off", "how forces were ended"),
             optional_text("host", "the machine, in real time"),
             optional_text("scheduling", "of the servo thread"),
             optional_key("woke_late", times_form(), "after the planned instant"),
             optional_key("busy", times_form(), "of a cycle"),
             optional_key("stop_took_s", number().form, "until forces were off"),
             optional_key("clock", clock, "in real time"),
             optional_key("markers", list_form(marker, 0), "set by the operator"),
             optional_key("device_findings", list_form(finding, 0),
                          "what the device noticed and that ended nothing")})};
  };
  static const FileKind kind = made();
  return kind;
}

}  // namespace tpm::haptics
