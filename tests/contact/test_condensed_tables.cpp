// What a step of the condensed contact reads, against the sum over all monomials and finite
// differences of the energy.
#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "tpm/base/random.hpp"
#include "tpm/contact/condensed/condensed_fit.hpp"

using namespace tpm;
using namespace tpm::contact;

namespace {

/// Of data of the size of a tissue's, so that no term is lost beside others.
class RandomFit {
 public:
  RandomFit() {
    frame.middle_depth_m = frame.half_depth_m = 4e-3;
    frame.tangential_m = 2e-3;
    std::vector<CondensedSample> samples(60);
    for (CondensedSample& sample : samples) {
      sample.u_m = place();
      sample.w_m = place();
      sample.energy_J = 1e-3 * number();
      for (double& x : sample.by_u_N) x = number();
      for (double& x : sample.by_w_N) x = number();
      for (double& x : sample.by_uu.reshaped()) x = 1e3 * number();
      for (double& x : sample.by_wu.reshaped()) x = 1e3 * number();
    }
    potential = CondensedPotential(frame, samples);
    for (int m = 0; m < CondensedMatrices::kTerms; ++m) {
      metrics.push_back({place(), spd(), spd(), spd(), {}});
    }
    tables = condensed_tables(frame, potential, CondensedMatrices(frame, metrics));
    for (double& x : tables.second_rate.reshaped()) x = number();
  }

  double number() { return 2.0 * random_.uniform() - 1.0; }
  Eigen::Vector3d place() { return {8e-3 * random_.uniform(), 2e-3 * number(), 2e-3 * number()}; }
  CondensedFrame frame;
  CondensedPotential potential;
  std::vector<CondensedMetric> metrics;
  CondensedTables tables;

 private:
  Eigen::Matrix3d spd() {
    Eigen::Matrix3d a;
    for (double& x : a.reshaped()) x = 0.2 * number();
    return 1e3 * (Eigen::Matrix3d::Identity() + a * a.transpose());
  }
  Random random_{3};
};

}  // namespace

TEST_CASE("a condensed step reads every monomial of the potential", "[condensed]") {
  RandomFit fit;
  for (const double c : fit.potential.coefficients()) REQUIRE(c != 0.0);
  for (int i = 0; i < 100; ++i) {
    CondensedVector rested = CondensedVector::Zero();
    rested.head<3>() = fit.place();
    const Eigen::Vector3d u = fit.place();
    const CondensedMatricesAt at = condensed_matrices_at(fit.tables, rested.head<3>());
    const CondensedPull pull = condensed_pull(fit.tables, u, rested, at);
    const CondensedPotential::Gradient sum = fit.potential.gradient(u, rested.head<3>());
    const double scale_N = sum.by_u_N.norm() + sum.by_w_N.norm();
    CHECK(std::abs(pull.energy_J - sum.value_J) < 1e-11 * scale_N * fit.frame.tangential_m);
    CHECK((pull.force_N + sum.by_u_N).norm() < 1e-11 * scale_N);
    const Eigen::Vector3d drive_N = -at.mobility.inverse() * pull.velocity.head<3>();
    CHECK((drive_N - sum.by_w_N).norm() < 1e-11 * scale_N);
  }
}

TEST_CASE("the matrices of a condensed step go through as many samples as terms", "[condensed]") {
  const RandomFit fit;
  for (const CondensedMetric& sample : fit.metrics) {
    const CondensedMatricesAt at = condensed_matrices_at(fit.tables, sample.w_m);
    CHECK((at.mobility * sample.metric).isIdentity(1e-8));
    CHECK(at.coupling.isApprox(sample.second_metric, 1e-8));
    CHECK(at.second.isApprox(sample.second_energy, 1e-8));
  }
}

TEST_CASE("the force of a condensed state is minus the slope of its energy", "[condensed]") {
  RandomFit fit;
  constexpr double kStep_m = 1e-6;
  for (int i = 0; i < 20; ++i) {
    CondensedVector state;
    state << fit.place(), 1e-3 * fit.number(), 1e-3 * fit.number(), 1e-3 * fit.number();
    const Eigen::Vector3d u = fit.place();
    const CondensedMatricesAt at = condensed_matrices_at(fit.tables, state.head<3>());
    CHECK(at.coupling == at.coupling.transpose());
    CHECK(at.second == at.second.transpose());
    CHECK(at.mobility == at.mobility.transpose());
    const auto energy_J = [&](const Eigen::Vector3d& there, const CondensedVector& viscous) {
      return condensed_pull(fit.tables, there, viscous, at).energy_J;
    };
    const CondensedPull pull = condensed_pull(fit.tables, u, state, at);
    Eigen::Vector3d by_u;
    CondensedVector by_state;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = kStep_m * Eigen::Vector3d::Unit(k);
      by_u[k] = (energy_J(u + step, state) - energy_J(u - step, state)) / (2.0 * kStep_m);
    }
    for (Eigen::Index k = 0; k < 6; ++k) {
      CondensedVector ahead = state;
      CondensedVector behind = state;
      ahead[k] += kStep_m;
      behind[k] -= kStep_m;
      by_state[k] = (energy_J(u, ahead) - energy_J(u, behind)) / (2.0 * kStep_m);
    }
    const Eigen::Vector3d by_w = by_state.head<3>();
    const Eigen::Vector3d by_q = by_state.tail<3>();
    const double scale_N = by_u.norm() + by_w.norm();
    CHECK((pull.force_N + by_u).norm() < 1e-5 * scale_N);
    CHECK((pull.velocity.head<3>() + at.mobility * by_w).norm() <
          1e-5 * scale_N * at.mobility.norm());
    const Eigen::Vector3d z = u - state.head<3>();
    const Eigen::Vector3d q = state.tail<3>();
    CHECK((by_q - (at.second * q - at.coupling * z)).norm() < 1e-5 * scale_N);
    CHECK((pull.velocity.tail<3>() - (z - fit.tables.second_rate * q)).norm() < 1e-15);
  }
}
