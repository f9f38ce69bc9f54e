#include "command_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

/// The command that was named last, the program itself if none was.
const CLI::App& innermost(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().back();
  return *command;
}

/// "tpm hil run"
std::string full_name(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  return parent == nullptr ? command.get_name() : full_name(*parent) + " " + command.get_name();
}

/// "hil run: " for the beginning of a message, "" for the program itself.
std::string place(const CLI::App& command) {
  if (command.get_parent() == nullptr) return {};
  const std::string name = full_name(command);
  return name.substr(name.find(' ') + 1) + ": ";
}

std::vector<std::string> commands_of(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* one : command.get_subcommands({})) names.push_back(one->get_name());
  return names;
}

/// With their dashes, without positional arguments.
std::vector<std::string> options_of(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

bool is_option(std::string_view word) {
  return word.size() > 1 && word.front() == '-';
}

/// Of "--option=value" what stands before the value.
std::string_view name_of(std::string_view word) {
  return word.substr(0, word.find('='));
}

/// The full names of all commands below this one that are called `name`.
std::vector<std::string> called(const CLI::App& command, const std::string& name) {
  std::vector<std::string> found;
  for (const CLI::App* one : command.get_subcommands({})) {
    if (one->get_name() == name) found.push_back("'" + full_name(*one) + "'");
    const std::vector<std::string> below = called(*one, name);
    found.insert(found.end(), below.begin(), below.end());
  }
  return found;
}

/// Options here that are commands in other programs.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kOptions{
    {{"select", "tpm fit --verbose"},
     {"spectrum", "tpm predict LAW --frequencies"},
     {"coverage", "tpm design CONFIG --repetitions"},
     {"recovery", "tpm design --laws LAWS --repetitions"}}};

std::string no_such_command(const CLI::App& command, const std::string& word) {
  for (const auto& [name, here] : kOptions) {
    if (command.get_parent() != nullptr || word != name) continue;
    return fmt::format("no command '{}'; did you mean '{}'? See tpm --help", name, here);
  }
  if (const std::vector<std::string> below = called(command, word); !below.empty()) {
    return fmt::format("{}no command '{}'; did you mean {}? See {} --help", place(command),
                       printable(word), fmt::join(below, " or "), full_name(command));
  }
  const std::vector<std::string> known = commands_of(command);
  const std::string nearest = nearest_word(word, known);
  const std::string name = full_name(command);
  if (nearest.empty()) {
    return fmt::format("{}no command '{}'; expected one of {}; see {} --help", place(command),
                       printable(word), fmt::join(known, ", "), name);
  }
  return fmt::format("{}no command '{}'; did you mean '{}'? See {} {} --help, or {} --help",
                     place(command), printable(word), nearest, name, nearest, name);
}

/// "'tpm hil check --loop-rate'" for each command from this one on that has an option of this name.
std::vector<std::string> with_option(const CLI::App& command, const std::string& name) {
  std::vector<std::string> found;
  const std::vector<std::string> known = options_of(command);
  if (std::find(known.begin(), known.end(), name) != known.end()) {
    found.push_back(fmt::format("'{} {}'", full_name(command), name));
  }
  for (const CLI::App* one : command.get_subcommands({})) {
    const std::vector<std::string> below = with_option(*one, name);
    found.insert(found.end(), below.begin(), below.end());
  }
  return found;
}

/// Commands that have this option: those that stand nearest to this one. None if there are more
/// than three, of which most do something else. What a command of a group (`tpm network build`)
/// finds outside of the group counts only if it is the only one.
std::vector<std::string> elsewhere(const CLI::App& command, const std::string& name) {
  constexpr std::size_t kMost = 3;
  if (!name.starts_with("--")) return {};
  const CLI::App* const group = command.get_parent();
  const bool of_a_group = group != nullptr && group->get_parent() != nullptr;
  for (const CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
    const std::vector<std::string> found = with_option(*app, name);
    const bool outside = of_a_group && app->get_parent() == nullptr;
    if (found.size() > (outside ? 1 : kMost)) return {};
    if (!found.empty()) return found;
  }
  return {};
}

std::string no_such_option(const CLI::App& command, std::string_view word) {
  const std::string name(name_of(word));
  const std::string nearest = nearest_word(name, options_of(command));
  const std::vector<std::string> others = elsewhere(command, name);
  std::string meant;
  if (name == "--overwrite") {
    // Commands that ask for it have it.
    if (command.get_option_no_throw("--output") != nullptr) {
      meant = "the file that -o names is replaced without it; ";
    }
  } else if (!nearest.empty()) {
    meant = fmt::format("did you mean '{}'? ", nearest);
  } else if (!others.empty()) {
    meant = fmt::format("did you mean {}? ", fmt::join(others, " or "));
  }
  return fmt::format("{}no option '{}'; {}see {} --help", place(command), printable(name), meant,
                     full_name(command));
}

/// A word beside a command's own arguments that was likely meant as one of its commands
/// (`tpm sweep polt FILE`).
std::string misspelt_command(const CLI::App& command, const std::vector<std::string>& left) {
  if (left.empty()) return {};
  const std::vector<std::string> known = commands_of(command);
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_positional() || option->count() == 0) continue;
    const std::string word = option->results().front();
    if (!nearest_word(word, known).empty()) return word;
  }
  return nearest_word(left.front(), known).empty() ? std::string{} : left.front();
}

}  // namespace

std::vector<std::string> command_words(int argc, const char* const* argv) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (words.empty()) return {"--help"};
  if (words.front() != "help") return words;
  std::erase(words, "help");
  words.emplace_back("--help");
  return words;
}

std::string unknown_command(const CLI::App& app) {
  const CLI::App& command = innermost(app);
  if (command.get_require_subcommand_min() == 0) return {};
  for (const std::string& word : command.remaining()) {
    if (!is_option(word)) return no_such_command(command, word);
  }
  return {};
}

std::string refusal(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = innermost(app);
  if (const std::string unknown = unknown_command(app); !unknown.empty()) return unknown;
  const std::vector<std::string> left = command.remaining();
  const auto option = std::find_if(left.begin(), left.end(), is_option);
  if (option != left.end()) return no_such_option(command, *option);
  if (command.get_require_subcommand_min() > 0) {
    return fmt::format("{}no command; expected one of {}; see {} --help", place(command),
                       fmt::join(commands_of(command), ", "), full_name(command));
  }
  if (const std::string word = misspelt_command(command, left); !word.empty()) {
    return no_such_command(command, word);
  }
  if (!left.empty()) {
    return fmt::format("{}'{}' is one argument too many; see {} --help", place(command),
                       printable(left.front()), full_name(command));
  }
  return fmt::format("{}{}; see {} --help", place(command), error.what(), full_name(command));
}

}  // namespace tpm::app
