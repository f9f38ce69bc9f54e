#pragma once
#include <cstddef>

#include "tpm/fit/groups/group_comparison.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/groups/young_moduli.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/show/short_answer.hpp"

namespace tpm::fit {

/// The short answer of one fit: whether the law describes the data, parameters with interval and
/// verdict in units of their size, what the data see least, and every flag.
[[nodiscard]] ShortAnswer short_answer(const FitResult& fit);

/// Of a selection: why this law, its fit, and every warning that the JSON has.
[[nodiscard]] ShortAnswer short_answer(const Selection& selection);

/// Of a folder: the typical specimen, and which recordings do not support it.
[[nodiscard]] ShortAnswer short_answer(const SpecimenStudy& study);

/// Of two groups: which parameters differ and by how much, and which recordings do not support it.
[[nodiscard]] ShortAnswer short_answer(const GroupComparison& comparison);

/// Adds Young's moduli to an answer, before its other rows, and their warnings.
void add_moduli(ShortAnswer& answer, const YoungModuli& moduli);

/// Number of starts that were drawn and compared before FitResult::starts_run of them were
/// followed.
[[nodiscard]] std::size_t starts_looked_at(const FitResult& fit);

}  // namespace tpm::fit
