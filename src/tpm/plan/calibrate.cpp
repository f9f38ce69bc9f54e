// Declared in tpm/plan/operations.hpp.
// Measures the time of each operation on this machine.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <vector>

#include "tpm/base/text.hpp"
#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/contact/pushed_contact.hpp"
#include "tpm/contact/servo_bonds.hpp"
#include "tpm/contact/step_error.hpp"
#include "tpm/organ/balance/equilibrium.hpp"
#include "tpm/organ/balance/lane_bonds.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/linear/frontal_factor.hpp"
#include "tpm/organ/linear/lane_factor.hpp"
#include "tpm/plan/operations.hpp"
#include "tpm/plan/scalar_model.hpp"
#include "tpmkit/bond_element.hpp"

namespace tpm::plan {
namespace {

constexpr int kRepeats = 60;
constexpr double kRepeat_s = 1e-3;  // at least, for one repeat

double elapsed_s(const std::function<void()>& work, int times) {
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < times; ++i) work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Least time of one call, s: repeats are shorter than the turns of other programs, so that what
/// those take falls out.
double time_of(const std::function<void()>& work) {
  int times = 1;
  while (elapsed_s(work, times) < kRepeat_s) times *= 2;
  double least = elapsed_s(work, times);
  for (int i = 1; i < kRepeats; ++i) least = std::min(least, elapsed_s(work, times));
  return least / times;
}

/// The paper's liver with its far half fixed: what the operations of networks are tried on.
class Bench {
 public:
  Bench()
      : network_(build_network(paper_liver(), {}, "calibration")),
        bonds_(network_, paper_element()),
        constraints_(network_.organ.size()),
        equilibrium_(bonds_, constraints_),
        factor_(equilibrium_.pattern()),
        viscous_state_{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds_.size())), 0.0, {}} {
    const Eigen::RowVectorXd height = network_.organ.position.row(2);
    const double middle = height.mean();
    for (std::size_t i = 0; i < constraints_.size(); ++i) {
      if (height[static_cast<Eigen::Index>(i)] > middle) constraints_.fix(i);
    }
  }

  [[nodiscard]] double bond_force_s() {
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest().cols());
    return time_of([&] { bonds_.add_forces(rest(), viscous_state_, force); }) / bonds();
  }

  [[nodiscard]] double bond_stiffness_s() {
    BlockMatrix matrix(bonds_.pattern());
    return time_of([&] {
             matrix.set_zero();
             bonds_.add_stiffness(rest(), viscous_state_, matrix);
           }) /
           bonds();
  }

  [[nodiscard]] double factor_product_s(double stiffness_s) {
    const double whole = time_of([&] { (void)equilibrium_.factorise(rest(), viscous_state_); });
    const auto products = static_cast<double>(equilibrium_.pattern().factor_products());
    return std::max(whole - stiffness_s * bonds(), 0.1 * whole) / products;
  }

  [[nodiscard]] double solve_block_s() {
    (void)equilibrium_.factorise(rest(), viscous_state_);
    Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Ones(3, rest().cols());
    return time_of([&] { equilibrium_.factor()->solve(x); }) / solved_blocks();
  }

  [[nodiscard]] double lane_block_s() {
    (void)equilibrium_.factorise(rest(), viscous_state_);
    factor_.copy(*equilibrium_.factor());
    LaneMatrix x = LaneMatrix::Ones(kLanes, 3 * rest().cols());
    return time_of([&] { factor_.solve(x); }) / solved_blocks();
  }

  [[nodiscard]] double lane_bond_s() {
    const LaneBonds lanes(bonds_);
    LaneMatrix position(kLanes, 3 * rest().cols());
    position.rowwise() = Eigen::Map<const Eigen::RowVectorXd>(rest().data(), 3 * rest().cols());
    LaneMatrix elongation(kLanes, static_cast<Eigen::Index>(lanes.relaxing_bonds().size()));
    LaneMatrix force = LaneMatrix::Zero(kLanes, 3 * rest().cols());
    return time_of([&] {
             lanes.elongations(position, elongation);
             lanes.add_forces(position, elongation, force);
           }) /
           bonds();
  }

  [[nodiscard]] double servo_bond_s() {
    const auto spheres = static_cast<std::size_t>(rest().cols());
    std::vector<ServoBonds::Choice> all;
    for (std::size_t b = 0; b < bonds_.size(); ++b) {
      all.push_back({b, bonds_.end_a()[b], bonds_.end_b()[b]});
    }
    ServoBonds servo(bonds_, rest(), all, static_cast<std::uint32_t>(spheres), true);
    const ServoWeights weights = servo_weights(bonds_, kPeriodOverTau * bonds_.relaxation_time_s());
    const std::vector<float> displacement(4 * (spheres + 1), 1e-4F);
    std::vector<float> force(8 * (spheres + 1), 0.0F);
    return time_of([&] {
             servo.advance(displacement.data(), weights, force.data());
             servo.accept();
           }) /
           static_cast<double>(ServoBonds::kWide * servo.groups());
  }

  [[nodiscard]] double servo_block_s() {
    std::vector<FrontalFactor::Edge> edges;
    for (std::size_t b = 0; b < bonds_.size(); ++b) {
      edges.push_back({bonds_.end_a()[b], bonds_.end_b()[b]});
    }
    const auto nodes = static_cast<std::size_t>(rest().cols());
    const auto fronts = std::make_shared<const EliminationFronts>(nodes, edges);
    FrontalFactor factor(fronts, true);
    const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
    // Near 1, so that repeated solutions stay of one size.
    const std::vector<Eigen::Matrix3d> diagonal(nodes, unit);
    const std::vector<Eigen::Matrix3d> across(edges.size(), -1e-3 * unit);
    (void)factor.factorise(diagonal, edges, across);
    const AlignedFloats one(4 * (nodes + 1), 1.0F);
    AlignedFloats x = one;
    return time_of([&] {
             std::copy(one.begin(), one.end(), x.begin());
             factor.solve(x.data());
           }) /
           static_cast<double>(FrontalFactor::blocks_read(*fronts));
  }

  [[nodiscard]] double contact_step_s() {
    const Eigen::Vector3d into = push();
    PushedContact tissue(bonds_, rest(), constraints_, contact());
    StepError error(tissue, rest(), kPeriodOverTau, kPeriod_s);
    double share = 0.0;
    return time_of([&] {
      share = 1.0 - share;
      (void)error.advance(1e-3 * share * into);
    });
  }

  [[nodiscard]] double condensed_step_s() {
    const Eigen::Vector3d into = push();
    CondensedOptions options;
    options.depth_m = kCondensedDepth_m;
    options.tangential_m = 0.5 * kCondensedDepth_m;
    CondensedContact model =
        build_condensed(bonds_, rest(), constraints_, contact(), into, options);
    double share = 0.0;
    return time_of([&] {
      share = share > 0.9 ? 0.0 : share + 1e-3;
      (void)model.step(kCondensedDepth_m * share * into);
    });
  }

 private:
  static constexpr double kPeriod_s = 1e-3;
  static constexpr double kPeriodOverTau = 1e-3;
  static constexpr double kCondensedDepth_m = 2e-3;

  [[nodiscard]] std::size_t contact() const { return network_.organ.contact.value(); }
  [[nodiscard]] Eigen::Vector3d push() const {
    return -network_.organ.normal.col(static_cast<Eigen::Index>(contact()));
  }
  [[nodiscard]] const Positions& rest() const { return network_.organ.position; }
  [[nodiscard]] double bonds() const { return static_cast<double>(bonds_.size()); }
  [[nodiscard]] double solved_blocks() const {
    const BlockPattern& pattern = equilibrium_.pattern();
    return 2.0 * static_cast<double>(pattern.factor_blocks()) +
           static_cast<double>(pattern.nodes());
  }

  Network network_;
  BondSystem bonds_;
  Constraints constraints_;
  Equilibrium equilibrium_;
  LaneFactor factor_;
  ViscousState viscous_state_;
};

