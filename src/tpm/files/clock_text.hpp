#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tpm::files {

/// True for a time of day or of a stopwatch, "11:09:16.534", "0:01:23,5" or "3:07 PM", with or
/// without a date before it.
[[nodiscard]] bool is_clock_text(std::string_view field);

/// Seconds since midnight, or since the stopwatch was started; none if the field is no clock text.
/// Two groups are minutes and seconds where the seconds have a fraction ("01:23.5"); "01:23" may be
/// either, and is none.
[[nodiscard]] std::optional<double> find_clock_seconds(std::string_view field);

/// Adds a day from each sample on where the clock falls by more than half a day.
void unwrap_midnights(std::span<double> seconds);

}  // namespace tpm::files
