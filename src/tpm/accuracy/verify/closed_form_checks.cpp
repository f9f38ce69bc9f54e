// Declared in tpm/accuracy/verify/verification.hpp.
// Answers that a formula gives, written down here once more, away from the code that they check.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "tpm/accuracy/verify/flawed.hpp"
#include "tpm/accuracy/verify/verification.hpp"
#include "tpm/contact/element_contact.hpp"
#include "tpm/contact/law_contact.hpp"
#include "tpm/law/contact_geometry.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpmkit/frequency_response.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::accuracy {
namespace {

// A standard linear solid.
constexpr double kLasting = 80.0, kRelaxing = 120.0;  // N/m
constexpr double kTau_s = 2.0;
constexpr double kCheckDepth_m = 4e-3, kRate = 2e-3;  // m, m/s

const char* const kRelativeError = "relative error";

std::vector<double> times_to(double end_s, int count) {
  std::vector<double> times;
  for (int i = 1; i <= count; ++i) times.push_back(end_s * i / count);
  return times;
}

Eigen::VectorXd values_at(const std::vector<double>& times_s,
                          const std::function<double(double)>& formula) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(times_s.size()));
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    values[static_cast<Eigen::Index>(i)] = formula(times_s[i]);
  }
  return values;
}

/// A law's response to a protocol against a formula.
/// @param first parameters before contact and offset; the first of them is the one that is wrong
VerificationCheck law_check(std::string what, std::string source, double tolerance, const char* law,
                            std::vector<double> first, const Protocol& protocol,
                            std::vector<double> times_s, std::function<double(double)> formula) {
  first.insert(first.end(), {0.0, 0.0});
  return {std::move(what), kRelativeError, std::move(source), 0.0, tolerance, [=](double flaw) {
            std::vector<double> parameters = first;
            parameters.front() *= 1.0 + flaw;
            const LawModel model(parse_law_name(law, "verification"));
            return relative_difference(
                model.respond(protocol, times_s, parameters, Want::values).value,
                values_at(times_s, formula));
          }};
}

/// Integral of exp(-(t - s)/tau) over s from 0 to t, over a ramp that ends at `ramp_s`.
double after_ramp(double time_s, double ramp_s, double tau_s) {
  const double end = std::min(time_s, ramp_s);
  return tau_s * (std::exp(-(time_s - end) / tau_s) - std::exp(-time_s / tau_s));
}

double solid_under_ramp(double time_s) {
  constexpr double kRamp_s = kCheckDepth_m / kRate;
  return kLasting * kRate * std::min(time_s, kRamp_s) +
         kRelaxing * kRate * after_ramp(time_s, kRamp_s, kTau_s);
}

/// Integral of exp(-(t - s)/tau) d(s^(3/2)) from 0 to t: with x = t/tau
/// 3/2 tau^(3/2) x^(3/2) exp(-x) sum of x^n/(n! (n + 3/2)).
double hertz_memory(double time_s, double tau_s) {
  const double x = time_s / tau_s;
  double term = 1.0, sum = 0.0;  // x^n/n!
  for (int n = 0; n < 200; ++n) {
    sum += term / (n + 1.5);
    term *= x / (n + 1);
  }
  return 1.5 * std::pow(time_s, 1.5) * std::exp(-x) * sum;
}

