// Declared in tpm/accuracy/verify/verification.hpp.
// Energy: what is stored and dissipated against work that was computed without either.
#include <cmath>
#include <memory>

#include "tpm/accuracy/benchmark_case.hpp"
#include "tpm/accuracy/stability/checked_problem.hpp"
#include "tpm/accuracy/stability/theory.hpp"
#include "tpm/accuracy/verify/flawed.hpp"
#include "tpm/accuracy/verify/verification.hpp"
#include "tpm/organ/balance/inertial.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/model.hpp"

namespace tpm::accuracy {
namespace {

constexpr double kStarTau_s = 0.1, kPushed_m = 4e-3, kSpeed = 0.02;  // s, m, m/s
constexpr double kRampEnd_s = kPushed_m / kSpeed;
const char* const kEnergyBalance = "(stored + dissipated - work)/work";

Protocol pushed_and_held() {
  return ramp_and_hold(kPushed_m, kSpeed, 0.4);
}

QuasiStaticEnergy account_of(const DrivenNetwork& n, const Protocol& protocol, double end_s) {
  const QuasiStatic solver(n.bonds, n.rest, n.constraints, n.probes,
                           {.tolerance = 1e-9, .energies = true});
  const std::vector<double> end{end_s};
  return solver.run(protocol, end).energy.value();
}

/// Work of a push at constant speed by Gauss and Legendre's rule on pieces: the forces come from
/// elsewhere.
double work_of_push(const std::function<Eigen::VectorXd(const std::vector<double>&)>& forces) {
  constexpr int kPieces = 8;
  const double x[3] = {-std::sqrt(0.6), 0.0, std::sqrt(0.6)};
  constexpr double w[3] = {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};
  constexpr double kHalf_s = 0.5 * kRampEnd_s / kPieces;
  std::vector<double> times;
  for (int i = 0; i < kPieces; ++i) {
    for (const double at : x) times.push_back(kHalf_s * (2 * i + 1 + at));
  }
  const Eigen::VectorXd force = forces(times);
  double sum = 0.0;
  for (Eigen::Index i = 0; i < force.size(); ++i) sum += w[i % 3] * force[i];
  return kSpeed * kHalf_s * sum;
}

/// The star under a push and hold: each share by a formula.
VerificationCheck star_check(const char* quantity, const char* source,
                             std::function<double(const BondElement&)> formula,
                             double QuasiStaticEnergy::*share) {
  return {"quasi-static network, the star, ramp and hold of a depth",
          quantity,
          source,
          0.0,
          1e-7,
          [=](double flaw) {
            const BondElement p = paper_element(kStarTau_s);
            BondElement wrong = flawed(p, flaw);
            for (BondMaterial::Branch& branch : wrong.branches) branch.modulus_Pa *= 1.0 + flaw;
            const Protocol protocol = pushed_and_held();
            const QuasiStaticEnergy energy =
                account_of(driven_star(wrong), protocol, protocol.end_s());
            return energy.*share / formula(p) - 1.0;
          }};
}

/// Work of the element's closed form over a ramp: springs and tension by integration of F de, the
/// branch by g v^2 tau (t - tau (1 - exp(-t/tau))).
double work_by_formula(const BondElement& p) {
  const double v = kSpeed, t = kRampEnd_s, e = kPushed_m, x = p.spacing_m;
  // Integral of 2 E' (1 - cos(arctan(e/x))) e de.
  const double tension = 2.0 * p.lateral_Pa * (0.5 * e * e - x * (std::sqrt(x * x + e * e) - x));
  const double branch =
      p.relaxing_Pa() * v * v * kStarTau_s * (t + kStarTau_s * std::expm1(-t / kStarTau_s));
  return (0.5 * p.equilibrium_Pa * e * e + tension + branch) * p.modulus_to_stiffness_m();
}

/// Force^2 of the branch over its dashpot, integrated over ramp and hold.
double heat_by_formula(const BondElement& p) {
  const double t = kRampEnd_s, end = pushed_and_held().end_s() - t;
  const double reached = -std::expm1(-t / kStarTau_s);
  const double ramp =
      t - 2.0 * kStarTau_s * reached - 0.5 * kStarTau_s * std::expm1(-2.0 * t / kStarTau_s);
  const double hold = -reached * reached * 0.5 * kStarTau_s * std::expm1(-2.0 * end / kStarTau_s);
  return p.relaxing_Pa() * kSpeed * kSpeed * kStarTau_s * (ramp + hold) *
         p.modulus_to_stiffness_m();
}

VerificationCheck organ_balance_check() {
  return {"quasi-static network of 24 spheres, ramp and hold of a depth",
          kEnergyBalance,
          "work: forces of CVODE (BDF) at a tolerance of 1e-8, Gauss quadrature",
          0.0,
          1e-4,
          [](double flaw) {
            const BondElement p = paper_element(kStarTau_s);
            const Protocol protocol = pushed_and_held();
            const double work = work_of_push([&](const std::vector<double>& times) {
              const auto benchmark =
                  std::make_shared<BenchmarkCase>(StudyOrgan(p, 24).driven, protocol, times);
              MethodSettings settings;
              settings.rule = StepRule::cvode_bdf;
              settings.tolerance = 1e-8;
              MethodRun run = rules_on(benchmark)->run(settings, times);
              if (run.end != MethodEnd::completed) {
                throw Error(ExitCode::numerical, "work", run.reason);
              }
              return run.response;
            });
            const QuasiStaticEnergy energy =
                account_of(StudyOrgan(flawed(p, flaw), 24).driven, protocol, protocol.end_s());
            return (energy.stored_J + energy.dissipated_J) / work - 1.0;
          }};
}

/// A sphere with mass under a load: the load's work is the load times the depth of the closed form.
VerificationCheck inertial_balance_check() {
  return {"inertial network, one sphere with mass under a load",
          kEnergyBalance,
          "work: load times depth, by the modes of the equation of motion",
          0.0,
          1e-5,
          [](double flaw) {
            constexpr double kMass_kg = 0.03, kLoad_N = 0.1, kDampingRatio = 0.2, kEnd_s = 0.3;
            BondElement p = paper_element(0.02);
            p.lateral_Pa = 0.0;
            const std::vector<double> end{kEnd_s};
            const auto driven = driven_star(flawed(p, flaw));
            const Eigen::VectorXd mass = Eigen::VectorXd::Constant(4, kMass_kg);
            InertialOptions options;
            options.tolerance = 1e-9;
            options.highest_order = 5;
            options.damping_ratio = kDampingRatio;
            options.energy = true;
            const Inertial solver(driven.bonds, driven.rest, driven.constraints, driven.probes,
                                  mass, options);
            const InertialEnergy energy = solver.run(creep(kLoad_N, kEnd_s), end).energy.value();
            const auto right = driven_star(p);
            LinearElement linear = linear_element(p, 0.0);
            linear.mass_kg = kMass_kg;
            linear.drag_per_s =
                2.0 * kDampingRatio *
                lowest_mode(right.bonds, right.rest, right.constraints, mass).angular_frequency();
            const double work = kLoad_N * linear_motion_m(linear, kLoad_N, end)[0];
            return (energy.stored + energy.kinetic + energy.bond_heat + energy.damping_heat) /
                       work -
                   1.0;
          }};
}

/// Rules that conserve quadratic energies move an undamped sphere on its ellipse of energy: after
/// n steps it is at x0 (1 - cos(2 n arctan(omega h/2))).
VerificationCheck conserving_check(StepRule rule, std::string name) {
  return {std::move(name) + ", undamped sphere, 10,000 steps",
          "error of the amplitude",
          "x = x0 (1 - cos(2 n arctan(omega h/2))), the ellipse of energy; Hairer, Lubich and "
          "Wanner (2006)",
          0.0,
          1e-7,
          [rule](double flaw) {
            constexpr double kMass_kg = 0.03, kLoad_N = 0.1, kStep_s = 2e-3;
            constexpr int kSteps = 10'000;
            BondElement p = paper_element(1e9);  // nothing relaxes
            p.lateral_Pa = 0.0;
            const Protocol protocol = creep(kLoad_N, kSteps * kStep_s);
            const auto problem =
                element_problem(flawed(p, flaw), protocol,
                                MethodMasses{Eigen::VectorXd::Constant(1, kMass_kg), 0.0});
            MethodSettings settings;
            settings.rule = rule;
            settings.step_s = kStep_s;
            const std::vector<double> times = last_steps(protocol.end_s(), kStep_s, 50);
            const MethodRun run = problem->run(settings, times);
            if (run.end != MethodEnd::completed) {
              throw Error(ExitCode::numerical, step_rule_name(rule), run.reason);
            }
            const double k = p.instantaneous_Pa() * p.modulus_to_stiffness_m();
            const double angle = 2.0 * std::atan(0.5 * std::sqrt(k / kMass_kg) * kStep_s);
            Eigen::VectorXd expected(run.response.size());
            for (Eigen::Index i = 0; i < expected.size(); ++i) {
              const double n = std::round(times[static_cast<std::size_t>(i)] / kStep_s);
              expected[i] = kLoad_N / k * (1.0 - std::cos(n * angle));
            }
            return relative_difference(run.response, expected);
          }};
}

}  // namespace

std::vector<VerificationCheck> energy_checks() {
  const char* const loop = "integrals of the closed form, written down in the check";
  return {star_check("work, relative error", loop, work_by_formula, &QuasiStaticEnergy::work_J),
          star_check("dissipated, relative error", loop, heat_by_formula,
                     &QuasiStaticEnergy::dissipated_J),
          star_check(
              "stored, relative error", loop,
              [](const BondElement& p) { return work_by_formula(p) - heat_by_formula(p); },
              &QuasiStaticEnergy::stored_J),
          organ_balance_check(),
          inertial_balance_check(),
          conserving_check(StepRule::implicit_midpoint, "implicit midpoint rule"),
          conserving_check(StepRule::newmark, "Newmark's average acceleration")};
}

}  // namespace tpm::accuracy
