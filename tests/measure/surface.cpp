// Prints the measured numbers of reports/haptics/report.md, "Over the surface":
//     measure_surface SESSION STEPS SEED
// The ball of a session of the kind `surface` over its organ. First it is pressed, held, and slid
// 20 mm there and back in three directions, at three depths: the force
// against that of the full network under the same ball (BallOnNetwork), all three components. Then
// random motions in space: the least work drawn, by the trapezoidal rule, and what a step takes, of
// each step the least of three equal runs.
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <string>
#include <vector>

#include "program.hpp"
#include "tpm/base/random.hpp"
#include "tpm/contact/surface_network.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpm/haptics/session/surface_scene.hpp"

using namespace tpm;
using namespace tpm::haptics;

namespace {

using Way = std::vector<Eigen::Vector3d>;

struct Setup {
  explicit Setup(const std::string& file)
      : session(read_session(file)),
        surface(session),
        bonds(surface.scene.tissue.bonds()),
        constraints(surface.scene.tissue.constraints()),
        into(surface.scene.probe().direction),
        x(into.unitOrthogonal()),
        y(into.cross(x)) {}
  [[nodiscard]] SurfaceNetwork network() const {
    return {bonds,
            surface.scene.rest(),
            constraints,
            surface.ball,
            {.period_s = session.servo.period_s}};
  }
  HilSession session;
  SurfaceScene surface;
  BondSystem bonds;
  Constraints constraints;
  Eigen::Vector3d into, x, y;
};

/// Displacements of the ball: in, held, slid 20 mm there and back at 20 mm/s, out.
Way slide_of(const Setup& setup, double depth_m, double angle) {
  const Eigen::Vector3d aside = std::cos(angle) * setup.x + std::sin(angle) * setup.y;
  Way way;
  const auto line = [&way](const Eigen::Vector3d& to, int steps) {
    const Eigen::Vector3d from =
        way.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : way.back();
    for (int i = 1; i <= steps; ++i) way.emplace_back(from + i * (to - from) / steps);
  };
  line(depth_m * setup.into, 500);
  line(depth_m * setup.into, 500);
  line(depth_m * setup.into + 20e-3 * aside, 1000);
  line(depth_m * setup.into, 1000);
  line(-5e-3 * setup.into, 500);
  line(-5e-3 * setup.into, 500);
  return way;
}

void compare(const Setup& setup, double depth_m, double angle) {
  constexpr std::size_t kEvery = 10;
  SurfaceNetwork network = setup.network();
  BallOnNetwork full(setup.bonds, setup.surface.scene.rest(), setup.constraints,
                     setup.surface.ball);
  const Way way = slide_of(setup, depth_m, angle);
  double peak = 0.0, most = 0.0, aside = 0.0, estimate = 0.0;
  int touching = 0, compared = 0, exceeded = 0;
  bool valid = true;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const ContactAnswer answer = network.step(way[i]);
    estimate = std::max(estimate, answer.error_N);
    valid = valid && answer.valid;
    if ((i + 1) % kEvery != 0) continue;
    const Eigen::Vector3d force =
        full.step(setup.surface.ball.start_m + way[i], kEvery * setup.session.servo.period_s);
    peak = std::max(peak, force.norm());
    aside = std::max(aside, (force - force.dot(setup.into) * setup.into).norm());
    most = std::max(most, (answer.force_N - force).norm());
    ++compared;
    exceeded += (answer.force_N - force).norm() > answer.error_N ? 1 : 0;
    touching = std::max(touching, full.touching());
  }
  fmt::print("{:.0f},{:.0f},{},{:.4f},{:.4f},{:.4f},{:.4f},{} of {},{}\n", 1e3 * depth_m,
             angle * 57.29577951308232, touching, peak, aside, 100.0 * most / peak,
             100.0 * estimate / peak, exceeded, compared, valid ? "yes" : "no");
  (void)std::fflush(stdout);
}

/// What the estimate says and what is true, for a material that relaxes in another time: pressed to
/// 4 mm, slid 10 mm aside and back, drawn out, each way from rest to rest, at most so fast. The
/// reference is the full network in eight steps a period.
void claim(const Setup& setup, double speed_m_per_s, double tau_s) {
  constexpr int kParts = 8;
  constexpr double kDeep_m = 4e-3, kFar_m = 10e-3;
  const BondMaterial material = setup.surface.scene.tissue.element().with_relaxation_time(tau_s);
  const BondSystem bonds = setup.bonds.with_materials(setup.surface.scene.tissue.network, material);
  const double period_s = setup.session.servo.period_s;
  SurfaceNetwork network(bonds, setup.surface.scene.rest(), setup.constraints, setup.surface.ball,
                         {.period_s = period_s});
  BallOnNetwork full(bonds, setup.surface.scene.rest(), setup.constraints, setup.surface.ball);
  Way way;
  const auto line = [&](const Eigen::Vector3d& to) {
    const Eigen::Vector3d from =
        way.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : way.back();
    const double fastest = 1.5;  // over the mean, of a polynomial that starts and ends at rest
    const int steps =
        static_cast<int>(std::ceil(fastest * (to - from).norm() / (speed_m_per_s * period_s)));
    for (int i = 1; i <= steps; ++i) {
      const double part = static_cast<double>(i) / steps;
      way.emplace_back(from + part * part * (3.0 - 2.0 * part) * (to - from));
    }
  };
  line(kDeep_m * setup.into);
  line(kDeep_m * setup.into + kFar_m * setup.x);
  line(kDeep_m * setup.into);
  line(-1e-3 * setup.into);
  double peak = 0.0, most = 0.0, estimate = 0.0, linear = 0.0;
  int exceeded = 0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& at : way) {
    const ContactAnswer answer = network.step(at);
    Eigen::Vector3d force;
    for (int i = 1; i <= kParts; ++i) {
      force = full.step(
          setup.surface.ball.start_m + before + static_cast<double>(i) / kParts * (at - before),
          period_s / kParts);
    }
    before = at;
    peak = std::max(peak, force.norm());
    most = std::max(most, (answer.force_N - force).norm());
    estimate = std::max(estimate, answer.error_N);
    linear = std::max(linear, network.linear_error_N());
    exceeded += (answer.force_N - force).norm() > answer.error_N ? 1 : 0;
  }
  fmt::print("{:.0f},{},{:.4f},{:.5f},{:.5f},{:.2g},{} of {}\n", 1e3 * speed_m_per_s, tau_s, peak,
             100.0 * most / peak, 100.0 * estimate / peak, 100.0 * linear / peak, exceeded,
             way.size());
  (void)std::fflush(stdout);
}

