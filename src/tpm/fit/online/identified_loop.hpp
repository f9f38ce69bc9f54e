#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tpm/contact/law_handover.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/online/identification.hpp"

namespace tpm::fit {

struct IdentifiedLoopOptions {
  double period_s = 1e-3;
  double first_width = 0.5;  ///< the first law enters the loop at this relative half width
  double narrower = 0.5;     ///< a new one is asked for when the widest interval is this much
                             ///< narrower than that of the law in the loop, or the law has changed
};

/// One change of the law in the loop.
struct LoopHandOver {
  double asked_s = 0.0;                     ///< when the new law was known
  std::optional<double> done_s;             ///< when it took over; none: it waited until the end
  std::string from, to;                     ///< names of the laws
  double widest_relative_half_width = 0.0;  ///< of the new one
  HandOver decision;                        ///< of the moment it was done, or of the last try
};

/// The model in the loop along a recording's motion, with the law that is identified meanwhile
/// handed over whenever that gives no energy to the hand.
struct IdentifiedLoop {
  std::optional<double> first_s;  ///< when the first law entered, at rest or with all relaxed
  std::vector<LoopHandOver> hand_overs;
};

/// Replays the motion at the loop's rate, linear between samples. The surface is the first law's
/// contact point. Throws Error(bad_input) for a recording that is not of a force over a depth.
[[nodiscard]] IdentifiedLoop replay_in_loop(const Identification& identification,
                                            const PreparedRecording& recording,
                                            const IdentifiedLoopOptions& options);

[[nodiscard]] Json to_json(const IdentifiedLoop& loop);
[[nodiscard]] std::string to_terminal_text(const IdentifiedLoop& loop);
/// "the first law entered the loop at 5.16 s; 2 of 9 hand-overs done, ...", one line.
[[nodiscard]] std::string loop_words(const IdentifiedLoop& loop);

}  // namespace tpm::fit
