#pragma once
#include <initializer_list>
#include <span>
#include <string_view>

#include "tpm/files/json.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpm/files/keys/types.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_uncertainty.hpp"

namespace tpm::files {

/// A law with its parameters.
[[nodiscard]] const FileKind& law_kind();

/// Some of the quantities of files.
[[nodiscard]] ValueType<Quantity> quantity_among(std::initializer_list<Quantity> all);

/// Throws Error(bad_input) for anything that schemas/law.schema.json or the law does not allow: an
/// unknown law or key, a missing parameter without a preset, a value out of range.
[[nodiscard]] LawFile law_from_json(const Json& json, const DocumentPlace& place);
/// An infinite spacing, which is its preset, is left out: JSON has no infinity.
[[nodiscard]] Json to_json(const LawFile& law);

/// The same in fits, law files, answers and predictions.
[[nodiscard]] Json to_json(const LawAdequacy& adequacy);

/// The block "fit" of a law file. Keys of `parameters` and `covariance` are law_key() names.
[[nodiscard]] Json to_json(const LawUncertainty& uncertainty, const LawSpec& spec);

/// Its form.
[[nodiscard]] const FormPtr& uncertainty_form();

/// Reads what has that form. Throws Error(bad_input) for names that the law has not, a matrix of
/// another size, one that is not symmetric or not positive semidefinite.
[[nodiscard]] LawUncertainty uncertainty_from_json(const Json& block, const LawSpec& spec,
                                                   std::span<const double> values,
                                                   const DocumentPlace& place);

}  // namespace tpm::files
