#include "tpm/haptics/show/hil_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/printed_number.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/loop/servo_counts.hpp"
#include "tpm/show/draw.hpp"
#include "tpm/show/run_record.hpp"

namespace tpm::haptics {
namespace {

constexpr double kMostError = 0.005;  // of the session's peak force

std::string mN(double force_N) {
  return significant(1e3 * force_N, 3);
}

/// Every `stride`-th value, so that a curve has at most some thousand points.
std::vector<double> thinned(const std::vector<double>& values, double scale = 1.0) {
  constexpr std::size_t kPoints = 4000;
  const std::size_t stride = std::max<std::size_t>(1, values.size() / kPoints);
  std::vector<double> result;
  for (std::size_t i = 0; i < values.size(); i += stride) result.push_back(scale * values[i]);
  return result;
}

/// Where the phases ask the tool to be, mm: a curve for each stretch of time; none while they ask
/// for a push.
std::vector<Series> asked_depths(const HilRecording& recording, const std::vector<double>& time_s) {
  OperatorScript script = recording.session.operator_script();
  std::vector<Series> stretches;
  bool before = false;
  for (const double time : time_s) {
    const OperatorAim aim = script.at(time);
    const bool place = aim.aim == OperatorPiece::Aim::place;
    if (place && !before) {
      stretches.push_back(
          line("asked for", {}, {}, std::string(provenance_name(Provenance::assumed))));
    }
    before = place;
    if (!place) continue;
    stretches.back().add(time, 1e3 * aim.value);
  }
  return stretches;
}

/// Some of the values, so that they can be told from the curve that they lie on.
Series some_points(std::string label, const std::vector<double>& x, const std::vector<double>& y,
                   std::string provenance) {
  constexpr std::size_t kPoints = 120;
  Series series{
      .kind = Series::Kind::points, .label = std::move(label), .provenance = std::move(provenance)};
  const std::size_t stride = std::max<std::size_t>(1, x.size() / kPoints);
  for (std::size_t i = 0; i < x.size(); i += stride) {
    series.add(x[i], y[i]);
  }
  return series;
}

/// Origin of what the device says of itself: the place of the tool, and the work of the hand.
std::string origin_of(const HilRecording& recording) {
  return recording.simulated() ? "simulated" : std::string(provenance_name(Provenance::measured));
}

/// The recording whose motion was repeated, if there is one.
void add_measured(std::vector<Series>& series, const HilRecording& recording) {
  const HilSession& session = recording.session;
  if (session.measured_N.size() < 2) return;
  const double start_s =
      session.phases.size() < 2 ? 0.0 : session.phases[session.phases.size() - 2].end_s;
  const double spacing_s =
      (session.duration_s() - start_s) / static_cast<double>(session.measured_N.size() - 1);
  std::vector<double> time_s;
  for (std::size_t i = 0; i < session.measured_N.size(); ++i) {
    time_s.push_back(start_s + spacing_s * static_cast<double>(i));
  }
  series.push_back(some_points(session.phases.back().name, time_s, session.measured_N,
                               std::string(provenance_name(Provenance::measured))));
}

Figure session_figure(const HilRecording& recording, const Verification& v) {
  const std::vector<double> time = thinned(v.time_s);
  const Axis seconds{"time", "s"};
  Figure figure{
      "session", recording.simulated() ? "The session, on a simulated device" : "The session",
      "Depth of the tool below the surface at rest and where the phases ask it to be, force sent "
      "to "
      "the device on the curve of the reference under the recorded motion, and their difference."};
  std::vector<Series> forces{line("reference", time, thinned(v.reference_N)),
                             some_points("commanded", v.time_s, v.commanded_N, "model")};
  add_measured(forces, recording);
  std::vector<Series> depths{line("tool", time, thinned(v.depth_m, 1e3), origin_of(recording))};
  for (Series& stretch : asked_depths(recording, time)) depths.push_back(std::move(stretch));
  std::vector<Series> errors{line("error", time, thinned(v.error_N, 1e3))};
  const double most_mN = 1e3 * kMostError * v.all.peak_N;
  if (!time.empty()) {
    const std::string limit = fmt::format("{} % of the peak", significant(100.0 * kMostError, 2));
    for (const double side : {-most_mN, most_mN}) {
      errors.push_back(line(limit, {time.front(), time.back()}, {side, side},
                            std::string(provenance_name(Provenance::assumed))));
    }
  }
  figure.panels = {{"motion", seconds, {"depth", "mm"}, std::move(depths)},
                   {"force", seconds, {"contact force", "N"}, std::move(forces)},
                   {"commanded less reference", seconds, {"force error", "mN"}, std::move(errors)}};
  return figure;
}

Figure energy_figure(const HilRecording& recording) {
  std::vector<double> time, observed, leak;
  for (const ServoRecord& row : recording.rows) {
    time.push_back(recording.time_s(row));
    observed.push_back(1e3 * row.observed_J);
    leak.push_back(1e3 * row.leak_J);
  }
  return {"energy",
          "Energy",
          "Work of the hand on what is rendered, which must not fall below zero but for "
          "what the held force leaks, and the leak as predicted, K dx^2/2 a period.",
          {{"energy",
            {"time", "s"},
            {"energy", "mJ"},
            {line("observed", thinned(time), thinned(observed), origin_of(recording)),
             line("predicted leak", thinned(time), thinned(leak))}}}};
}

/// Largest and smallest difference from the readings, in words.
std::string experiment_line(const Verification& v) {
  if (v.experiment.empty()) return "no experiment is repeated: nothing is compared with readings";
  double least = 1e300, most = -1e300;
  for (const BesideExperiment& e : v.experiment) {
    const double part = 100.0 * (e.commanded_N / e.measured_N - 1.0);
    least = std::min(least, part);
    most = std::max(most, part);
  }
  return fmt::format(
      "beside the pig-liver readings of the same indentations: {} to {}, which "
      "compares the material, not the rendering",
      percent_text(least, 0), percent_text(most, 0));
}

/// To be read in a minute: how it ended and whether it could be rendered safely, whether what was
/// commanded is the model, and how that lies beside the experiment.
void add_glance(Document& d, const HilRecording& r, const Verification& v,
                const RecordingSummary& s) {
  d.heading(2, "Safe, faithful, like the experiment?");
  std::vector<Cell> lines;
  for (Remark& remark : recording_remarks(r)) lines.push_back({std::move(remark.text), Tone::bad});
  if (s.cause == to_string(StopCause::finished)) {
    lines.push_back({"the session came to its end", Tone::good});
  }
  if (const auto& rendering = r.opened.rendering) {
    lines.push_back({rendering->verdict, rendering->passive  ? Tone::good
                                         : rendering->stable ? Tone::plain
                                                             : Tone::bad});
    for (std::string& text : rendering->texts()) lines.push_back({std::move(text), Tone::bad});
  }
  lines.push_back(
      {fmt::format("the force commanded is within {} of the reference, in parts of the "
                   "session's peak of {} N",
                   share_words(v.all.max_N, v.all.peak_N), significant(v.all.peak_N, 4)),
       v.all.max_N <= kMostError * v.all.peak_N ? Tone::good : Tone::bad});
  if (r.session.measured_N.empty()) lines.push_back({experiment_line(v)});
  for (const CrossCheck& o : v.others) {
    if (o.measured) {
      lines.push_back({fmt::format("{}: {} mN rms, {} mN at most", o.name, mN(o.commanded.rms_N),
                                   mN(o.commanded.max_N))});
    }
  }
  if (r.simulated()) {
    lines.push_back(
        {"SIMULATED DEVICE: no motor moved and no hand felt these forces. What is "
         "verified is the path from motion to command, not the hardware.",
         Tone::bad});
  }
  d.bullets(std::move(lines));
  d.picture({"session", "The session", ""});
}

void add_identity(Document& d, const HilRecording& r) {
  const RecordingHeader& header = r.opened;
  const RecordedDevice& device = header.device;
  Table table{"", {{"what"}, {"value"}}};
  const auto row = [&](const char* what, std::string value) {
    table.rows.push_back({{what}, {value.empty() ? "not known" : std::move(value)}});
  };
  row("device", device.name);
  row("kind", device.kind);
  row("communication mode", device.communication_mode);
  row("serial", device.serial);
  row("firmware", device.firmware);
  row("library", device.library_version);
  row("model in the loop", header.model.name);
  row("its error", header.model.error_bound);
  row("rate", significant(1.0 / r.session.servo.period_s, 4) + " Hz");
  row("time", header.time);
  row("tpm", header.version);
  row("date", header.notes.date);
  row("operator", header.notes.operator_code);
  row("subject", header.notes.subject_code);
  d.heading(2, "Device and model");
  d.table(std::move(table));
  std::vector<Cell> assumed;
  for (const Remark& assumption : device.assumptions) assumed.push_back({assumption.text});
  if (!assumed.empty()) d.bullets(std::move(assumed));
}

/// Adds the candidates of a planned model.
void add_plan(Document& d, const Json& plan) {
  if (plan.is_null()) return;
  const auto number = [](const Json& value, double scale, const char* unit) {
    return value.is_null() ? std::string("-") : significant(scale * value.get<double>(), 3) + unit;
  };
  Table table{fmt::format("Picked by tpm plan: {}, the cheapest within {} % of the peak at {} Hz",
                          plan.at("choice").get<std::string>(),
                          significant(100.0 * plan.at("tolerance").get<double>(), 3),
                          significant(plan.at("rate_Hz").get<double>(), 4)),
              {{"candidate"}, {"a period, us"}, {"claimed error"}, {"verified"}, {"why not"}}};
  for (const Json& c : plan.at("candidates")) {
    if (c.at("claimed_error").is_null()) continue;
    table.rows.push_back({{c.at("name").get<std::string>()},
                          {number(c.at("period_s"), 1e6, "")},
                          {number(c.at("claimed_error"), 100.0, " %")},
                          {number(c.at("verified_error"), 100.0, " %")},
                          {c.at("reason").get<std::string>()}});
  }
  table.stacks = true;
  d.table(std::move(table));
}

void add_fidelity(Document& d, const Verification& v) {
  d.heading(2, "Fidelity");
  d.paragraph(fmt::format(
      "Reference: {}, under the motion of the surface as recorded ({} knots within {} um, "
      "{}; its own error estimate is {} mN). Over {} instants the commanded force is "
      "off by {} mN rms and {} mN at most, {} of the session's peak of {} N.",
      v.reference, v.knots, significant(1e6 * v.motion_tolerance_m, 3), motion_cost(v, 1e3, "mN"),
      mN(v.reference_error_N), v.all.instants, mN(v.all.rms_N), mN(v.all.max_N),
      share_words(v.all.max_N, v.all.peak_N), significant(v.all.peak_N, 4)));
  std::vector<Cell> others;
  for (const CrossCheck& o : v.others) {
    others.push_back(
        {fmt::format("{}, {} to {} s: {} mN rms, {} mN at most; {} mN from the reference at most",
                     o.name, significant(o.start_s, 4), significant(o.end_s, 4),
                     mN(o.commanded.rms_N), mN(o.commanded.max_N), mN(o.apart_N))});
  }
  for (const Remark& remark : v.remarks) others.push_back({remark.text, Tone::bad});
  if (!others.empty()) d.bullets(std::move(others));
  Table phases = phase_table(v).page(
      "Force error by phase; depth: how well the operator followed, rms", v.phases);
  phases.stacks = true;
  d.table(std::move(phases));
}

void add_experiment(Document& d, const Verification& v) {
  if (v.experiment.empty()) return;
  d.heading(2, "Beside the experiment");
  d.paragraph(
      "Readings of pig liver (Samur et al. 2007, as printed) at the same depths, without "
      "error bars and with a rate that is not stated; the difference says how well the "
      "material of the session is chosen, not how well it is rendered.");
  Table readings = experiment_table(v).page("", v.experiment);
  readings.stacks = true;
  d.table(std::move(readings));
}

void add_timing(Document& d, const HilRecording& r, const RecordingSummary& s) {
  const ServoCounts& n = s.counts;
  d.heading(2, "Timing, limits, end");
  std::vector<Cell> lines;
  lines.push_back(
      {fmt::format("end: {}", s.cause), s.cause == "finished" ? Tone::good : Tone::bad});
  if (!r.closed) {
    lines.push_back({"nothing is said of timing without the closing record", Tone::bad});
  } else if (r.ended.scheduling) {
    lines.push_back({r.ended.host.value()});
    lines.push_back({*r.ended.scheduling});
    const auto add_times = [&](const char* what, const RecordedTimes& t) {
      const auto us = [](double time_s) { return significant(1e6 * time_s, 3); };
      lines.push_back({fmt::format("{}: p50 {} us, p99 {} us, p99.9 {} us, max {} us", what,
                                   us(t.p50_s), us(t.p99_s), us(t.p999_s), us(t.max_s))});
    };
    add_times("woke after the deadline", r.ended.woke_late.value());
    add_times("work of a cycle", r.ended.busy.value());
    lines.push_back({fmt::format("records dropped: {}", r.ended.dropped_records)});
  } else {
    lines.push_back({"virtual time: deadlines are met by definition, nothing is said of timing"});
  }
  lines.push_back({fmt::format(
      "{} cycles; missed periods {}; time guards {}; saturations {}; limited by force {}, "
      "slipped {}, limited while ramping in {}; damped {}",
      s.cycles, n.missed, n.time_guards, n.saturations, n.force_limited, n.slipped, n.ramping_in,
      n.damped)});
  if (n.beyond_model == 0) {
    lines.push_back({"within the range that the model is good for in every cycle"});
  } else {
    lines.push_back(
        {fmt::format("beyond the range that the model is good for in {} cycles, first at {} s",
                     n.beyond_model, significant(s.first_beyond_s, 6)),
         Tone::bad});
  }
  d.bullets(std::move(lines));
}

void add_energy(Document& d, const RecordingSummary& s) {
  d.heading(2, "Energy");
  d.paragraph(fmt::format(
      "Work of the hand on what was rendered: {} mJ at the end, {} mJ at the least. Holding the "
      "force within a period gives energy away, {} mJ in all by K dx^2/2 a period, which the "
      "friction of the device has to take up.",
      significant(1e3 * s.observed_end_J, 4), significant(1e3 * s.observed_least_J, 3),
      significant(1e3 * s.leak_J, 3)));
  d.picture({"energy", "Energy", ""});
}

}  // namespace

ResultTable<PhaseFidelity> phase_table(const Verification& v) {
  using Row = PhaseFidelity;
  using Of = ResultColumn<Row>;
  const double peak_N = v.all.peak_N;
  const auto force = [](auto member) { return [member](const Row& p) { return p.force.*member; }; };
  const auto of_peak = [=](const Row& p) {
    const bool good = p.force.max_N <= kMostError * peak_N;
    return Cell{share_words(p.force.max_N, peak_N), good ? Tone::good : Tone::bad};
  };
  return {{Of("phase", [](const Row& p) { return p.phase.name; }).shown("phase"),
           {"kind", [](const Row& p) { return to_string(p.phase.kind); }},
           Of("start_s", &Row::start_s).shown("start s", 1, 1.0, 5),
           {"instants", force(&ForceFidelity::instants)},
           Of("rms_N", force(&ForceFidelity::rms_N)).shown("rms mN", 1, 1e-3, 3),
           Of("max_N", force(&ForceFidelity::max_N)).shown("max mN", 1, 1e-3, 3),
           Of("peak_N", force(&ForceFidelity::peak_N)).shown("max of peak", 1).in_words(of_peak),
           Of("depth_rms_m", &Row::depth_rms_m).shown("depth um", 1, 1e-6, 3)}};
}

ResultTable<BesideExperiment> experiment_table(const Verification& v) {
  using Row = BesideExperiment;
  using Of = ResultColumn<Row>;
  const auto difference = [](const Row& e) {
    return Cell{percent_text(100.0 * (e.commanded_N / e.measured_N - 1.0), 1)};
  };
  const auto cause = [material = v.material](const Row& e) {
    return cause_of_difference(e, material);
  };
  return {{Of("depth_m", &Row::depth_m).shown("depth mm", 1, 1e-3, 3),
           Of("rate_m_per_s", &Row::rate_m_per_s).shown("rate mm/s", 1, 1e-3, 3),
           Of("label", &Row::label).shown("reading"),
           Of("measured_N", &Row::measured_N, 0).shown("measured N", 1, 1.0, 3),
           Of("commanded_N", &Row::commanded_N).shown("commanded N", 1, 1.0, 3),
           Of("reference_N", &Row::reference_N).shown("difference", 1).in_words(difference),
           {"reached_m", &Row::reached_m},
           Of("cause", cause).shown("because")}};
}

RecordingSummary summary_of(const HilRecording& recording) {
  RecordingSummary s;
  s.cause = recording.cause();
  for (const ServoRecord& row : recording.rows) {
    ++s.cycles;
    if (s.counts.beyond_model == 0 && (row.flags & kBeyondModel) != 0) {
      s.first_beyond_s = static_cast<double>(row.cycle) * recording.session.servo.period_s;
    }
    add_to(s.counts, row);
    if (row.stop != StopCause::none) continue;  // nothing was rendered in the last one
    s.observed_end_J = row.observed_J;
    s.observed_least_J = std::min(s.observed_least_J, row.observed_J);
    s.leak_J = row.leak_J;
  }
  return s;
}

void write_hil_report(const HilRecording& recording, const Verification& v,
                      const std::filesystem::path& folder, const std::string& python) {
  const RecordingSummary summary = summary_of(recording);
  Document d;
  d.title = recording.session.title;
  d.subtitle = device_line(recording);
  add_glance(d, recording, v, summary);
  add_experiment(d, v);
  add_energy(d, summary);
  add_timing(d, recording, summary);
  add_identity(d, recording);
  add_plan(d, recording.opened.model.plan);
  add_fidelity(d, v);
  typeset(d);
  write_document(folder, d, {session_figure(recording, v), energy_figure(recording)}, python);
  Json json = verification_json(recording, v);
  json["rendering"] = recording.header.value("rendering", Json());
  json["closing"] = recording.closing;
  json["observed_end_J"] = rounded(summary.observed_end_J, 6);
  json["observed_least_J"] = rounded(summary.observed_least_J, 6);
  json["leak_J"] = rounded(summary.leak_J, 6);
  write_file(folder / "report.json", to_text(json));
}

}  // namespace tpm::haptics
