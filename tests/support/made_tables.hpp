#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace tpm::test {

/// A table as a machine or a person might have written it, and what it says.
struct MadeTable {
  std::string bytes;
  std::string recipe;  ///< how it was written, for messages: "semicolon, decimal comma, ..."
  std::vector<double> time_s, drive_SI, response_SI;  ///< the numbers as they were rounded
  bool late_clock = false;  ///< a step response whose clock started before the step
};

/// The table of a seed: a ramp and hold of a depth, of a strain, or a step that is kept, in any
/// delimiter, decimal sign, mark of thousands, quotes, preamble, units, encoding, language and
/// order of columns, with columns beside them that are no measurement. The same seed makes the same
/// bytes.
[[nodiscard]] MadeTable made_table(std::uint32_t seed);

/// Outcome of reading it.
enum class ReadingResult {
  right,    ///< every number within rounding
  refused,  ///< an Error
  wrong,    ///< read, and not what it says
};

/// Writes the table to a file and reads it as tpm fit does, without any option.
/// @param said  becomes the message of a refusal, or what differs
[[nodiscard]] ReadingResult read_made_table(const MadeTable& table, const std::string& path,
                                            std::string& said);

}  // namespace tpm::test
