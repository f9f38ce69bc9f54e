#pragma once
#include <functional>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/printed_number.hpp"
#include "tpm/paper/claims/audit.hpp"
#include "tpm/paper/claims/claim_reader.hpp"

namespace tpm::paper {

/// Asks which changed input would give a printed number that the formula does not give:
///  1. other printed values of an input, in the whole formula or in single terms of a sum (so that
///     a mixture of two printed values comes out), and
///  2. any single input, by root finding within a factor of ten, written with the fewest digits
///     that give the printed ones.
/// @param printed in `unit`, compared with the value of the claim
/// @param inputs names to try, those of `value.inputs(scope)` or a part of them
/// @return at most `limit` causes; printed values first, then few digits, then small changes
[[nodiscard]] std::vector<AuditCause> search_causes(const ClaimReader& reader,
                                                    const ClaimValue& value, const Scope& scope,
                                                    const PrintedNumber& printed, const Unit& unit,
                                                    const std::vector<AuditInput>& inputs,
                                                    std::size_t limit = 4);

}  // namespace tpm::paper
