#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace tpm::app {

/// Kind of the values of the option of this name, such as "LENGTH" or "FILE": one kind in all
/// commands. Empty for a name that the table lacks.
[[nodiscard]] std::string_view kind_of_option(std::string_view name);

/// Shows in the help of all commands of which kind the values of options are. A value of a kind
/// with a dimension is read before a command runs: it throws Error(usage) naming the option.
void set_option_kinds(CLI::App& app);

/// Refuses a value of an option that is none of these words, naming the nearest of them.
[[nodiscard]] CLI::Validator one_of_words(std::vector<std::string> words);

}  // namespace tpm::app
