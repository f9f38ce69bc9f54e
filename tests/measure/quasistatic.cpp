// Prints the measured numbers of reports/networks/report.md:
// build/release/tests/measure_quasistatic [all | two [E1]]
// With "two" only the ends of the ramp and of the hold are asked for; E1 in Pa, 12000 if none.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <string_view>
#include <vector>

#include "organ_scene.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using tpm::testing::OrganScene;

namespace {

constexpr double kTolerance = 1e-6;
constexpr int kRepeats = 5;

/// Every 0.1 s, and close after both changes of rate.
std::vector<double> output_times(double relaxation_time_s) {
  std::vector<double> times;
  for (int i = 0; i <= 310; ++i) times.push_back(0.1 * i);
  for (const double change_s : {0.0, 2.0}) {
    double after = 1e-2;
    while (after < 20.0) {
      times.push_back(std::min(change_s + after * relaxation_time_s, 31.0));
      after *= 1.5;
    }
  }
  return times;
}

struct Timed {
  QuasiStaticRun run;
  double median_ms = 0.0, least_ms = 0.0;
};

Timed timed_run(const QuasiStatic& solver, const Protocol& protocol,
                const std::vector<double>& times, int repeats) {
  Timed result;
  std::vector<double> taken;
  for (int i = 0; i < repeats; ++i) {
    const std::clock_t start = std::clock();
    result.run = solver.run(protocol, times);
    taken.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  std::sort(taken.begin(), taken.end());
  result.median_ms = taken[taken.size() / 2];
  result.least_ms = taken.front();
  return result;
}

/// The paper's liver with its far side fixed, or with all of its inner layer.
OrganScene liver_scene(bool inner_fixed) {
  if (!inner_fixed) return OrganScene(paper_liver());
  OrganScene scene(paper_liver(), 1.0);
  for (std::size_t i = 0; i < scene.constraints.size(); ++i) {
    if (scene.network.organ.layer[i] == 1) scene.constraints.fix(i);
  }
  return scene;
}

void measure(const OrganScene& scene, bool two, const TpmParameters& of_tissue) {
  fmt::print("{} spheres, {} bonds, {} free coordinates\n", scene.network.organ.size(),
             scene.network.bonds.size(), scene.constraints.count());
  fmt::print("{:>10} {:>9} {:>9} {:>6} {:>6} {:>6} {:>6} {:>7} {:>9} {:>9} {:>9}\n", "tau, s",
             "CPU ms", "least", "steps", "again", "iter", "factor", "solves", "error", "estimate",
             "end, N");
  const Protocol protocol = ramp_and_hold(8e-3, 4e-3, 29.0);
  for (const double tau : {2e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0}) {
    const TpmParameters material = of_tissue.with_relaxation_time(tau);
    const std::vector<double> times = two ? std::vector<double>{2.0, 31.0} : output_times(tau);
    const BondSystem bonds(scene.network, material);
    const Positions& rest = scene.network.organ.position;
    const QuasiStatic solver(bonds, rest, scene.constraints, scene.probe,
                             {.tolerance = kTolerance});
    const QuasiStatic reference(bonds, rest, scene.constraints, scene.probe, {.tolerance = 1e-10});
    const Timed timed = timed_run(solver, protocol, times, kRepeats);
    const QuasiStaticRun exact = reference.run(protocol, times);
    const double peak = exact.response.maxCoeff();
    const QuasiStaticWork& work = timed.run.work;
    const double error = (timed.run.response - exact.response).cwiseAbs().maxCoeff() / peak;
    fmt::print(
        "{:>10g} {:>9.2f} {:>9.2f} {:>6} {:>6} {:>6} {:>6} {:>7} {:>9.1e} {:>9.1e} {:>9.6f}\n", tau,
        timed.median_ms, timed.least_ms, work.steps, work.rejected, work.iterations,
        work.factorisations, work.back_solves, error, timed.run.error_estimate / peak,
        exact.response[two ? 1 : 310]);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bool two = argc > 1 && std::string_view(argv[1]) == "two";
  TpmParameters material;
  if (argc > 2) material.E1_Pa = std::strtod(argv[2], nullptr);
  measure(liver_scene(false), two, material);
  measure(liver_scene(true), two, material);
  return 0;
}
