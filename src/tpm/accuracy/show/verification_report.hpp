#pragma once
#include <filesystem>
#include <string>

#include "tpm/accuracy/verify/verification.hpp"
#include "tpm/files/json.hpp"

namespace tpm::accuracy {

/// "114 checks: all hold." or how many fail.
[[nodiscard]] std::string verification_words(const VerificationRun& verification);

/// A line of the text, and whether it belongs to a check that failed.
struct VerificationLine {
  std::string text;
  bool failed = false;
};
/// verification_words(), a line for each group, and the first checks that failed.
[[nodiscard]] std::vector<VerificationLine> brief_lines(const VerificationRun& verification);
/// A table for a terminal, then verification_words().
[[nodiscard]] std::vector<VerificationLine> verification_lines(const VerificationRun& verification);

/// Keys: docs/accuracy.md.
[[nodiscard]] Json to_json(const VerificationRun& verification);

/// One line a check.
[[nodiscard]] std::string verification_csv(const VerificationRun& verification);

/// Writes report.md, report.html, verification.json, verification.csv, and report.run.json, the
/// only one that changes from run to run.
/// @param seconds wall time of the checks
void write_verification(const VerificationRun& verification, const std::filesystem::path& folder,
                        double seconds);

}  // namespace tpm::accuracy
