// Prints the measured numbers of reports/networks: measure_materials written|cost|servo|lag
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <ctime>
#include <functional>
#include <vector>

#include "organ_scene.hpp"
#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/law/relaxation/fractional_branches.hpp"
#include "tpm/organ/body/liver.hpp"
#include "written_out_network.hpp"

using namespace tpm;
using namespace tpm::contact;
using namespace tpm_test;
using tpm::testing::OrganScene;

namespace {

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Branches of falling weight whose moduli are a share of 12 kPa.
BondMaterial material_of(const std::vector<double>& times, double relaxing_share) {
  BondMaterial m;
  m.equilibrium_Pa = (1.0 - relaxing_share) * 12e3;
  for (const double time_s : times) {
    m.branches.push_back({relaxing_share * 12e3 / static_cast<double>(times.size()), time_s});
  }
  m.lateral_Pa = 12e3;
  return m;
}

struct Named {
  std::string name;
  MaterialField field;
};

std::vector<Named> materials(const Network& network) {
  BondMaterial fractional;
  const FractionalBranches sum = fractional_branches(0.3, 1.0, {1e-2, 1e3, 1e-3}, 40);
  fractional.equilibrium_Pa = 3e3 + 9e3 * sum.constant;
  fractional.lateral_Pa = 12e3;
  for (const auto& [share, time_s] : sum.branches) {
    fractional.branches.push_back({9e3 * share, time_s});
  }
  BondMaterial stiffening = material_of({1.0}, 0.5);
  stiffening.potential = elongation_function("cubic", {5e-3});
  BondMaterial kernel = material_of({0.2, 5.0}, 0.5);
  kernel.kernel = kernel.potential = elongation_function("cubic", {5e-3});
  std::vector<Named> all{
      {"1 branch, 50 %", material_of({1.0}, 0.5)},
      {"1 branch, 90 %", material_of({1.0}, 0.9)},
      {"2 branches, 90 %", material_of({0.2, 20.0}, 0.9)},
      {"5 branches, 90 %", material_of({2e-3, 0.02, 0.3, 4.0, 60.0}, 0.9)},
      {fmt::format("fractional 0.3 ({} branches)", fractional.branches.size()), fractional},
      {"cubic potential", stiffening},
      {"cubic potential and kernel", kernel}};
  // A tumour as configs/liver_tumour.json has it: 15 mm around 10 mm below the contact.
  MaterialField tumour(material_of({0.2, 20.0}, 0.5));
  tumour.factor = Eigen::VectorXd::Ones(network.organ.position.cols());
  const auto contact = static_cast<Eigen::Index>(*network.organ.contact);
  const Eigen::Vector3d centre =
      network.organ.position.col(contact) - 0.010 * network.organ.normal.col(contact);
  for (Eigen::Index i = 0; i < tumour.factor.size(); ++i) {
    if ((network.organ.position.col(i) - centre).norm() <= 0.015) tumour.factor[i] = 5.0;
  }
  all.push_back({"tumour, 2 branches", tumour});
  return all;
}

Protocol ramp_and_hold(double depth_m, double ramp_s, double end_s) {
  return {Drive::displacement, {{0.0, 0.0}, {ramp_s, depth_m}, {end_s, depth_m}}, "ramp and hold"};
}

/// 60 spheres, branches written out and integrated by CVODES, against the quasi-static network.
void print_written() {
  LiverRequest request;
  request.count = 60;
  const OrganScene scene(fill_liver(request));
  const std::vector<double> times{0.1, 0.5, 1.0, 1.01, 1.1, 1.5, 2.0, 4.0};
  fmt::print("{:<30} {:>12} {:>12} {:>12} {:>8}\n", "60 spheres, 6 mm", "peak N", "error/peak",
             "1-(s+d)/work", "steps");
  for (const Named& named : materials(scene.network)) {
    if (named.field.factor.size() > 0) continue;
    const BondMaterial& m = named.field.materials.front();
    const BondSystem bonds(scene.network, named.field);
    const QuasiStaticRun run = QuasiStatic(bonds, scene.network.organ.position, scene.constraints,
                                           scene.probe, {.tolerance = 1e-7, .energies = true})
                                   .run(ramp_and_hold(6e-3, 1.0, 4.0), times);
    WrittenNetwork written(scene.network, written_bonds(scene.network, m), scene.constraints,
                           scene.probe);
    const std::vector<double> force = written_ramp(written, 6e-3, 1.0, times);
    double peak = 0.0, worst = 0.0;
    for (std::size_t i = 0; i < times.size(); ++i) {
      peak = std::max(peak, force[i]);
      worst = std::max(worst, std::abs(force[i] - run.response[static_cast<Eigen::Index>(i)]));
    }
    const QuasiStaticEnergy& e = run.energy.value();
    fmt::print("{:<30} {:>12.6f} {:>12.2e} {:>12.2e} {:>8}\n", named.name, peak, worst / peak,
               1.0 - (e.stored_J + e.dissipated_J) / e.work_J, run.work.steps);
  }
}

/// The least of several timings.
double least_ms(int repeats, const std::function<void()>& run) {
  double least = 1e9;
  for (int i = 0; i < repeats; ++i) {
    const double start = cpu_s();
    run();
    least = std::min(least, 1e3 * (cpu_s() - start));
  }
  return least;
}

void print_cost() {
  const OrganScene scene(paper_liver());
  const Positions& rest = scene.network.organ.position;
  const std::vector<std::vector<double>> sets{{2e-4}, {0.02},  {1.0},
                                              {10.0}, {100.0}, {2e-4, 0.02, 1.0, 10.0, 100.0}};
  std::vector<double> times;
  for (int i = 0; i <= 310; ++i) times.push_back(0.1 * i);
  fmt::print("424 spheres, ramp of 8 mm in 2 s and hold to 31 s, tolerance 1e-6\n");
  fmt::print("{:<28} {:>8} {:>12} {:>10} {:>14} {:>12} {:>12}\n", "relaxation times s", "steps",
             "back-solves", "run ms", "fixed step ms", "servo us", "condensed us");
  const BondSystem one(scene.network, material_of({1.0}, 0.5));
  const CondensedContact built =
      build_condensed(one, rest, scene.constraints, scene.probe.sphere, scene.probe.direction);
  for (const std::vector<double>& set : sets) {
    const BondSystem bonds(scene.network, material_of(set, 0.5));
    const QuasiStatic free(bonds, rest, scene.constraints, scene.probe, {.tolerance = 1e-6});
    QuasiStaticRun run;
    const double run_ms =
        least_ms(7, [&] { run = free.run(ramp_and_hold(8e-3, 2.0, 31.0), times); });
    // 62 steps of half a second each: what one step costs.
    const QuasiStatic fixed(bonds, rest, scene.constraints, scene.probe,
                            {.tolerance = 1e-6, .step_s = 0.5});
    QuasiStaticRun stepped;
    const double fixed_ms =
        least_ms(7, [&] { stepped = fixed.run(ramp_and_hold(8e-3, 2.0, 31.0), times); });
    ServoNetwork servo(bonds, rest, scene.constraints, scene.probe.sphere, scene.probe.direction);
    const double servo_ms = least_ms(7, [&] {
      servo.reset();
      for (int i = 1; i <= 1000; ++i) servo.step(8e-6 * i * scene.probe.direction);
    });
    std::vector<CondensedBranch> branches;
    for (const double time_s : set) branches.push_back({1.0, time_s});
    CondensedContact condensed = built.with_branches(branches);
    constexpr int kTimes = 20;  // a step is short
    const double condensed_ms = least_ms(15, [&] {
      for (int again = 0; again < kTimes; ++again) {
        condensed.reset();
        for (int i = 1; i <= 1000; ++i) condensed.step(8e-6 * i * scene.probe.direction);
      }
    });
    fmt::print("{:<28} {:>8} {:>12} {:>10.2f} {:>14.3f} {:>12.2f} {:>12.3f}\n",
               fmt::format("{}", fmt::join(set, ", ")), run.work.steps, run.work.back_solves,
               run_ms, fixed_ms / stepped.work.steps, servo_ms, condensed_ms / kTimes);
  }
}

/// Models at servo rate along a ramp to 8 mm in 0.8 s and a hold, against the quasi-static network.
void print_servo() {
  const OrganScene scene(paper_liver());
  const Positions& rest = scene.network.organ.position;
  constexpr double kPeriod_s = 1e-3, kDepth_m = 8e-3;
  constexpr int kRamp = 800, kSteps = 3000;
  std::vector<double> times;
  for (int i = 1; i <= kSteps; ++i) times.push_back(kPeriod_s * i);
  fmt::print("{:<30} {:<10} {:>12} {:>12} {:>14}\n", "424 spheres", "model", "error/peak",
             "claim/peak", "over claim");
  for (const Named& named : materials(scene.network)) {
    const BondSystem bonds(scene.network, named.field);
    // The models move the contact in space: it does not yield to the side.
    Constraints guided = scene.constraints;
    guided.slide(scene.probe.sphere, scene.probe.direction);
    const QuasiStaticRun run =
        QuasiStatic(bonds, rest, guided, scene.probe, {.tolerance = 1e-7})
            .run(ramp_and_hold(kDepth_m, kRamp * kPeriod_s, kSteps * kPeriod_s), times);
    const double peak = run.response.maxCoeff();
    const auto compare = [&](const char* name,
                             const std::function<std::unique_ptr<ContactModel>()>& make) {
      std::unique_ptr<ContactModel> model;
      try {
        model = make();
      } catch (const Error& error) {
        fmt::print("{:<30} {:<10} {}\n", named.name, name, error.what());
        return;
      }
      double worst = 0.0, claim = 0.0;
      int over = 0;
      for (int i = 1; i <= kSteps; ++i) {
        const double depth = kDepth_m * std::min(1.0, static_cast<double>(i) / kRamp);
        const ContactAnswer answer = model->step(depth * scene.probe.direction);
        const double force = -answer.force_N.dot(scene.probe.direction);
        const double error = std::abs(force - run.response[i - 1]);
        worst = std::max(worst, error);
        claim = std::max(claim, answer.error_N);
        over += error > answer.error_N ? 1 : 0;
      }
      fmt::print("{:<30} {:<10} {:>12.2e} {:>12.2e} {:>14}\n", named.name, name, worst / peak,
                 claim / peak, fmt::format("{} of {}", over, kSteps));
    };
    compare("full", [&] {
      return std::make_unique<ServoNetwork>(bonds, rest, scene.constraints, scene.probe.sphere,
                                            scene.probe.direction,
                                            ServoNetworkOptions{.period_s = kPeriod_s});
    });
    compare("condensed", [&] {
      return std::make_unique<CondensedContact>(build_condensed(
          bonds, rest, scene.constraints, scene.probe.sphere, scene.probe.direction));
    });
  }
}

/// The condensed model of livers of 60 spheres where its viscous state lags: a ramp to 8 mm, a
/// hold, a release and a rest of the same length each, against the quasi-static network.
void print_lag() {
  constexpr double kDepth_m = 8e-3;
  constexpr int kRamp = 100, kSteps = 4 * kRamp;
  fmt::print("{:>4} {:>6} {:>9} {:>9} {:>12} {:>12} {:>12} {:>12}\n", "seed", "share", "branches",
             "ramp/tau", "error/peak", "claim/peak", "over claim", "by at most");
  for (const std::uint64_t seed : {1, 5}) {
    LiverRequest request;
    request.count = 60;
    request.seed = seed;
    const OrganScene scene(fill_liver(request));
    const Positions& rest = scene.network.organ.position;
    Constraints guided = scene.constraints;
    guided.slide(scene.probe.sphere, scene.probe.direction);
    for (const double share : {0.2, 0.5, 0.9}) {
      for (const std::vector<double>& branches : {std::vector{1.0}, std::vector{0.2, 5.0}}) {
        const BondSystem bonds(scene.network, MaterialField(material_of(branches, share)));
        const CondensedContact built =
            build_condensed(bonds, rest, scene.constraints, scene.probe.sphere,
                            scene.probe.direction, {.depth_m = kDepth_m});
        for (const double ramp_s : {0.05, 0.5, 2.5, 12.0}) {  // the mean relaxation time is 1 s
          const double step_s = ramp_s / kRamp;
          const Protocol protocol(Drive::displacement,
                                  {{0.0, 0.0},
                                   {ramp_s, kDepth_m},
                                   {2.0 * ramp_s, kDepth_m},
                                   {3.0 * ramp_s, 0.0},
                                   {4.0 * ramp_s, 0.0}},
                                  "there and back");
          std::vector<double> times;
          for (int i = 1; i < kSteps; ++i) times.push_back(step_s * i);
          times.push_back(protocol.end_s());
          const Eigen::VectorXd expected =
              QuasiStatic(bonds, rest, guided, scene.probe, {.tolerance = 1e-7})
                  .run(protocol, times)
                  .response;
          CondensedContact model = built.with_period(step_s);
          double worst = 0.0, claim = 0.0, by = 0.0;
          int over = 0;
          for (int i = 1; i <= kSteps; ++i) {
            const double depth = value_at(protocol, times[static_cast<std::size_t>(i - 1)]);
            const ContactAnswer answer = model.step(depth * scene.probe.direction);
            const double force = -answer.force_N.dot(scene.probe.direction);
            const double error = std::abs(force - expected[i - 1]);
            worst = std::max(worst, error);
            claim = std::max(claim, answer.error_N);
            by = std::max(by, error / answer.error_N);
            over += error > answer.error_N ? 1 : 0;
          }
          const double peak = expected.maxCoeff();
          fmt::print("{:>4} {:>6} {:>9} {:>9} {:>12.2e} {:>12.2e} {:>12} {:>12.2f}\n", seed, share,
                     branches.size(), ramp_s, worst / peak, claim / peak,
                     fmt::format("{} of {}", over, kSteps), by);
        }
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto asked = [&](const char* name) { return argc < 2 || std::strcmp(argv[1], name) == 0; };
  if (asked("written")) print_written();
  if (asked("cost")) print_cost();
  if (asked("servo")) print_servo();
  if (asked("lag")) print_lag();
  return 0;
}
