#include "tpm/reduce/condensed_tables.hpp"

// NOLINTBEGIN(*-avoid-c-arrays, *-reinterpret-cast, bugprone-suspicious-include)
namespace tpm::organ {
namespace {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"  // no vector crosses a call
namespace plain {
#include "tpm/reduce/condensed_kernel.inc"
}  // namespace plain

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define TPM_CONDENSED_WIDE
#pragma GCC push_options
#pragma GCC target("avx2")
namespace wide {
#include "tpm/reduce/condensed_kernel.inc"
}  // namespace wide
#pragma GCC pop_options
#endif
#pragma GCC diagnostic pop

/// Both kinds give the same bits: no products and sums are contracted.
bool is_wide() {
#ifdef TPM_CONDENSED_WIDE
  return __builtin_cpu_supports("avx2") != 0;
#else
  return false;
#endif
}

}  // namespace

void settle_condensed(const CondensedTables& tables, CondensedState& state) noexcept {
  plain::settle(tables, state);
}

void step_condensed(const CondensedTables& tables, const CondensedRates& rates,
                    CondensedState& state, const double* to) noexcept {
#ifdef TPM_CONDENSED_WIDE
  if (is_wide()) return wide::step(tables, rates, state, to);
#endif
  plain::step(tables, rates, state, to);
}

void pull_condensed(const CondensedTables& tables, const CondensedRates& rates, const double* u,
                    const double* viscous, const double* matrices, CondensedPull& pull) noexcept {
#ifdef TPM_CONDENSED_WIDE
  if (is_wide()) return wide::pull_of(tables, rates, u, viscous, matrices, pull);
#endif
  plain::pull_of(tables, rates, u, viscous, matrices, pull);
}

void matrices_of_condensed(const CondensedTables& tables, const double* w,
                           double* matrices) noexcept {
#ifdef TPM_CONDENSED_WIDE
  if (is_wide()) return wide::all_matrices(tables, w, matrices);
#endif
  plain::all_matrices(tables, w, matrices);
}

void advance_condensed(const CondensedModeTables& modes, const CondensedBranchArrays& branches,
                       const double* velocity, const double* way, const double* frame,
                       CondensedAdvance& result) noexcept {
#ifdef TPM_CONDENSED_WIDE
  if (is_wide()) return wide::advance(modes, branches, velocity, way, frame, result);
#endif
  plain::advance(modes, branches, velocity, way, frame, result);
}

CondensedValue value_of_condensed(const CondensedTables& tables, const double* u,
                                  const double* viscous) noexcept {
  double result[4];
  plain::value(tables, u, viscous, result);
  return {result[0], {result[1], result[2], result[3]}};
}
// NOLINTEND(*-avoid-c-arrays, *-reinterpret-cast, bugprone-suspicious-include)

}  // namespace tpm::organ
