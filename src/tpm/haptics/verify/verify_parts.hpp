#pragma once
// Internal to haptics/: what the ways of verifying a recording share.
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tpm/haptics/verify/verify.hpp"

namespace tpm::haptics {

/// In place of a force of the reference where it has no equilibrium.
inline constexpr double kNoReference = std::numeric_limits<double>::quiet_NaN();

using RowList = std::vector<const ServoRecord*>;

/// Adds up errors of instants. An instant without a reference is left out.
class FidelitySum {
 public:
  void add(double commanded_N, double reference_N);
  void add_error(double error, double reference_N);
  [[nodiscard]] ForceFidelity take() const;

 private:
  ForceFidelity result_;
  double squares_ = 0.0;
};

/// The rows that hold a motion: not the last one of a session that stopped, which moved nothing.
/// Throws Error(bad_input) if there are fewer than two.
[[nodiscard]] RowList moved_rows(const HilRecording& recording);

/// The numbers of the rows that are compared, `spacing_s` apart.
[[nodiscard]] std::vector<std::size_t> compared_rows(const HilRecording& recording,
                                                     std::size_t rows, double spacing_s);

/// A verification with what is compared and what was commanded then, without a reference.
[[nodiscard]] Verification begun(const HilRecording& recording, const RowList& rows,
                                 const std::vector<std::size_t>& compared);

/// Fills in the errors of the phases and of the whole from those of the instants.
/// @param reference_size_N of the reference's force at each instant compared
void compare_phases(Verification& v, const HilRecording& recording, const RowList& rows,
                    const std::vector<std::size_t>& compared,
                    const std::vector<double>& reference_size_N);

/// Largest difference between the reference and another answer, N, up to the answer's end. The
/// instants of the reference are among those of the answer.
[[nodiscard]] double apart_from_reference(const Verification& v, const std::vector<double>& time_s,
                                          const std::vector<double>& answer_N);

/// Asks for a cross-check; one that cannot be had becomes a note.
void ask(Verification& v, const std::string& what, const std::function<void()>& cross_check);

/// Drops the instants without a reference, and counts them. Throws Error(numerical) if less than
/// half are left.
void leave_out_what_has_no_reference(Verification& v);

/// The ways of verifying: by the network along the push, by the network under a ball in space, by
/// the law.
[[nodiscard]] Verification verify_along_push(const HilRecording& recording,
                                             const VerifyOptions& options);
[[nodiscard]] Verification verify_in_space(const HilRecording& recording,
                                           const VerifyOptions& options);
[[nodiscard]] Verification verify_law(const HilRecording& recording, const VerifyOptions& options);

}  // namespace tpm::haptics
