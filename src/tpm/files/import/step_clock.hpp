#pragma once
#include <string>

#include "tpm/files/import/import.hpp"

namespace tpm::files {

/// Leaves out samples before options.from_s, after options.until_s and before options.step_time_s,
/// from which the times then count. Throws Error(bad_input) if no two samples remain, or if there
/// is no time to choose by.
void keep_time_window(ImportedSeries& series, const std::string& file,
                      const ImportOptions& options);

/// Turns a strain that is kept from the first sample on, and its stress, into a relaxation modulus,
/// and a stress that is kept, and its strain, into a creep compliance. Kept means within 2 %. A
/// strain may be reached in the first thousandth of the time, if the first sample already stands
/// within the step, the clock counts from it, and the stress relaxes after it: these rows are left
/// out, and the times count from where half of the step is reached (unless its time is stated).
/// Other series stay as they are.
/// @return how many rows are left out
std::size_t resolve_kept_step(ImportedSeries& series, const ImportOptions& options);

/// Sorts the rows of G(t) or J(t) by their times, if these are all different and fall so often that
/// the rows are no specimens below each other.
void sort_shuffled_rows(ImportedSeries& series);

/// Leaves out a reading of exactly 0 at time 0 of G(t) or J(t), if the next one is above 0: it was
/// taken before the step, and a law's answer at the step itself is that right behind it.
void leave_out_zero_at_step(ImportedSeries& series);

/// True if samples that begin late may count from a step at 0. Times in geometric progression may,
/// and so may times that begin within two steps of the sampling; others are those of a clock that
/// ran before the step.
/// @param times strictly increasing
[[nodiscard]] bool counts_from_step(const std::vector<double>& times);

/// Refuses a relaxation modulus or creep compliance whose clock does not start at its step, naming
/// --step-time, and a step time for a recording that holds no step. Throws Error(bad_input).
void require_step_clock(const ImportedSeries& series, const std::string& file,
                        const ImportOptions& options);

}  // namespace tpm::files
