// The program `tpm`: reads the command line, runs one command, turns errors into one line.
#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "command.hpp"
#include "command_words.hpp"
#include "json_usage.hpp"
#include "option_kinds.hpp"
#include "out_of_memory.hpp"
#include "shipped_files.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/replacement.hpp"
#include "tpm/haptics/device/forces_off_guard.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"
#include "tpmkit/version.hpp"

namespace tpm::app {

void add_format_option(CLI::App& command, Session& session) {
  command.add_option("--format", session.format, "Output format: text or json")
      ->check(one_of_words({"text", "json"}))
      ->capture_default_str();
}

void add_output_option(CLI::App& command, std::string& output) {
  command.add_option("-o,--output", output,
                     "File to write (default: the terminal); beside JSON the table as .csv");
}

void add_force_option(CLI::App& command, Session& session) {
  if (command.get_option_no_throw("--overwrite") != nullptr) return;
  command.add_flag("--overwrite", session.force,
                   "Replace files that exist, also those that were changed since tpm wrote them, "
                   "and results of other inputs under names that were not given");
}

void require_new(const std::string& output, const Session& session) {
  if (session.force || !std::filesystem::is_regular_file(output)) return;
  throw Error(ExitCode::usage, "-o " + output, "the file exists",
              "another --output, or --overwrite");
}

void set_run(CLI::App& command, Session& session, std::function<int()> work) {
  command.callback([&session, work = std::move(work)] { session.run = work; });
}

void write_output(std::string_view text) {
  const std::string safe = for_terminal(text, LineEnds::kept);
  if (std::fwrite(safe.data(), 1, safe.size(), stdout) == safe.size()) return;
  throw Error(ExitCode::environment, "standard output",
              fmt::format("cannot be written: {}", std::strerror(errno)), "room for the answer");
}

void write_alarming(std::string_view text) {
  const char* no_color = std::getenv("NO_COLOR");
  const bool plain = no_color != nullptr && *no_color != '\0';
  if (plain || ::isatty(STDOUT_FILENO) == 0) {
    write_output(text);
    return;
  }
  (void)std::fputs("\x1b[31m", stdout);
  write_output(text);
  (void)std::fputs("\x1b[0m", stdout);
}

void write_message(std::string_view line) {
  if (line.ends_with('\n')) line.remove_suffix(1);
  const std::string safe = for_terminal(line, LineEnds::escaped) + "\n";
  (void)std::fputs(safe.c_str(), stderr);
}

void deliver(const std::string& text, const std::string& file) {
  if (file.empty()) {
    write_output(text);
  } else {
    write_file(file, text);
  }
}

std::filesystem::path csv_beside(const std::string& output, const Session& session) {
  if (output.empty() || is_device_or_pipe(output)) return {};
  (void)Replacement(output);  // before a long run and its folder of results: can it be written?
  if (!session.json()) return {};
  std::filesystem::path file = output;
  // One that is called so already keeps its name whole.
  file = file.extension() == ".csv" ? output + ".csv" : file.replace_extension(".csv").string();
  will_write({file});
  return file;
}

void deliver_csv(const std::string& csv, const std::filesystem::path& file) {
  if (!file.empty()) write_file(file, csv);
}

std::string written(const Session& session, const std::string& folder,
                    const std::vector<std::string>& files) {
  if (session.json()) return {};
  return fmt::format("\nwritten to {}: {}\n", folder, fmt::join(files, ", "));
}

void say_with_files(const Session& session, Json json, std::string_view text,
                    const std::vector<std::string>& files, const std::string& next) {
  add_end(json, {}, files, next);
  if (session.json()) return write_output(answer_text(session, std::move(json)));
  const std::string wrote =
      files.empty() ? std::string() : fmt::format("wrote {}\n", fmt::join(files, ", "));
  write_output(fmt::format("{}{}{}", text, wrote, next_line(next)));
}

void will_write_into(const std::filesystem::path& folder, std::initializer_list<const char*> names,
                     Naming naming) {
  if (folder.empty()) return;
  will_write_in(folder, naming);
  std::vector<std::filesystem::path> files;
  for (const char* name : names) files.push_back(folder / name);
  will_write(files, naming);
}

double option_quantity(std::string_view text, Dimension dimension, std::string_view option) {
  return of_option([&] { return parse_quantity(text, dimension, option); });
}

double option_number(std::string_view text, std::string_view option) {
  return of_option([&] { return parse_number(text, option); });
}

double parse_share(std::string_view text, const char* option) {
  if (const auto share = find_share(text)) return *share;
  throw Error(ExitCode::usage, option, fmt::format("'{}'", printable(text)),
              "a share such as 10% or 0.1");
}

std::uint64_t parse_whole_number(const std::string& text, const char* option,
                                 std::uint64_t smallest, std::uint64_t largest) {
  std::uint64_t value = 0;
  const auto [stop, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = status == std::errc{} && stop == text.data() + text.size();
  if (whole && value >= smallest && value <= largest) return value;
  throw Error(ExitCode::usage, option, fmt::format("'{}'", printable(text)),
              fmt::format("a whole number from {} to {}", smallest, largest));
}

namespace {

/// No command writes over a file that it reads: what --output names, or --folder where that has a
/// default, is announced before anything is read. Commands that write further files announce them
/// themselves.
void announce_output(const CLI::App& app, Session& session) {
  for (const CLI::App* command : app.get_subcommands()) {
    announce_output(*command, session);
    const CLI::Option* output = command->get_option_no_throw("--output");
    if (output == nullptr) output = command->get_option_no_throw("--folder");
    // Of a command with a command of its own only that one runs.
    if (output == nullptr || !command->get_subcommands().empty()) continue;
    if (output->check_lname("folder") && output->get_default_str().empty()) continue;
    const bool given = output->count() > 0;
    session.output_naming = given ? Naming::file : Naming::by_default;
    will_write({given ? output->results().front() : output->get_default_str()},
               session.output_naming);
  }
}

/// The chosen command with the files that it was given: "tpm fit /data/a.csv".
std::string origin_of(const CLI::App& app) {
  std::string origin = app.get_name();
  for (const CLI::App* command : app.get_subcommands()) {
    origin += " " + origin_of(*command);
    for (const CLI::Option* option : command->get_options()) {
      if (!option->get_positional()) continue;
      for (const std::string& word : option->results()) {
        std::error_code ec;
        const bool file = std::filesystem::exists(word, ec);
        const auto whole = std::filesystem::weakly_canonical(word, ec);
        origin += " " + (file && !ec ? whole.string() : word);
      }
    }
  }
  return origin;
}

/// The words of the chosen command: "hil verify".
std::string words_of_command(const CLI::App& app) {
  std::string words;
  for (const CLI::App* command : app.get_subcommands()) {
    const std::string below = words_of_command(*command);
    words = command->get_name() + (below.empty() ? "" : " " + below);
  }
  return words;
}

/// Every command that writes under names of its own can be told to replace what stands there.
void add_force_options(CLI::App& app, Session& session) {
  for (CLI::App* command : app.get_subcommands({})) {
    add_force_options(*command, session);
    const CLI::Option* output = command->get_option_no_throw("--output");
    const bool has_default = output != nullptr && !output->get_default_str().empty();
    if (has_default || command->get_option_no_throw("--folder") != nullptr) {
      add_force_option(*command, session);
    }
  }
}

/// The commands in the groups that `tpm --help` and docs/commands.md show.
void add_commands(CLI::App& app, Session& session) {
  using Adder = void (*)(CLI::App&, Session&);
  struct Group {
    const char* name;
    std::vector<Adder> commands;
  };
  const std::vector<Group> groups = {
      {"Data: recordings, laws and fits",
       {add_example_command, add_data_command, add_fit_command, add_predict_command,
        add_validate_command, add_identify_command, add_laws_command, add_export_command,
        add_design_command, add_view_command}},
      {"Tissue: organs of spheres",
       {add_network_command, add_material_command, add_simulate_command, add_plan_command,
        add_sweep_command}},
      {"Hand: haptic devices", {add_hil_command, add_budget_command}},
      {"Evidence: the paper, and tpm itself",
       {add_paper_command, add_accuracy_command, add_schema_command, add_version_command}}};
  for (const Group& group : groups) {
    for (const Adder add : group.commands) {
      const std::size_t before = app.get_subcommands({}).size();
      add(app, session);
      for (std::size_t i = before; i < app.get_subcommands({}).size(); ++i) {
        app.get_subcommand(static_cast<int>(i))->group(group.name);
      }
    }
  }
}

int run(int argc, char** argv) {
  CLI::App app{"tpm: from a force recording to a soft-tissue model to validate, simulate and feel",
               "tpm"};
  app.require_subcommand(1);
  app.footer(
      "Example:\n  tpm example recording\n  tpm fit recording.csv\n"
      "Each command explains itself: tpm COMMAND --help, or tpm help COMMAND");
  app.set_version_flag("-V,--version", fmt::format("tpm {}", version()), "Print the version");
  Session session;
  FileRoles roles;
  add_commands(app, session);
  add_force_options(app, session);
  set_option_kinds(app);
  app.add_flag_callback(
      "--json-usage",
      [&app] {
        write_output(to_text(json_usage(app)));
        throw CLI::Success();
      },
      "Print all commands and their options as JSON");
  std::vector<ShippedFile> shipped;
  accept_shipped_files(app, shipped);

  try {
    std::vector<std::string> words = command_words(argc, argv);
    session.words = words;
    std::reverse(words.begin(), words.end());  // CLI11 takes them from the back
    app.parse(std::move(words));
  } catch (const CLI::Success& wanted) {  // --help, --version
    const std::string unknown = unknown_command(app);
    if (unknown.empty()) return app.exit(wanted);
    tell_user("tpm: {}\n", unknown);
    return static_cast<int>(ExitCode::usage);
  } catch (const CLI::ParseError& error) {
    tell_user("tpm: {}\n", refusal(app, error));
    return static_cast<int>(ExitCode::usage);
  }
  for (const ShippedFile& file : shipped) {
    tell_user("tpm: {} is not here: using the one that comes with tpm, {}\n", file.word, file.path);
  }
  session.command = words_of_command(app);
  roles.mark_results(origin_of(app), session.force);
  announce_output(app, session);
  try {
    return session.run();
  } catch (const Error& error) {
    throw with_example(app, error);
  }
}

/// A closed standard stream would hand its number to the next file that is opened, and messages
/// would be written into that file.
void occupy_closed_streams() {
  for (int stream = 0; stream <= 2; ++stream) {
    if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    // Opened the wrong way round, so that writing to a closed output still fails.
    (void)::open("/dev/null", stream == 0 ? O_WRONLY : O_RDONLY);
  }
}

/// Throws unless all output was written, before the exit code claims so.
void require_output_written() {
  const bool flushed = std::fflush(stdout) == 0;
  if (flushed && std::ferror(stdout) == 0) return;
  throw Error(ExitCode::environment, "standard output",
              fmt::format("cannot be written: {}", std::strerror(errno)), "room for the answer");
}

}  // namespace
}  // namespace tpm::app

namespace {

/// During a session (OutOfMemoryIsThrown), libraries that ask for memory where they must not throw
/// (nlohmann-json does in its destructor) end here: then nothing is unwound.
[[noreturn]] void end_without_memory() noexcept {
  tpm::haptics::cut_all_forces();
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    ::_exit(tpm::app::say_out_of_memory());
  } catch (...) {
    std::abort();
  }
  std::abort();
}

/// Keeps large freed arrays for the next of their size. By default the C library gives every array
/// above 32 MB back to the system, and a fit of a million samples makes such arrays anew in each
/// evaluation: each time the system clears 4 kB pages one by one, which costs more than the
/// arithmetic where page faults are dear (virtual machines).
void keep_large_arrays() noexcept {
  constexpr int kLargestKept = 1 << 30;
  ::mallopt(M_MMAP_THRESHOLD, kLargestKept);
  ::mallopt(M_TRIM_THRESHOLD, kLargestKept);
}

/// The exit code; what goes wrong is one line. Throws std::bad_alloc.
int answer(int argc, char** argv) {
  try {
    tpm::app::occupy_closed_streams();
    const int code = tpm::app::run(argc, argv);
    tpm::app::require_output_written();
    return code;
  } catch (const tpm::Error& error) {
    tpm::app::tell_user("tpm: {}\n", error.what());
    return static_cast<int>(error.code());
  } catch (const std::filesystem::filesystem_error& error) {
    tpm::app::tell_user("tpm: {}: {}\n", error.path1().string(), error.code().message());
    return static_cast<int>(tpm::ExitCode::environment);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    // Nothing in the library throws anything else on purpose: this is a defect of tpm.
    tpm::app::tell_user("tpm: internal error: {}; please report it\n", error.what());
    return static_cast<int>(tpm::ExitCode::numerical);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::set_terminate(end_without_memory);
  // A limit of the size of files is an error of the write, which says which file it was.
  (void)std::signal(SIGXFSZ, SIG_IGN);
  keep_large_arrays();
  tpm::app::end_when_out_of_memory();
  try {
    return answer(argc, argv);
  } catch (const std::bad_alloc&) {  // telling what went wrong takes memory, too
    return tpm::app::say_out_of_memory();
  }
}
