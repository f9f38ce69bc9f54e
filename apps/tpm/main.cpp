// The program `tpm`: reads the command line, runs one command, turns errors into one line.
#include <fmt/format.h>

#include <charconv>
#include <cstdio>
#include <exception>
#include <filesystem>

#include "command.hpp"
#include "tpm/core/error.hpp"
#include "tpm/store/file.hpp"

namespace tpm::app {

void add_format_option(CLI::App& command, Session& session) {
  command.add_option("--format", session.format, "Output format: text or json")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
}

void deliver(const std::string& text, const std::string& file) {
  if (file.empty()) {
    fmt::print("{}", text);
  } else {
    write_file(file, text);
  }
}

std::uint64_t parse_whole_number(const std::string& text, const char* option,
                                 std::uint64_t smallest) {
  constexpr std::uint64_t kLargest = 1'000'000'000;
  std::uint64_t value = 0;
  const auto [stop, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = status == std::errc{} && stop == text.data() + text.size();
  if (whole && value >= smallest && value <= kLargest) return value;
  throw Error(ExitCode::usage, option, fmt::format("'{}'", printable(text)),
              fmt::format("a whole number from {} to {}", smallest, kLargest));
}

namespace {

/// No command writes over a file that it was given to read.
void require_output_apart(const CLI::App& app) {
  for (const CLI::App* command : app.get_subcommands()) {
    require_output_apart(*command);
    const CLI::Option* output = command->get_option_no_throw("--output");
    if (output == nullptr) continue;
    const std::string file =
        output->count() > 0 ? output->results().front() : output->get_default_str();
    for (const CLI::Option* option : command->get_options()) {
      if (option == output) continue;
      for (const std::string& given : option->results()) {
        std::error_code ignored;
        if (!std::filesystem::is_regular_file(given, ignored) ||
            !std::filesystem::equivalent(given, file, ignored)) {
          continue;
        }
        throw Error(ExitCode::usage, fmt::format("-o {}", printable(file)),
                    fmt::format("is {} itself", option->get_name()), "another file");
      }
    }
  }
}

int run(int argc, char** argv) {
  CLI::App app{"tpm: check a viscoelastic soft-tissue model against data", "tpm"};
  app.require_subcommand(1);
  app.footer(
      "Example:\n  tpm tables --depths 2,4,6,8 --spacings 20,25,30,35\n"
      "Each command explains itself: tpm COMMAND --help");
  Session session;
  add_version_command(app, session);
  add_fit_command(app, session);
  add_select_command(app, session);
  add_recovery_command(app, session);
  add_check_gradient_command(app, session);
  add_design_command(app, session);
  add_laws_command(app, session);
  add_spectrum_command(app, session);
  add_export_command(app, session);
  add_coverage_command(app, session);
  add_tables_command(app, session);
  add_audit_command(app, session);
  add_data_command(app, session);
  add_network_command(app, session);
  add_simulate_command(app, session);
  add_plan_command(app, session);
  add_report_command(app, session);
  add_experiments_command(app, session);
  add_benchmark_command(app, session);
  add_stability_command(app, session);
  add_sweep_command(app, session);
  add_hil_command(app, session);

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& wanted) {  // --help
    return app.exit(wanted);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "tpm: {}; see tpm --help\n", error.what());
    return static_cast<int>(ExitCode::usage);
  }
  require_output_apart(app);
  return session.run();
}

}  // namespace
}  // namespace tpm::app

int main(int argc, char** argv) {
  try {
    return tpm::app::run(argc, argv);
  } catch (const tpm::Error& error) {
    fmt::print(stderr, "tpm: {}\n", error.what());
    return static_cast<int>(error.code());
  } catch (const std::exception& error) {
    // Nothing in the library throws anything else on purpose: this is a defect of tpm.
    fmt::print(stderr, "tpm: internal error: {}; please report it\n", error.what());
    return static_cast<int>(tpm::ExitCode::numerical);
  }
}
