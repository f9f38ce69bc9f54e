// Prints the measured numbers of docs/haptics.md, "Over the surface":
//     measure_surface SESSION RADIUS_MM STEPS SEED
// A patch of the session's tissue around its contact, a condensed model at each place. First a tool
// held still between the first place and each of its neighbours, pressed 4 mm within 1 s and held
// for 4 s: the force against that of the whole nonlinear network in which the spheres are driven
// together by the same shares. Then a slow slide over the patch at 4 mm of depth; then random
// motions in space: the least work drawn, by the trapezoidal rule, and what a step takes (least of
// three equal runs of each step).
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <string>
#include <vector>

#include "tpm/core/error.hpp"
#include "tpm/core/random.hpp"
#include "tpm/haptics/session.hpp"
#include "tpm/haptics/surface_patch.hpp"
#include "tpm/network/quasistatic.hpp"
#include "tpm/servo/real_time.hpp"

using namespace tpm;

namespace {

constexpr double kPeriod_s = 1e-3, kDepth_m = 4e-3, kToolRadius_m = 5e-3;

struct Setup {
  Setup(const std::string& file, double radius_m)
      : session(read_session(file)),
        tissue(parse_tissue(session.scene, file, session.folder)),
        first(tissue.network.organ.contact.value()),
        facing(facing_spheres(tissue, first)),
        surface(surface_patch(
            tissue, first,
            {.radius_m = radius_m, .period_s = kPeriod_s, .tool_radius_m = kToolRadius_m})) {
    for (const std::size_t sphere : facing) {
      modelled += (place(sphere) - place(first)).norm() <= radius_m ? 1 : 0;
    }
  }
  [[nodiscard]] Eigen::Vector3d place(std::size_t sphere) const {
    return tissue.network.organ.position.col(static_cast<Eigen::Index>(sphere));
  }
  [[nodiscard]] Eigen::Vector3d into(std::size_t sphere) const {
    return -tissue.network.organ.normal.col(static_cast<Eigen::Index>(sphere));
  }
  /// Centre of the tool that touches a sphere's top.
  [[nodiscard]] Eigen::Vector3d on(std::size_t sphere) const {
    return place(sphere) - (kToolRadius_m + tissue.network.organ.radius) * into(sphere);
  }