std::vector<VerificationCheck> law_checks() {
  std::vector<VerificationCheck> checks;
  checks.push_back(
      law_check("standard linear solid, ramp and hold of a depth",
                "F = v (k_inf t + k1 tau (1 - exp(-t/tau))), then relaxing; Tschoegl (1989)", 1e-12,
                "linear-1", {kLasting, kRelaxing, kTau_s}, ramp_and_hold(kCheckDepth_m, kRate, 8.0),
                times_to(10.0, 40), solid_under_ramp));
  checks.push_back(law_check(
      "standard linear solid, step of a depth", "F = d (k_inf + k1 exp(-t/tau))", 1e-12, "linear-1",
      {kLasting, kRelaxing, kTau_s}, step_and_hold(kCheckDepth_m, 10.0), times_to(10.0, 40),
      [](double t) { return kCheckDepth_m * (kLasting + kRelaxing * std::exp(-t / kTau_s)); }));
  checks.push_back(
      law_check("standard linear solid, creep",
                "u = F (1/k_inf - (1/k_inf - 1/k0) exp(-t/T)), T = tau k0/k_inf; Tschoegl (1989)",
                1e-9, "linear-1", {kLasting, kRelaxing, kTau_s}, creep(0.3, 30.0),
                times_to(30.0, 40), [](double t) {
                  constexpr double kAll = kLasting + kRelaxing;
                  const double retarded = std::exp(-t * kLasting / (kTau_s * kAll));
                  return 0.3 * (1.0 / kLasting - (1.0 / kLasting - 1.0 / kAll) * retarded);
                }));
  checks.push_back(
      law_check("spring-pot of order 0.3, ramp of a depth",
                "F = v k t^0.7/Gamma(1.7); Mainardi (2010)", 1e-8, "linear-fspringpot",
                {kRelaxing, 0.3}, ramp_and_hold(kCheckDepth_m, kRate, 0.0), times_to(2.0, 40),
                [](double t) { return kRate * kRelaxing * std::pow(t, 0.7) / std::tgamma(1.7); }));
  checks.push_back(law_check("fractional Zener solid of order 1/2, step of a depth",
                             "G = k_inf + k1 exp(t/tau) erfc(sqrt(t/tau)), E_1/2 of Mittag-Leffler",
                             1e-9, "linear-fzener", {kLasting, kRelaxing, kTau_s, 0.5},
                             step_and_hold(kCheckDepth_m, 10.0), times_to(10.0, 40), [](double t) {
                               const double x = t / kTau_s;
                               return kCheckDepth_m * (kLasting + kRelaxing * std::exp(x) *
                                                                      std::erfc(std::sqrt(x)));
                             }));
  checks.push_back(law_check(
      "Hertz contact of a standard linear solid, ramp of a depth",
      "Lee and Radok (1960): integral of G(t - s) d(s^(3/2)), a series", 1e-9, "hertz-1",
      {kLasting, kRelaxing, kTau_s}, ramp_and_hold(kCheckDepth_m, kRate, 0.0), times_to(2.0, 40),
      [](double t) {
        constexpr double kReference_m = 1e-3;  // LawSpec::reference
        const double scale = std::pow(kRate, 1.5) / std::sqrt(kReference_m);
        return scale * (kLasting * std::pow(t, 1.5) + kRelaxing * hertz_memory(t, kTau_s));
      }));
  return checks;
}

/// Force of a rigid probe from the modulus that the law's stiffness is converted to.
VerificationCheck probe_check(std::string what, std::string source, const char* law,
                              std::vector<double> more, const ContactGeometry& geometry,
                              std::function<double(double modulus_Pa, double depth_m)> formula) {
  more.insert(more.end(), {0.0, 0.0});
  return {std::move(what), kRelativeError, std::move(source), 0.0, 1e-12, [=](double flaw) {
            constexpr double kStiffness = 50.0;
            const LawModel model(parse_law_name(law, "verification"));
            std::vector<double> parameters{kStiffness * (1.0 + flaw)};
            parameters.insert(parameters.end(), more.begin(), more.end());
            const double modulus = modulus_Pa(model.spec(), kStiffness, geometry).value();
            const std::vector<double> end{1.0};
            const double force =
                model.respond(ramp_and_hold(2.5e-3, 2.5e-3, 0.0), end, parameters, Want::values)
                    .value[0];
            return std::abs(force / formula(modulus, 2.5e-3) - 1.0);
          }};
}