/// A random walk over the surface, on and off, smooth at the scale of a period.
Way wander(const Setup& setup, long steps, std::uint64_t seed) {
  constexpr double kAside_m = 20e-3;
  Random random(seed);
  const auto about = [&](double size) { return size * (2.0 * random.uniform() - 1.0); };
  Way way;
  Eigen::Vector3d at = -5e-3 * setup.into, aim = at, speed = Eigen::Vector3d::Zero();
  for (long i = 0; i < steps; ++i) {
    if (i % 100 == 0) {
      aim =
          (1e-3 + about(6e-3)) * setup.into + about(kAside_m) * setup.x + about(kAside_m) * setup.y;
    }
    speed += 1e-3 * (400.0 * (aim - at) - 30.0 * speed);
    at += 1e-3 * speed;
    way.push_back(at);
  }
  return way;
}

void random_motions(const Setup& setup, long steps, std::uint64_t seed) {
  const Way way = wander(setup, steps, seed);
  SurfaceNetwork network = setup.network();
  std::vector<double> times(way.size(), 1e9);
  double work = 0.0, least = 0.0, most = 0.0, fastest = 0.0;
  long touching = 0, several = 0, not_valid = 0, balances = 0;
  for (int round = 0; round < 3; ++round) {
    network.reset();
    Eigen::Vector3d before = Eigen::Vector3d::Zero(), force = before;
    for (std::size_t i = 0; i < way.size(); ++i) {
      const std::int64_t begin = now_ns();
      const ContactAnswer answer = network.step(way[i]);
      times[i] = std::min(times[i], 1e-3 * static_cast<double>(now_ns() - begin));
      if (round > 0) continue;
      work -= 0.5 * (force + answer.force_N).dot(way[i] - before);
      least = std::min(least, work);
      most = std::max(most, work);
      if (i > 0) fastest = std::max(fastest, (way[i] - before).norm());
      touching += network.touching() > 0 ? 1 : 0;
      several += network.touching() > 1 ? 1 : 0;
      not_valid += answer.valid ? 0 : 1;
      balances += network.balances();
      before = way[i];
      force = answer.force_N;
    }
  }
  std::sort(times.begin(), times.end());
  const auto at = [&](double share) {
    return times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
  };
  fmt::print(
      "random: {} steps, up to {:.0f} mm/s, {} in contact, {} of them with several spheres, {} not "
      "valid, {:.3f} balances a step\nleast work {:.3g} J, largest {:.3g} J, at the end {:.3g} "
      "J\na step: p50 {:.1f} us, p99 {:.1f} us, largest {:.1f} us\n",
      way.size(), 1e3 * fastest / setup.session.servo.period_s, touching, several, not_valid,
      static_cast<double>(balances) / static_cast<double>(way.size()), least, most, work, at(0.5),
      at(0.99), at(1.0));
}

void run(const std::string& file, long steps, std::uint64_t seed) {
  const std::clock_t begin = std::clock();
  const Setup setup(file);
  (void)setup.network();
  fmt::print("ball of {:.0f} mm, spheres of {:.0f} mm; built in {:.2f} s of processor time\n",
             1e3 * setup.surface.ball.radius_m, 1e3 * setup.surface.ball.sphere_radius_m,
             static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  fmt::print(
      "depth_mm,direction_degree,spheres_touched,peak_N,largest_aside_N,largest_difference_percent,"
      "largest_estimate_percent,instants_beyond_estimate,valid\n");
  for (const double depth_m : {2e-3, 4e-3, 8e-3}) {
    for (const double angle : {0.0, 2.0, 4.0}) compare(setup, depth_m, angle);
  }
  fmt::print(
      "speed_mm_per_s,tau_s,peak_N,largest_error_percent,largest_estimate_percent,"
      "part_of_linear_elongations_percent,periods_beyond_estimate\n");
  for (const double speed : {0.02, 0.2}) claim(setup, speed, 10.0);
  for (const double tau_s : {0.1, 0.01, 0.003, 0.001}) claim(setup, 0.2, tau_s);
  random_motions(setup, steps, seed);
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(
      argc, argv, 3, 3, "measure_surface SESSION STEPS SEED",
      [](const auto& words) { run(words[0], std::stol(words[1]), std::stoul(words[2])); });
}
