#include "tpm/plan/inertia_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/organ/balance/driven_tissue.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpm/plan/rest_answers.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

constexpr int kLanczosSteps = 24;
constexpr int kSamples = 400;  // after each change of rate, fewer where rates change often
constexpr int kLeastSamples = 4;
constexpr std::size_t kAllSamples = 80'000;
constexpr double kPeriods = 3.0;  // of the lowest mode that they span

/// Lanczos' method with full orthogonalisation.
class Lanczos {
 public:
  Lanczos(const PlanScene& scene, const TissueState& rest, const Constraints& constraints,
          const Eigen::VectorXd& mass_kg, const RelaxationFactor& relaxation_factor)
      : bonds_(scene.driven().bonds),
        rest_(rest),
        constraints_(constraints),
        root_(mass_kg.cwiseSqrt().transpose().replicate(3, 1).reshaped()),
        viscous_state_{rest.mean, relaxation_factor, rest.closed} {}

  /// @param fields displacements, m, per unit of what each group imposes; the response is the
  /// first's
  [[nodiscard]] std::vector<SeenMode> modes(const std::vector<Eigen::Matrix3Xd>& fields) const {
    Eigen::MatrixXd sources(root_.size(), std::ssize(fields));
    for (std::size_t g = 0; g < fields.size(); ++g) {
      Eigen::Matrix3Xd field = fields[g];
      constraints_.project(field);
      sources.col(static_cast<Eigen::Index>(g)) = root_.cwiseProduct(field.reshaped());
    }
    Eigen::VectorXd q = sources.col(0);
    const double size = q.norm();
    if (!(size > 0.0)) return {};
    q /= size;
    Eigen::MatrixXd basis(q.size(), 0);
    std::vector<double> diagonal, beside;
    for (int k = 0; k < kLanczosSteps; ++k) {
      basis.conservativeResize(Eigen::NoChange, k + 1);
      basis.col(k) = q;
      Eigen::VectorXd next = apply(q);
      diagonal.push_back(q.dot(next));
      for (int twice = 0; twice < 2; ++twice) next -= basis * (basis.transpose() * next);
      const double beta = next.norm();
      if (!(beta > 1e-10 * diagonal.front()) || k + 1 == kLanczosSteps) break;
      beside.push_back(beta);
      q = next / beta;
    }
    beside.resize(diagonal.size() - 1);
    const SymmetricModes ritz =
        tridiagonal_modes(Eigen::Map<Eigen::VectorXd>(diagonal.data(), std::ssize(diagonal)),
                          Eigen::Map<Eigen::VectorXd>(beside.data(), std::ssize(beside)));
    const Eigen::MatrixXd seen = ritz.vectors.transpose() * (basis.transpose() * sources);
    std::vector<SeenMode> modes;
    for (Eigen::Index i = 0; i < ritz.values.size(); ++i) {
      SeenMode& mode = modes.emplace_back();
      mode.omega2 = std::max(ritz.values[i], 1e-12);
      for (const double of_group : seen.row(i)) {
        mode.weights.push_back(seen(i, 0) * of_group * mode.omega2);
      }
    }
    return modes;
  }

 private:
  [[nodiscard]] Eigen::VectorXd apply(const Eigen::VectorXd& q) const {
    const Eigen::Matrix3Xd x = q.cwiseQuotient(root_).reshaped(3, q.size() / 3);
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, x.cols());
    bonds_.add_stiffness_times(rest_.position, viscous_state_, x, force);
    constraints_.project(force);
    return force.reshaped().cwiseQuotient(root_);
  }

  const BondSystem& bonds_;
  const TissueState& rest_;
  const Constraints& constraints_;
  Eigen::VectorXd root_;
  ViscousState viscous_state_;
};

/// Responses of a damped mode to a unit impulse: q, its integral, its rate.
struct ImpulseResponse {
  double value = 0.0, integral = 0.0, rate = 0.0;
};

ImpulseResponse impulse(double t, double omega2, double alpha) {
  const double half = 0.5 * alpha;
  const double d2 = omega2 - half * half;
  const double d = std::sqrt(std::max(std::abs(d2), 1e-6 * omega2));
  double s = 0.0, c = 0.0;  // sine over d and cosine times the decay, or hyperbolic ones
  if (d2 > 0.0) {
    const double decay = std::exp(-half * t);
    s = decay * std::sin(d * t) / d;
    c = decay * std::cos(d * t);
  } else {
    const double slow = std::exp((d - half) * t), fast = std::exp(-(d + half) * t);
    s = 0.5 * (slow - fast) / d;
    c = 0.5 * (slow + fast);
  }
  return {s, (1.0 - c - half * s) / omega2, c - half * s};
}

