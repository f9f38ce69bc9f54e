// Declared in tpm/haptics/verify/verify_parts.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <span>

#include "tpm/haptics/session/surface_scene.hpp"
#include "tpm/haptics/verify/verify_parts.hpp"
#include "tpm/organ/steps/ball_by_cvode.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

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
                                      const RowList& rows,
                                      const std::vector<std::size_t>& compared) {
  std::vector<BallPlace> places{
      {recording.time_s(*rows[compared.front()]) - recording.session.servo.period_s,
       surface.ball.start_m}};
  for (const std::size_t i : compared) {
    places.push_back(place_of_ball(surface, recording, *rows[i]));
  }
  return places;
}

/// Largest distance of the ball from the lines between these places.
double off_the_lines_m(const SurfaceScene& surface, const HilRecording& recording,
                       const RowList& rows, const std::vector<BallPlace>& places) {
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
                        surface.scene.tissue.constraints(), surface.ball);
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
/// touched: the viscous state is zero until then.
/// @param reference forces at the places after the first
void ask_cvode_in_space(Verification& v, const SurfaceScene& surface,
                        const std::vector<BallPlace>& places,
                        const std::vector<std::optional<Eigen::Vector3d>>& reference,
                        const RowList& rows, const std::vector<std::size_t>& compared,
                        const VerifyOptions& options) {
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
      surface.scene.tissue.bonds(), surface.scene.rest(), surface.scene.tissue.constraints(),
      surface.ball, window, std::max(kFinest, options.window_tolerance));
  FidelitySum sum;
  CrossCheck& cross_check = v.others.emplace_back();
  for (std::size_t i = 1; i < answer.size(); ++i) {
    const std::size_t k = touched + i - 1;
    if (!reference[k]) continue;
    const Eigen::Map<const Eigen::Vector3d> commanded_N(rows[compared[k]]->commanded_N);
    sum.add_error((surface.to_model * commanded_N - answer[i]).norm(), answer[i].norm());
    cross_check.apart_N = std::max(cross_check.apart_N, (answer[i] - *reference[k]).norm());
  }
  cross_check.name = "CVODE (Adams) on the viscous elongations, in balance at each evaluation";
  cross_check.start_s = window.front().time_s;
  cross_check.end_s = window.back().time_s;
  cross_check.commanded = sum.take();
}

}  // namespace

Verification verify_in_space(const HilRecording& recording, const VerifyOptions& options) {
  const RowList rows = moved_rows(recording);
  const std::vector<std::size_t> compared =
      compared_rows(recording, rows.size(), options.spacing_s);
  constexpr std::size_t kFewest = 4;  // the reference's error is told from every second of them
  if (compared.size() < kFewest) {
    throw bad_input(recording.name, fmt::format("{} instants to compare", compared.size()),
                    "instants closer together: four or more");
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
    const Eigen::Vector3d rendered_N = surface.to_model.transpose() * *fine[k];
    v.reference_N.push_back(-recording.session.servo.push.dot(rendered_N));
    v.error_N.push_back((commanded_N - rendered_N).norm());
    size_N.push_back(fine[k]->norm());
    // The error falls with the square of the step.
    if (k % 2 == 0 && coarse[k / 2]) {
      v.reference_error_N = std::max(v.reference_error_N, (*coarse[k / 2] - *fine[k]).norm() / 3.0);
    }
  }
  compare_phases(v, recording, rows, compared, size_N);
  ask(v, "the cross-check by CVODE",
      [&] { ask_cvode_in_space(v, surface, places, fine, rows, compared, options); });
  leave_out_what_has_no_reference(v);
  return v;
}

}  // namespace tpm::haptics
