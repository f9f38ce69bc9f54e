#pragma once
#include <Eigen/Core>

namespace tpm::organ {

/// The polynomials of a condensed model as its step reads them. With p and s the scaled depths of
/// u and w, and t the four scaled tangential coordinates (u, u, w, w), column (i, n) stands for
/// p^i s^n; a column of at most degree a has
///
///     constant + linear t + t' square t/2 + cube(t, t, t)/6
///
/// where the square is there up to degree 3, the cube up to 1 (kCondensedDegrees). Arrays are read
/// as vectors of the processor.
struct alignas(32) CondensedTables {
  // NOLINTBEGIN(*-avoid-c-arrays): read in code compiled for several processors, which must not
  // instantiate inline functions
  static constexpr int kDepths = 8;
  static constexpr int kPairs = 10;  ///< of tangential coordinates
  static constexpr int kMatrixTerms = 14;
  static constexpr int kMatrixEntries = 20;  ///< three symmetric matrices, two zeros

  double constant[kDepths][8] = {};   ///< by n, then i
  double linear[6][6][4] = {};        ///< by i, then n
  double square[4][4][4][4] = {};     ///< by i, n, column of the matrix
  double cube[2][2][kPairs][4] = {};  ///< by i, n, pair of coordinates
  double matrices[kMatrixTerms][kMatrixEntries] = {};
  double middle_depth_m = 0.0, per_half_depth = 0.0, per_tangential = 0.0;
  // NOLINTEND(*-avoid-c-arrays)
};

/// What a step needs that depends on period and relaxation time. States are w (3), 0, q (3), 0.
struct alignas(32) CondensedRates {
  // NOLINTBEGIN(*-avoid-c-arrays)
  double first[6][8] = {}, second[6][8] = {}, rate[6][8] = {};  ///< columns
  double drift[3][8] = {};
  double of_second[3][4] = {};  ///< rate of q by q
  double relaxation_point = 1.0;
  // NOLINTEND(*-avoid-c-arrays)
};

/// The state of a condensed model between steps, and its answer; in the axes of the contact.
struct alignas(32) CondensedState {
  // NOLINTBEGIN(*-avoid-c-arrays)
  double viscous[8] = {};                                 ///< w (3), 0, q (3), 0; m
  double matrices[CondensedTables::kMatrixEntries] = {};  ///< at w
  double pending[8] = {};                                 ///< to be added to the viscous state; m
  double u[4] = {};                                       ///< m
  double force[4] = {};                                   ///< on what is in contact, N
  double second_force[4] = {};                            ///< the part of q in it, N
  bool kept = false;  ///< the latest step did not change the viscous state
  // NOLINTEND(*-avoid-c-arrays)
};

/// Sets what follows from the viscous state: for the start.
void settle_condensed(const CondensedTables& tables, CondensedState& state) noexcept;

/// One step to state.u -> to (m, in the axes of the contact).
void step_condensed(const CondensedTables& tables, const CondensedRates& rates,
                    CondensedState& state, const double* to) noexcept;

/// What a viscous state does with the contact at u.
struct alignas(32) CondensedPull {
  // NOLINTBEGIN(*-avoid-c-arrays)
  double velocity[8] = {};  ///< of w (3), 0, q (3), 0 per relaxation time, m
  double force[4] = {};     ///< on what is in contact, N
  double energy_J = 0.0;    ///< stored, with all branches alike
  // NOLINTEND(*-avoid-c-arrays)
};
/// @param rates those of q by q are used
/// @param matrices matrices_of_condensed() at w
void pull_condensed(const CondensedTables& tables, const CondensedRates& rates, const double* u,
                    const double* viscous, const double* matrices, CondensedPull& pull) noexcept;
/// The matrices at w, CondensedTables::kMatrixEntries of them.
void matrices_of_condensed(const CondensedTables& tables, const double* w,
                           double* matrices) noexcept;

/// Linear modes of the viscous state, and what the branches of a step need beside them. Vectors of
/// modes and of states have 8 numbers, 3 and a 0 twice.
struct alignas(32) CondensedModeTables {
  // NOLINTBEGIN(*-avoid-c-arrays)
  double left[6][8] = {}, right[6][8] = {};  ///< columns: of w and q; of the modes
  double second_metric[6] = {};              ///< N: 00, 11, 22, 01, 02, 12; N/m
  // NOLINTEND(*-avoid-c-arrays)
};
/// Arrays of a step of several branches (condensed_branches.hpp), 8 numbers each.
struct CondensedBranchArrays {
  int count = 0;
  const double* share = nullptr;    ///< one number each
  const double* follow = nullptr;   ///< count x count, those that are followed inside
  const double* drift = nullptr;    ///< per way of the contact
  const double* pending = nullptr;  ///< modes
  const double* spread = nullptr;   ///< a_j, p_j
  double* lacks = nullptr;          ///< modes
  double* moved = nullptr;          ///< modes
  double* next = nullptr;           ///< spread at the end
};
/// What a step changes in the mean of the branches.
struct alignas(32) CondensedAdvance {
  // NOLINTBEGIN(*-avoid-c-arrays)
  double speed[8] = {};  ///< modes of the velocity at the start
  double mean[8] = {};   ///< modes of the change
  double change[8] = {};
  double spread_J = 0.0;  ///< at the end
  // NOLINTEND(*-avoid-c-arrays)
};
/// @param velocity of the mean at the start
/// @param way of the contact, m
/// @param frame C: 00, 10, 11, 20, 21, 22
void advance_condensed(const CondensedModeTables& modes, const CondensedBranchArrays& branches,
                       const double* velocity, const double* way, const double* frame,
                       CondensedAdvance& result) noexcept;

/// Energy and force with the contact at u, whatever the viscous state.
struct CondensedValue {
  double energy_J = 0.0;
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();  ///< minus its gradient by u
};
[[nodiscard]] CondensedValue value_of_condensed(const CondensedTables& tables, const double* u,
                                                const double* viscous) noexcept;

}  // namespace tpm::organ
