// Prints the measured numbers of reports/methods/report.md: build/release/tests/measure_condensed
// [SCENE]...
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <vector>

#include "condensed_passivity.hpp"
#include "contact_path.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/scene/scene.hpp"

using namespace tpm;
using namespace tpm::contact;
using namespace tpm::testing;

namespace {

using Path = std::vector<Eigen::Vector3d>;

struct NamedPath {
  std::string name;
  std::vector<Knot> depths;
  bool aside = false;  ///< circles up to 2 mm aside besides
};

double depth_at(const std::vector<Knot>& knots, double time_s) {
  std::size_t k = 1;
  while (k + 1 < knots.size() && knots[k].time_s < time_s) ++k;
  const double share = (time_s - knots[k - 1].time_s) / (knots[k].time_s - knots[k - 1].time_s);
  return knots[k - 1].value + std::clamp(share, 0.0, 1.0) * (knots[k].value - knots[k - 1].value);
}

std::vector<Knot> random_probing(double longest_s) {
  Random random(5);
  std::vector<Knot> knots{{0.0, 0.0}};
  while (knots.back().time_s < longest_s) {
    const double to = 8e-3 * random.uniform();
    const double speed = 1e-3 * std::pow(100.0, random.uniform());
    const double took = std::ceil(1e3 * std::abs(to - knots.back().value) / speed) * 1e-3;
    knots.push_back({knots.back().time_s + std::max(took, 1e-3), to});
    if (random.uniform() < 0.3) knots.push_back({knots.back().time_s + 0.05, to});
  }
  return knots;
}

std::vector<NamedPath> named_paths() {
  return {{"8 mm at 100 mm/s, hold", {{0.0, 0.0}, {0.08, 8e-3}, {0.38, 8e-3}}},
          {"8 mm at 4 mm/s, hold", {{0.0, 0.0}, {2.0, 8e-3}, {4.0, 8e-3}}},
          {"8 mm at 1 mm/s", {{0.0, 0.0}, {8.0, 8e-3}}},
          {"in and out at 100 mm/s", {{0.0, 0.0}, {0.08, 8e-3}, {0.16, 0.0}, {0.3, 0.0}}},
          {"in, hold, out to 1 mm, hold",
           {{0.0, 0.0}, {0.2, 8e-3}, {1.2, 8e-3}, {1.4, 1e-3}, {2.4, 1e-3}}},
          {"random probing", random_probing(4.0)},
          {"circles to 2 mm aside", {{0.0, 0.0}, {0.2, 8e-3}, {0.6, 8e-3}, {0.8, 3e-3}}, true},
          {"random, and aside", random_probing(0.8), true}};
}

struct Scene {
  explicit Scene(const char* file)
      : tissue(read_tissue(file)),
        contact(tissue.network.organ.contact.value()),
        into(-tissue.network.organ.normal.col(static_cast<Eigen::Index>(contact))) {}
  Tissue tissue;
  std::size_t contact;
  Eigen::Vector3d into;

