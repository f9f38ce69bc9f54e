#pragma once
#include <string>
#include <string_view>

namespace tpm::base {

/// Shortest decimal text that reads back as the same double; the same on every machine.
[[nodiscard]] std::string shortest(double value);

/// `digits` significant digits in the way people write numbers (12.3, 0.00123, 1.23e+07): never a
/// trailing exponent of zero, always a point as decimal sign. Non-finite values give "inf", "-inf"
/// and "nan".
[[nodiscard]] std::string significant(double value, int digits);

/// A probability for people: "0.0012", "2e-18".
[[nodiscard]] std::string probability(double p);

/// Significant digits of the numbers of results in JSON and CSV, where no other number is given.
inline constexpr int kResultDigits = 6;

/// Significant digits of an estimate in tables that people read (terminal, page, Python), of the
/// ends of its interval and of values in sentences, and of its standard error.
inline constexpr int kEstimateDigits = 5, kIntervalDigits = 4, kErrorDigits = 3;

/// The double nearest to `value` written with `digits` significant digits: what results store so
/// that they agree between machines, whose last bits differ. Non-finite values stay as they are.
[[nodiscard]] double rounded(double value, int digits = kResultDigits);

/// `decimals` digits after the point.
[[nodiscard]] std::string fixed(double value, int decimals);

/// Text without the blanks before and behind it.
[[nodiscard]] std::string_view trimmed(std::string_view text,
                                       std::string_view blanks = " \t") noexcept;

enum class LineEnds { kept, escaped };

/// Text as a terminal may show it: what would move its cursor, change its colours or turn the
/// direction of writing is written as \uXXXX, which JSON reads as the same character; bytes that
/// are not UTF-8 become '?'. Tabs stay.
[[nodiscard]] std::string for_terminal(std::string_view text, LineEnds line_ends);

/// A word of a command line as a shell takes it: quoted where it has to be.
[[nodiscard]] std::string shell_quoted(std::string_view word);

/// A file name as a shell takes it: quoted where it has to be. For a command that a user is to
/// type, whole.
[[nodiscard]] std::string shell_word(std::string_view name);

/// A message of this library for one who calls it: options of the command line are arguments there,
/// so that "--device-file" becomes "device_file". Commands that it names as a whole stay ("tpm hil
/// identify --device omega7").
[[nodiscard]] std::string with_arguments_for_options(std::string_view message);

}  // namespace tpm::base