std::vector<VerificationCheck> probe_checks() {
  constexpr double kPoisson = 0.45, kRadius_m = 5e-3;
  constexpr double kPlane = 1.0 - kPoisson * kPoisson;
  const double half_angle = std::numbers::pi / 3.0;
  ContactGeometry sphere, cone, punch;
  sphere.sphere_radius_m = punch.punch_radius_m = kRadius_m;
  cone.cone_half_angle_rad = half_angle;
  for (ContactGeometry* geometry : {&sphere, &cone, &punch}) geometry->poisson_ratio = kPoisson;
  return {
      probe_check("sphere on an elastic half space",
                  "Hertz (1882): F = 4/3 E/(1 - nu^2) sqrt(R) u^(3/2)", "hertz", {}, sphere,
                  [](double modulus, double depth) {
                    return 4.0 / 3.0 * modulus / kPlane * std::sqrt(kRadius_m) *
                           std::pow(depth, 1.5);
                  }),
      probe_check("cone on an elastic half space",
                  "Sneddon (1965): F = 2/pi E/(1 - nu^2) tan(a) u^2", "power", {2.0}, cone,
                  [half_angle](double modulus, double depth) {
                    return 2.0 / std::numbers::pi * modulus / kPlane * std::tan(half_angle) *
                           depth * depth;
                  }),
      probe_check("flat punch on an elastic half space", "Sneddon (1965): F = 2 E/(1 - nu^2) r u",
                  "linear", {}, punch, [](double modulus, double depth) {
                    return 2.0 * modulus / kPlane * kRadius_m * depth;
                  })};
}

VerificationCheck oscillation_check() {
  return {
      "standard linear solid, storage and loss at 0.01 to 100 Hz",
      kRelativeError,
      "k_inf + k1 i omega tau/(1 + i omega tau); Tschoegl (1989)",
      0.0,
      1e-12,
      [](double flaw) {
        std::vector<double> hertz;
        for (int i = -4; i <= 4; ++i) hertz.push_back(std::pow(10.0, 0.5 * i));
        const std::vector<double> parameters{kLasting * (1.0 + flaw), kRelaxing, kTau_s, 0.0, 0.0};
        const SpectrumResponse found = respond_spectrum(parse_law_name("linear-1", "verification"),
                                                        parameters, hertz, {}, Want::values);
        const auto turned = [](double frequency_Hz) {
          return 2.0 * std::numbers::pi * frequency_Hz * kTau_s;
        };
        return std::max(relative_difference(found.storage,
                                            values_at(hertz,
                                                      [&](double f) {
                                                        const double x = turned(f) * turned(f);
                                                        return kLasting + kRelaxing * x / (1.0 + x);
                                                      })),
                        relative_difference(found.loss, values_at(hertz, [&](double f) {
                                              const double x = turned(f);
                                              return kRelaxing * x / (1.0 + x * x);
                                            })));
      }};
}

VerificationCheck chain_check() {
  return {"standard linear solid as a Kelvin chain",
          kRelativeError,
          "k0 = k_inf + k1, kc = k_inf k0/k1, T = tau k0/k_inf; Tschoegl (1989)",
          0.0,
          1e-12,
          [](double flaw) {
            constexpr double kAll = kLasting + kRelaxing;
            const KelvinChain chain = to_series({kLasting * (1.0 + flaw), {kRelaxing}, {kTau_s}});
            return std::max({std::abs(chain.k0 / kAll - 1.0),
                             std::abs(chain.k.at(0) / (kLasting * kAll / kRelaxing) - 1.0),
                             std::abs(chain.T_s.at(0) / (kTau_s * kAll / kLasting) - 1.0)});
          }};
}

/// Force of a step by the paper's Eq. 11, with Eq. 2 for the tension.
VerificationCheck paper_step_check() {
  return {
      "the paper's element, step of a depth",
      kRelativeError,
      "Bao et al. (2013), Eqs. 2 and 11",
      0.0,
      1e-12,
      [](double flaw) {
        const TpmParameters p = TpmParameters{}.with_relaxation_time(kTau_s);
        const std::vector<double> times = times_to(10.0, 40);
        TpmParameters wrong = p;
        wrong.E2_Pa *= 1.0 + flaw;
        return relative_difference(
            make_closed_form()
                ->respond(step_and_hold(kCheckDepth_m, 10.0), times, to_vector(wrong), Want::values)
                .value,
            values_at(times, [&](double t) {
              const double lambda1 =
                  2.0 * p.Eprime_Pa * (1.0 - std::cos(std::atan(kCheckDepth_m / p.spacing_m)));
              const double both = p.E1_Pa + p.E2_Pa;
              const double relaxed = 1.0 - std::exp(-t * both / p.eta1_Pa_s);
              return (p.E2_Pa + lambda1 - p.E2_Pa * p.E2_Pa / both * relaxed) * kCheckDepth_m *
                     p.A0_m2 / p.l0_m;
            }));
      }};
}

