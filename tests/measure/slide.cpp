// Prints the measured numbers of reports/haptics/report.md, "Over the surface", of slides that
// follow it:
//     measure_slide SESSION
// The slides of a session of the kind `surface` by the simulated device in virtual time, following
// the surface and straight: how deep the ball was under where it would touch the organ at rest, and
// the force commanded against the push.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "program.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/session/surface_scene.hpp"

using namespace tpm;
using namespace tpm::haptics;

namespace {

struct Range {
  double least = 1e9, most = -1e9, sum = 0.0, squares = 0.0, count = 0.0;
  void see(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
    sum += value;
    squares += value * value;
    ++count;
  }
  [[nodiscard]] double spread() const {
    return std::sqrt(std::max(0.0, squares / count - sum * sum / (count * count)));
  }
};

void run(const HilSession& session, const char* how) {
  const SurfaceScene surface(session);
  const Eigen::Vector3d& push = session.servo.push;
  std::vector<Range> depths(session.phases.size()), forces(session.phases.size());
  LoopModel loop = make_loop_model(session);
  const ServoSettings servo =
      loop_settings(session, loop, check_rendering(session, *loop.model, loop, "virtual"), true);
  const std::shared_ptr<HapticDevice> device = make_device({}, session);
  (void)device->open();
  device->prepare(session.preparation);
  (void)run_in_virtual_time(*device, *loop.model, servo, [&](const ServoRecord& row) {
    if (row.stop != StopCause::none) return;
    const Eigen::Vector3d moved =
        Eigen::Map<const Eigen::Vector3d>(row.position_m) - session.servo.surface_m;
    const Eigen::Vector3d aside = surface.to_model * (moved - moved.dot(push) * push);
    const auto touch =
        surface.ball.depth_to_touch_m(surface.scene.rest(), aside, surface.scene.probe().direction);
    const auto phase = static_cast<std::size_t>(row.phase);
    if (phase >= depths.size() || !touch) return;
    depths[phase].see(moved.dot(push) - *touch);
    forces[phase].see(-push.dot(Eigen::Map<const Eigen::Vector3d>(row.commanded_N)));
  });
  for (std::size_t p = 0; p < session.phases.size(); ++p) {
    if (session.phases[p].kind != SessionPhaseKind::slide) continue;
    fmt::print("{},\"{}\",{:.2f},{:.2f},{:.2f},{:.4f},{:.4f}\n", how, session.phases[p].name,
               1e3 * depths[p].least, 1e3 * depths[p].most, 1e3 * depths[p].spread(),
               forces[p].least, forces[p].most);
  }
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(argc, argv, 1, 1, "measure_slide SESSION", [](const auto& words) {
    HilSession session = read_session(words[0]);
    fmt::print(
        "way,phase,least_depth_mm,most_depth_mm,spread_of_depth_mm,least_push_N,most_push_N\n");
    run(session, "follows");
    for (SessionPhase& phase : session.phases) phase.surface_m.clear();
    run(session, "straight");
  });
}
