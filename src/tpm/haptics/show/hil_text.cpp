// Declared in tpm/haptics/show/hil_report.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>

#include "tpm/base/lists.hpp"
#include "tpm/base/printed_number.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpm/haptics/show/hil_report.hpp"

namespace tpm::haptics {
namespace {

std::string us(double seconds) {
  const double value = 1e6 * seconds;
  return value < 1000.0 ? significant(value, 3) : fmt::format("{:.0f}", value);
}

std::string device_words(const DeviceIdentity& device) {
  if (device.hardware) {
    return fmt::format("{}, serial {}, communication {}", device.name, device.serial,
                       to_string(device.link));
  }
  return fmt::format("SIMULATED DEVICE, no hardware: {} ({}, communication {})", device.name,
                     device.kind, to_string(device.link));
}

std::string times_text(const char* what, const TimeHistogram& times) {
  if (times.count() == 0) return fmt::format("{}: not counted\n", what);
  return fmt::format("{}: p50 {} us, p99 {} us, p99.9 {} us, max {} us\n", what,
                     us(times.quantile_s(0.5)), us(times.quantile_s(0.99)),
                     us(times.quantile_s(0.999)), us(times.max_s()));
}

/// Null if nothing was counted: the first cycle hung.
Json times_json(const TimeHistogram& times) {
  if (times.count() == 0) return {};
  return {{"p50_s", rounded(times.quantile_s(0.5))},
          {"p99_s", rounded(times.quantile_s(0.99))},
          {"p999_s", rounded(times.quantile_s(0.999))},
          {"max_s", rounded(times.max_s())}};
}

/// Counts in bins that double in width: up to 1 us, 2 us, 4 us, ...
std::vector<std::pair<double, std::uint64_t>> octaves(const TimeHistogram& times) {
  std::vector<std::pair<double, std::uint64_t>> result;
  std::uint64_t inside = 0, next = 0;
  for (std::size_t edge = 1, bin = 0; bin < times.bins().size(); edge *= 2) {
    next = 0;
    for (; bin < std::min(edge, times.bins().size()); ++bin) next += times.bins()[bin];
    result.emplace_back(1e-6 * static_cast<double>(edge), next);
    inside += next;
  }
  if (times.count() > inside) result.emplace_back(times.max_s(), times.count() - inside);
  while (!result.empty() && result.back().second == 0) result.pop_back();
  return result;
}

/// The extrapolation in words.
std::string extrapolation_of(const JitterCheck& check) {
  const TimeHistogram& late = check.outcome.woke_late;
  if (hung(check)) return "nothing, because a cycle hung";
  if (const auto hour_s = once_an_hour_s(check)) {
    return fmt::format("{} us once an hour, {}", us(*hour_s),
                       *hour_s > late.max_s()
                           ? "if the tail beyond 99.9 % falls as an exponential"
                           : "the largest seen, for an exponential tail beyond 99.9 % ends below");
  }
  return fmt::format("too short: {} cycles, {},000 needed", late.count(),
                     kFewestToExtrapolate / 1000);
}

Json stalls_json(const JitterCheck& check) {
  const TimeHistogram& late = check.outcome.woke_late;
  const bool counted = late.count() > 0;
  return {{"beyond_watchdog", counted ? Json(stalls_beyond_watchdog(check)) : Json()},
          {"p9999_s", counted ? Json(rounded(late.quantile_s(0.9999))) : Json()},
          {"watchdog_s", rounded(check.watchdog_s)},
          {"once_an_hour_extrapolated_s", or_null(once_an_hour_s(check))},
          {"extrapolation", extrapolation_of(check)},
          {"upper_95_per_s", or_null(most_stalls_per_s(check))},
          {"upper_95", stall_bound(check)}};
}

std::string stalls_text(const JitterCheck& check) {
  const TimeHistogram& late = check.outcome.woke_late;
  std::string text = "stalls beyond the watchdog: not counted\n";
  if (late.count() > 0) {
    const std::string bound = stall_bound(check);
    text = fmt::format(
        "p99.99 of the wake-ups {} us, the watchdog waits for {} us; stalls beyond it: {}{}{}\n",
        us(late.quantile_s(0.9999)), us(check.watchdog_s), stalls_beyond_watchdog(check),
        hung(check)     ? ", and a cycle that hung"
        : bound.empty() ? ""
                        : ": ",
        bound);
  }
  return text + fmt::format("extrapolated, not measured: {}\n", extrapolation_of(check));
}

/// The device that a rehearsal stands for; empty if it stands for none.
std::string on_hardware_text(const std::optional<RenderingCheck>& rendering,
                             const std::string& kind) {
  if (!rendering) return {};
  return fmt::format("on the device '{}' it would be {}: {}\n", kind,
                     rendering->acceptable() ? "accepted" : "refused", rendering->verdict());
}

Json on_hardware_json(const std::optional<RenderingCheck>& rendering) {
  if (!rendering) return {};
  Json json = to_json(*rendering);
  json["accepted"] = rendering->acceptable();
  return json;
}

Json session_verdict_json(const SessionVerdict& session) {
  return {{"title", session.title},
          {"accepted", session.accepted},
          {"verdict", session.words},
          {"rendering", session.rendering ? to_json(*session.rendering) : Json()},
          {"stands_for", session.on_hardware ? Json(session.hardware_kind) : Json()},
          {"rendering_on_hardware", on_hardware_json(session.on_hardware)}};
}

std::string session_verdict_text(const SessionVerdict& session) {
  return fmt::format("session: {}: {}: {}\n", session.title,
                     session.accepted ? "accepted" : "refused", session.words) +
         on_hardware_text(session.on_hardware, session.hardware_kind);
}

Json fidelity_json(const ForceFidelity& f) {
  return {{"instants", f.instants},
          {"rms_N", rounded(f.rms_N)},
          {"max_N", rounded(f.max_N)},
          {"peak_N", rounded(f.peak_N)}};
}

/// The errors of all phases of one kind.
struct PhaseKindErrors {
  std::string kind;
  std::size_t count = 0, instants = 0;
  double squares = 0.0, max_N = 0.0;
  [[nodiscard]] double rms_N() const { return std::sqrt(squares / static_cast<double>(instants)); }
};

std::vector<PhaseKindErrors> errors_by_kind(const Verification& v) {
  std::map<std::string, PhaseKindErrors> kinds;
  for (const PhaseFidelity& p : v.phases) {
    const std::string name(to_string(p.phase.kind));
    PhaseKindErrors& kind = kinds[name];
    kind.kind = name;
    ++kind.count;
    kind.squares += p.force.rms_N * p.force.rms_N * static_cast<double>(p.force.instants);
    kind.instants += p.force.instants;
    kind.max_N = std::max(kind.max_N, p.force.max_N);
  }
  return mapped<PhaseKindErrors>(kinds, [](const auto& kind) { return kind.second; });
}

std::string newtons(double force_N, int digits = 3) {
  return sized_text(Dimension::force, force_N, digits);
}

ResultTable<PhaseKindErrors> kind_table(double peak_N) {
  using Row = PhaseKindErrors;
  using Of = ResultColumn<Row>;
  const auto of_peak = [=](const Row& k) {
    return peak_N > 0.0 ? Json(k.max_N / peak_N) : Json(nullptr);
  };
  const auto rms = [](const Row& k) { return Cell{newtons(k.rms_N())}; };
  const auto most = [](const Row& k) { return Cell{newtons(k.max_N)}; };
  const auto percent = [=](const Row& k) { return Cell{share_words(k.max_N, peak_N)}; };
  return {{Of("kind", &Row::kind).shown("phase", -10), Of("count", &Row::count).shown("count", 7),
           Of("rms_N", &Row::rms_N).shown("rms", 12).in_words(rms),
           Of("max_N", &Row::max_N).shown("max", 12).in_words(most),
           Of("max_over_peak", of_peak).shown("max/peak", 10).in_words(percent)}};
}

/// Time that was verified: of a session that ended early, of how much.
std::string verified_words(const HilRecording& recording, const Verification& v) {
  const bool finished = recording.cause() == to_string(StopCause::finished);
  return significant(v.end_s, 6) + " s" +
         (finished ? std::string()
                   : " of " + significant(recording.session.duration_s(), 6) + " s");
}

/// motion_cost() in the unit that fits the force.
std::string cost_words(const Verification& v) {
  return v.motion_error_N ? fmt::format("which can cost {}", newtons(*v.motion_error_N))
                          : motion_cost(v, 1.0, "N");
}

std::string said_by_device(const ServoOutcome& o, const std::vector<DeviceFinding>& findings) {
  std::string text;
  if (o.device.error != 0) {
    text += fmt::format("the device said: error {} ({})\n", o.device.error, o.device.error_text);
  }
  for (const DeviceFinding& finding : findings) {
    text += "the device noticed: " + finding.text + "\n";
  }
  return text;
}

/// Machine, device and cycles that were counted.
std::string measured_text(const JitterCheck& check) {
  const ServoOutcome& o = check.outcome;
  std::string text = fmt::format(
      "{}\n{}\n{}\n{} Hz for {} s: {} cycles, {} late, {} periods missed\n",
      device_words(check.device), host_line(), o.scheduling, significant(check.rate_Hz, 4),
      significant(check.duration_s, 4), o.cycles, o.counts.late, o.counts.missed);
  text += times_text("woke after the deadline", o.woke_late);
  text += times_text("work of a cycle", o.busy);
  return text + fmt::format("time guards {}, saturations {}\n", o.counts.time_guards,
                            o.counts.saturations);
}

/// Stalls, and the limits of a session.
std::string limits_text(const JitterCheck& check) {
  const ServoOutcome& o = check.outcome;
  return stalls_text(check) +
         fmt::format(
             "at most {} consecutive periods missed, {} of 1000 cycles late; watchdog {} ms, a "
             "cycle may take {} ms; end: {}\n",
             o.counts.most_consecutive_missed, o.counts.most_late,
             significant(1e3 * check.watchdog_s, 3), significant(1e3 * check.cycle_timeout_s, 3),
             to_string(o.cause));
}

std::string gate_text(const JitterCheck& check) {
  return check.session ? session_verdict_text(*check.session)
                       : "session: none was named, so none was asked for its tissue\n";
}

}  // namespace

Json check_json(const JitterCheck& check) {
  const ServoOutcome& o = check.outcome;
  Json bins = Json::array();
  for (const auto& [edge, count] : octaves(o.woke_late)) {
    bins.push_back({{"up_to_s", rounded(edge)}, {"cycles", count}});
  }
  return {{"simulated_device", !check.device.hardware},
          {"device", to_json(check.device)},
          {"host", host_line()},
          {"scheduling", o.scheduling},
          {"rate_Hz", rounded(check.rate_Hz)},
          {"duration_s", rounded(check.duration_s)},
          {"cycles", o.cycles},
          {"late_cycles", o.counts.late},
          {"missed_periods", o.counts.missed},
          {"time_guards", o.counts.time_guards},
          {"saturations", o.counts.saturations},
          {"woke_late", times_json(o.woke_late)},
          {"busy", times_json(o.busy)},
          {"woke_late_histogram", bins},
          {"stalls", stalls_json(check)},
          {"cause", to_string(o.cause)},
          {"detail", o.detail},
          {"device_error", o.device.error},
          {"device_error_text", std::string(o.device.error_text)},
          {"device_findings", remarks_json(check.findings)},
          {"most_consecutive_missed", o.counts.most_consecutive_missed},
          {"most_late_of_1000", o.counts.most_late},
          {"watchdog_s", rounded(check.watchdog_s)},
          {"cycle_timeout_s", rounded(check.cycle_timeout_s)},
          {"timing_kept", check.timing_kept},
          {"timing", check.timing},
          {"advice", check.advice},
          {"session", check.session ? session_verdict_json(*check.session) : Json()}};
}

std::string check_text(const JitterCheck& check) {
  const ServoOutcome& o = check.outcome;
  std::string text = measured_text(check);
  if (o.woke_late.count() > 0) text += "woke after the deadline, up to\n";
  for (const auto& [edge, count] : octaves(o.woke_late)) {
    text += fmt::format("  {:>8} us {:>10}\n", us(edge), count);
  }
  text += limits_text(check) + said_by_device(o, check.findings);
  return text + "timing: " + check.timing + "\n" + check.advice + "\n" + gate_text(check);
}

ShortAnswer short_answer(const JitterCheck& check) {
  ShortAnswer answer;
  answer.conclusion = separate_lines("timing: " + check.timing + "\n" + gate_text(check));
  answer.limits = separate_lines(measured_text(check) + limits_text(check) + check.advice);
  answer.warnings = separate_lines(said_by_device(check.outcome, check.findings));
  return answer;
}

Json run_json(const HilSession& session, const SessionRun& run) {
  const bool tested = session.law && session.law->adequacy;
  Json outcome = recording_closing(run.outcome);
  if (!run.findings.empty()) outcome["device_findings"] = remarks_json(run.findings);
  return {{"simulated_device", !run.device.hardware},
          {"title", session.title},
          {"device", to_json(run.device)},
          {"model",
           {{"name", run.model.name},
            {"error_bound", run.model.error_bound},
            {"adequacy", tested ? files::to_json(*session.law->adequacy) : Json()},
            {"plan", run.model.plan}}},
          {"rendering", to_json(run.rendering)},
          {"stands_for", run.on_hardware ? Json(run.hardware_kind) : Json()},
          {"rendering_on_hardware", on_hardware_json(run.on_hardware)},
          {"rate_Hz", rounded(1.0 / session.servo.period_s)},
          {"duration_s", rounded(session.duration_s())},
          {"phases", session.phases.size()},
          {"largest_force_N", rounded(run.largest_force_N)},
          {"perceptible", run.largest_force_N >= kLeastFeltForce_N},
          {"time", run.outcome.real_time ? "real" : "virtual"},
          {"outcome", outcome}};
}

std::string run_text(const HilSession& session, const SessionRun& run) {
  const ServoOutcome& o = run.outcome;
  const double lived_s = static_cast<double>(o.cycles) * session.servo.period_s;
  std::string text = fmt::format(
      "{}\n{}\nrendering: {}\nmodel: {}; error: {}\n{} of {} s at {} Hz in {} time, {} phases\n",
      session.title, device_words(run.device), run.rendering.verdict(), run.model.name,
      run.model.error_bound, significant(lived_s, 6), significant(session.duration_s(), 6),
      significant(1.0 / session.servo.period_s, 4), o.real_time ? "real" : "virtual",
      session.phases.size());
  text += on_hardware_text(run.on_hardware, run.hardware_kind);
  if (o.real_time) {
    text += o.scheduling + "\n" + times_text("woke after the deadline", o.woke_late) +
            times_text("work of a cycle", o.busy);
  }
  text += fmt::format(
      "late cycles {}, missed periods {}, time guards {}, saturations {}, limited by force {}, "
      "slipped {}, damped {}, beyond the model {}, records dropped {}\n",
      o.counts.late, o.counts.missed, o.counts.time_guards, o.counts.saturations,
      o.counts.force_limited, o.counts.slipped, o.counts.damped, o.counts.beyond_model,
      o.dropped_records);
  text += fmt::format(
      "largest force {}{}\n", newtons(run.largest_force_N),
      run.largest_force_N >= kLeastFeltForce_N
          ? std::string()
          : fmt::format(": no hand feels it (less than {} N, assumed)", kLeastFeltForce_N));
  text += fmt::format("end: {}{}{}\n", to_string(o.cause), o.detail.empty() ? "" : ": ", o.detail);
  return text + said_by_device(o, run.findings);
}

Json verification_json(const HilRecording& recording, const Verification& v) {
  Json others = Json::array();
  for (const CrossCheck& o : v.others) {
    Json json = fidelity_json(o.commanded);
    json["name"] = o.name;
    json["start_s"] = rounded(o.start_s);
    json["end_s"] = rounded(o.end_s);
    json["apart_from_reference_N"] = rounded(o.apart_N);
    others.push_back(std::move(json));
  }
  return {{"simulated_device", recording.simulated()},
          {"recording", recording.name},
          {"device", recording.header.at("device")},
          {"model", recording.header.at("model")},
          {"reference", v.reference},
          {"whole", v.whole},
          {"damaged_rows", recording.damaged},
          {"cause", recording.cause()},
          {"detail", recording.ended.detail},
          {"device_findings", remarks_json(recording.ended.device_findings)},
          {"without_equilibrium", v.without_equilibrium},
          {"remarks", remarks_json(all_remarks(recording, v))},
          {"end_s", rounded(v.end_s)},
          {"asked_s", rounded(recording.session.duration_s())},
          {"knots", v.knots},
          {"motion_tolerance_m", v.motion_tolerance_m},
          {"motion_error_N", or_null(v.motion_error_N)},
          {"reference_error_N", rounded(v.reference_error_N)},
          {"model_error_N", rounded(v.model_error_N)},
          {"all", fidelity_json(v.all)},
          {"kinds", kind_table(v.all.peak_N).list(errors_by_kind(v))},
          {"phases", phase_table(v).list(v.phases)},
          {"others", others},
          {"experiment", experiment_table(v).list(v.experiment)}};
}

std::string share_words(double part_N, double peak_N) {
  return peak_N > 0.0 ? significant(100.0 * part_N / peak_N, 3) + " %" : "-";
}

std::string motion_cost(const Verification& v, double per_newton, std::string_view unit) {
  if (!v.motion_error_N) return "the instants compared among them";
  return fmt::format("which can cost {} {}", significant(per_newton * *v.motion_error_N, 3), unit);
}

std::string verification_text(const HilRecording& recording, const Verification& v) {
  std::string text = fmt::format(
      "{}\n{}\nverified {} against: {}\nmotion through {} knots within {}, {}; the "
      "reference's own error estimate {}\n",
      recording.session.title, device_line(recording), verified_words(recording, v), v.reference,
      v.knots, sized_text(Dimension::length, v.motion_tolerance_m, 3), cost_words(v),
      newtons(v.reference_error_N));
  const ResultTable<PhaseKindErrors> table = kind_table(v.all.peak_N);
  text += table.text(errors_by_kind(v)) +
          table.line({"all", v.phases.size(), 1, v.all.rms_N * v.all.rms_N, v.all.max_N}) +
          fmt::format("   peak {}\n", newtons(v.all.peak_N, 4));
  for (const Remark& remark : all_remarks(recording, v)) text += "note: " + remark.text + "\n";
  for (const CrossCheck& o : v.others) {
    text += fmt::format("beside: {}, {} to {} s: rms {}, max {}; {} from the reference\n", o.name,
                        significant(o.start_s, 4), significant(o.end_s, 4),
                        newtons(o.commanded.rms_N), newtons(o.commanded.max_N), newtons(o.apart_N));
  }
  for (const BesideExperiment& e : v.experiment) {
    text += fmt::format("experiment: {} mm at {} mm/s, {}: measured {}, commanded {} ({}): {}\n",
                        significant(1e3 * e.depth_m, 3), significant(1e3 * e.rate_m_per_s, 3),
                        e.label, newtons(e.measured_N), newtons(e.commanded_N),
                        percent_text(100.0 * (e.commanded_N / e.measured_N - 1.0), 1),
                        cause_of_difference(e, v.material));
  }
  return text;
}

ShortAnswer short_answer(const HilRecording& recording, const Verification& v) {
  ShortAnswer answer;
  answer.conclusion = {
      fmt::format("{}: the force commanded differs from the reference by {} at most ({} of the "
                  "peak of {}), rms {}",
                  recording.session.title, newtons(v.all.max_N),
                  share_words(v.all.max_N, v.all.peak_N), newtons(v.all.peak_N, 4),
                  newtons(v.all.rms_N)),
      device_line(recording),
      fmt::format("reference: {}; {}, {} instants", v.reference, verified_words(recording, v),
                  v.all.instants)};
  const auto row = [](const std::string& phase, const std::string& count, const std::string& rms,
                      const std::string& most, const std::string& of_peak) {
    return fmt::format("{:<10} {:>7} {:>12} {:>12} {:>10}", phase, count, rms, most, of_peak);
  };
  answer.head = {row("phase", "count", "rms", "max", "max/peak")};
  for (const PhaseKindErrors& k : errors_by_kind(v)) {
    answer.rows.push_back(row(k.kind, std::to_string(k.count), newtons(k.rms_N()), newtons(k.max_N),
                              share_words(k.max_N, v.all.peak_N)));
  }
  answer.limits = {
      fmt::format("limit: motion through {} knots within {}, {}; the reference's own error "
                  "estimate {}; the model's {}",
                  v.knots, sized_text(Dimension::length, v.motion_tolerance_m, 3), cost_words(v),
                  newtons(v.reference_error_N), newtons(v.model_error_N))};
  constexpr std::size_t kShown = 3;  // of cross-checks
  for (std::size_t i = 0; i < std::min(v.others.size(), kShown); ++i) {
    const CrossCheck& o = v.others[i];
    answer.limits.push_back(fmt::format("beside: {}, {} to {} s: {} from the reference", o.name,
                                        significant(o.start_s, 4), significant(o.end_s, 4),
                                        newtons(o.apart_N)));
  }
  if (v.others.size() > kShown) {
    answer.limits.push_back(fmt::format("... and {} more comparisons", v.others.size() - kShown));
  }
  if (!v.experiment.empty()) {
    const auto off = [](const BesideExperiment& e) {
      return std::abs(e.commanded_N / e.measured_N - 1.0);
    };
    const BesideExperiment& worst = *std::ranges::max_element(v.experiment, {}, off);
    answer.limits.push_back(
        fmt::format("experiment: {} readings; farthest at {}, {}: measured {}, commanded {} ({})",
                    v.experiment.size(), sized_text(Dimension::length, worst.depth_m, 3),
                    worst.label, newtons(worst.measured_N), newtons(worst.commanded_N),
                    percent_text(100.0 * (worst.commanded_N / worst.measured_N - 1.0), 1)));
    answer.limits.push_back("because " + cause_of_difference(worst, v.material));
  }
  answer.warnings = remark_texts(all_remarks(recording, v));
  return answer;
}

}  // namespace tpm::haptics
