// Prints the measured numbers of reports/networks/report.md:
// build/release/tests/measure_inertial
#include <fmt/format.h>

#include <ctime>
#include <initializer_list>
#include <limits>

#include "far_side.hpp"
#include "tpm/organ/balance/inertial.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

struct Scene {
  explicit Scene(const TpmParameters& p)
      : network(build_network(paper_liver(), {}, "liver")),
        bonds(network, p),
        constraints(tpm_measure::held_on_the_far_side(network.organ)),
        probe{*network.organ.contact, Eigen::Vector3d::UnitZ()},
        mass(sphere_masses_kg(network.organ)) {}
  Network network;
  BondSystem bonds;
  Constraints constraints;
  Probe probe;
  Eigen::VectorXd mass;
};

template <class Work>
double cpu_seconds(Work&& work) {
  const std::clock_t begin = std::clock();
  work();
  return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

/// The 31 s of ramp and hold, asked for in the hold only: there the inertia's own forces are over.
struct Reference {
  Protocol protocol = ramp_and_hold(8e-3, 4e-3, 29.0);
  std::vector<double> times;
  Eigen::VectorXd force;
  double seconds = 0.0;
};

Reference quasi_static(const Scene& scene) {
  Reference reference;
  for (int i = 1; i <= 29; ++i) reference.times.push_back(2.0 + i);
  const auto force = [&](double tolerance) {
    return QuasiStatic(scene.bonds, scene.network.organ.position, scene.constraints, scene.probe,
                       {tolerance})
        .run(reference.protocol, reference.times)
        .response;
  };
  reference.force = force(1e-9);
  constexpr int kRepetitions = 20;
  Eigen::VectorXd usual;
  reference.seconds = cpu_seconds([&] {
                        for (int i = 0; i < kRepetitions; ++i) usual = force(1e-6);
                      }) /
                      kRepetitions;
  fmt::print(
      "quasi-static at 1e-6: {:.2f} ms, {:.6f} N at the end; largest error in the hold {:.1e}\n",
      1e3 * reference.seconds, usual.tail(1)[0],
      (usual - reference.force).cwiseAbs().maxCoeff() / reference.force.maxCoeff());
  return reference;
}

struct Outcome {
  double seconds = 0.0;
  double error_at_end = 0.0;
};

Outcome measure(const Scene& scene, const Reference& reference, const InertialOptions& options) {
  const Inertial inertial(scene.bonds, scene.network.organ.position, scene.constraints, scene.probe,
                          scene.mass, options);
  InertialRun run;
  Outcome outcome;
  outcome.seconds = cpu_seconds([&] { run = inertial.run(reference.protocol, reference.times); });
  const Eigen::VectorXd error =
      (run.response - reference.force).cwiseAbs() / reference.force.tail(1)[0];
  outcome.error_at_end = error.tail(1)[0];
  fmt::print(
      "{:<10} {:>5} {:>9.0e} {:>8} {:>8} {:>8} {:>8} {:>9.3f} {:>9.0f} {:>10.1e} {:>10.1e}\n",
      options.newton == NewtonSolver::klu ? "KLU" : "eliminated", options.highest_order,
      options.tolerance, run.work.steps, run.work.rejected, run.work.newton_iterations,
      run.work.factorisations, outcome.seconds, outcome.seconds / reference.seconds,
      outcome.error_at_end, error.maxCoeff());
  return outcome;
}

InertialOptions options_of(int order) {
  InertialOptions options;
  options.highest_order = order;
  return options;
}

void measure_material(double eta1) {
  TpmParameters p;
  p.eta1_Pa_s = eta1;
  const Scene scene(p);
  const LowestMode lowest =
      lowest_mode(scene.bonds, scene.network.organ.position, scene.constraints, scene.mass);
  fmt::print("\ntau = {:.3g} s; {} free coordinates; lowest mode {:.4f} Hz, damping ratio 0.1\n",
             p.relaxation_time_s(), scene.constraints.count(), lowest.frequency_Hz);
  const Reference reference = quasi_static(scene);
  fmt::print("{:<10} {:>5} {:>9} {:>8} {:>8} {:>8} {:>8} {:>9} {:>9} {:>10} {:>10}\n", "solver",
             "order", "tolerance", "steps", "rejected", "Newton", "factors", "CPU s", "ratio",
             "error end", "error max");
  // The loosest setting of a series that comes near enough, as do all tighter ones: not by luck.
  double cheapest = kNever;
  const auto series = [&](InertialOptions options, std::initializer_list<double> tolerances) {
    double seconds = kNever;
    for (const double tolerance : tolerances) {
      options.tolerance = tolerance;
      const Outcome outcome = measure(scene, reference, options);
      if (outcome.error_at_end > 1e-3) seconds = kNever;
      if (outcome.error_at_end <= 1e-3) seconds = std::min(seconds, outcome.seconds);
    }
    cheapest = std::min(cheapest, seconds);
  };
  series(options_of(1), {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6});
  series(options_of(2), {1e-1, 1e-2, 1e-3, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6});
  series(options_of(3), {1e-4, 1e-5});
  series(options_of(5), {1e-1, 1e-2, 1e-3, 1e-4, 1e-5});
  InertialOptions klu = options_of(2);
  klu.newton = NewtonSolver::klu;
  series(klu, {1e-2, 1e-4});
  InertialOptions dashpots = options_of(5);
  dashpots.stiffness_share = 1.0;
  fmt::print("the same ratio by dashpots along the bonds (not counted below):\n");
  for (const double tolerance : {1e-3, 1e-4, 1e-5}) {
    dashpots.tolerance = tolerance;
    static_cast<void>(measure(scene, reference, dashpots));
  }
  if (cheapest == kNever) {
    fmt::print("no series comes within 1e-3 of the quasi-static force at the end of the hold\n");
    return;
  }
  fmt::print("cheapest within 1e-3 at the end: {:.3f} s, {:.0f} times the quasi-static network\n",
             cheapest, cheapest / reference.seconds);
}

}  // namespace

int main() {
  for (const double eta1 : {5.0, 2.4e5}) measure_material(eta1);
  return 0;
}
