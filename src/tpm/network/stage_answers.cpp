// What StageBalance answers of the step that it has found: responses, states, heat and work.
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>

#include "tpm/network/stage_balance.hpp"

namespace tpm {
namespace {

constexpr double kLongPart = 0.25;  // of a step: its quadrature takes 16 points instead of 8

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
  states.position.noalias() = at.interpolation * (x_.rowwise() - start_);
  states.position.rowwise() += start_;
  LaneMatrix known;
  find_known(at.weights, begin_, known);
  apply(at.weights, followed_, begin_, known, states.memory);
  states.weights = std::move(at.weights);
  return states;
}

LaneVector StageBalance::responses(const Within& states) {
  force_.setZero();
  tissue_.add_load(states.imposed, force_);
  bonds_.add_forces(states.position, states.memory, force_);
  const LaneVector plain = tissue_.response(states.position, force_);
  tissue_.constraints().project(force_);
  return plain + tissue_.adjoint_sign() * (force_ * lane_field_.transpose());
}

LaneVector StageBalance::responses_within(const TissueState& state,
                                          std::span<const double> fractions, double h,
                                          double rate) {
  return responses(within(state, fractions, h, rate));
}

StatesWithin StageBalance::states_within(const TissueState& state,
                                         std::span<const double> fractions, double h, double rate) {
  const Within states = within(state, fractions, h, rate);
  StatesWithin all{responses(states), std::vector<TissueState>(fractions.size(), state)};
  d_ = force_;  // what responses() left of them
  factor_.solve(d_);
  tissue_.constraints().project(d_);
  Eigen::MatrixXd viscous;
  for (std::size_t lane = 0; lane < fractions.size(); ++lane) {
    const auto row = static_cast<Eigen::Index>(lane);
    TissueState& at = all.states[lane];
    ++work_.back_solves;
    at.time_s += fractions[lane] * h;
    at.imposed = states.imposed[row];
    const Eigen::RowVectorXd place = states.position.row(row) + d_.row(row);
    at.position = Eigen::Map<const Positions>(place.data(), 3, coordinates_ / 3);
    tissue_.bonds().followed(at.position, at.followed);
    viscous_in_lane(states.weights, followed_, begin_, row, viscous);
    put_viscous(viscous, at);
  }
  return all;
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
                       states.memory.middleCols(group.first, group.count);
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

QuasiStaticEnergy StageBalance::energy_of_step(const TissueState& state, double h, double rate,
                                               double from, double until) {
  using Long = boost::math::quadrature::gauss<double, 2 * kLanes>;
  using Short = boost::math::quadrature::gauss<double, kLanes>;
  QuasiStaticEnergy energy;
  double response_integral = 0.0;  // over the imposed value
  const double half = 0.5 * (until - from);
  std::array<double, kLanes> fractions{};
  LaneVector weight;
  const auto put = [&](std::size_t lane, double abscissa, double share) {
    fractions[lane] = from + half * (1.0 + abscissa);
    weight[static_cast<Eigen::Index>(lane)] = half * h * share;
  };
  const auto add = [&] {
    const Within states = within(state, fractions, h, rate);
    response_integral += rate * weight.dot(responses(states));
    energy.dissipated_J += weight.dot(heat_W(states));
  };
  if (until - from > kLongPart) {
    for (const double side : {-1.0, 1.0}) {
      for (std::size_t i = 0; i < kLanes; ++i) {
        put(i, side * Long::abscissa()[i], Long::weights()[i]);
      }
      add();
    }
  } else {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const double side = i % 2 == 0 ? -1.0 : 1.0;
      put(i, side * Short::abscissa()[i / 2], Short::weights()[i / 2]);
    }
    add();
  }
  if (tissue_.depth_driven()) {
    energy.work_J = response_integral;
  } else {
    // The integral of F du, by parts.
    const std::array<double, 2> ends{from, until};
    const LaneVector depth = responses_within(state, ends, h, rate);
    energy.work_J = (state.imposed + until * h * rate) * depth[1] -
                    (state.imposed + from * h * rate) * depth[0] - response_integral;
  }
  return energy;
}

}  // namespace tpm
