#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tpm::files {

/// Why a title that names a quantity does not name its measurement: "Displacement command" is what
/// was asked for, "Max. load" a limit or a summary, "Load cell temperature" another quantity.
struct RefusedWord {
  std::string word;      ///< as it stands among `words`
  std::string_view why;  ///< "is what was asked for, not what was measured"
  bool asked = false;    ///< it is that: a column of the same quantity, and not another one
};

/// The first word of a title that refuses it a meaning, in English, French, German, Spanish or
/// Italian.
/// @param words of the title, in small letters without accents
[[nodiscard]] std::optional<RefusedWord> find_refused_word(const std::vector<std::string>& words);

/// True for the words of a quantity that no recording is read from: a torque, an angle, a
/// temperature, the pressure of a fluid.
[[nodiscard]] bool names_another_quantity(const std::vector<std::string>& words);

/// The words, and what is left of joined ones: "sollkraft" also as "kraft".
[[nodiscard]] std::vector<std::string> with_parts_of_joined(std::vector<std::string> words);

}  // namespace tpm::files
