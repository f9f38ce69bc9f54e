#pragma once
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {

/// State that every command shares. A command registers its options on a CLI11 subcommand and sets
/// `run` in that subcommand's callback; main() calls it once, after the whole command line was
/// read, and nothing that CLI11 filled in is used if reading failed.
struct Session {
  std::string command;          ///< its words after "tpm": "hil verify"
  std::string format = "text";  ///< --format: text or json
  bool force = false;           ///< --overwrite: results may be replaced whoever made them
  /// Of the result that --output names: Naming::by_default if the option is missing.
  Naming output_naming = Naming::file;
  std::function<int()> run;        ///< the chosen command; returns the exit code
  std::vector<std::string> words;  ///< of the command line, behind "tpm"

  [[nodiscard]] bool json() const { return format == "json"; }
  /// Of files in a folder that --output names.
  [[nodiscard]] Naming folder_naming() const {
    return output_naming == Naming::file ? Naming::folder : output_naming;
  }
};

/// Has a command do this work, after the whole command line was read (Session::run).
void set_run(CLI::App& command, Session& session, std::function<int()> work);

/// Adds --format text|json to a command.
void add_format_option(CLI::App& command, Session& session);

/// Adds --overwrite to a command that writes files of names which the user does not give, unless it
/// has one of its own.
void add_force_option(CLI::App& command, Session& session);

/// Throws Error(usage) for a recording or a measurement that would replace a file, unless
/// --overwrite was given: neither can be made again.
void require_new(const std::string& output, const Session& session);

/// The error of the chosen command, or, where it refuses a file that was named like an example of
/// tpm example, one that says how to come by that example's files.
[[nodiscard]] Error with_example(const CLI::App& app, const Error& error);

/// Adds -o, --output for an answer beside which a table stands (csv_beside()).
void add_output_option(CLI::App& command, std::string& output);

/// Adds options that are texts to a group of the help.
inline auto options_of_group(CLI::App& command, const char* group) {
  return [&command, group](const char* name, std::string& target, const char* help) {
    return command.add_option(name, target, help)->group(group);
  };
}

/// Of a command that ran to its end: 0, or 1 where the answer is no.
[[nodiscard]] constexpr int exit_code(bool yes) {
  return static_cast<int>(yes ? ExitCode::success : ExitCode::answer_is_no);
}

/// Prints the text, or writes it to `file` if that is not empty.
void deliver(const std::string& text, const std::string& file);

/// The CSV that stands beside an answer in JSON: "laws.csv" of `-o laws.json`. Announced before it
/// is computed (will_write()). Empty where the answer is no JSON, or goes to the terminal, a device
/// or a pipe.
[[nodiscard]] std::filesystem::path csv_beside(const std::string& output, const Session& session);
/// Writes it, unless the name is empty.
void deliver_csv(const std::string& csv, const std::filesystem::path& file);

/// The line that says which files were written into a folder; empty where the answer is JSON.
[[nodiscard]] std::string written(const Session& session, const std::string& folder,
                                  const std::vector<std::string>& files);

/// Announces the files of these names in a folder, before they are computed, and others that come
/// into it (will_write(), will_write_in()); none if the folder is empty.
void will_write_into(const std::filesystem::path& folder, std::initializer_list<const char*> names,
                     Naming naming = Naming::folder);

/// Reads a whole number from `smallest` to `largest`. Throws Error(usage) naming the option.
[[nodiscard]] std::uint64_t parse_whole_number(const std::string& text, const char* option,
                                               std::uint64_t smallest,
                                               std::uint64_t largest = 1'000'000'000);

/// Reads options of a command, no files: what they refuse (Error(bad_input)) is a usage error,
/// because the value stands on the command line.
template <class Read>
decltype(auto) of_option(Read&& read) {
  try {
    return std::forward<Read>(read)();
  } catch (const Error& error) {
    if (error.code() != ExitCode::bad_input) throw;
    throw error.with_code(ExitCode::usage);
  }
}

/// Reads the word of an option while the command line is read: a wrong one is refused even if the
/// command has no use for it.
template <typename Parse>
std::function<void(const std::string&)> reads_word(Parse parse, std::string option) {
  return [parse, option = std::move(option)](const std::string& text) {
    of_option([&] { static_cast<void>(parse(text, option)); });
  };
}

/// The value of an option: parse_quantity() and parse_number() as usage errors.
[[nodiscard]] double option_quantity(std::string_view text, Dimension dimension,
                                     std::string_view option);
[[nodiscard]] double option_number(std::string_view text, std::string_view option);

/// A share such as "10%" or "0.1". Throws Error(usage) naming the option.
[[nodiscard]] double parse_share(std::string_view text, const char* option);

/// Writes to standard output, control characters from names and titles escaped (for_terminal()).
/// Throws Error(environment) if it takes nothing more.
void write_output(std::string_view text);

/// The same, red where standard output is a terminal and $NO_COLOR is not set: for what failed.
void write_alarming(std::string_view text);

/// Formats and writes an answer to standard output.
template <class... Arguments>
void say(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  write_output(fmt::format(text, std::forward<Arguments>(arguments)...));
}

/// Writes one line to standard error, control characters escaped, those that end lines too. A full
/// disk behind it, or nobody who reads it, changes nothing else.
void write_message(std::string_view line);

/// Formats and writes a warning or an error: one line that ends in a line feed.
template <class... Arguments>
void tell_user(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  write_message(fmt::format(text, std::forward<Arguments>(arguments)...));
}

/// Prints an answer, the files that were written and the command to type next, which JSON has under
/// "files" and "next".
/// @param next may be empty
void say_with_files(const Session& session, Json json, std::string_view text,
                    const std::vector<std::string>& files, const std::string& next);

// One function per file cmd_*.cpp.
void add_schema_command(CLI::App& app, Session& session);
void add_version_command(CLI::App& app, Session& session);
void add_view_command(CLI::App& app, Session& session);
void add_example_command(CLI::App& app, Session& session);
void add_fit_command(CLI::App& app, Session& session);
void add_budget_command(CLI::App& app, Session& session);
void add_material_command(CLI::App& app, Session& session);
void add_identify_command(CLI::App& app, Session& session);
void add_predict_command(CLI::App& app, Session& session);
void add_validate_command(CLI::App& app, Session& session);
void add_design_command(CLI::App& app, Session& session);
void add_laws_command(CLI::App& app, Session& session);
void add_export_command(CLI::App& app, Session& session);
void add_data_command(CLI::App& app, Session& session);
void add_network_command(CLI::App& app, Session& session);
void add_simulate_command(CLI::App& app, Session& session);
void add_plan_command(CLI::App& app, Session& session);
void add_paper_command(CLI::App& app, Session& session);
void add_accuracy_command(CLI::App& app, Session& session);
void add_sweep_command(CLI::App& app, Session& session);
void add_hil_command(CLI::App& app, Session& session);
void add_hil_serve_command(CLI::App& hil, Session& session);       // below `tpm hil`
void add_hil_check_command(CLI::App& hil, Session& session);       // below `tpm hil`
void add_hil_identify_command(CLI::App& hil, Session& session);    // below `tpm hil`
void add_hil_export_command(CLI::App& hil, Session& session);      // below `tpm hil`
void add_hil_verify_commands(CLI::App& hil, Session& session);     // below `tpm hil`
void add_hil_stability_command(CLI::App& hil, Session& session);   // below `tpm hil`
void add_verify_command(CLI::App& accuracy, Session& session);     // below `tpm accuracy`
void add_benchmark_command(CLI::App& accuracy, Session& session);  // below `tpm accuracy`
void add_stability_command(CLI::App& accuracy, Session& session);  // below `tpm accuracy`
void add_report_command(CLI::App& paper, Session& session);        // below `tpm paper`
void add_tables_command(CLI::App& paper, Session& session);        // below `tpm paper`
void add_audit_command(CLI::App& paper, Session& session);         // below `tpm paper`
void add_experiments_command(CLI::App& paper, Session& session);   // below `tpm paper`
void add_data_import_command(CLI::App& data, Session& session);    // below `tpm data`
void add_sweep_views(CLI::App& sweep, Session& session);           // below `tpm sweep`

}  // namespace tpm::app
