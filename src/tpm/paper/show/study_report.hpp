#pragma once
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/paper/claims/audit.hpp"
#include "tpm/paper/tables.hpp"
#include "tpm/show/table_document.hpp"

namespace tpm::paper {

/// The tables with printed and measured values, verdicts and the counts, one section per depth.
/// The columns for printed and measured values are left out where no row has any.
[[nodiscard]] TableDocument tables_document(const TablesResult& result);

/// One line per cell, SI units in the column names; empty where a cell has no printed value.
[[nodiscard]] std::string tables_csv(const TablesResult& result);

/// The audit for a terminal: every finding with its numbers, then the counts.
/// @param all also the findings that hold, else only their number
[[nodiscard]] std::string audit_text(const AuditReport& report, bool all);

}  // namespace tpm::paper
