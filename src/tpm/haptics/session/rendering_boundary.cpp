#include "tpm/haptics/session/rendering_boundary.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <numbers>

#include "tpm/base/dense_algebra.hpp"

namespace tpm::haptics {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kAmplitude_m = 1e-3;
constexpr int kSamples = 1024;  // of a measurement; frequencies are whole numbers of cycles in them

/// Cycles in kSamples: closer and closer to zero, where a delay is worst, up to Nyquist.
std::vector<int> measured_cycles() {
  std::vector<int> cycles;
  for (int step = 0;; ++step) {
    const int whole = static_cast<int>(std::lround(std::pow(1.25, step)));
    if (2 * whole >= kSamples) break;
    if (cycles.empty() || whole > cycles.back()) cycles.push_back(whole);
  }
  cycles.push_back(kSamples / 2);
  return cycles;
}

/// Friction that makes up for the energy given away under one sinusoid.
double damping_at(const RenderedContact& contact, int cycles) {
  ElementContact model = contact.model();
  const double angle = 2.0 * std::numbers::pi * cycles / kSamples;
  const double tau = contact.rule == ElementRule::mass_spring ? 0.0 : contact.relaxation_time_s;
  const int settling =
      static_cast<int>(std::ceil(25.0 * tau / contact.period_s)) + contact.delay_periods + 2;
  std::vector<double> sent(static_cast<std::size_t>(contact.delay_periods) + 1, 0.0);
  double delivered_J = 0.0, moved2 = 0.0, held_N = 0.0, before_m = 0.0;
  for (int i = 0; i <= settling + kSamples; ++i) {
    const double at = kAmplitude_m * std::cos(angle * i);
    if (i > settling) {
      delivered_J += held_N * (at - before_m);
      moved2 += (at - before_m) * (at - before_m);
    }
    const std::size_t slot = static_cast<std::size_t>(i) % sent.size();
    sent[slot] = model.step(Eigen::Vector3d(0.0, 0.0, at)).force_N.z();
    if (!(std::abs(sent[slot]) < 1e6)) return kInfinite;
    held_N = sent[(static_cast<std::size_t>(i) + 1) % sent.size()];
    before_m = at;
  }
  return delivered_J * contact.period_s / moved2;
}

/// Force over displacement at 1/z.
std::complex<double> transfer(const RenderedContact& contact, std::complex<double> back) {
  const BondElement p = contact.material();
  const double scale = p.modulus_to_stiffness_m();
  const double relaxed = scale * p.equilibrium_Pa;
  const double h = contact.period_s;
  if (contact.rule == ElementRule::mass_spring) {
    return relaxed + contact.dashpot_N_s_per_m() / h * (1.0 - back);
  }
  const double q = h / contact.relaxation_time_s;
  const double relaxing = scale * p.relaxing_Pa();
  if (contact.rule == ElementRule::forward_euler) {
    return relaxed + relaxing * (1.0 - q * back / (1.0 - (1.0 - q) * back));
  }
  const RelaxationWeights w = relaxation_weights(q);
  return relaxed + relaxing * (1.0 - (w.w1 + w.w0 * back) / (1.0 - w.r * back));
}

bool rule_diverges(const RenderedContact& contact) {
  return contact.rule == ElementRule::forward_euler &&
         contact.period_s >= 2.0 * contact.relaxation_time_s;
}

/// Between `low`, where it holds, and `high`, where it does not, to 1e-4 of the value.
double last_that_holds(double low, double high, const std::function<bool(double)>& holds) {
  while (high / low > 1.0 + 1e-4) {
    const double middle = std::sqrt(low * high);
    (holds(middle) ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

double needed_damping(const RenderedContact& contact, BoundaryBy by) {
  return by == BoundaryBy::measurement ? measured_passive_damping(contact)
                                       : predicted_passive_damping(contact);
}

/// The simulated device and arm on the contact, let go 1 mm from rest: does it come to rest?
bool comes_to_rest(const RenderedContact& contact, PlantSettings plant) {
  plant.period_s = contact.period_s;
  plant.delay_periods = contact.delay_periods;
  plant.encoder_step_m = 0.0;
  plant.arm.correction_per_s = 0.0;
  plant.push = Eigen::Vector3d::UnitZ();
  plant.motor_limit_N = plant.velocity_limit_m_per_s = plant.watchdog_s = kInfinite;
  VirtualPlant device(
      plant, OperatorScript({{OperatorPiece::Aim::place, 1e9, kAmplitude_m, kAmplitude_m}}));
  device.put_hand(0.0);
  ElementContact model = contact.model();
  const double longest_s = std::max(contact.relaxation_time_s, 0.05);
  const long steps = std::max(20'000L, std::lround(20.0 * longest_s / contact.period_s));
  double early = 0.0, late = 0.0;
  for (long i = 0; i < steps; ++i) {
    const Eigen::Vector3d at = device.measured_m();
    (void)device.command(model.step(at).force_N);
    device.advance();
    const double size = std::abs(device.position_m().z());
    if (!(size < 1e6)) return false;
    if (i >= steps / 4 && i < steps / 2) early = std::max(early, size);
    if (i >= 3 * (steps / 4)) late = std::max(late, size);
  }
  return late < early || late < 1e-12;
}

}  // namespace

BondElement RenderedContact::material() const {
  BondElement p;
  constexpr double kLeast = 1e-6;  // of each spring
  const double share = std::clamp(equilibrium_share, kLeast, 1.0 - kLeast);
  const double modulus_Pa = stiffness_N_per_m / p.modulus_to_stiffness_m();
  p.equilibrium_Pa = share * modulus_Pa;
  p.branches = {{(1.0 - share) * modulus_Pa, relaxation_time_s}};
  return p;
}

double RenderedContact::dashpot_N_s_per_m() const {
  constexpr double kRatio = 0.1, kDensity_kg_m3 = 1060.0, kRadius_m = 0.010;
  const double mass =
      kDensity_kg_m3 * 4.0 / 3.0 * std::numbers::pi * kRadius_m * kRadius_m * kRadius_m;
  return 2.0 * kRatio * std::sqrt(equilibrium_share * stiffness_N_per_m * mass);
}

ElementContact RenderedContact::model() const {
  return {material(), period_s, rule, rule == ElementRule::mass_spring ? dashpot_N_s_per_m() : 0.0};
}

double measured_passive_damping(const RenderedContact& contact) {
  double most = 0.0;
  for (const int cycles : measured_cycles()) most = std::max(most, damping_at(contact, cycles));
  return most;
}

double predicted_passive_damping(const RenderedContact& contact) {
  if (rule_diverges(contact)) return kInfinite;
  constexpr int kFrequencies = 4096;
  double most = 0.0;
  for (int i = 1; i <= kFrequencies; ++i) {
    const double angle = std::numbers::pi * i / kFrequencies;
    const std::complex<double> back = std::polar(1.0, -angle);
    const std::complex<double> loop =
        (1.0 - back) * transfer(contact, back) * std::polar(1.0, -angle * contact.delay_periods);
    most = std::max(most, contact.period_s * loop.real() / (2.0 * (1.0 - std::cos(angle))));
  }
  return most;
}

double largest_passive_stiffness(RenderedContact contact, double damping_N_s_per_m, BoundaryBy by) {
  return last_that_holds(1e-3, 1e8, [&](double stiffness) {
    contact.stiffness_N_per_m = stiffness;
    return needed_damping(contact, by) <= damping_N_s_per_m;
  });
}

double smallest_passive_relaxation_time(RenderedContact contact, double damping_N_s_per_m,
                                        BoundaryBy by) {
  const auto passive = [&](double periods) {
    contact.relaxation_time_s = periods * contact.period_s;
    return needed_damping(contact, by) <= damping_N_s_per_m;
  };
  constexpr double kShort = 1e-3, kLong = 1e3;
  if (passive(kShort)) return 0.0;
  if (!passive(kLong)) return kInfinite;
  const double rate = last_that_holds(1.0 / kLong, 1.0 / kShort,
                                      [&](double inverse) { return passive(1.0 / inverse); });
  return contact.period_s / rate;
}

double loop_spectral_radius(const RenderedContact& contact, const PlantSettings& plant) {
  PlantSettings settings = plant;
  settings.period_s = contact.period_s;
  const Eigen::Matrix<double, 2, 3> moved = place_propagator(settings);
  // State: x, v, w (followed displacement), x of the period before, forces on their way.
  const Eigen::Index forces = contact.delay_periods, size = 4 + forces;
  const BondElement p = contact.material();
  const double scale = p.modulus_to_stiffness_m();
  const double relaxed = scale * p.equilibrium_Pa;
  const double relaxing = scale * p.relaxing_Pa();
  const double q = contact.period_s / contact.relaxation_time_s;
  const RelaxationWeights w = relaxation_weights(q);
  // The model steps first: it sees x, its state is w and x before.
  Eigen::RowVectorXd followed = Eigen::RowVectorXd::Zero(size);
  Eigen::RowVectorXd force = Eigen::RowVectorXd::Zero(size);
  force[0] = -relaxed;
  if (contact.rule == ElementRule::mass_spring) {
    force[0] -= contact.dashpot_N_s_per_m() / contact.period_s;
    force[3] += contact.dashpot_N_s_per_m() / contact.period_s;
  } else {
    const bool exact = contact.rule == ElementRule::exact;
    followed[2] = exact ? w.r : 1.0 - q;
    followed[3] = exact ? w.w0 : q;
    followed[0] = exact ? w.w1 : 0.0;
    force[0] -= relaxing;
    force += relaxing * followed;
  }
  Eigen::RowVectorXd acting = force;  // on the device over the period
  if (forces > 0) acting = Eigen::RowVectorXd::Unit(size, size - 1);
  Eigen::MatrixXd loop = Eigen::MatrixXd::Zero(size, size);
  loop.topLeftCorner(2, 2) = moved.leftCols<2>();
  loop.topRows(2) += moved.col(2) * acting;
  loop.row(2) = followed;
  loop(3, 0) = 1.0;
  if (forces > 0) loop.row(4) = force;
  for (Eigen::Index i = 1; i < forces; ++i) loop(4 + i, 3 + i) = 1.0;
  return spectral_radius(loop);
}

double largest_stable_stiffness(RenderedContact contact, const PlantSettings& plant,
                                BoundaryBy by) {
  return last_that_holds(1.0, 1e8, [&](double stiffness) {
    contact.stiffness_N_per_m = stiffness;
    return by == BoundaryBy::measurement ? comes_to_rest(contact, plant)
                                         : loop_spectral_radius(contact, plant) < 1.0;
  });
}

}  // namespace tpm::haptics
