#pragma once
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/printed_number.hpp"
#include "tpm/paper/claims/claim_reader.hpp"

namespace tpm::paper {

/// Each fills the verdict and the numbers of a finding from one claim; id, kind and quote are
/// there already. All throw Error(bad_input) naming the claim.

/// "value": `printed` against `expression`, `terms` or `solve`.
void check_value(const ClaimReader& claim, Finding& finding);
/// "range": two printed numbers against `expression` at the ends of `over`.
void check_range(const ClaimReader& claim, Finding& finding);
/// "band": the value must lie between two printed numbers; with `tables`, in every row between the
/// columns named in `band`.
void check_band(const ClaimReader& claim, Finding& finding);
/// "agree": `left` and `right` must be equal within `tolerance` (relative, 1e-9), at every value of
/// `vary`; with `transform`, `left` is a Laplace transform whose inverse is meant.
void check_agree(const ClaimReader& claim, Finding& finding);
/// "inequality": `left` `relation` `right`.
void check_inequality(const ClaimReader& claim, Finding& finding);
/// "dimension": the unit of the symbol `expression` must be of `claimed_dimension`.
void check_dimension(const ClaimReader& claim, Finding& finding);
/// "table": every cell of the `series` columns of `tables` against its expression.
void check_table(const ClaimReader& claim, Finding& finding);
/// "misfit": measured columns against their expressions, in percent; with `relative_error` a
/// chi-square test at 95 %, without it there is nothing to hold "close" to.
void check_misfit(const ClaimReader& claim, Finding& finding);

/// Adds a comparison of digits to the details, and to the verdict unless that is worse already.
void add_check(Finding& finding, std::string what, const DigitCheck& check, const Unit& unit);

}  // namespace tpm::paper
