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
constexpr std::size_t kMostKinks = 200;
constexpr int kSamples = 400;     // after each change of rate
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

  /// @param field displacements, m
  [[nodiscard]] std::vector<SeenMode> modes(Eigen::Matrix3Xd field) const {
    constraints_.project(field);
    Eigen::VectorXd q = root_.cwiseProduct(field.reshaped());
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
    std::vector<SeenMode> modes;
    for (Eigen::Index i = 0; i < ritz.values.size(); ++i) {
      const double first = size * ritz.vectors(0, i);
      const double omega2 = std::max(ritz.values[i], 1e-12);
      modes.push_back({omega2, first * first * omega2});
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
  const double decay = std::exp(-half * t);
  // Above critical damping sine and cosine become hyperbolic; the envelope is enough there.
  const double d = std::sqrt(std::max(d2, 1e-6 * omega2));
  const double s = std::sin(d * t) / d, c = std::cos(d * t);
  return {decay * s, (1.0 - decay * (c + half * s)) / omega2, decay * (c - half * s)};
}

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
};

std::vector<Kink> rate_kinks(const Protocol& protocol) {
  const auto knots = protocol.knots();
  std::vector<Kink> kinks;
  double rate = 0.0;
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    const double length = knots[k + 1].time_s - knots[k].time_s;
    if (!(length > 0.0)) continue;
    const double next = (knots[k + 1].value - knots[k].value) / length;
    if (next != rate) kinks.push_back({knots[k].time_s, next - rate});
    rate = next;
  }
  if (kinks.size() <= kMostKinks) return kinks;
  std::stable_sort(kinks.begin(), kinks.end(), [](const Kink& a, const Kink& b) {
    return std::abs(a.change) > std::abs(b.change);
  });
  kinks.resize(kMostKinks);
  std::sort(kinks.begin(), kinks.end(),
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
  double largest = 0.0;
  for (std::size_t k = 0; k < kinks.size(); ++k) {
    const double until = k + 1 < kinks.size() ? kinks[k + 1].time_s : end_s;
    const double length = std::min(span_s, until - kinks[k].time_s);
    for (int i = 0; i <= kSamples; ++i) {
      const double t = kinks[k].time_s + length * i / kSamples;
      double sum = 0.0, rate = 0.0;
      for (std::size_t j = 0; j <= k; ++j) {
        rate += kinks[j].change;
        for (const SeenMode& mode : modes) {
          const ImpulseResponse r = impulse(t - kinks[j].time_s, mode.omega2, alpha);
          sum += kinks[j].change * mode.weight * (r.value + alpha * r.integral);
        }
      }
      largest = std::max(largest, std::abs(sum + own_drag * rate));
    }
  }
  return largest;
}

double of_jump(double jump, const std::vector<SeenMode>& modes, double alpha, double span_s) {
  double largest = 0.0;
  for (int i = 0; i <= kSamples; ++i) {
    double sum = 0.0;
    for (const SeenMode& mode : modes) {
      const ImpulseResponse r = impulse(span_s * i / kSamples, mode.omega2, alpha);
      sum += mode.weight * (r.rate + alpha * r.value);
    }
    largest = std::max(largest, std::abs(jump * sum));
  }
  return largest;
}

}  // namespace

InertiaModes inertia_modes(const PlanScene& scene) {
  const DrivenNetwork& driven = scene.driven();
  const Eigen::VectorXd mass = masses_kg(scene.scene(), scene.run_network());
  constexpr double kConverged = 1e-8;  // sets damping and the time looked at
  const LowestMode lowest =
      lowest_mode(driven.bonds, driven.rest, driven.constraints, mass, kConverged);
  const double omega = lowest.angular_frequency();
  const double alpha = 2.0 * scene.scene().formulation.damping_ratio * omega;
  DrivenTissue tissue(driven.bonds, driven.rest, driven.constraints, driven.probes,
                      scene.protocol().drive());
  const TissueState rest = tissue.at_rest(0.0);
  const ViscousState viscous_state{rest.mean, lowest.relaxation_factor, rest.closed};
  if (!tissue.equilibrium().factorise(rest.position, viscous_state)) {
    throw Error(ExitCode::numerical, "network", "its stiffness at rest is not positive", "");
  }
  InertiaModes found;
  found.modes = without_ringing_contacts(
      Lanczos(scene, rest, tissue.constraints(), mass, lowest.relaxation_factor)
          .modes(tissue.unit_field(rest, viscous_state).displacement),
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
  estimate.of_rates = of_rates(rate_kinks(scene.protocol()), modes, alpha, own_drag, span_s,
                               scene.protocol().knots().back().time_s);
  const double jump = largest_jump(scene.protocol());
  if (jump > 0.0) {
    estimate.of_jumps = scene.by_depth() ? std::numeric_limits<double>::infinity()
                                         : of_jump(jump, modes, alpha, span_s);
  }
  return estimate;
}

}  // namespace tpm::plan
