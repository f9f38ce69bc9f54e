#include "tpm/haptics/verify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/curve/load.hpp"
#include "tpm/haptics/law_reference.hpp"
#include "tpm/haptics/surface_scene.hpp"
#include "tpm/law/law_model.hpp"
#include "tpm/method/ball_by_cvode.hpp"
#include "tpm/method/method.hpp"
#include "tpm/model/model.hpp"
#include "tpm/network/quasistatic.hpp"
#include "tpm/scene/experiment_blocks.hpp"
#include "tpm/scene/scene.hpp"

namespace tpm {
namespace {

constexpr double kNoReference = std::numeric_limits<double>::quiet_NaN();

/// Adds up errors of instants.
class FidelitySum {
 public:
  void add(double commanded_N, double reference_N) {
    add_error(commanded_N - reference_N, reference_N);
  }
  void add_error(double error, double reference_N) {
    if (std::isnan(reference_N)) return;
    squares_ += error * error;
    result_.max_N = std::max(result_.max_N, std::abs(error));
    result_.peak_N = std::max(result_.peak_N, std::abs(reference_N));
    ++result_.instants;
  }
  [[nodiscard]] ForceFidelity take() const {
    ForceFidelity result = result_;
    if (result.instants > 0) {
      result.rms_N = std::sqrt(squares_ / static_cast<double>(result.instants));
    }
    return result;
  }

