#include "tpm/plan/contact_spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/evenly.hpp"
#include "tpm/organ/balance/driven_tissue.hpp"
#include "tpm/organ/bonds/material_refusal.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

constexpr int kThetas = 9;
constexpr int kTimes = 21, kMostTried = 31;
constexpr double kPerDecade = 8.0;
constexpr double kBeyond = 30.0;  // rates beyond the relaxation times, as a factor

/// Remaining share of a branch's stiffness at a rate.
double remaining(double per_rate_s, double time_s) {
  return time_s / (time_s + per_rate_s);
}

double decades(double from, double to) {
  return std::log10(to / from);
}

/// Share of what can relax that has relaxed at a rate.
double relaxed_share(const std::vector<ViscousLaw::Branch>& branches, double per_rate_s) {
  double theta = 0.0;
  for (const ViscousLaw::Branch& branch : branches) {
    theta += branch.share * per_rate_s / (per_rate_s + branch.relaxation_time_s);
  }
  return theta;
}

/// The polynomial through values at the extrema of a Chebyshev polynomial over 0..1 (barycentric
/// formula: Berrut and Trefethen, SIAM Review 46, 2004).
double between(const std::vector<double>& theta, const std::vector<double>& values, double at) {
  double above = 0.0;
  double below = 0.0;
  for (std::size_t i = 0; i < theta.size(); ++i) {
    if (at == theta[i]) return values[i];
    const bool end = i == 0 || i + 1 == theta.size();
    const double weight = (i % 2 == 0 ? 1.0 : -1.0) * (end ? 0.5 : 1.0) / (at - theta[i]);
    above += weight * values[i];
    below += weight;
  }
  return above / below;
}

/// The spectrum's rates and stiffnesses from stiffnesses by theta.
void set_rates(ContactSpectrum& spectrum, const std::vector<ViscousLaw::Branch>& branches,
               const std::vector<double>& theta, const std::vector<double>& stiffness) {
  constexpr double kEver = std::numeric_limits<double>::infinity();
  if (branches.size() < 2) {
    const double tau_s = branches.empty() ? 1.0 : branches.front().relaxation_time_s;
    for (const double share : theta) {
      spectrum.per_rate_s.push_back(share < 1.0 ? tau_s * share / (1.0 - share) : kEver);
    }
    spectrum.stiffness_N_per_m = stiffness;
    return;
  }
  const double first = spectrum.shortest_s / kBeyond;
  const double last = spectrum.longest_s * kBeyond;
  const int count = 1 + static_cast<int>(std::ceil(kPerDecade * decades(first, last)));
  const auto add = [&](double per_rate_s, double stiffness_there) {
    spectrum.per_rate_s.push_back(per_rate_s);
    spectrum.stiffness_N_per_m.push_back(stiffness_there);
  };
  add(0.0, stiffness.front());
  for (const double at : evenly_in_log(first, last, count)) {
    add(at, between(theta, stiffness, relaxed_share(branches, at)));
  }
  add(kEver, stiffness.back());
}

struct BranchFit {
  double error = std::numeric_limits<double>::infinity();
  std::vector<ScalarBranch> branches;
};

/// Shares for given times whose sum is 1, by least squares, and the largest deviation; no
/// fit if a share is not above 0.
BranchFit fit_shares(const ContactSpectrum& spectrum, const std::vector<double>& times_s) {
  const auto rows = static_cast<Eigen::Index>(spectrum.per_rate_s.size());
  const auto columns = static_cast<Eigen::Index>(times_s.size());
  const double whole = spectrum.instantaneous() - spectrum.equilibrium();
  Eigen::MatrixXd a(rows, columns);
  Eigen::VectorXd b(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto k = static_cast<std::size_t>(i);
    b[i] = (spectrum.stiffness_N_per_m[k] - spectrum.equilibrium()) / whole;
    for (Eigen::Index j = 0; j < columns; ++j) {
      a(i, j) = remaining(spectrum.per_rate_s[k], times_s[static_cast<std::size_t>(j)]);
    }
  }
  Eigen::VectorXd shares = Eigen::VectorXd::Ones(columns);
  if (columns > 1) {
    const Eigen::VectorXd last = a.col(columns - 1);
    const Eigen::MatrixXd others = a.leftCols(columns - 1).colwise() - last;
    shares.head(columns - 1) = least_squares(others, b - last);
    shares[columns - 1] = 1.0 - shares.head(columns - 1).sum();
  }
  BranchFit fit;
  if (!(shares.minCoeff() > 0.0)) return fit;
  fit.error = (a * shares - b).cwiseAbs().maxCoeff();
  for (Eigen::Index j = 0; j < columns; ++j) {
    fit.branches.push_back({shares[j], times_s[static_cast<std::size_t>(j)]});
  }
  return fit;
}

