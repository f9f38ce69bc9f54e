#pragma once
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"

namespace tpm::show {

/// Most lines of an answer on a terminal.
inline constexpr std::size_t kAnswerLines = 25;

/// The parts of a short answer, each a list of lines. Where they are too many, rows are summed up
/// in one line first; then warnings share a line. Nothing else is shortened, and no warning is left
/// out.
struct ShortAnswer {
  std::vector<std::string> conclusion{};  ///< the finding, and whether it can be relied on
  std::vector<std::string> head{};        ///< of the table; may be empty
  std::vector<std::string> rows{};        ///< of the table
  /// Summary of the rows from this one on, in one line. The default counts them.
  std::function<std::string(std::size_t from)> rest{};
  std::vector<std::string> limits{};    ///< the strongest limits of the answer
  std::vector<std::string> warnings{};  ///< written with "! " before them, each once
  std::vector<std::string> end{};       ///< files, and the next command
};

/// At most `most` lines, each ended. A line feed within a part becomes a blank.
[[nodiscard]] std::string to_text(const ShortAnswer& answer, std::size_t most = kAnswerLines);

/// The lines of a text that are not empty.
[[nodiscard]] std::vector<std::string> separate_lines(std::string_view text);

/// At most `most` of the lines; the last one counts the others: "... and 3 more recordings".
[[nodiscard]] std::vector<std::string> counted(std::vector<std::string> lines, std::size_t most,
                                               const char* what);

/// "more: --verbose; next: COMMAND", the last line of a short answer.
/// @param next may be empty
[[nodiscard]] std::string end_line(const std::string& next);

/// Adds the lines that end an answer: the files of a folder, where the rest is, what to type next.
/// @param files may be empty: nothing was written
void end_answer(ShortAnswer& answer, const std::string& folder,
                const std::vector<std::string>& files, const std::string& next);

}  // namespace tpm::show