/// A mode in motion: q, its integral, its rate.
class MovingMode {
 public:
  MovingMode(double omega2, double alpha) : omega2_(omega2), alpha_(alpha) {}
  void strike(double impulse) { rate_ += impulse; }
  [[nodiscard]] MovingMode after(double t) const {
    const ImpulseResponse r = impulse(t, omega2_, alpha_);
    MovingMode later = *this;
    later.value_ = value_ * (r.rate + alpha_ * r.value) + rate_ * r.value;
    later.integral_ += value_ * (r.value + alpha_ * r.integral) + rate_ * r.integral;
    later.rate_ = rate_ * r.rate - omega2_ * value_ * r.value;
    return later;
  }
  [[nodiscard]] double response() const { return value_ + alpha_ * integral_; }

 private:
  double omega2_, alpha_;
  double value_ = 0.0, integral_ = 0.0, rate_ = 0.0;
};

/// Without the modes in which spheres ring on stiff contacts of tools: the network itself damps
/// those, and its impacts are inelastic.
std::vector<SeenMode> without_ringing_contacts(std::vector<SeenMode> modes, const BondSystem& bonds,
                                               const Eigen::VectorXd& mass_kg) {
  constexpr double kStiff = 100.0;  // times the stiffest bond
  constexpr double kShare = 0.25;   // of the frequency of a sphere on its contact, squared
  const Eigen::Index between = bonds.stiffness().size() - std::ssize(bonds.contacts());
  const double stiffest = bonds.stiffness().head(between).maxCoeff();
  double least = std::numeric_limits<double>::infinity();
  for (const ToolContact& contact : bonds.contacts()) {
    if (contact.stiffness_N_per_m < kStiff * stiffest) continue;
    least = std::min(least, contact.stiffness_N_per_m / mass_kg[contact.sphere]);
  }
  std::erase_if(modes, [&](const SeenMode& mode) { return mode.omega2 > kShare * least; });
  return modes;
}

struct Kink {
  double time_s = 0.0, change = 0.0;
  std::size_t group = 0;
};

/// Protocols of all groups, that of the scene first.
std::vector<const Protocol*> all_protocols(const PlanScene& scene) {
  std::vector<const Protocol*> all{&scene.protocol()};
  for (const DriveGroup& group : scene.driven().probes.loading().beside) {
    all.push_back(&group.protocol);
  }
  return all;
}

void add_rate_kinks(const Protocol& protocol, std::size_t group, std::vector<Kink>& kinks) {
  const auto knots = protocol.knots();
  double rate = 0.0;
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    const double length = knots[k + 1].time_s - knots[k].time_s;
    if (!(length > 0.0)) continue;
    const double next = (knots[k + 1].value - knots[k].value) / length;
    if (next != rate) kinks.push_back({knots[k].time_s, next - rate, group});
    rate = next;
  }
  // One that ends before the others keeps its last value.
  if (group > 0 && rate != 0.0) kinks.push_back({knots.back().time_s, -rate, group});
}

std::vector<Kink> rate_kinks(const std::vector<const Protocol*>& protocols) {
  std::vector<Kink> kinks;
  for (std::size_t g = 0; g < protocols.size(); ++g) add_rate_kinks(*protocols[g], g, kinks);
  std::stable_sort(kinks.begin(), kinks.end(),
                   [](const Kink& a, const Kink& b) { return a.time_s < b.time_s; });
  return kinks;
}

double largest_jump(const Protocol& protocol) {
  const auto knots = protocol.knots();
  double jump = protocol.equilibrium_at_start() ? 0.0 : std::abs(knots.front().value);
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    if (knots[k].time_s != knots[k + 1].time_s) continue;
    jump = std::max(jump, std::abs(knots[k + 1].value - knots[k].value));
  }
  return jump;
}

