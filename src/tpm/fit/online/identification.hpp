#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/online/sequential_fit.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::fit {

struct IdentifyOptions {
  /// Empty: linear and power kernels with 0 to 2 branches, and a linear one with a branch and
  /// elastic tension.
  std::vector<LawSpec> laws;
  double level = 0.95;
  /// Stop when the interval of every material parameter of the simplest law is at most this part of
  /// its estimate to each side; in (0, 1).
  double target = 0.1;
  /// And stays so, with the same law, until there are this many times as many samples: a width that
  /// is small by chance comes together with an estimate that is off, and does not last.
  double patience = 1.3;
  double margin = 3.0;              ///< of BIC, as in select_law
  std::optional<double> reference;  ///< planned depth; none: the recording's
  std::uint64_t seed = 0;
};

/// Estimates after a sample.
struct IdentifiedSample {
  double time_s = 0.0;
  std::size_t law = 0;  ///< place in Identification::laws
  SequentialEstimate estimate;
};

/// A recording identified while it is replayed.
struct Identification {
  std::string name;
  IdentifyOptions options;
  std::vector<LawSpec> laws;
  std::vector<IdentifiedSample> history;  ///< from the first estimate on
  std::optional<std::size_t> stopped;     ///< place in `history`
  double begin_s = 0.0, end_s = 0.0;      ///< of the ramp and hold
  double peak_response = 0.0;             ///< SI
  std::size_t samples = 0;
  std::vector<Remark> remarks;

  /// Result of the identification: where it stopped, or its last sample.
  [[nodiscard]] const IdentifiedSample& result() const;
};

/// Feeds the ramp and hold of a recording sample by sample to a SequentialFit of each law. Nothing
/// after a sample changes what is said at it.
///
/// The rule begins when the drive has been held for a tenth of the time: before, an elastic law is
/// told from a relaxing one by nothing. It looks at widths, never at estimates or at how well they
/// fit. A fixed-sample interval at the first time its own estimated width is small enough would
/// contain the true value too rarely (Chow & Robbins, Ann. Math. Stat. 36 (1965) 457: only in the
/// limit of narrow widths); `patience` takes most of that away (reports/chain/report.md counts
/// the rest). While contact or offset stands on a bound the intervals hold only there, and it
/// waits. Throws Error(bad_input) for options out of range or a recording without a ramp.
[[nodiscard]] Identification identify(const PreparedRecording& recording,
                                      const IdentifyOptions& options);

/// The identified law with the covariance of its coordinates, for law files. Contact and offset are
/// the recording's.
[[nodiscard]] LawFile identified_law(const Identification& identification,
                                     const PreparedRecording& recording);
/// The same of one sample.
[[nodiscard]] LawFile law_of_sample(const Identification& identification,
                                    const IdentifiedSample& sample);

[[nodiscard]] Json to_json(const Identification& identification);
[[nodiscard]] std::string to_terminal_text(const Identification& identification);
/// The result with its intervals, and where the end of the recording differs.
[[nodiscard]] ShortAnswer short_answer(const Identification& identification);

}  // namespace tpm::fit
