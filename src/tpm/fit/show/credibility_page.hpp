#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/fit/validate/validation.hpp"

namespace tpm::fit {

/// What only the user can say of a model (ASME V&V 40).
struct CredibilityWords {
  std::string question, context, risk;  ///< empty: not stated, and shown so
};

/// Everything that a credibility page shows, as JSON: the words, the invocation that recomputes it,
/// the files with their SHA-256, and the validation.
/// @param invocation as the caller needs it to ask again
[[nodiscard]] Json credibility_record(const ValidationRequest& request,
                                      const Validation& validation, const CredibilityWords& words,
                                      Json invocation);

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

/// The record of a page. Throws Error(bad_input) for a file that is no such page.
[[nodiscard]] Json read_credibility_record(const std::filesystem::path& page);

}  // namespace tpm::fit