 private:
  ForceFidelity result_;
  double squares_ = 0.0;
};

/// The rows that hold a motion: not the last one of a session that stopped, which moved nothing.
std::vector<const ServoRecord*> moved_rows(const HilRecording& recording) {
  std::vector<const ServoRecord*> rows;
  for (const ServoRecord& row : recording.rows) {
    if (row.stop == StopCause::none) rows.push_back(&row);
  }
  if (rows.size() < 2) {
    throw bad_input(recording.name, "holds no motion", "a session of at least two cycles");
  }
  return rows;
}

struct Motion {
  std::vector<double> time_s, surface_m;
};

Motion motion_of(const HilRecording& recording, const std::vector<const ServoRecord*>& rows) {
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

std::vector<std::size_t> compared_rows(const HilRecording& recording, std::size_t rows,
                                       double spacing_s) {
  const auto stride = static_cast<std::size_t>(
      std::max(1.0, std::round(spacing_s / recording.session.servo.period_s)));
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < rows; i += stride) chosen.push_back(i);
  return chosen;
}

void judge_phases(Verification& v, const HilRecording& recording,
                  const std::vector<const ServoRecord*>& rows,
                  const std::vector<std::size_t>& compared,
                  const std::vector<double>& reference_size_N) {
  const std::vector<SessionPhase>& phases = recording.session.phases;
  std::vector<FidelitySum> sums(phases.size());
  std::vector<double> depth_squares(phases.size(), 0.0);
  FidelitySum all;
  OperatorScript script = recording.session.operator_script();
  for (std::size_t k = 0; k < compared.size(); ++k) {
    const ServoRecord& row = *rows[compared[k]];
    const auto p = std::min(static_cast<std::size_t>(row.phase), phases.size() - 1);
    sums[p].add_error(v.error_N[k], reference_size_N[k]);
    all.add_error(v.error_N[k], reference_size_N[k]);
    const OperatorAim aim = script.at(v.time_s[k]);
    if (std::isnan(reference_size_N[k])) continue;
    const bool place = aim.aim == OperatorPiece::Aim::place;  // phases that ask for a push: none
    const double asked = place ? aim.value : row.tool_depth_m;
    depth_squares[p] += (row.tool_depth_m - asked) * (row.tool_depth_m - asked);
  }
  v.all = all.take();
  for (std::size_t p = 0; p < phases.size(); ++p) {
    const ForceFidelity force = sums[p].take();
    if (force.instants == 0) continue;
    v.phases.push_back({phases[p], p == 0 ? 0.0 : phases[p - 1].end_s, force,
                        std::sqrt(depth_squares[p] / static_cast<double>(force.instants))});
  }
}

/// How far the reference is from another answer, at its own instants up to the answer's end.
double apart_from_reference(const Verification& v, const std::vector<double>& time_s,
                            const std::vector<double>& answer_N) {
  double most = 0.0;
  std::size_t i = 0;
  for (std::size_t k = 0; k < v.time_s.size() && v.time_s[k] <= time_s.back(); ++k) {
    while (time_s[i] < v.time_s[k]) ++i;  // the instants of the reference are among them
    if (std::isnan(v.reference_N[k]) || std::isnan(answer_N[i])) continue;
    most = std::max(most, std::abs(answer_N[i] - v.reference_N[k]));
  }
  return most;
}

/// The network again, over the first seconds, by an integrator of its own.
void ask_cvode(Verification& v, const HilRecording& recording, const DrivenNetwork& network,
               const Protocol& motion, const VerifyOptions& options) {
  const auto past = std::upper_bound(v.time_s.begin(), v.time_s.end(), options.window_s);
  const std::vector<double> times(v.time_s.begin(), past);
  if (!(options.window_s > 0.0) || times.size() < 2) return;
  MethodSettings settings;
  settings.rule = StepRule::cvode_bdf;
  settings.tolerance = options.window_tolerance;
  const MethodRun run = network_problem(network, motion)->run(settings, times);
  if (run.end != MethodEnd::completed) {
    throw Error(ExitCode::numerical, recording.name,
                "the second opinion by CVODE ends early: " + run.reason,
                "another --window, or 0 s");
  }
  const std::vector<double> answer(run.response.begin(), run.response.end());
  FidelitySum sum;
  for (std::size_t k = 0; k < times.size(); ++k) sum.add(v.commanded_N[k], answer[k]);
  OtherOpinion& opinion = v.others.emplace_back();
  opinion.name = "CVODE (BDF) on what the bonds remember, in balance at each evaluation";
  opinion.start_s = times.front();
  opinion.end_s = times.back();
  opinion.commanded = sum.take();
  opinion.apart_N = apart_from_reference(v, times, answer);
}

/// The star's own models: in closed form on every sample, and CVODES on the reference's motion.
void ask_others(Verification& v, const HilRecording& recording, const Motion& every_sample,
                const Protocol& thinned, const std::vector<const ServoRecord*>& rows,
                const TpmParameters& material, const VerifyOptions& options) {
  const TpmVector parameters = to_vector(material);
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
std::vector<const ServoRecord*>::const_iterator after_phase(
    const std::vector<const ServoRecord*>& rows, std::int32_t phase) {
  return std::partition_point(rows.begin(), rows.end(),
                              [phase](const ServoRecord* row) { return row->phase <= phase; });
}

/// Whether the phases from a ramp or hold on repeat the experiment of the readings: held for the 30
/// s after which they were taken.
bool repeats_experiment(const std::vector<SessionPhase>& phases, std::size_t p) {
  constexpr double kHeld_s = 30.0, kAbout_s = 1.0;
  const std::size_t hold = phases[p].kind == SessionPhaseKind::hold ? p : p + 1;
  if (hold >= phases.size() || phases[hold].kind != SessionPhaseKind::hold) return false;
  const double begin_s = hold == 0 ? 0.0 : phases[hold - 1].end_s;
  return std::abs(phases[hold].end_s - begin_s - kHeld_s) <= kAbout_s;
}

/// Puts the largest commanded force of a ramp, and the one at the end of a hold, beside the
/// readings of the same depth: of sessions on the paper's star or liver that repeat that
/// experiment.
void put_beside_experiment(Verification& v, const HilRecording& recording,
                           const std::vector<const ServoRecord*>& rows) {
  const std::string organ = recording.session.scene.at("organ").value("kind", "");
  if (organ != "star" && organ != "liver") return;
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
    for (const Datum& datum : readings.data) {
      if (datum.label != (ramp ? "peak" : "end") || !datum.value || !datum.depth_m) continue;
      if (std::abs(*datum.depth_m - phases[p].depth_m) > 1e-9) continue;
      v.experiment.push_back(
          {phases[p].depth_m, phases[p].rate_m_per_s, datum.label, *datum.value, commanded_N});
    }
  }
}

/// What is compared, and what was commanded then.
Verification begun(const HilRecording& recording, const std::vector<const ServoRecord*>& rows,
                   const std::vector<std::size_t>& compared) {
  Verification v;
  v.whole = recording.closed && recording.damaged == 0;
  v.end_s = recording.time_s(*rows.back());
  for (const std::size_t i : compared) {
    v.time_s.push_back(recording.time_s(*rows[i]));
    v.depth_m.push_back(rows[i]->tool_depth_m);
    v.commanded_N.push_back(recording.commanded_N(*rows[i]));
  }
  for (const ServoRecord* row : rows) {
    v.model_error_N = std::max(v.model_error_N, row->model_error_N);
  }
  return v;
}

/// In the coordinates of the scene.
BallPlace place_of_ball(const SurfaceScene& surface, const HilRecording& recording,
                        const ServoRecord& row) {
  const Eigen::Map<const Eigen::Vector3d> at_m(row.position_m);
  return {recording.time_s(row),
          surface.ball.start_m + surface.to_model * (at_m - recording.session.servo.surface_m)};
}

/// Where the ball was at the instants compared, in the coordinates of the scene, after where it was
/// a period before the first.
std::vector<BallPlace> places_of_ball(const SurfaceScene& surface, const HilRecording& recording,
                                      const std::vector<const ServoRecord*>& rows,
                                      const std::vector<std::size_t>& compared) {
  std::vector<BallPlace> places{
      {recording.time_s(*rows[compared.front()]) - recording.session.servo.period_s,
       surface.ball.start_m}};
  for (const std::size_t i : compared) {
    places.push_back(place_of_ball(surface, recording, *rows[i]));
  }
  return places;
}

/// How far the ball was from the lines between these places, at most.
double off_the_lines_m(const SurfaceScene& surface, const HilRecording& recording,
                       const std::vector<const ServoRecord*>& rows,
                       const std::vector<BallPlace>& places) {
  double largest_m = 0.0;
  std::size_t next = 1;
  for (const ServoRecord* row : rows) {
    const double time_s = recording.time_s(*row);
    while (next < places.size() && places[next].time_s < time_s) ++next;
    if (next == places.size()) break;
    const BallPlace &a = places[next - 1], &b = places[next];
    const double share = (time_s - a.time_s) / (b.time_s - a.time_s);
    const Eigen::Vector3d at_m = place_of_ball(surface, recording, *row).at_m;
    largest_m = std::max(largest_m, (at_m - a.at_m - share * (b.at_m - a.at_m)).norm());
  }
  return largest_m;
}

/// Forces of the full network on a ball at the places after the first; only every `stride`-th of
/// them is a step. None where there is no equilibrium.
std::vector<std::optional<Eigen::Vector3d>> forces_on_ball(const SurfaceScene& surface,
                                                           const std::vector<BallPlace>& places,
                                                           std::size_t stride) {
  BallOnNetwork network(surface.scene.tissue.bonds(), surface.scene.rest(),
                        surface.scene.tissue.freedom(), surface.ball);
  std::vector<std::optional<Eigen::Vector3d>> forces;
  double before_s = places.front().time_s;
  for (std::size_t k = 1; k < places.size(); k += stride) {
    try {
      forces.emplace_back(network.step(places[k].at_m, places[k].time_s - before_s));
      before_s = places[k].time_s;
    } catch (const Error& error) {  // the network is where it was
      if (error.code() != ExitCode::numerical) throw;
      forces.emplace_back();
    }
  }
  return forces;
}

/// The network under the ball again, by an integrator of its own, from the instant before it is
/// touched: nothing is remembered until then.
/// @param reference forces at the places after the first
void ask_cvode_in_space(Verification& v, const SurfaceScene& surface,
                        const std::vector<BallPlace>& places,
                        const std::vector<std::optional<Eigen::Vector3d>>& reference,
                        const std::vector<const ServoRecord*>& rows,
                        const std::vector<std::size_t>& compared, const VerifyOptions& options) {
  const auto touched = static_cast<std::size_t>(
      std::find_if(reference.begin(), reference.end(),
                   [](const auto& force) { return !force || !force->isZero(0.0); }) -
      reference.begin());
  if (!(options.window_s > 0.0) || touched == reference.size()) return;
  const double end_s = places[touched].time_s + options.window_s;
  std::size_t past = touched + 2;
  while (past < places.size() && places[past].time_s <= end_s) ++past;
  const std::span<const BallPlace> window(places.data() + touched, past - touched);
  // Its error control meets a corner of the motion at each instant compared; this tells forces to
  // some micronewtons already.
  constexpr double kFinest = 1e-8;
  const std::vector<Eigen::Vector3d> answer = ball_forces_by_cvode(
      surface.scene.tissue.bonds(), surface.scene.rest(), surface.scene.tissue.freedom(),
      surface.ball, window, std::max(kFinest, options.window_tolerance));
  FidelitySum sum;
  OtherOpinion& opinion = v.others.emplace_back();
  for (std::size_t i = 1; i < answer.size(); ++i) {
    const std::size_t k = touched + i - 1;
    if (!reference[k]) continue;
    const Eigen::Map<const Eigen::Vector3d> commanded_N(rows[compared[k]]->commanded_N);
    sum.add_error((surface.to_model * commanded_N - answer[i]).norm(), answer[i].norm());
    opinion.apart_N = std::max(opinion.apart_N, (answer[i] - *reference[k]).norm());
  }
  opinion.name = "CVODE (Adams) on what the bonds remember, in balance at each evaluation";
  opinion.start_s = window.front().time_s;
  opinion.end_s = window.back().time_s;
  opinion.commanded = sum.take();
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
  try {
    const QuasiStaticRun run = network.run(motion, v.time_s);
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

/// Another opinion that fails costs nothing but itself.
void ask(Verification& v, const std::string& what, const std::function<void()>& opinion) {
  const std::size_t others = v.others.size();
  try {
    opinion();
  } catch (const Error& error) {
    if (error.code() != ExitCode::numerical) throw;
    v.others.resize(others);
    v.notes.push_back(what + " is missing: " + error.what());
  }
}

void leave_out_what_has_no_reference(Verification& v) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < v.reference_N.size(); ++k) {
    if (std::isnan(v.reference_N[k])) continue;
    for (auto* column : {&v.time_s, &v.reference_N, &v.commanded_N, &v.depth_m, &v.error_N}) {
      (*column)[kept] = (*column)[k];
    }
    ++kept;
  }
  v.without_equilibrium = v.reference_N.size() - kept;
  if (v.without_equilibrium == 0) return;
  v.notes.push_back(
      fmt::format("no equilibrium of the reference at {} of {} instants, which are left "
                  "out; what follows them rests on a motion straight across",
                  v.without_equilibrium, v.reference_N.size()));
  if (2 * kept < v.reference_N.size()) {
    throw Error(ExitCode::numerical, v.reference, v.notes.back(),
                "a motion that the tissue can bear");
  }
  for (auto* column : {&v.time_s, &v.reference_N, &v.commanded_N, &v.depth_m, &v.error_N}) {
    column->resize(kept);
  }
}

Verification verify_in_space(const HilRecording& recording, const VerifyOptions& options) {
  const std::vector<const ServoRecord*> rows = moved_rows(recording);
  const std::vector<std::size_t> compared =
      compared_rows(recording, rows.size(), options.spacing_s);
  constexpr std::size_t kFewest = 4;  // the reference's error is told from every second of them
  if (compared.size() < kFewest) {
    throw bad_input(recording.name, fmt::format("{} instants to compare", compared.size()),
                    "a --spacing that leaves four or more");
  }
  const SurfaceScene surface(recording.session);
  Verification v = begun(recording, rows, compared);
  v.reference = "full nonlinear quasi-static network of " +
                std::to_string(surface.scene.tissue.network.organ.size()) +
                " spheres under the ball, Newton's method with exact tangents in every step";
  v.knots = compared.size();
  const std::vector<BallPlace> places = places_of_ball(surface, recording, rows, compared);
  v.motion_tolerance_m = off_the_lines_m(surface, recording, rows, places);
  const auto fine = forces_on_ball(surface, places, 1);
  const auto coarse = forces_on_ball(surface, places, 2);
  std::vector<double> size_N;
  for (std::size_t k = 0; k < compared.size(); ++k) {
    const Eigen::Map<const Eigen::Vector3d> commanded_N(rows[compared[k]]->commanded_N);
    if (!fine[k]) {
      v.reference_N.push_back(kNoReference);
      v.error_N.push_back(kNoReference);
      size_N.push_back(kNoReference);
      continue;
    }
    const Eigen::Vector3d felt_N = surface.to_model.transpose() * *fine[k];
    v.reference_N.push_back(-recording.session.servo.push.dot(felt_N));
    v.error_N.push_back((commanded_N - felt_N).norm());
    size_N.push_back(fine[k]->norm());
    // The error falls with the square of the step.
    if (k % 2 == 0 && coarse[k / 2]) {
      v.reference_error_N = std::max(v.reference_error_N, (*coarse[k / 2] - *fine[k]).norm() / 3.0);
    }
  }
  judge_phases(v, recording, rows, compared, size_N);
  ask(v, "the second opinion by CVODE",
      [&] { ask_cvode_in_space(v, surface, places, fine, rows, compared, options); });
  leave_out_what_has_no_reference(v);
  return v;
}

/// Depth of the model's tool: of a tool that touches that of the surface, slip included.
std::vector<double> touched_depth_m(const std::vector<const ServoRecord*>& rows) {
  std::vector<double> depth;
  depth.reserve(rows.size());
  for (const ServoRecord* row : rows) {
    const bool touching = (row->flags & kTouching) != 0;
    depth.push_back(touching ? row->surface_depth_m
                             : std::min(row->tool_depth_m, row->surface_depth_m));
  }
  return depth;
}

OtherOpinion opinion_of(const Verification& v, std::string name, const std::vector<double>& time_s,
                        const std::vector<double>& answer_N, const HilRecording& recording,
                        const std::vector<const ServoRecord*>& rows) {
  FidelitySum sum;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    sum.add(recording.commanded_N(*rows[i]), answer_N[i]);
  }
  return {std::move(name), time_s.front(), time_s.back(), sum.take(),
          apart_from_reference(v, time_s, answer_N)};
}

/// The force that was measured along the motion of the last phase, N; none before it.
std::optional<double> measured_at(const HilSession& session, double time_s) {
  const std::vector<double>& measured_N = session.measured_N;
  const double start_s =
      session.phases.size() < 2 ? 0.0 : session.phases[session.phases.size() - 2].end_s;
  const double spacing_s =
      (session.duration_s() - start_s) / static_cast<double>(measured_N.size() - 1);
  const double part = (time_s - start_s) / spacing_s;
  if (part < 0.0) return std::nullopt;
  const auto i = std::min(static_cast<std::size_t>(part), measured_N.size() - 2);
  return measured_N[i] + (part - static_cast<double>(i)) * (measured_N[i + 1] - measured_N[i]);
}

/// What was commanded, and what the law says, beside the recording.
void put_beside_recording(Verification& v, const HilRecording& recording,
                          const std::vector<const ServoRecord*>& rows) {
  const HilSession& session = recording.session;
  if (session.measured_N.size() < 2) return;
  OtherOpinion& opinion = v.others.emplace_back();
  opinion.name =
      fmt::format("MEASURED: the recording {}, its offset taken off", session.phases.back().name);
  FidelitySum sum;
  for (const ServoRecord* row : rows) {
    const auto measured_N = measured_at(session, recording.time_s(*row));
    if (!measured_N) continue;
    if (opinion.end_s == 0.0) opinion.start_s = recording.time_s(*row);
    opinion.end_s = recording.time_s(*row);
    sum.add(recording.commanded_N(*row), *measured_N);
  }
  opinion.commanded = sum.take();
  for (std::size_t k = 0; k < v.time_s.size(); ++k) {
    const auto measured_N = measured_at(session, v.time_s[k]);
    if (!measured_N || std::isnan(v.reference_N[k])) continue;
    opinion.apart_N = std::max(opinion.apart_N, std::abs(*measured_N - v.reference_N[k]));
  }
}

/// A law is asked along every sample of the motion. A Hertz contact that shrinks follows Ting in
/// LawModel and the integral over the whole history in the loop: there the latter is the reference,
/// and how far Ting is stands beside it.
Verification verify_law(const HilRecording& recording, const VerifyOptions& options) {
  const std::vector<const ServoRecord*> rows = moved_rows(recording);
  const std::vector<std::size_t> compared =
      compared_rows(recording, rows.size(), options.spacing_s);
  const LawFile& law = recording.session.law.value();
  Verification v = begun(recording, rows, compared);
  v.knots = rows.size();
  const std::vector<double> depth_m = touched_depth_m(rows);
  std::vector<double> time_s;
  time_s.reserve(rows.size());
  for (const ServoRecord* row : rows) time_s.push_back(recording.time_s(*row));
  const LawModel model(law.spec);
  std::vector<double> values = law.values;
  for (const char* name : {"contact", "offset"}) values[model.index(name)] = 0.0;
  const Response response = model.respond(measured_history(Drive::displacement, time_s, depth_m),
                                          time_s, values, Want::values);
  const std::vector<double> by_model(response.value.begin(), response.value.end());
  const bool branches = law.spec.fractional == Fractional::none;
  const std::vector<double> by_gauss =
      branches ? law_forces_by_gauss(law, time_s, depth_m) : std::vector<double>();
  const bool integral = law.spec.kernel == Kernel::hertz && branches;
  v.reference = integral ? "the law's integral over the recorded motion, by Gauss's rule"
                         : "the law over the recorded motion, by its own quadrature (docs/laws.md)";
  for (const std::size_t i : compared) v.reference_N.push_back((integral ? by_gauss : by_model)[i]);
  for (std::size_t k = 0; k < compared.size(); ++k) {
    v.error_N.push_back(v.commanded_N[k] - v.reference_N[k]);
  }
  judge_phases(v, recording, rows, compared, v.reference_N);
  if (integral) {
    v.others.push_back(
        opinion_of(v, "Ting's solution, as far as it answers", time_s, by_model, recording, rows));
  } else if (branches) {
    v.others.push_back(
        opinion_of(v, "the law's integral by Gauss's rule", time_s, by_gauss, recording, rows));
  }
  if (!v.others.empty() && !integral) v.reference_error_N = v.others.front().apart_N;
  put_beside_recording(v, recording, rows);
  leave_out_what_has_no_reference(v);
  return v;
}

}  // namespace