  [[nodiscard]] BondSystem bonds(double relaxation_time_s) const {
    return {tissue.network, tissue.element().with_relaxation_time(relaxation_time_s)};
  }
};

Path path_of(const Scene& scene, const NamedPath& named, double period_s) {
  const auto steps = static_cast<long long>(std::llround(named.depths.back().time_s / period_s));
  const Eigen::Vector3d across = scene.into.unitOrthogonal();
  const Eigen::Vector3d other = scene.into.cross(across);
  Path path;
  for (long long i = 1; i <= steps; ++i) {
    const double t = period_s * static_cast<double>(i);
    const double radius = named.aside ? 2e-3 * std::min(1.0, t / 0.3) : 0.0;
    path.push_back(depth_at(named.depths, t) * scene.into +
                   radius * (std::cos(12.0 * t) * across + std::sin(12.0 * t) * other));
  }
  return path;
}

struct Comparison {
  double peak_N = 0.0, error_N = 0.0, field = 0.0;
  std::vector<double> claims;  ///< claimed over true error
};

/// Against steps of the full network, `finer` of them in each of the contact's.
Comparison compare(const Scene& scene, const CondensedContact& built, double relaxation_time_s,
                   const Path& path, int every) {
  const BondSystem bonds = scene.bonds(relaxation_time_s);
  ContactPath full(bonds, scene.tissue.network.organ.position, scene.tissue.constraints(),
                   scene.contact);
  CondensedContact contact = built.with_relaxation_time(relaxation_time_s);
  Comparison result;
  double field_error = 0.0, field_peak = 0.0;
  Eigen::Matrix3Xd field(3, contact.spheres());
  for (std::size_t i = 0; i < path.size(); ++i) {
    const ContactAnswer answer = contact.step(path[i]);
    const bool last = i + 1 == path.size();
    if ((i + 1) % static_cast<std::size_t>(every) != 0 && !last) continue;
    full.advance(path[i], every * contact.period_s());
    const double off = (answer.force_N - full.force_N()).norm();
    result.error_N = std::max(result.error_N, off);
    result.peak_N = std::max(result.peak_N, full.force_N().norm());
    result.claims.push_back(answer.error_N / off);
    contact.displacements(field);
    const Eigen::Matrix3Xd true_field = full.displacements_m();
    field_error = std::max(field_error, (field - true_field).colwise().norm().maxCoeff());
    field_peak = std::max(field_peak, true_field.colwise().norm().maxCoeff());
  }
  result.field = field_error / field_peak;
  return result;
}

/// Along the normal, against the quasi-static network with fixed steps.
double quasistatic_error(const Scene& scene, const CondensedContact& built,
                         double relaxation_time_s, const NamedPath& named) {
  const BondSystem bonds = scene.bonds(relaxation_time_s);
  Constraints constraints = scene.tissue.constraints();
  constraints.slide(scene.contact, scene.into);
  const Path path = path_of(scene, named, built.period_s());
  std::vector<double> times;
  std::vector<std::size_t> steps;
  for (std::size_t i = 0; i < path.size(); i += std::max<std::size_t>(1, path.size() / 200)) {
    steps.push_back(i);
    times.push_back(
        std::min(built.period_s() * static_cast<double>(i + 1), named.depths.back().time_s));
  }
  QuasiStaticOptions options;
  options.tolerance = 1e-9;
  options.step_s = std::max(0.5 * relaxation_time_s, 4e-3);
  const QuasiStaticRun run = QuasiStatic(bonds, scene.tissue.network.organ.position, constraints,
                                         Probe{scene.contact, scene.into}, options)
                                 .run(Protocol(Drive::displacement, named.depths), times);
  CondensedContact contact = built.with_relaxation_time(relaxation_time_s);
  std::vector<double> force;
  for (const Eigen::Vector3d& at : path) {
    force.push_back(-contact.step(at).force_N.dot(scene.into));
  }
  double error = 0.0;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    error = std::max(error, std::abs(force[steps[k]] - run.response[static_cast<Eigen::Index>(k)]));
  }
  return error / run.response.cwiseAbs().maxCoeff();
}

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// Batches of 100 steps: the clock costs as much as a step.
void print_times(const Scene& scene, const CondensedContact& built) {
  CondensedContact contact = built.with_relaxation_time(0.1);
  const Path path = path_of(scene, named_paths()[6], built.period_s());
  std::vector<double> step_us;
  std::vector<double> field_us;
  Eigen::Matrix3Xd field(3, contact.spheres());
  using Clock = std::chrono::steady_clock;
  const auto us_since = [](Clock::time_point start) {
    return std::chrono::duration<double, std::micro>(Clock::now() - start).count() / 100.0;
  };
  for (int round = 0; round < 200; ++round) {
    for (std::size_t i = 0; i + 100 <= path.size(); i += 100) {
      auto start = Clock::now();
      for (std::size_t k = 0; k < 100; ++k) (void)contact.step(path[i + k]);
      step_us.push_back(us_since(start));
      start = Clock::now();
      for (std::size_t k = 0; k < 100; ++k) contact.displacements(field);
      field_us.push_back(us_since(start));
    }
  }
  fmt::print(
      "a step: median {:.3f} us, least {:.3f}, p99 {:.3f}; all positions besides: median "
      "{:.2f} us, least {:.2f}, p99 {:.2f}\n",
      percentile(step_us, 0.5), percentile(step_us, 0.0), percentile(step_us, 0.99),
      percentile(field_us, 0.5), percentile(field_us, 0.0), percentile(field_us, 0.99));
}

void measure(const char* file) {
  const Scene scene(file);
  const std::clock_t start = std::clock();
  const CondensedContact built =
      build_condensed(scene.tissue.bonds(), scene.tissue.network.organ.position,
                      scene.tissue.constraints(), scene.contact, scene.into);
  fmt::print("\n{}: built in {:.2f} s of CPU\n", scene.tissue.title,
             static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  print_times(scene, built);
  fmt::print("{:>8} {:30} {:>8} {:>9} {:>8} {:>8} {:>8}\n", "tau, s", "path", "peak, N", "error, %",
             "field, %", "claim", "least");
  for (const double tau : {2e-4, 1e-2, 0.1, 1.0, 10.0, 100.0}) {
    for (const NamedPath& named : named_paths()) {
      if (!named.aside) {
        fmt::print("{:>8g} {:30} {:>8} {:>9.4f}\n", tau, named.name, "",
                   100.0 * quasistatic_error(scene, built, tau, named));
        continue;
      }
      const Comparison found =
          compare(scene, built, tau, path_of(scene, named, built.period_s()), tau < 0.05 ? 1 : 4);
      fmt::print("{:>8g} {:30} {:>8.4f} {:>9.4f} {:>8.4f} {:>8.2f} {:>8.2f}\n", tau, named.name,
                 found.peak_N, 100.0 * found.error_N / found.peak_N, 100.0 * found.field,
                 percentile(found.claims, 0.5), percentile(found.claims, 0.0));
    }
  }
  fmt::print("{:>8} {:>14} {:>14} {:>14}  (a million random steps, J)\n", "tau, s", "created",
             "least stored", "most stored");
  for (const double tau : {2e-4, 1e-2, 0.1, 1.0, 100.0}) {
    CondensedContact contact = built.with_relaxation_time(tau);
    const EnergyAccount account =
        account_of_random_motion(contact, scene.into, CondensedOptions{}, 1'000'000, 0);
    fmt::print("{:>8g} {:>14.2e} {:>14.2e} {:>14.2e}\n", tau, account.created_J, account.least_J,
               account.highest_J);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1) {
    for (int i = 1; i < argc; ++i) measure(argv[i]);
    return 0;
  }
  measure(TPM_TEST_SOURCE_DIR "/configs/liver_scene.json");
  measure(TPM_TEST_SOURCE_DIR "/configs/liver_inner_fixed_scene.json");
  return 0;
}
