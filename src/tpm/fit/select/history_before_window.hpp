#pragma once
#include <optional>
#include <span>
#include <string_view>

#include "tpm/base/remark.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/recording/prepared_recording.hpp"

namespace tpm::fit {

/// Code of the remarks below.
inline constexpr const char* kHistoryBeforeWindow = "history_before_window";

/// History before the fitted part that a law may lack.
enum class History {
  /// Earlier loads that had not relaxed yet. Rows that --from-time or --step-time leave out when a
  /// file is read are no part of the history that drives the law: it then rests at the drive of the
  /// first row that is kept. The file is read once more without them: a load among them is 2 % of
  /// the largest fitted drive from contact, with a response beyond the residual. A window "from" of
  /// a configuration keeps the history and is not concerned.
  unread,
  /// A pull, before the fitted part of an indentation: the law loses contact where a load would
  /// have to pull. At least 3 readings in a row, after a load, lie below the force without contact
  /// by more than 5 residuals and 1 % of the peak (a specimen that is glued, gripped or sticks).
  pulled,
};

/// Detects a recording whose law lacks such a history, where it ended less than 5 times the longest
/// relaxation time before the fitted part, or the law has a spring-pot, whose memory has no end. No
/// parameter of the material is then identified (ParameterResult::unconfirmed), and a remark says
/// so.
/// @return true if a recording lacks it
bool doubt_history(FitResult& fit, History lacking);

/// History::unread of a law of known values that is compared with a recording: a remark of that
/// code, where a load that was not read ended less than 5 times the longest relaxation time before
/// the first compared sample. A response is seen beyond the noise of the recording, and contact is
/// where its own rows show it.
/// @param values of all parameters of the law
/// @param recording read from the file of its name
/// @param of "the prediction", "the comparison": what lacks the history
[[nodiscard]] std::optional<Remark> history_before_window(const LawSpec& law,
                                                          std::span<const double> values,
                                                          const PreparedRecording& recording,
                                                          std::string_view of);

}  // namespace tpm::fit