/// Forces of a contact that is stepped at 1 kHz through a ramp and hold along +z.
Eigen::VectorXd stepped(ContactModel& model, double depth_m, double rate_m_per_s, int steps) {
  Eigen::VectorXd force(steps);
  for (int i = 0; i < steps; ++i) {
    const double depth = std::min(depth_m, rate_m_per_s * (i + 1) * model.period_s());
    force[i] = std::abs(model.step(Eigen::Vector3d(0.0, 0.0, depth)).force_N.z());
  }
  return force;
}

std::vector<VerificationCheck> servo_checks() {
  const auto ticks = [] { return times_to(4.0, 4000); };
  VerificationCheck of_law{
      "exact exponential update at 1 kHz, contact by a law (LawContact), ramp and hold",
      kRelativeError,
      "F = v (k_inf t + k1 tau (1 - exp(-t/tau))), then relaxing",
      0.0,
      1e-12,
      [ticks](double flaw) {
        LawFile law;
        law.spec = parse_law_name("linear-1", "verification");
        law.values = {kLasting * (1.0 + flaw), kRelaxing, kTau_s, 0.0, 0.0};
        LawContact contact(law, {});
        return relative_difference(stepped(contact, kCheckDepth_m, kRate, 4000),
                                   values_at(ticks(), solid_under_ramp));
      }};
  VerificationCheck of_element{
      "exact exponential update at 1 kHz, one element (ElementContact), ramp and hold",
      kRelativeError,
      "closed form of the element, Bao et al. (2013), Eqs. 2 and 11",
      0.0,
      1e-12,
      [ticks](double flaw) {
        const BondElement p = paper_element(kTau_s);
        ElementContact contact(flawed(p, flaw), 1e-3);
        const Eigen::VectorXd expected = values_at(ticks(), [&](double t) {
          const double e = std::min(kCheckDepth_m, kRate * t);
          const double tension = 2.0 * p.lateral_Pa * (1.0 - std::cos(std::atan(e / p.spacing_m)));
          return ((p.equilibrium_Pa + tension) * e +
                  p.relaxing_Pa() * kRate * after_ramp(t, kCheckDepth_m / kRate, kTau_s)) *
                 p.A0_m2 / p.l0_m;
        });
        return relative_difference(stepped(contact, kCheckDepth_m, kRate, 4000), expected);
      }};
  return {std::move(of_law), std::move(of_element)};
}

/// Elastic springs of one stiffness.
BondMaterial springs(double modulus_Pa) {
  BondMaterial material;
  material.equilibrium_Pa = material.lateral_Pa = modulus_Pa;
  return material;
}
constexpr double kSpring_Pa = 12e3;

/// Spheres at given places in the plane z = 0, joined by equal springs.
Network joined_springs(const std::vector<std::array<double, 2>>& places,
                       const std::vector<NeighbourPair>& pairs) {
  Organ organ;
  organ.name = "springs";
  organ.position = Positions::Zero(3, static_cast<Eigen::Index>(places.size()));
  for (std::size_t i = 0; i < places.size(); ++i) {
    organ.position.col(static_cast<Eigen::Index>(i)).head<2>() << places[i][0], places[i][1];
  }
  organ.normal = Eigen::Vector3d::UnitY().replicate(1, organ.position.cols());
  organ.layer.assign(places.size(), 0);
  organ.radius = 1e-3;
  organ.spacing = 10e-3;
  NetworkOptions options;
  options.rule = StiffnessRule::per_bond;
  return join(std::move(organ), pairs, options, "verification");
}

