#include "tpm/law/creep_weights.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "tpm/law/relaxation/exponential_sum.hpp"

namespace tpm::law {
namespace {

using Place = ExponentialCollocation::Place;

std::vector<double> begin_and_radau_nodes() {
  std::vector<double> nodes = radau_nodes(kCreepNodes);
  nodes.insert(nodes.begin(), 0.0);
  return nodes;
}

double lattice_step() {
  static const double step = ExponentialSum::log_step_for(kFractionalTolerance);
  return step;
}

/// Weights at z = exp(k lattice_step()).
class LatticeWeights {
 public:
  LatticeWeights() {
    for (long k = -kBelow; k <= kAbove; ++k) {
      weights_.push_back(creep_rule().weights(std::exp(static_cast<double>(k) * lattice_step())));
    }
  }
  [[nodiscard]] static bool has(long k) { return k >= -kBelow && k <= kAbove; }
  [[nodiscard]] const BranchWeights& at(long k) const {
    return weights_[static_cast<std::size_t>(k + kBelow)];
  }

 private:
  static constexpr long kBelow = 220, kAbove = 220;  // z from 1e-20 to 1e20
  std::vector<BranchWeights> weights_;
};

const LatticeWeights& lattice_weights() {
  static const LatticeWeights weights;
  return weights;
}

constexpr long kOffLattice = std::numeric_limits<long>::min();

/// The place of a fixed rate on the lattice of ExponentialSum, if it has one.
long lattice_place(double rate_per_s) {
  constexpr double kRounding = 1e-9;
  constexpr double kFarthest = 1e4;
  const double steps = std::log(rate_per_s) / lattice_step();
  const double nearest = std::round(steps);
  const bool on = std::abs(steps) < kFarthest && std::abs(steps - nearest) < kRounding;
  return on ? std::lround(nearest) : kOffLattice;
}

}  // namespace

CreepRule::CreepRule() : collocation(begin_and_radau_nodes()) {
  constexpr std::array<std::size_t, kCreepPlaces - kCreepNodes> kHalfwayAfter{0, 3, 6};
  const std::vector<double>& c = collocation.nodes();
  for (std::size_t i = 1; i < c.size(); ++i) place.push_back(collocation.place(c[i]));
  for (const std::size_t i : kHalfwayAfter) {
    place.push_back(collocation.place(0.5 * (c[i] + c[i + 1])));
  }
  for (Eigen::Index i = 0; i < kCreepPlaces; ++i) {
    const Place& at = place[static_cast<std::size_t>(i)];
    fraction[i] = at.fraction();
    interpolation.col(i) = at.interpolation();
    derivative.col(i) = at.derivative();
  }
}

BranchWeights CreepRule::weights(double z) const {
  BranchWeights weights;
  for (Eigen::Index i = 0; i < kCreepPlaces; ++i) {
    weights.lag.col(i) = place[static_cast<std::size_t>(i)].lag(z);
  }
  weights.decay = (-z * fraction).exp();
  return weights;
}

const CreepRule& creep_rule() {
  static const CreepRule rule;
  return rule;
}

double on_creep_lattice(double h) {
  return std::exp(std::floor(std::log(h) / lattice_step()) * lattice_step());
}

CreepWeights::CreepWeights(const RelaxationSum& relaxation) : relaxation_(relaxation) {
  const auto count = static_cast<std::size_t>(relaxation.stiffness.size());
  own_.resize(count);
  weights_.resize(count);
  lattice_.assign(count, kOffLattice);
  for (std::size_t j = 0; j < count; ++j) {
    if (relaxation.rate_parameter[j] >= 0) continue;
    lattice_[j] = lattice_place(relaxation.rate_per_s[static_cast<Eigen::Index>(j)]);
  }
}

void CreepWeights::set_step(double h) {
  h_ = h;
  const long step = h > 0.0 ? lattice_place(h) : kOffLattice;
  for (std::size_t j = 0; j < weights_.size(); ++j) {
    const bool on_lattice = step != kOffLattice && lattice_[j] != kOffLattice;
    if (on_lattice && LatticeWeights::has(lattice_[j] + step)) {
      weights_[j] = &lattice_weights().at(lattice_[j] + step);
      continue;
    }
    own_[j] = creep_rule().weights(h * relaxation_.rate_per_s[static_cast<Eigen::Index>(j)]);
    weights_[j] = &own_[j];
  }
}

double CreepWeights::lag_by_z(Eigen::Index branch, Eigen::Index node, const CreepCourse& course,
                              double carried) const {
  const double z = h_ * relaxation_.rate_per_s[branch];
  const Place& at = creep_rule().place[static_cast<std::size_t>(node)];
  // w = weights' course + decay w(0), and w(0) = -carried.
  return -at.weight_slopes(z).dot(course) - at.fraction() * (*this)[branch].decay[node] * carried;
}

}  // namespace tpm::law