  HilSession session;
  Tissue tissue;
  std::size_t first;
  std::vector<std::size_t> facing;
  SurfaceContact surface;
  int modelled = 0;
};

/// Pressed between two places and held: the largest difference from the network, over its peak.
void compare(Setup& setup, std::size_t other, double part) {
  const Eigen::Vector3d from = (1.0 - part) * setup.on(setup.first) + part * setup.on(other);
  const Eigen::Vector3d into =
      ((1.0 - part) * setup.into(setup.first) + part * setup.into(other)).normalized();
  constexpr int kRamp = 1000, kSteps = 5000;
  // A tool on the line between two tops stands a little off the surface: begin where it touches.
  setup.surface.reset();
  const double start_m = setup.surface.step(from).depth_m;
  setup.surface.reset();
  const Eigen::Vector3d touch = from - start_m * into;
  std::vector<double> time, force;
  for (int i = 1; i <= kSteps; ++i) {
    const double depth = kDepth_m * std::min(1.0, static_cast<double>(i) / kRamp);
    const SurfaceContact::Answer answer = setup.surface.step(touch + depth * into);
    if (i % 50 != 0) continue;
    time.push_back(kPeriod_s * i);
    force.push_back(-answer.force_N.dot(into));
  }
  std::vector<Probe> probes;
  Freedom freedom = setup.tissue.freedom();
  for (std::size_t k = 0; k < setup.facing.size(); ++k) {
    const double share = setup.surface.depth_m(k) / kDepth_m;
    if (share <= 1e-9) continue;
    const std::size_t sphere = setup.facing[k];
    freedom.guide(sphere, setup.into(sphere));
    probes.push_back({sphere, setup.into(sphere), share});
  }
  const BondSystem bonds = setup.tissue.bonds();
  QuasiStaticOptions options;
  options.tolerance = 1e-8;
  const Protocol ramp(Drive::displacement, {{0.0, 0.0}, {1.0, kDepth_m}, {5.0, kDepth_m}}, "press");
  const QuasiStaticRun run =
      QuasiStatic(bonds, setup.tissue.network.organ.position, freedom, Probes(probes), options)
          .run(ramp, time);
  double peak = 0.0, most = 0.0;
  for (std::size_t i = 0; i < time.size(); ++i) {
    const double expected = run.response[static_cast<Eigen::Index>(i)];
    peak = std::max(peak, expected);
    if (std::abs(force[i] - expected) > std::abs(most)) most = force[i] - expected;
  }
  fmt::print("{},{:.2f},{},{:.4f},{:+.2f}\n", other + 1, part, probes.size(), peak,
             100.0 * most / peak);
  (void)std::fflush(stdout);
}

void slide(Setup& setup, std::size_t other) {
  setup.surface.reset();
  constexpr int kRamp = 1000, kSlide = 8000;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  double least = 1e9, most = 0.0, jump = 0.0, aside = 0.0;
  for (int i = 1; i <= kRamp + kSlide; ++i) {
    const double part = std::clamp(static_cast<double>(i - kRamp) / kSlide, 0.0, 1.0);
    const double depth = kDepth_m * std::min(1.0, static_cast<double>(i) / kRamp);
    const Eigen::Vector3d into =
        ((1.0 - part) * setup.into(setup.first) + part * setup.into(other)).normalized();
    const Eigen::Vector3d at =
        (1.0 - part) * setup.on(setup.first) + part * setup.on(other) + depth * into;
    const Eigen::Vector3d force = setup.surface.step(at).force_N;
    if (i > kRamp) {
      const double along = -force.dot(into);
      least = std::min(least, along);
      most = std::max(most, along);
      aside = std::max(aside, (force + along * into).norm());
      jump = std::max(jump, (force - before).norm());
    }
    before = force;
  }
  fmt::print(
      "slide to sphere {} in 8 s: force {:.4f} to {:.4f} N, aside at most {:.4f} N, largest "
      "change in a period {:.3g} N\n",
      other + 1, least, most, aside, jump);
}

/// A random walk over the patch, on and off, smooth at the scale of a period.
std::vector<Eigen::Vector3d> wander(const Setup& setup, long steps, std::uint64_t seed,
                                    double radius_m) {
  Random random(seed);
  const Eigen::Vector3d into = setup.into(setup.first), origin = setup.on(setup.first);
  const Eigen::Vector3d x = into.unitOrthogonal(), y = into.cross(x);
  const auto about = [&](double size) { return size * (2.0 * random.uniform() - 1.0); };
  std::vector<Eigen::Vector3d> way;
  Eigen::Vector3d at = origin - 5e-3 * into, aim = at, speed = Eigen::Vector3d::Zero();
  for (long i = 0; i < steps; ++i) {
    if (i % 100 == 0) {
      aim = origin + (1e-3 + about(6e-3)) * into + about(radius_m) * x + about(radius_m) * y;
    }
    speed += kPeriod_s * (400.0 * (aim - at) - 30.0 * speed);
    at += kPeriod_s * speed;
    way.push_back(at);
  }
  return way;
}

void random_motions(Setup& setup, long steps, std::uint64_t seed, double radius_m) {
  const std::vector<Eigen::Vector3d> way = wander(setup, steps, seed, radius_m);
  std::vector<double> times(way.size(), 1e9);
  double work = 0.0, least = 0.0, most = 0.0, pull = 0.0;
  long touching = 0, several = 0, trusted = 0;
  int awake = 0;
  const Eigen::Vector3d into = setup.into(setup.first);
  for (int round = 0; round < 3; ++round) {
    setup.surface.reset();
    Eigen::Vector3d before = way.front(), force = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < way.size(); ++i) {
      const std::int64_t begin = now_ns();
      const SurfaceContact::Answer answer = setup.surface.step(way[i]);
      times[i] = std::min(times[i], 1e-3 * static_cast<double>(now_ns() - begin));
      if (round > 0) continue;
      work -= 0.5 * (force + answer.force_N).dot(way[i] - before);
      least = std::min(least, work);
      most = std::max(most, work);
      pull = std::max(pull, answer.force_N.dot(into));
      touching += answer.touching > 0 ? 1 : 0;
      several += answer.touching > 1 ? 1 : 0;
      trusted += answer.touching > 0 && answer.trusted ? 1 : 0;
      awake = std::max(awake, answer.awake);
      before = way[i];
      force = answer.force_N;
    }
  }
  std::sort(times.begin(), times.end());
  const auto at = [&](double share) {
    return times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
  };
  fmt::print(
      "random: {} steps, {} in contact, {} of them with several places, {} trusted, at most "
      "{} awake\nleast work {:.3g} J, largest {:.3g} J; largest pull into the tissue {:.3g} "
      "N\na step: p50 {:.2f} us, p99 {:.2f} us, largest {:.2f} us\n",
      way.size(), touching, several, trusted, awake, least, most, pull, at(0.5), at(0.99), at(1.0));
}

int run(const std::string& file, double radius_m, long steps, std::uint64_t seed) {
  const std::clock_t begin = std::clock();
  Setup setup(file, radius_m);
  fmt::print("{} places, {} with a model, built in {:.1f} s of processor time\n",
             setup.surface.places(), setup.modelled,
             static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  fmt::print("towards_sphere,part_of_way,spheres_driven,peak_N,largest_difference_percent\n");
  compare(setup, setup.facing.at(1), 0.0);
  for (std::size_t k = 1; k <= 3; ++k) {
    for (const double part : {0.25, 0.5}) compare(setup, setup.facing.at(k), part);
  }
  slide(setup, setup.facing.at(1));
  random_motions(setup, steps, seed, 0.6 * radius_m);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    fmt::print(stderr, "measure_surface SESSION RADIUS_MM STEPS SEED\n");
    return 2;
  }
  try {
    return run(argv[1], 1e-3 * std::stod(argv[2]), std::stol(argv[3]), std::stoul(argv[4]));
  } catch (const std::exception& error) {
    fmt::print(stderr, "measure_surface: {}\n", error.what());
    return 3;
  }
}