/// A cantilever of square bays, each with one diagonal; statically determinate. Deflection of the
/// loaded corner by the sum of n^2/k over the springs, n the force of each under a unit load: in
/// the bay j from the tip the chords carry j and j + 1, the diagonal sqrt(2), the upright 1.
VerificationCheck beam_check() {
  return {"beam of 10 square bays of springs, load at its end, deflection",
          kRelativeError,
          "principle of virtual work: F/k times the sum of n^2 = 700 F/k",
          0.0,
          1e-5,
          [](double flaw) {
            constexpr std::uint32_t kBays = 10;
            constexpr double kBay_m = 10e-3;
            std::vector<std::array<double, 2>> places;
            for (std::uint32_t i = 0; i <= kBays; ++i) {
              places.push_back({i * kBay_m, kBay_m});  // 2 i
              places.push_back({i * kBay_m, 0.0});     // 2 i + 1
            }
            std::vector<NeighbourPair> pairs;
            double sum = 0.0;
            for (std::uint32_t i = 0; i < kBays; ++i) {
              const std::uint32_t top = 2 * i, bottom = top + 1;
              pairs.push_back({top, top + 2});
              pairs.push_back({top, top + 3});
              pairs.push_back({bottom, bottom + 2});
              pairs.push_back({top + 2, bottom + 2});
              const double from_tip = kBays - 1 - i;
              sum += from_tip * from_tip + (from_tip + 1.0) * (from_tip + 1.0) + 2.0 + 1.0;
            }
            const Network network = joined_springs(places, pairs);
            Constraints constraints(places.size());
            constraints.fix(0);
            constraints.fix(1);
            for (std::size_t i = 2; i < places.size(); ++i) {
              constraints.impose(i, Eigen::Vector3d::UnitZ());  // stays in the plane
            }
            const BondMaterial material = springs(kSpring_Pa);
            const BondSystem bonds(network, springs(kSpring_Pa * (1.0 + flaw)));
            const QuasiStatic beam(bonds, network.organ.position, constraints,
                                   Probe{2 * kBays, -Eigen::Vector3d::UnitY(), 1.0},
                                   {.tolerance = 1e-4});
            // Small, and pushed both ways: what is not linear cancels to second order. What is left
            // unbalanced is 1e-3 of the tolerance; less would be below the rounding of forces.
            constexpr double kSmall_m = 1e-5;
            const double load_N = kSmall_m * material.modulus_to_stiffness_m() * kSpring_Pa / sum;
            const std::vector<double> end{1.0};
            const double down = beam.run(creep(load_N, 1.0), end).response[0];
            const double up = beam.run(creep(-load_N, 1.0), end).response[0];
            return std::abs(0.5 * (down - up) / kSmall_m - 1.0);
          }};
}

/// The slowest vibration of a row of equal masses and springs, one end fixed.
VerificationCheck vibration_check() {
  return {"row of 20 masses on springs, slowest vibration",
          kRelativeError,
          "omega = 2 sqrt(k/m) sin(pi/(4 n + 2)); Rayleigh, The Theory of Sound, section 120",
          0.0,
          1e-9,
          [](double flaw) {
            constexpr std::uint32_t kMasses = 20;
            constexpr double kMass_kg = 5e-3;
            std::vector<std::array<double, 2>> places;
            std::vector<NeighbourPair> pairs;
            Constraints constraints(kMasses + 1);
            for (std::uint32_t i = 0; i <= kMasses; ++i) {
              places.push_back({10e-3 * i, 0.0});
              if (i > 0) pairs.push_back({i - 1, i});
              if (i > 0) constraints.slide(i, Eigen::Vector3d::UnitX());
            }
            constraints.fix(0);
            const Network network = joined_springs(places, pairs);
            const BondSystem bonds(network, springs(kSpring_Pa * (1.0 + flaw)));
            const LowestMode mode = lowest_mode(bonds, network.organ.position, constraints,
                                                Eigen::VectorXd::Constant(kMasses + 1, kMass_kg));
            const double k = springs(kSpring_Pa).modulus_to_stiffness_m() * kSpring_Pa;
            const double expected =
                2.0 * std::sqrt(k / kMass_kg) * std::sin(std::numbers::pi / (4.0 * kMasses + 2.0));
            return std::abs(mode.angular_frequency() / expected - 1.0);
          }};
}

void append_checks(std::vector<VerificationCheck>& all, std::vector<VerificationCheck> more) {
  for (VerificationCheck& check : more) all.push_back(std::move(check));
}

}  // namespace

std::vector<VerificationCheck> closed_form_checks() {
  std::vector<VerificationCheck> checks = law_checks();
  append_checks(checks, {oscillation_check(), chain_check(), paper_step_check()});
  append_checks(checks, probe_checks());
  append_checks(checks, servo_checks());
  append_checks(checks, {beam_check(), vibration_check()});
  return checks;
}

}  // namespace tpm::accuracy
