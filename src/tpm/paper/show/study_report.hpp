#pragma once
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/paper/claims/audit.hpp"
#include "tpm/paper/tables.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpm/show/table_document.hpp"

namespace tpm::paper {

/// The tables with printed and measured values, verdicts and the counts, one section per depth.
/// The columns for printed and measured values are left out where no row has any.
[[nodiscard]] TableDocument tables_document(const TablesResult& result);

/// One line per cell, SI units in the column names; empty where a cell has no printed value.
[[nodiscard]] std::string tables_csv(const TablesResult& result);

/// A row per depth and spacing with the computed values; printed values only where they do not
/// follow, and the counts of all.
[[nodiscard]] ShortAnswer short_answer(const TablesResult& result);

/// The audit in full: every finding with its numbers, then the counts.
[[nodiscard]] std::string audit_text(const AuditReport& report);

/// The counts of all verdicts, the claims of each that does not stand, and the numbers that are
/// furthest off.
[[nodiscard]] ShortAnswer short_answer(const AuditReport& report);

}  // namespace tpm::paper
