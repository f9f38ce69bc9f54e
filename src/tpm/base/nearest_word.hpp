#pragma once
#include <span>
#include <string>
#include <string_view>

#include "tpmkit/error.hpp"

namespace tpm::base {

/// The known word that a misspelt one was probably meant to be: the first of those with the fewest
/// letters added, left out, changed or swapped with their neighbour. Case does not count, and `-`
/// is
/// `_`. A word of n letters may be 1 + n / 4 such edits away, or be the beginning (3 letters or
/// more) of a known one. Empty if no word is so near.
[[nodiscard]] std::string nearest_word(std::string_view word, std::span<const std::string> known);

/// " (did you mean 'WORD'?)" for a message, or nothing.
[[nodiscard]] std::string did_you_mean(std::string_view word, std::span<const std::string> known);

/// Error(bad_input) for a word that is none of the known ones, in a file or on the command line:
/// "WHERE: WHAT 'WORD' (did you mean 'NEAREST'?); expected one of KNOWN".
[[nodiscard]] Error unknown_word(std::string_view where, std::string_view what,
                                 std::string_view word, std::span<const std::string> known);

}  // namespace tpm::base
