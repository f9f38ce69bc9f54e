// Declared in tpm/haptics/verify/verify_parts.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tpm/haptics/session/pushed_scene.hpp"
#include "tpm/haptics/verify/verify_parts.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpm/organ/scene/scene_keys.hpp"
#include "tpm/organ/steps/method.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/curve_file.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/model.hpp"

namespace tpm::haptics {
namespace {

struct Motion {
  std::vector<double> time_s, surface_m;
};

Motion motion_of(const HilRecording& recording, const RowList& rows) {
  Motion motion;
  for (const ServoRecord* row : rows) {
    motion.time_s.push_back(recording.time_s(*row));
    motion.surface_m.push_back(row->surface_depth_m);
  }
  return motion;
}

Protocol protocol_of(const Motion& motion, const std::vector<std::size_t>& kept) {
  std::vector<double> time, depth;
  for (const std::size_t i : kept) {
    time.push_back(motion.time_s[i]);
    depth.push_back(motion.surface_m[i]);
  }
  return measured_history(Drive::displacement, time, depth);
}

/// The network again, over the first seconds, by an integrator of its own.
void ask_cvode(Verification& v, const HilRecording& recording, const DrivenNetwork& network,
               const Protocol& motion, const VerifyOptions& options) {
  const auto past = std::upper_bound(v.time_s.begin(), v.time_s.end(), options.window_s);
  const std::vector<double> times(v.time_s.begin(), past);
  if (!(options.window_s > 0.0) || times.size() < 2) return;
  if (motion.peak() == 0.0) return;  // never touched: verify() says so
  MethodSettings settings;
  settings.rule = StepRule::cvode_bdf;
  settings.tolerance = options.window_tolerance;
  const Progress progress("cross-check by CVODE over the window", 1);
  const MethodRun run = network_problem(network, motion)->run(settings, times);
  if (run.end != MethodEnd::completed) {
    throw Error(ExitCode::numerical, recording.name,
                "the cross-check by CVODE ends early: " + run.reason, "another window, or 0 s");
  }
  const std::vector<double> answer(run.response.begin(), run.response.end());
  FidelitySum sum;
  for (std::size_t k = 0; k < times.size(); ++k) sum.add(v.commanded_N[k], answer[k]);
  CrossCheck& cross_check = v.others.emplace_back();
  cross_check.name = "CVODE (BDF) on the viscous elongations, in balance at each evaluation";
  cross_check.start_s = times.front();
  cross_check.end_s = times.back();
  cross_check.commanded = sum.take();
  cross_check.apart_N = apart_from_reference(v, times, answer);
}

/// The star's own models: in closed form on every sample, and CVODES on the reference's motion.
void ask_others(Verification& v, const HilRecording& recording, const Motion& every_sample,
                const Protocol& thinned, const RowList& rows, const TpmVector& parameters,
                const VerifyOptions& options) {
  const auto ask = [&](const char* model, const std::string& name, const Protocol& protocol,
                       std::size_t count) {
    const std::vector<double> times(
        every_sample.time_s.begin(),
        every_sample.time_s.begin() + static_cast<std::ptrdiff_t>(count));
    const Response response = make_model(model)->respond(protocol, times, parameters, Want::values);
    FidelitySum sum;
    for (std::size_t i = 0; i < count; ++i) {
      sum.add(recording.commanded_N(*rows[i]), response.value[static_cast<Eigen::Index>(i)]);
    }
    const std::vector<double> answer(response.value.begin(), response.value.end());
    v.others.push_back(
        {name, times.front(), times.back(), sum.take(), apart_from_reference(v, times, answer)});
  };
  ask("closed_form", "closed form of the star at every sample",
      measured_history(Drive::displacement, every_sample.time_s, every_sample.surface_m),
      rows.size());
  const auto past =
      std::upper_bound(every_sample.time_s.begin(), every_sample.time_s.end(), options.window_s);
  const auto count = static_cast<std::size_t>(past - every_sample.time_s.begin());
  if (options.window_s > 0.0 && count >= 2) {
    ask("cvodes", "CVODES on the element's differential equation", thinned, count);
  }
}

/// The first row after a phase.
RowList::const_iterator after_phase(const RowList& rows, std::int32_t phase) {
  return std::partition_point(rows.begin(), rows.end(),
                              [phase](const ServoRecord* row) { return row->phase <= phase; });
}

/// True if the phases from a ramp or hold on repeat the experiment of the readings: held for the 30
/// s after which they were taken.
bool repeats_experiment(const std::vector<SessionPhase>& phases, std::size_t p) {
  constexpr double kHeld_s = 30.0, kAbout_s = 1.0;
  const std::size_t hold = phases[p].kind == SessionPhaseKind::hold ? p : p + 1;
  if (hold >= phases.size() || phases[hold].kind != SessionPhaseKind::hold) return false;
  const double begin_s = hold == 0 ? 0.0 : phases[hold - 1].end_s;
  return std::abs(phases[hold].end_s - begin_s - kHeld_s) <= kAbout_s;
}

/// The reference in a part of the session: its largest force, or the last.
std::optional<double> reference_in(const Verification& v, double from_s, double to_s,
                                   bool largest) {
  std::optional<double> found;
  for (std::size_t k = 0; k < v.time_s.size(); ++k) {
    if (v.time_s[k] < from_s || v.time_s[k] > to_s || !std::isfinite(v.reference_N[k])) continue;
    found = largest && found ? std::max(*found, v.reference_N[k]) : v.reference_N[k];
  }
  return found;
}

/// Moduli of a scene's material as they stand there, or the name of what it is.
std::string material_words(const Json& scene) {
  const Json material = scene.value("material", Json());
  if (material.is_string()) return material.get<std::string>();
  std::vector<std::string> words;
  for (const auto& [key, value] : material.items()) {
    if (key.starts_with("E") && value.is_string()) {
      words.push_back(key + " " + value.get<std::string>());
    }
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

/// Puts the largest commanded force of a ramp, and the one at the end of a hold, beside the
/// readings of the same depth: of sessions on the paper's star or liver that repeat that
/// experiment.
void put_beside_experiment(Verification& v, const HilRecording& recording, const RowList& rows) {
  const OrganKind organ = scene_block().made(recording.session.scene, {recording.name}).organ.kind;
  if (organ != OrganKind::star && organ != OrganKind::liver) return;
  const PointSet readings = load_points("evren_relaxation");
  const std::vector<SessionPhase>& phases = recording.session.phases;
  for (std::size_t p = 0; p < phases.size(); ++p) {
    const bool ramp = phases[p].kind == SessionPhaseKind::indent;
    if (!ramp && phases[p].kind != SessionPhaseKind::hold) continue;
    if (!repeats_experiment(phases, p)) continue;
    const auto first = after_phase(rows, static_cast<std::int32_t>(p) - 1);
    // The operator lags behind what is shown: the peak may come when the hold has begun.
    const bool held = ramp && p + 1 < phases.size() && phases[p + 1].kind == SessionPhaseKind::hold;
    const auto past = after_phase(rows, static_cast<std::int32_t>(held ? p + 1 : p));
    if (past == first || past == rows.end()) continue;  // cut off before its end
    double commanded_N = recording.commanded_N(**(past - 1));
    if (ramp) {
      for (auto row = first; row != past; ++row) {
        commanded_N = std::max(commanded_N, recording.commanded_N(**row));
      }
    }
    double reached_m = 0.0;
    std::uint32_t flags = 0;
    for (auto row = first; row != past; ++row) {
      reached_m = std::max(reached_m, (*row)->surface_depth_m);
      flags |= (*row)->flags;
    }
    const auto reference =
        reference_in(v, recording.time_s(**first), recording.time_s(**(past - 1)), ramp);
    for (const Datum& datum : readings.data) {
      if (datum.label != (ramp ? "peak" : "end") || !datum.value || !datum.depth_m) continue;
      if (std::abs(*datum.depth_m - phases[p].depth_m) > 1e-9) continue;
      v.experiment.push_back({phases[p].depth_m, phases[p].rate_m_per_s, datum.label, *datum.value,
                              commanded_N, reference, reached_m, flags});
    }
  }
}

/// The motion with a straight line from an instant to a later one.
Protocol cut_across(const Protocol& motion, double from_s, double from, double to_s, double to) {
  std::vector<double> time, depth;
  const auto add = [&](double t, double d) {
    if (!time.empty() && t <= time.back()) return;
    time.push_back(t);
    depth.push_back(d);
  };
  for (const Knot& knot : motion.knots()) {
    if (knot.time_s < from_s) add(knot.time_s, knot.value);
  }
  add(from_s, from);
  add(to_s, to);
  for (const Knot& knot : motion.knots()) {
    if (knot.time_s > to_s) add(knot.time_s, knot.value);
  }
  return measured_history(Drive::displacement, time, depth);
}

/// The reference at the instants compared. Where it has no equilibrium it goes on from the last
/// instant that has one, straight to the next at which the tissue is no deeper than there.
void run_reference(Verification& v, const QuasiStatic& network, const Protocol& motion) {
  Progress progress("the full network at the instants compared", v.time_s.size());
  try {
    // An observer makes a run a quarter longer: the state of every instant is computed for it.
    QuasiStaticObserver see;
    if (progress.is_shown()) see = [&](const QuasiStaticState&) { progress.advance(); };
    const QuasiStaticRun run = network.run(motion, v.time_s, see);
    v.reference_N.assign(run.response.begin(), run.response.end());
    v.reference_error_N = run.error_estimate;
    return;
  } catch (const Error& error) {
    if (error.code() != ExitCode::numerical) throw;
  }
  constexpr int kMostGaps = 100;
  v.reference_N.assign(v.time_s.size(), kNoReference);
  Protocol left = motion;
  std::optional<QuasiStaticState> last;
  std::size_t next = 0;
  for (int gap = 0; gap < kMostGaps && next < v.time_s.size(); ++gap) {
    const std::vector<double> times(v.time_s.begin() + static_cast<std::ptrdiff_t>(next),
                                    v.time_s.end());
    std::optional<QuasiStaticState> reached;
    const auto see = [&](const QuasiStaticState& state) {
      v.reference_N[next++] = state.response;
      reached = state;
    };
    try {
      const QuasiStaticRun run = network.run(left, times, see, last ? &*last : nullptr);
      v.reference_error_N += run.error_estimate;
      return;
    } catch (const Error& error) {
      if (error.code() != ExitCode::numerical) throw;
    }
    if (reached) last = reached;
    if (!last) return;  // not even at rest
    const auto deeper = [&](std::size_t k) {
      return value_at(motion, v.time_s[k]) > last->imposed;
    };
    ++next;
    while (next < v.time_s.size() && deeper(next)) ++next;
    if (next == v.time_s.size()) return;
    left = cut_across(motion, last->time_s, last->imposed, v.time_s[next],
                      value_at(motion, v.time_s[next]));
  }
}

}  // namespace

Verification verify_along_push(const HilRecording& recording, const VerifyOptions& options) {
  const RowList rows = moved_rows(recording);
  const Motion motion = motion_of(recording, rows);
  const Tissue tissue = parse_tissue(recording.session.scene, recording.name, {});
  const SceneContact contact = moved_contact(recording.session, tissue);
  const BondSystem bonds = tissue.bonds();
  QuasiStaticOptions settings;
  settings.tolerance = options.tolerance;
  // As in the loop, the tool takes the spheres along the push and not across it.
  Constraints constraints = tissue.constraints();
  std::vector<Probe> moved;
  for (const std::size_t sphere : spheres_of(contact, tissue.network.organ)) {
    constraints.slide(sphere, contact.probe.direction);
    moved.push_back({sphere, contact.probe.direction});
  }
  const DrivenNetwork driven =
      driven_network(bonds, tissue.network.organ, constraints, std::move(moved), {});
  const QuasiStatic network(bonds, driven.rest, constraints, driven.probes, settings);

  const std::vector<std::size_t> compared =
      compared_rows(recording, rows.size(), options.spacing_s);
  Verification v = begun(recording, rows, compared);
  v.reference = "full nonlinear quasi-static network of " +
                std::to_string(tissue.network.organ.size()) + " spheres, exact exponential update";
  v.motion_tolerance_m = options.motion_tolerance_m;
  const std::vector<std::size_t> kept =
      decimated(motion.time_s, motion.surface_m, options.motion_tolerance_m);
  v.knots = kept.size();
  const Protocol protocol = protocol_of(motion, kept);
  run_reference(v, network, protocol);
  for (std::size_t k = 0; k < compared.size(); ++k) {
    v.error_N.push_back(v.commanded_N[k] - v.reference_N[k]);
  }
  compare_phases(v, recording, rows, compared, v.reference_N);
  ask(v, "the cross-check by CVODE", [&] { ask_cvode(v, recording, driven, protocol, options); });
  if (recording.session.model == "element") {
    ask_others(v, recording, motion, protocol, rows,
               element_constants(tissue.element("hil verify")), options);
  }
  if (const auto stiffness_N_per_m = recording.opened.model.stiffness_N_per_m) {
    v.motion_error_N = options.motion_tolerance_m * *stiffness_N_per_m;
  }
  v.material = material_words(recording.session.scene);
  put_beside_experiment(v, recording, rows);
  leave_out_what_has_no_reference(v);
  return v;
}

}  // namespace tpm::haptics
