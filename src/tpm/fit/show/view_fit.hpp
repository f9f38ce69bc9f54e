#pragma once
#include <filesystem>
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpm/show/view_parts.hpp"

namespace tpm::fit {

/// The kind of a JSON document that a fit or a validation has written.
enum class FitFile { none, answer, law, figures, validation };
[[nodiscard]] FitFile fit_file(const Json& document);

/// The answer of a fit in a folder of results ("selection.json", "answer.json"), whose page shows
/// figures.json beside it.
[[nodiscard]] bool is_answer_of_folder(const std::filesystem::path& file);

/// The validation in a folder of results, whose page shows figures.json beside it.
[[nodiscard]] bool is_validation_of_folder(const std::filesystem::path& file);

/// The page of law.json, figures.json, validation.json or the JSON answer of `tpm fit`. Throws
/// Error(bad_input) for another document.
/// @param bytes of the file, for its text and its hash
[[nodiscard]] ViewPage view_fit(const std::filesystem::path& file, std::string_view bytes);

/// The page of a whole fit: what it concludes, its adequacy and warnings, parameters with intervals
/// and verdicts, figures and profiles. It needs nothing but a browser, and nothing that draws.
/// @param answer the JSON answer of `tpm fit`
/// @param figures what figures.json holds
/// @param file law.json, or config.json of a fit without a law, which stands on the page by its
///        SHA-256; it must be there
[[nodiscard]] ViewPage fit_page(const Json& answer, const Json& figures,
                                const std::filesystem::path& file);

}  // namespace tpm::fit