double panel_product_s() {
  constexpr std::size_t kSize = 384;  // beyond the innermost cache
  const AlignedFloats numbers(kSize * kSize, 1e-3F), x(kSize, 1.0F);
  AlignedFloats y(kSize, 0.0F);
  const FloatPanel panel{numbers.data(), kSize, kSize};
  return time_of([&] { panel_kernels(true).times(panel, x.data(), y.data()); }) /
         static_cast<double>(kSize * kSize);
}

double dense_flop_s() {
  constexpr int kSize = 64;
  const Eigen::MatrixXd a = Eigen::MatrixXd::Constant(kSize, kSize, 1e-3);
  Eigen::VectorXd x = Eigen::VectorXd::Ones(kSize), y(kSize);
  return time_of([&] {
           y.noalias() = a * x;
           x = 0.5 * y;
         }) /
         (kSize * kSize);
}

/// A step of a scalar model with `branches` exponentials.
double scalar_step_s(int branches) {
  std::vector<ScalarBranch> list(static_cast<std::size_t>(branches), {1.0, 10.0});
  DepthCurve equilibrium, relaxing;
  equilibrium.stiffness_N_per_m = 100.0;
  relaxing.stiffness_N_per_m = 50.0;
  ScalarModel model(std::move(equilibrium), std::move(relaxing), std::move(list), 1e-3);
  double depth = 0.0;
  return time_of([&] {
    depth = depth > 1e-3 ? 0.0 : depth + 1e-6;
    (void)model.step_to(depth);
  });
}

}  // namespace

OperationCosts measured_costs() {
  OperationCosts costs{{}, "measured"};
  const auto set = [&](Operation kind, double seconds) {
    costs.seconds[static_cast<std::size_t>(kind)] = rounded(std::max(seconds, 1e-12), 2);
  };
  const double one = scalar_step_s(1);
  const double per_term = (scalar_step_s(9) - one) / 8.0;
  set(Operation::scalar_term, per_term);
  set(Operation::scalar_step, one - per_term);
  set(Operation::dense_flop, dense_flop_s());
  Bench bench;
  set(Operation::bond_force, bench.bond_force_s());
  const double stiffness_s = bench.bond_stiffness_s();
  set(Operation::bond_stiffness, stiffness_s);
  set(Operation::factor_product, bench.factor_product_s(stiffness_s));
  set(Operation::solve_block, bench.solve_block_s());
  set(Operation::lane_block, bench.lane_block_s());
  set(Operation::lane_bond, bench.lane_bond_s());
  set(Operation::contact_step, bench.contact_step_s());
  set(Operation::servo_bond, bench.servo_bond_s());
  set(Operation::servo_block, bench.servo_block_s());
  set(Operation::panel_product, panel_product_s());
  set(Operation::condensed_step, bench.condensed_step_s());
  return costs;
}

}  // namespace tpm::plan
