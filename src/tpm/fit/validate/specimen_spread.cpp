#include "tpm/fit/validate/specimen_spread.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/base/distributions.hpp"
#include "tpm/fit/groups/random_effects.hpp"
#include "tpm/fit/validate/pooled.hpp"

namespace tpm::fit {
namespace {

/// A quantity of one recording of the calibration.
struct CalibrationShare {
  std::size_t recording;
  const QuantityComparison* quantity;
};

std::vector<CalibrationShare> shares_in(std::span<const RecordingComparison> calibration,
                                        const QuantityOfInterest& quantity, bool creep) {
  std::vector<CalibrationShare> members;
  for (std::size_t i = 0; i < calibration.size(); ++i) {
    if (calibration[i].creep != creep) continue;
    for (const QuantityComparison& q : calibration[i].quantities) {
      if (q.quantity == quantity && std::abs(q.simulated) > 0.0) members.push_back({i, &q});
    }
  }
  return members;
}

SpecimenSpread spread_of(const std::vector<CalibrationShare>& members, std::size_t recordings,
                         std::span<const int> readings) {
  std::vector<SpecimenEstimate> estimates;
  double mean = 0.0, own_square = 0.0, weights = 0.0, weight_squares = 0.0;
  const auto n = static_cast<double>(members.size());
  for (const CalibrationShare& m : members) {
    const double size = m.quantity->simulated;
    const double share = m.quantity->measured / size;
    const double own = std::max(m.quantity->u_own / std::abs(size), 1e-12);
    estimates.push_back({"", share, own});
    mean += share / n;
    own_square += own * own / n;
    const double weight = m.recording < readings.size() ? readings[m.recording] : 1.0;
    weights += weight;
    weight_squares += weight * weight;
  }
  SpecimenSpread spread;
  spread.recordings = static_cast<int>(members.size());
  const double tau_squared = random_effects(estimates).tau_squared.value_or(0.0);
  spread.deviations = Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(recordings));
  for (std::size_t k = 0; k < members.size(); ++k) {
    spread.deviations[static_cast<Eigen::Index>(members[k].recording)] =
        estimates[k].estimate - mean;
  }
  const double norm = spread.deviations.norm();
  if (norm > 0.0) spread.deviations *= std::sqrt(tau_squared) / norm;
  spread.with_own = std::sqrt(tau_squared + own_square);
  spread.of_mean = weights > 0.0 ? std::sqrt(weight_squares) / weights : 1.0 / std::sqrt(n);
  return spread;
}

}  // namespace

double SpecimenSpread::tau_at_most() const {
  constexpr double kExcluded = 0.05;
  const double whole = with_own * with_own, own = whole - tau() * tau();
  return std::sqrt(
      std::max(whole * degrees() / chi_squared_quantile(kExcluded, degrees()) - own, 0.0));
}

std::vector<SpecimenSpread> specimen_spreads(std::span<const RecordingComparison> calibration,
                                             std::span<const int> readings) {
  std::vector<SpecimenSpread> all;
  for (const bool creep : {false, true}) {
    for (const QuantityComparison& one : each_quantity(calibration)) {
      const std::vector<CalibrationShare> members = shares_in(calibration, one.quantity, creep);
      const bool known = std::ranges::any_of(all, [&](const SpecimenSpread& own) {
        return own.quantity == one.quantity && own.creep == creep;
      });
      if (members.size() < 2 || known) continue;
      SpecimenSpread spread = spread_of(members, calibration.size(), readings);
      spread.quantity = one.quantity;
      spread.creep = creep;
      all.push_back(std::move(spread));
    }
  }
  return all;
}

}  // namespace tpm::fit
