// Declared in tpm/organ/balance/stage_balance.hpp.
// Results of a step of StageBalance: responses, states, heat and work.
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>

#include "tpm/organ/balance/stage_balance.hpp"

namespace tpm::organ {
namespace {

using LegendreValues = Eigen::Matrix<double, StepEnergy::kPoints + 1, 1>;

/// Legendre's polynomials of degree 0 to kPoints at x, by their recurrence.
LegendreValues legendre(double x) {
  LegendreValues value;
  value[0] = 1.0;
  value[1] = x;
  for (Eigen::Index n = 1; n < StepEnergy::kPoints; ++n) {
    const auto m = static_cast<double>(n);
    value[n + 1] = ((2.0 * m + 1.0) * x * value[n] - m * value[n - 1]) / (m + 1.0);
  }
  return value;
}

}  // namespace

StageBalance::Shapes StageBalance::shapes(std::span<const double> fractions, double h) const {
  Shapes shapes;
  Places places;
  for (const double c : fractions) places.push_back(full_.place(c));
  shapes.weights = weights_at(places, fractions, h);
  shapes.interpolation.setZero();
  for (int lane = 0; lane < kLanes; ++lane) {
    const std::size_t place = std::min(static_cast<std::size_t>(lane), fractions.size() - 1);
    shapes.interpolation.row(lane).head(stages_) =
        places[place].interpolation().tail(stages_).transpose();
  }
  return shapes;
}

StageBalance::Within StageBalance::within(const TissueState& state,
                                          std::span<const double> fractions, double h,
                                          double rate) const {
  Shapes at = shapes(fractions, h);
  Within states;
  for (int lane = 0; lane < kLanes; ++lane) {
    const double c = fractions[std::min(static_cast<std::size_t>(lane), fractions.size() - 1)];
    states.imposed[lane] = state.imposed + c * h * rate;
  }
  // Of displacements, not of coordinates, for the sake of rounding.
  mix_lanes(at.interpolation, x_.rowwise() - start_, states.position);
  states.position.rowwise() += start_;
  LaneMatrix known;
  find_known(at.weights, begin_, known);
  apply(at.weights, followed_, begin_, known, states.mean_viscous);
  states.weights = std::move(at.weights);
  return states;
}

LaneVector StageBalance::responses(const Within& states) {
  force_.setZero();
  tissue_.add_load(states.imposed, force_);
  bonds_.add_forces(states.position, states.mean_viscous, force_);
  const LaneVector plain = tissue_.response(states.position, force_);
  tissue_.constraints().project(force_);
  return plain + tissue_.adjoint_sign() * (force_ * lane_field_.transpose());
}

std::vector<LaneVector> StageBalance::responses_of_groups(const Within& states,
                                                          const LaneVector& first) const {
  std::vector<LaneVector> responses{first};
  if (tissue_.path().single()) return responses;
  LaneMatrix force = LaneMatrix::Zero(kLanes, coordinates_);
  tissue_.add_load(states.imposed, force);
  bonds_.add_forces(states.position, states.mean_viscous, force);
  for (std::size_t g = 1; g < tissue_.groups(); ++g) {
    responses.push_back(tissue_.response(states.position, force, g));
  }
  return responses;
}

LaneVector StageBalance::powers_per_rate(const Within& states,
                                         const std::vector<LaneVector>& responses) const {
  LaneVector sum = LaneVector::Zero();
  for (std::size_t g = 0; g < tissue_.groups(); ++g) {
    const LaneVector slope =
        states.imposed.unaryExpr([&](double at) { return tissue_.path().slope(g, at); });
    sum += (tissue_.depth_driven(g) ? 1.0 : -1.0) * slope.cwiseProduct(responses[g]);
  }
  return sum;
}

LaneVector StageBalance::responses_within(const TissueState& state,
                                          std::span<const double> fractions, double h,
                                          double rate) {
  return responses(within(state, fractions, h, rate));
}

std::vector<QuasiStaticState> StageBalance::states_within(const TissueState& state,
                                                          std::span<const double> fractions,
                                                          double h, double rate, bool energies) {
  Within all = within(state, fractions, h, rate);
  const LaneVector response = responses(all);
  d_ = force_;  // what responses() left of them
  factor_.solve(d_);
  tissue_.constraints().project(d_);
  all.position += d_;
  LaneVector stored_J;
  const bool in_lanes = energies && bonds_.is_linear();
  if (in_lanes) stored_J = bonds_.stored_J(all.position, all.mean_viscous);
  work_.back_solves += static_cast<int>(fractions.size());
  std::vector<QuasiStaticState> states;
  Eigen::MatrixXd viscous;
  for (std::size_t lane = 0; lane < fractions.size(); ++lane) {
    const auto row = static_cast<Eigen::Index>(lane);
    QuasiStaticState& at = states.emplace_back();
    at.time_s = state.time_s + fractions[lane] * h;
    at.imposed = all.imposed[row];
    at.response = response[row];
    const Eigen::RowVectorXd place = all.position.row(row);
    at.position = Eigen::Map<const Positions>(place.data(), 3, coordinates_ / 3);
    viscous_in_lane(all.weights, followed_, begin_, row, viscous);
    at.viscous = state.viscous;
    put_viscous(viscous, at.viscous);
    if (!energies) continue;
    at.energy.emplace().stored_J =
        tissue_.dead_energy_J(at.position) +
        (in_lanes ? stored_J[row] + spread_J(viscous)
                  : tissue_.bonds().stored_energy_J(at.position, at.viscous));
  }
  return states;
}

double StageBalance::spread_J(const Eigen::MatrixXd& viscous) const {
  double spread = 0.0;
  for (const LaneBonds::Group& group : bonds_.groups()) {
    const std::vector<ViscousLaw::Branch>& branches = tissue_.bonds().laws()[group.law].branches;
    if (branches.size() < 2) continue;
    Eigen::VectorXd share(static_cast<Eigen::Index>(branches.size()));
    for (std::size_t b = 0; b < branches.size(); ++b) {
      share[static_cast<Eigen::Index>(b)] = branches[b].share;
    }
    for (Eigen::Index i = group.first; i < group.first + group.count; ++i) {
      const auto elongation = viscous.col(i).head(share.size());
      const double mean = share.dot(elongation);
      const std::size_t bond = bonds_.relaxing_bonds()[static_cast<std::size_t>(i)];
      spread += tissue_.bonds().relaxing()[static_cast<Eigen::Index>(bond)] *
                share.dot((elongation.array() - mean).square().matrix());
    }
  }
  return 0.5 * spread;
}

LaneVector StageBalance::heat_W(const Within& states) const {
  LaneVector heat = LaneVector::Zero();
  LaneMatrix elongation;
  bonds_.elongations(states.position, elongation);
  const Eigen::VectorXd relaxing = bonds_.of_relaxing(tissue_.bonds().relaxing());
  std::vector<LaneBonds::Group> general;
  for (const LaneBonds::Group& group : bonds_.groups()) {
    const ViscousLaw& law = tissue_.bonds().laws()[group.law];
    if (!law.is_linear() || law.branches.size() != 1) {
      general.push_back(group);
      continue;
    }
    // V(l) = l, and the only branch is the viscous elongation: all lanes at once.
    const auto apart = elongation.middleCols(group.first, group.count) -
                       states.mean_viscous.middleCols(group.first, group.count);
    heat += apart.cwiseAbs2() * relaxing.segment(group.first, group.count) /
            law.branches.front().relaxation_time_s;
  }
  if (general.empty()) return heat;
  Eigen::MatrixXd viscous;
  for (Eigen::Index lane = 0; lane < kLanes; ++lane) {
    viscous_in_lane(states.weights, followed_, begin_, lane, viscous);
    for (const LaneBonds::Group& group : general) {
      const ViscousLaw& law = tissue_.bonds().laws()[group.law];
      for (std::size_t b = 0; b < law.branches.size(); ++b) {
        double sum = 0.0;
        for (Eigen::Index i = group.first; i < group.first + group.count; ++i) {
          const double l = elongation(lane, i);
          const double m = viscous(static_cast<Eigen::Index>(b), i);
          sum += relaxing[i] * (l - law.kernel.inverse(m)) * (law.kernel.value(l) - m);
        }
        heat[lane] += law.branches[b].share * sum / law.branches[b].relaxation_time_s;
      }
    }
  }
  return heat;
}

StepEnergy StageBalance::energy_of_step(const TissueState& state, double h, double rate) {
  using Points = boost::math::quadrature::gauss<double, StepEnergy::kPoints>;
  StepEnergy energy;
  energy.h_s_ = h;
  energy.rate_ = rate;
  energy.response_.assign(tissue_.groups(), StepEnergy::Series::Zero());
  for (const double side : {-1.0, 1.0}) {
    std::array<double, kLanes> fractions{};
    for (std::size_t i = 0; i < kLanes; ++i) {
      fractions[i] = 0.5 * (1.0 + side * Points::abscissa()[i]);
    }
    const Within states = within(state, fractions, h, rate);
    const std::vector<LaneVector> of_groups = responses_of_groups(states, responses(states));
    const LaneVector per_rate = powers_per_rate(states, of_groups);
    const LaneVector heat = heat_W(states);
    for (std::size_t i = 0; i < kLanes; ++i) {
      const auto lane = static_cast<Eigen::Index>(i);
      const StepEnergy::Series projected =
          Points::weights()[i] * legendre(side * Points::abscissa()[i]).head<StepEnergy::kPoints>();
      energy.per_rate_ += per_rate[lane] * projected;
      energy.heat_W_ += heat[lane] * projected;
      for (std::size_t g = 0; g < of_groups.size(); ++g) {
        energy.response_[g] += of_groups[g][lane] * projected;
      }
    }
  }
  for (Eigen::Index n = 0; n < StepEnergy::kPoints; ++n) {
    const double norm = 0.5 * static_cast<double>(2 * n + 1);
    energy.per_rate_[n] *= norm;
    energy.heat_W_[n] *= norm;
    for (StepEnergy::Series& response : energy.response_) response[n] *= norm;
  }
  bool by_load = false;
  for (std::size_t g = 0; g < tissue_.groups(); ++g) by_load = by_load || !tissue_.depth_driven(g);
  if (by_load) {
    const std::array<double, 2> ends{0.0, 1.0};
    const Within states = within(state, ends, h, rate);
    const LaneVector response = responses(states);
    const auto loads_J = [&](Eigen::Index lane) {
      const Eigen::RowVectorXd place = states.position.row(lane);
      return tissue_.loads_J(Eigen::Map<const Positions>(place.data(), 3, coordinates_ / 3),
                             states.imposed[lane], response[lane]);
    };
    energy.loads_at_start_J_ = loads_J(0);
    energy.loads_at_end_J_ = loads_J(1);
  }
  return energy;
}

StepEnergy::Extreme StepEnergy::largest_response(std::size_t group) const {
  constexpr int kParts = 4 * kPoints;  // a polynomial of degree kPoints - 1 turns less often
  const auto at = [&](double fraction) {
    return std::abs(response_[group].dot(legendre(2.0 * fraction - 1.0).head<kPoints>()));
  };
  Extreme largest;
  for (int i = 0; i <= kParts; ++i) {
    const double fraction = static_cast<double>(i) / kParts;
    if (const double size = at(fraction); size > largest.size) largest = {fraction, size};
  }
  // Halves the distance to its neighbours while the middle of the three is the largest.
  double apart = 0.5 / kParts;
  while (apart > 1e-9) {
    const double middle = largest.fraction;
    for (const double fraction : {middle - apart, middle + apart}) {
      if (fraction < 0.0 || fraction > 1.0) continue;
      if (const double size = at(fraction); size > largest.size) largest = {fraction, size};
    }
    apart *= 0.5;
  }
  return largest;
}

double StepEnergy::integral(const Series& series, double fraction) {
  const double x = 2.0 * fraction - 1.0;
  const LegendreValues value = legendre(x);
  double sum = series[0] * (x + 1.0);
  for (Eigen::Index n = 1; n < kPoints; ++n) {
    sum += series[n] * (value[n + 1] - value[n - 1]) / static_cast<double>(2 * n + 1);
  }
  return 0.5 * sum;
}

QuasiStaticEnergy StepEnergy::until(double fraction, double loads_J) const {
  QuasiStaticEnergy energy;
  energy.dissipated_J = h_s_ * integral(heat_W_, fraction);
  energy.work_J = rate_ * h_s_ * integral(per_rate_, fraction) + loads_J - loads_at_start_J_;
  return energy;
}

}  // namespace tpm::organ