double of_rates(const std::vector<Kink>& kinks, const std::vector<SeenMode>& modes, double alpha,
                double own_drag, double span_s, double end_s) {
  std::vector<MovingMode> moving;
  for (const SeenMode& mode : modes) moving.emplace_back(mode.omega2, alpha);
  double largest = 0.0, rate = 0.0;
  const int samples =
      std::clamp(static_cast<int>(kAllSamples / std::max<std::size_t>(kinks.size(), 1)),
                 kLeastSamples, kSamples);
  for (std::size_t k = 0; k < kinks.size(); ++k) {
    const Kink& kink = kinks[k];
    for (std::size_t i = 0; i < modes.size(); ++i) {
      moving[i].strike(kink.change * modes[i].weights[kink.group]);
    }
    if (kink.group == 0) rate += kink.change;
    const double until = k + 1 < kinks.size() ? kinks[k + 1].time_s : end_s;
    const double length = std::min(span_s, until - kink.time_s);
    for (int s = 0; s <= samples && length > 0.0; ++s) {
      double sum = own_drag * rate;
      for (const MovingMode& mode : moving) sum += mode.after(length * s / samples).response();
      largest = std::max(largest, std::abs(sum));
    }
    for (MovingMode& mode : moving) mode = mode.after(until - kink.time_s);
  }
  return largest;
}

double of_jump(double jump, std::size_t group, const std::vector<SeenMode>& modes, double alpha,
               double span_s) {
  double largest = 0.0;
  for (int i = 0; i <= kSamples; ++i) {
    double sum = 0.0;
    for (const SeenMode& mode : modes) {
      const ImpulseResponse r = impulse(span_s * i / kSamples, mode.omega2, alpha);
      sum += mode.weights[group] * (r.rate + alpha * r.value);
    }
    largest = std::max(largest, std::abs(jump * sum));
  }
  return largest;
}

}  // namespace

InertiaModes inertia_modes(const PlanScene& scene) {
  const DrivenNetwork& driven = scene.driven();
  constexpr double kAny_kg = 0.01;  // a tool that moves as imposed: its mass changes nothing
  const Eigen::VectorXd mass = masses_kg(scene.scene(), scene.run_network(), kAny_kg);
  constexpr double kConverged = 1e-8;  // sets damping and the time looked at
  const LowestMode lowest =
      lowest_mode(driven.bonds, driven.rest, driven.constraints, mass, kConverged);
  const double omega = lowest.angular_frequency();
  const double alpha = 2.0 * scene.scene().formulation.damping_ratio * omega;
  DrivenTissue tissue(driven.bonds, driven.rest, driven.constraints, driven.probes,
                      scene.protocol());
  const TissueState rest = tissue.at_rest(0.0);
  const ViscousState viscous_state{rest.mean, lowest.relaxation_factor, rest.closed};
  if (!tissue.equilibrium().factorise(rest.position, viscous_state)) {
    throw Error(ExitCode::numerical, "network", "its stiffness at rest is not positive", "");
  }
  std::vector<Eigen::Matrix3Xd> fields;
  for (std::size_t g = 0; g < tissue.groups(); ++g) {
    fields.push_back(tissue.unit_field(rest, viscous_state, g).displacement);
  }
  InertiaModes found;
  found.modes = without_ringing_contacts(
      Lanczos(scene, rest, tissue.constraints(), mass, lowest.relaxation_factor).modes(fields),
      driven.bonds, mass);
  found.lowest_Hz = lowest.frequency_Hz;
  found.alpha_per_s = alpha;
  Eigen::VectorXd damped = mass;  // tools are not
  for (const ToolContact& contact : driven.bonds.contacts()) damped[contact.tool] = 0.0;
  if (tissue.depth_driven()) found.own_drag_kg_s = alpha * tissue.driven_mass_kg(damped);
  return found;
}

InertiaEstimate estimate_inertia(const PlanScene& scene) {
  const auto& [modes, lowest_Hz, alpha, own_drag] = modes_at_rest(scene);
  InertiaEstimate estimate;
  estimate.lowest_Hz = lowest_Hz;
  for (const SeenMode& mode : modes) {
    estimate.highest_Hz =
        std::max(estimate.highest_Hz, std::sqrt(mode.omega2) / (2.0 * std::numbers::pi));
  }
  const double span_s = kPeriods / lowest_Hz;
  const std::vector<const Protocol*> protocols = all_protocols(scene);
  estimate.of_rates = of_rates(rate_kinks(protocols), modes, alpha, own_drag, span_s,
                               scene.protocol().knots().back().time_s);
  for (std::size_t g = 0; g < protocols.size(); ++g) {
    const double jump = largest_jump(*protocols[g]);
    if (!(jump > 0.0)) continue;
    estimate.of_jumps += protocols[g]->drive() == Drive::displacement
                             ? std::numeric_limits<double>::infinity()
                             : of_jump(jump, g, modes, alpha, span_s);
  }
  return estimate;
}

}  // namespace tpm::plan