Verification verify(const HilRecording& recording, const VerifyOptions& options) {
  if (recording.session.model == LoopModelKind::law) return verify_law(recording, options);
  if (recording.session.model == LoopModelKind::surface) return verify_in_space(recording, options);
  const std::vector<const ServoRecord*> rows = moved_rows(recording);
  const Motion motion = motion_of(recording, rows);
  const Tissue tissue = parse_tissue(recording.session.scene, recording.name, {});
  const Probe probe =
      parse_contacts(Json::array({{{"kind", "sphere"}}}), tissue, DocumentPlace{recording.name})
          .front()
          .probe;
  const BondSystem bonds = tissue.bonds();
  QuasiStaticOptions settings;
  settings.tolerance = options.tolerance;
  // As in the loop, the tool takes the sphere along the push and not across it.
  Freedom freedom = tissue.freedom();
  freedom.guide(probe.sphere, probe.direction);
  const DrivenNetwork driven = driven_network(bonds, tissue.network.organ, freedom, {probe}, {});
  const QuasiStatic network(bonds, driven.rest, freedom, probe, settings);

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
  judge_phases(v, recording, rows, compared, v.reference_N);
  ask(v, "the second opinion by CVODE",
      [&] { ask_cvode(v, recording, driven, protocol, options); });
  if (recording.session.model == LoopModelKind::element) {
    ask_others(v, recording, motion, protocol, rows, tissue.element("hil verify"), options);
  }
  v.motion_error_N = options.motion_tolerance_m *
                     recording.header.at("model").at("stiffness_at_once_N_per_m").get<double>();
  put_beside_experiment(v, recording, rows);
  leave_out_what_has_no_reference(v);
  return v;
}

}  // namespace tpm
