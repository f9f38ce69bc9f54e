#include "tpm/plan/contact_spectrum.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tpm/core/error.hpp"
#include "tpm/network/driven_tissue.hpp"
#include "tpm/network/material_refusal.hpp"

namespace tpm {
namespace {

constexpr int kThetas = 9;
constexpr int kTimes = 21;

/// What remains of a branch's stiffness where a share theta of a bond has relaxed.
double remaining(double theta, double ratio) {
  return (1.0 - theta) * ratio / (theta + (1.0 - theta) * ratio);
}

struct BranchFit {
  double error = std::numeric_limits<double>::infinity();
  std::vector<ScalarBranch> branches;
};

/// Shares for given times (in tau) whose sum is 1, by least squares, and the largest deviation; no
/// fit if a share is not above 0.
BranchFit fit_shares(const ContactSpectrum& spectrum, const std::vector<double>& ratios) {
  const auto rows = static_cast<Eigen::Index>(spectrum.theta.size());
  const auto columns = static_cast<Eigen::Index>(ratios.size());
  const double whole = spectrum.at_once() - spectrum.relaxed();
  Eigen::MatrixXd a(rows, columns);
  Eigen::VectorXd b(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto k = static_cast<std::size_t>(i);
    b[i] = (spectrum.stiffness_N_per_m[k] - spectrum.relaxed()) / whole;
    for (Eigen::Index j = 0; j < columns; ++j) {
      a(i, j) = remaining(spectrum.theta[k], ratios[static_cast<std::size_t>(j)]);
    }
  }
  Eigen::VectorXd shares = Eigen::VectorXd::Ones(columns);
  if (columns > 1) {
    const Eigen::VectorXd last = a.col(columns - 1);
    const Eigen::MatrixXd others = a.leftCols(columns - 1).colwise() - last;
    shares.head(columns - 1) = others.colPivHouseholderQr().solve(b - last);
    shares[columns - 1] = 1.0 - shares.head(columns - 1).sum();
  }
  BranchFit fit;
  if (!(shares.minCoeff() > 0.0)) return fit;
  fit.error = (a * shares - b).cwiseAbs().maxCoeff();
  for (Eigen::Index j = 0; j < columns; ++j) {
    fit.branches.push_back({shares[j], ratios[static_cast<std::size_t>(j)] * spectrum.tau_s});
  }
  return fit;
}

void search(const ContactSpectrum& spectrum, std::vector<double>& ratios, int first, int left,
            BranchFit& best) {
  if (left == 0) {
    BranchFit fit = fit_shares(spectrum, ratios);
    if (fit.error < best.error) best = std::move(fit);
    return;
  }
  for (int i = first; i < kTimes; ++i) {
    ratios.push_back(std::pow(spectrum.longest, static_cast<double>(i) / (kTimes - 1)));
    search(spectrum, ratios, i + 1, left - 1, best);
    ratios.pop_back();
  }
}

}  // namespace

ContactSpectrum contact_spectrum(const PlanScene& scene) {
  const DrivenNetwork& driven = scene.driven();
  // Times a factor, the material of all bonds.
  const BondMaterial& material = scene.scene().tissue.materials.materials.front();
  DrivenTissue tissue(driven.bonds, driven.rest, driven.freedom, driven.probes,
                      scene.protocol().drive());
  const TissueState rest = tissue.at_rest(0.0);
  ContactSpectrum spectrum;
  require_one_relaxation(driven.bonds, "a contact of a few exponentials");
  spectrum.tau_s = driven.bonds.relaxation_time_s();
  // A bond under a constant force creeps in k/(k - g) tau; one without equilibrium modulus creeps
  // for ever.
  spectrum.longest =
      std::min(material.instantaneous_Pa() / std::max(material.equilibrium_Pa, 1e-3), 1e3);
  for (int i = 0; i < kThetas; ++i) {
    const double theta = 0.5 * (1.0 - std::cos(std::numbers::pi * i / (kThetas - 1)));
    const BondMemory memory{rest.mean, theta, rest.closed};
    if (!tissue.equilibrium().factorise(rest.position, memory) ||
        !tissue.equilibrium().is_stable()) {
      throw Error(ExitCode::numerical, "network", "its stiffness at rest is not positive", "");
    }
    const DrivenTissue::UnitField unit = tissue.unit_field(rest, memory);
    double per_depth = 1.0;
    double stiffness =
        1.0 / unit.stiffness;  // under a load the work of the unit field is the compliance
    if (tissue.depth_driven()) {
      Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest.position.cols());
      driven.bonds.add_stiffness_times(rest.position, memory, unit.displacement, force);
      stiffness = -tissue.response(rest.position, force);
    } else {
      per_depth = stiffness;
    }
    spectrum.theta.push_back(theta);
    spectrum.stiffness_N_per_m.push_back(stiffness);
    const auto field =
        per_depth * unit.displacement.leftCols(scene.network().organ.position.cols());
    if (i == 0) spectrum.field_at_once = field;
    if (i == kThetas - 1) spectrum.field_relaxed = field;
  }
  return spectrum;
}

std::vector<ScalarBranch> fitted_branches(const ContactSpectrum& spectrum, int most) {
  if (!(spectrum.at_once() - spectrum.relaxed() > 1e-12 * spectrum.at_once())) return {};
  BranchFit best;
  std::vector<double> ratios;
  search(spectrum, ratios, 0, most, best);
  return best.branches;
}

}  // namespace tpm