int times_tried(const ContactSpectrum& spectrum) {
  const double count = kPerDecade * decades(spectrum.shortest_s, spectrum.longest_s);
  return static_cast<int>(std::clamp<double>(std::ceil(count), kTimes, kMostTried));
}

void search(const ContactSpectrum& spectrum, std::vector<double>& times_s, int first, int left,
            BranchFit& best) {
  if (left == 0) {
    BranchFit fit = fit_shares(spectrum, times_s);
    if (fit.error < best.error) best = std::move(fit);
    return;
  }
  const int count = times_tried(spectrum);
  for (int i = first; i < count; ++i) {
    times_s.push_back(spectrum.shortest_s * std::pow(spectrum.longest_s / spectrum.shortest_s,
                                                     static_cast<double>(i) / (count - 1)));
    search(spectrum, times_s, i + 1, left - 1, best);
    times_s.pop_back();
  }
}

}  // namespace

ContactSpectrum contact_spectrum(const PlanScene& scene) {
  const DrivenNetwork& driven = scene.driven();
  // Times a factor, the material of all bonds.
  const BondMaterial& material = scene.scene().tissue.materials.materials.front();
  DrivenTissue tissue(driven.bonds, driven.rest, driven.constraints, driven.probes,
                      scene.protocol().drive());
  const TissueState rest = tissue.at_rest(0.0);
  ContactSpectrum spectrum;
  require_material(
      driven.bonds, "a contact of a few exponentials",
      {&Capabilities::branches, &Capabilities::stiffening, &Capabilities::any_potential});
  const std::vector<ViscousLaw::Branch> branches = common_branches(driven.bonds);
  // A bond under a constant force creeps in k/(k - g) tau; one without equilibrium modulus creeps
  // for ever.
  const double slower =
      std::min(material.instantaneous_Pa() / std::max(material.equilibrium_Pa, 1e-3), 1e3);
  spectrum.shortest_s = branches.empty() ? 1.0 : branches.front().relaxation_time_s;
  spectrum.longest_s = slower * (branches.empty() ? 1.0 : branches.back().relaxation_time_s);
  std::vector<double> of_theta;
  std::vector<double> stiffness_of_theta;
  for (int i = 0; i < kThetas; ++i) {
    const double theta = 0.5 * (1.0 - std::cos(std::numbers::pi * i / (kThetas - 1)));
    const ViscousState viscous_state{rest.mean, theta, rest.closed};
    if (!tissue.equilibrium().factorise(rest.position, viscous_state) ||
        !tissue.equilibrium().is_stable()) {
      throw Error(ExitCode::numerical, "network", "its stiffness at rest is not positive", "");
    }
    const DrivenTissue::UnitField unit = tissue.unit_field(rest, viscous_state);
    double per_depth = 1.0;
    double stiffness =
        1.0 / unit.stiffness;  // under a load the work of the unit field is the compliance
    if (tissue.depth_driven()) {
      Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest.position.cols());
      driven.bonds.add_stiffness_times(rest.position, viscous_state, unit.displacement, force);
      stiffness = -tissue.response(rest.position, force);
    } else {
      per_depth = stiffness;
    }
    of_theta.push_back(theta);
    stiffness_of_theta.push_back(stiffness);
    const auto field =
        per_depth * unit.displacement.leftCols(scene.network().organ.position.cols());
    if (i == 0) spectrum.field_instantaneous = field;
    if (i == kThetas - 1) spectrum.field_relaxed = field;
  }
  set_rates(spectrum, branches, of_theta, stiffness_of_theta);
  return spectrum;
}

std::vector<ScalarBranch> fitted_branches(const ContactSpectrum& spectrum, int most) {
  if (!(spectrum.instantaneous() - spectrum.equilibrium() > 1e-12 * spectrum.instantaneous()))
    return {};
  BranchFit best;
  std::vector<double> times_s;
  // One more exponential than relax gets a share of 0, or of rounding with either sign.
  for (int count = 1; count <= most; ++count) search(spectrum, times_s, 0, count, best);
  return best.branches;
}

}  // namespace tpm::plan
