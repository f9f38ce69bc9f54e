#include "tpm/contact/condensed/condensed_tables.hpp"

#include "tpm/contact/condensed/condensed_monomials.hpp"

namespace tpm::contact {
namespace {

/// Psi(u, w) and its gradient, J and N.
struct PotentialSlope {
  double value_J = 0.0;
  Eigen::Vector3d by_u, by_w;
};

/// Psi = sum over i, n of p^i s^n column(i, n)(t), by Horner's scheme in s within one in p; that of
/// a derivative runs beside that of the value.
PotentialSlope potential_slope(const CondensedTables& tables, const Eigen::Vector3d& u,
                               const Eigen::Vector3d& w) {
  const double p = (u[0] - tables.middle_depth_m) * tables.per_half_depth;
  const double s = (w[0] - tables.middle_depth_m) * tables.per_half_depth;
  const Eigen::Vector4d t = Eigen::Vector4d(u[1], u[2], w[1], w[2]) * tables.per_tangential;
  constexpr auto degree = kCondensedDegrees;  // of p and s, by the power of t
  double all = 0.0, all_by_p = 0.0, all_by_s = 0.0;
  Eigen::Vector4d all_by_t = Eigen::Vector4d::Zero();
  for (int i = degree[0]; i >= 0; --i) {
    double row = 0.0, row_by_s = 0.0;
    Eigen::Vector4d row_by_t = Eigen::Vector4d::Zero();
    for (int n = degree[0] - i; n >= 0; --n) {
      const CondensedColumn& column =
          tables.columns[static_cast<std::size_t>(i)][static_cast<std::size_t>(n)];
      row_by_s = row_by_s * s + row;
      row = row * s + column.constant;
      if (i + n > degree[1]) continue;
      Eigen::Vector4d by_t = column.linear;
      Eigen::Vector4d mean_by_t = column.linear;  // on the way from 0 to t
      if (i + n <= degree[2]) {
        const Eigen::Vector4d second = column.square * t;
        by_t += second;
        mean_by_t += second / 2.0;
      }
      if (i + n <= degree[3]) {
        Eigen::Vector4d third = Eigen::Vector4d::Zero();
        for (Eigen::Index k = 0; k < 4; ++k) third += t[k] * (column.cube.middleCols<4>(4 * k) * t);
        by_t += third / 2.0;
        mean_by_t += third / 6.0;
      }
      row += t.dot(mean_by_t);
      row_by_t = row_by_t * s + by_t;
    }
    all_by_p = all_by_p * p + all;
    all = all * p + row;
    all_by_s = all_by_s * p + row_by_s;
    all_by_t = all_by_t * p + row_by_t;
  }
  const double by_depth = tables.per_half_depth;
  all_by_t *= tables.per_tangential;
  return {all,
          {all_by_p * by_depth, all_by_t[0], all_by_t[1]},
          {all_by_s * by_depth, all_by_t[2], all_by_t[3]}};
}

/// Of entries 00, 11, 22, 01, 02, 12.
Eigen::Matrix3d symmetric_of(const Eigen::Matrix<double, 6, 1>& m) {
  Eigen::Matrix3d matrix;
  matrix << m[0], m[3], m[4],  //
      m[3], m[1], m[5],        //
      m[4], m[5], m[2];
  return matrix;
}

}  // namespace

CondensedMatricesAt condensed_matrices_at(const CondensedTables& tables,
                                          const Eigen::Vector3d& w) noexcept {
  const double p = (w[0] - tables.middle_depth_m) * tables.per_half_depth;
  const double s = w[1] * tables.per_tangential;
  const double t = w[2] * tables.per_tangential;
  const double p2 = p * p;
  Eigen::Matrix<double, CondensedTables::kMatrixTerms, 1> terms;
  terms << 1.0, p, p2, p2 * p, p2 * p2, s, s * p, s * p2, t, t * p, t * p2, s * s, s * t, t * t;
  const Eigen::Matrix<double, 18, 1> entries = tables.matrices.lazyProduct(terms);
  return {symmetric_of(entries.segment<6>(0)), symmetric_of(entries.segment<6>(6)),
          symmetric_of(entries.segment<6>(12))};
}

/// S = Psi - z' N q + q' G q/2 with z = u - w; dw/dt = -M^-1 dS/dw and dq/dt = z - H q per
/// relaxation time, without the derivatives of N and G by w.
CondensedPull condensed_pull(const CondensedTables& tables, const Eigen::Vector3d& u,
                             const CondensedVector& viscous,
                             const CondensedMatricesAt& matrices) noexcept {
  const Eigen::Vector3d w = viscous.head<3>();
  const Eigen::Vector3d q = viscous.tail<3>();
  const Eigen::Vector3d z = u - w;
  const PotentialSlope psi = potential_slope(tables, u, w);
  const Eigen::Vector3d coupled = matrices.coupling * q;
  CondensedPull pull;
  pull.energy_J = psi.value_J - z.dot(coupled) + 0.5 * q.dot(matrices.second * q);
  pull.force_N = coupled - psi.by_u;
  pull.velocity.head<3>() = matrices.mobility * -(psi.by_w + coupled);
  pull.velocity.tail<3>() = z - tables.second_rate * q;
  return pull;
}

CondensedState::CondensedState(const CondensedTables& tables) noexcept
    : matrices(condensed_matrices_at(tables, Eigen::Vector3d::Zero())) {}

void step_condensed(const CondensedTables& tables, const CondensedRates& rates,
                    CondensedState& state, const Eigen::Vector3d& to) noexcept {
  const Eigen::Vector3d way = to - state.u;
  const Eigen::Vector3d midway = state.u + rates.relaxation_point * way;
  const CondensedPull before = condensed_pull(tables, midway, state.viscous, state.matrices);
  const CondensedVector next =
      state.viscous + state.pending + rates.first * before.velocity + rates.drift * way;
  const CondensedMatricesAt matrices = condensed_matrices_at(tables, next.head<3>());
  const CondensedPull after = condensed_pull(tables, midway, next, matrices);
  state.kept = !(after.energy_J <= before.energy_J);  // also where it is not a number
  if (state.kept) {
    state.pending.setZero();
  } else {
    // The contribution of the rates' change within the step is added to the next step.
    state.pending =
        rates.second * (after.velocity - before.velocity + rates.rate * (next - state.viscous));
    state.viscous = next;
    state.matrices = matrices;
  }
  state.u = to;
  state.force_N = condensed_pull(tables, to, state.viscous, state.matrices).force_N;
}

}  // namespace tpm::contact
