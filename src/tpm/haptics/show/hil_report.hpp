#pragma once
#include <filesystem>
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/session/jitter_check.hpp"
#include "tpm/haptics/verify/verify.hpp"
#include "tpm/show/document.hpp"
#include "tpm/show/figure.hpp"
#include "tpm/show/result_table.hpp"
#include "tpm/show/short_answer.hpp"

namespace tpm::haptics {

// Texts, JSON and pages of the commands of tpm hil; keys are described in docs/haptics.md.

[[nodiscard]] Json check_json(const JitterCheck& check);
[[nodiscard]] std::string check_text(const JitterCheck& check);
/// The short answer of a check: the verdicts, then what they rest on. The histogram is left out.
[[nodiscard]] ShortAnswer short_answer(const JitterCheck& check);

[[nodiscard]] Json run_json(const HilSession& session, const SessionRun& run);
[[nodiscard]] std::string run_text(const HilSession& session, const SessionRun& run);

[[nodiscard]] Json verification_json(const HilRecording& recording, const Verification& v);
/// Cost of the difference between motion recorded and motion compared, in words.
[[nodiscard]] std::string motion_cost(const Verification& v, double per_newton,
                                      std::string_view unit);
[[nodiscard]] std::string verification_text(const HilRecording& recording, const Verification& v);
/// The short answer of a verification: how far the forces are off, where, what limits the
/// comparison, and every note.
[[nodiscard]] ShortAnswer short_answer(const HilRecording& recording, const Verification& v);

/// Part of a peak in %; "-" of a peak of 0.
[[nodiscard]] std::string share_words(double part_N, double peak_N);
/// Force errors of the phases of a verification, and its readings of the experiment.
[[nodiscard]] ResultTable<PhaseFidelity> phase_table(const Verification& v);
[[nodiscard]] ResultTable<BesideExperiment> experiment_table(const Verification& v);

/// Energy and limits of a recording, from its rows.
struct RecordingSummary {
  std::uint64_t cycles = 0;
  ServoCounts counts;  ///< without most_consecutive_missed and most_late
  double observed_end_J = 0.0, observed_least_J = 0.0, leak_J = 0.0;
  double first_beyond_s = 0.0;  ///< of the first cycle beyond the model; 0 if there is none
  std::string cause;            ///< of the end; "cut off" if the recording has no closing record
};
[[nodiscard]] RecordingSummary summary_of(const HilRecording& recording);

/// One page on a session: report.md, report.html and report.json with figures in a folder.
void write_hil_report(const HilRecording& recording, const Verification& v,
                      const std::filesystem::path& folder, const std::string& python);

}  // namespace tpm::haptics
