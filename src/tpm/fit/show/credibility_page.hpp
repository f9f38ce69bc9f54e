#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/fit/validate/validation.hpp"

namespace tpm::fit {

/// Statements about a model that only the user can make (ASME V&V 40).
struct CredibilitySummary {
  std::string question, context, risk;  ///< empty: not stated, and shown so
};

/// A file that is evidence for one of the categories of the FDA's guidance.
struct CredibilityEvidence {
  std::string category;  ///< "code verification"
  std::string file;
};

/// "code verification=checks.json", the categories by their names. Throws Error(bad_input) naming
/// them; the file is read by `credibility_record`, for its SHA-256.
[[nodiscard]] CredibilityEvidence parse_evidence(std::string_view text, std::string_view where);

/// Everything that a credibility page shows, as JSON: the summary, the invocation that recomputes
/// it, the files with their SHA-256, the law with its parameters, and the validation.
/// @param invocation as the caller needs it to ask again
/// @param other_files read beside law and recordings: an instrument, a session
[[nodiscard]] Json credibility_record(const ValidationRequest& request,
                                      const Validation& validation,
                                      const CredibilitySummary& summary, Json invocation,
                                      const std::vector<CredibilityEvidence>& evidence = {},
                                      const std::vector<std::string>& other_files = {});

/// A number or text of a record that is no longer what it was.
struct CredibilityChange {
  std::string place;  ///< JSON pointer
  std::string before, now;
};

/// Every value in which two records differ.
[[nodiscard]] std::vector<CredibilityChange> changes_of(const Json& before, const Json& now);

/// The page: question of interest, context of use, model risk; then the evidence by the categories
/// of the FDA's guidance of November 2023, empty ones shown empty; applicability; provenance.
/// Changes stand first, in red. It holds its record, which read_credibility_record() finds.
[[nodiscard]] std::string credibility_page(const Json& record,
                                           const std::vector<CredibilityChange>& changes = {});

/// True if a page is what its record prints: no if someone changed a number that it shows, or if
/// another version of this program wrote it.
[[nodiscard]] bool shows_its_record(const std::filesystem::path& page, const Json& record);

/// The record of a page. Throws Error(bad_input) for a file that is no such page.
[[nodiscard]] Json read_credibility_record(const std::filesystem::path& page);

}  // namespace tpm::fit
