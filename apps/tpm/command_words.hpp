#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tpm::app {

/// The words of a command line without the program's name. `tpm` alone and `tpm help COMMAND`
/// become
/// `--help` and `COMMAND --help`.
[[nodiscard]] std::vector<std::string> command_words(int argc, const char* const* argv);

/// A word that stands where only a command of `app`, or of the command before it, may stand, but is
/// none: one line that names it, the nearest command and the help to read. Empty if there is none.
[[nodiscard]] std::string unknown_command(const CLI::App& app);

/// One line that says what is wrong with a command line that CLI11 refused: of an unknown option
/// the nearest known one, and the help of the command that it was given to.
[[nodiscard]] std::string refusal(const CLI::App& app, const CLI::ParseError& error);

}  // namespace tpm::app
