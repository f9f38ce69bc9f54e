// Declared in tpm/contact/condensed/condensed.hpp.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/contact/condensed/condensed_fit.hpp"
#include "tpm/contact/condensed/condensed_lag.hpp"
#include "tpm/organ/bonds/material_refusal.hpp"
#include "tpmkit/error.hpp"

namespace tpm::contact {
namespace {

constexpr int kMemories = 30;               // places of w
constexpr int kPlacesEach = 5;              // places of u for each w
constexpr int kPlacesAtRest = 10;           // for w = 0
constexpr double kDepthMargin = 0.03;       // of the depth, sampled on either side
constexpr double kTangentialMargin = 0.05;  // of the tangential range
constexpr double kStride = 0.5;             // of the depth, from one equilibrium to the next

/// The van der Corput sequence to a base: evenly spread over 0..1.
double radical_inverse(int i, int base) {
  double result = 0.0;
  for (double digit = 1.0 / base; i > 0; i /= base, digit /= base) result += digit * (i % base);
  return result;
}

/// Places spread over the range, denser at its ends.
class SpreadPlaces {
 public:
  SpreadPlaces(const CondensedFrame& frame, const CondensedOptions& options,
               const std::array<int, 3>& bases)
      : frame_(frame), options_(options), bases_(bases) {}

  [[nodiscard]] Eigen::Vector3d next() {
    ++count_;
    const double along = 0.5 * (1.0 - std::cos(std::numbers::pi * number(0)));
    const double depth = options_.depth_m * ((1.0 + 2.0 * kDepthMargin) * along - kDepthMargin);
    const double across = (1.0 + kTangentialMargin) * options_.tangential_m * std::sqrt(number(1));
    const double angle = 2.0 * std::numbers::pi * number(2);
    return frame_.axes * Eigen::Vector3d(depth, across * std::cos(angle), across * std::sin(angle));
  }

 private:
  [[nodiscard]] double number(std::size_t which) const {
    return radical_inverse(count_, bases_[which]);
  }
  CondensedFrame frame_;
  CondensedOptions options_;
  std::array<int, 3> bases_;
  int count_ = 0;
};

void require_valid(const BondSystem& bonds, const Positions& rest, std::size_t contact,
                   const Eigen::Vector3d& into_tissue, const CondensedOptions& options) {
  const auto refuse = [](const std::string& what) {
    throw Error(ExitCode::bad_input, "condensed model", what);
  };
  const auto positive = [&](double value, std::string_view name) {
    if (!(value > 0.0) || !std::isfinite(value)) {
      refuse(fmt::format("the {} is {}; expected a number above 0", name, value));
    }
  };
  positive(options.depth_m, "depth");
  positive(options.tangential_m, "tangential range");
  positive(options.period_s, "period");
  require_material(
      bonds, "the condensed model",
      {&Capabilities::branches, &Capabilities::stiffening, &Capabilities::any_potential});
  if (bonds.contact_count() > 0 || bonds.spheres() != static_cast<std::size_t>(rest.cols())) {
    refuse("the network has tools; expected spheres only, one of which is the contact");
  }
  if (contact >= bonds.spheres()) {
    refuse(fmt::format("there is no sphere {}; expected 1 to {}", contact + 1, bonds.spheres()));
  }
  if (std::abs(into_tissue.norm() - 1.0) > 1e-9) {
    refuse("the direction into the tissue is no unit vector; expected length 1");
  }
}

std::vector<CondensedBranch> condensed_branches(const BondSystem& bonds) {
  std::vector<CondensedBranch> branches;
  for (const ViscousLaw::Branch& branch : common_branches(bonds)) {
    branches.push_back({branch.share, branch.relaxation_time_s});
  }
  return branches;
}

CondensedFrame frame_of(const Eigen::Vector3d& into_tissue, const CondensedOptions& options) {
  CondensedFrame frame;
  const Eigen::Vector3d across = into_tissue.unitOrthogonal();
  frame.axes << into_tissue, across, into_tissue.cross(across);
  frame.middle_depth_m = frame.half_depth_m = 0.5 * options.depth_m;
  frame.tangential_m = options.tangential_m;
  return frame;
}

}  // namespace

CondensedContact build_condensed(const BondSystem& bonds, const Positions& rest,
                                 const Constraints& constraints, std::size_t contact,
                                 const Eigen::Vector3d& into_tissue,
                                 const CondensedOptions& options) {
  require_valid(bonds, rest, contact, into_tissue, options);
  Constraints held = constraints;
  held.fix(contact);
  const auto fit = std::make_shared<CondensedFit>();
  fit->frame = frame_of(into_tissue, options);
  fit->contact = static_cast<Eigen::Index>(contact);
  fit->least_depth_m = -kDepthMargin * options.depth_m;
  fit->most_depth_m = (1.0 + kDepthMargin) * options.depth_m;
  fit->most_tangential_m = (1.0 + kTangentialMargin) * options.tangential_m;

  CondensedSampler sampler(bonds, rest, held, contact, kStride * options.depth_m);
  std::vector<CondensedBranch> branches = condensed_branches(bonds);
  SpreadPlaces viscous_places(fit->frame, options, {2, 3, 5});
  SpreadPlaces places(fit->frame, options, {7, 11, 13});
  std::vector<CondensedMetric> metrics;
  std::vector<CondensedSample> samples;
  for (int i = 0; i < kMemories; ++i) {
    const Eigen::Vector3d w = i == 0 ? Eigen::Vector3d::Zero() : viscous_places.next();
    const CondensedMetric metric = sampler.relax_at(w);
    const CondensedSample relaxed = sampler.sample_at(w);
    if (i == 0) {
      fit->instantaneous = relaxed.by_uu;
      fit->equilibrium = relaxed.by_uu + relaxed.by_wu;
    }
    const auto local = [&](const Eigen::Matrix3d& m) {
      return Eigen::Matrix3d(fit->frame.axes.transpose() * (0.5 * (m + m.transpose())) *
                             fit->frame.axes / kMemories);
    };
    fit->mean_metric += local(metric.metric);
    fit->mean_energy -= local(relaxed.by_wu);
    fit->mean_coupling += local(metric.second_metric);
    fit->mean_second += local(metric.second_energy);
    const Eigen::Matrix3d coupling = local(kMemories * metric.second_metric);
    fit->coupling_along = std::max(fit->coupling_along, coupling(0, 0));
    fit->coupling_across = std::max({fit->coupling_across, coupling(1, 1), coupling(2, 2)});
    metrics.push_back(metric);
    samples.push_back(relaxed);
    for (int j = 0; j < (i == 0 ? kPlacesAtRest : kPlacesEach); ++j) {
      samples.push_back(sampler.sample_at(places.next()));
    }
  }
  const CondensedPotential potential(fit->frame, samples);
  fit->tables = condensed_tables(fit->frame, potential, CondensedMatrices(fit->frame, metrics));
  fit->tables.second_rate = condensed_modes(*fit).rates().bottomRightCorner<3, 3>();
  fit->fit_error_N = potential.worst_N();
  fit->field = CondensedField(fit->frame, rest, samples, metrics);
  CondensedContact model{fit, std::move(branches), options.period_s};
  fit->lag_error_N = condensed_lag_error_N(model, *fit, bonds, rest, constraints, into_tissue);
  return model;
}

}  // namespace tpm::contact
