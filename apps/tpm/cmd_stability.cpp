// tpm stability: where each step rule fails.
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <string>

#include "command.hpp"
#include "tpm/core/error.hpp"
#include "tpm/report/draw.hpp"
#include "tpm/report/stability_report.hpp"
#include "tpm/store/writable.hpp"

namespace tpm::app {
namespace {

int stability(const std::string& folder, int along, const Session& session) {
  const std::string python = find_drawing_python();  // before the work, not after
  require_writable_folder(folder);
  const auto start = std::chrono::steady_clock::now();
  const StabilityStudy study = run_stability_study(along);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  write_stability(study, folder, python, took.count());
  if (session.json()) {
    say("{}", to_text(to_json(study)));
    return 0;
  }
  for (const std::string& sentence : stability_sentences(study)) say("- {}\n", sentence);
  say("written to {}: report.html, report.md, stability.json, limits.csv, corners.csv, servo.csv, "
      "map_*.csv, figures\n",
      folder);
  return 0;
}

}  // namespace

void add_stability_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand(
      "stability", "Where each step rule fails: maps, limits against theory, degenerate corners");
  auto folder = std::make_shared<std::string>("out/stability");
  command->add_option("-o,--output", *folder, "Folder to write into")->capture_default_str();
  auto along = std::make_shared<std::string>(std::to_string(kPointsAlongMaps));
  command->add_option("--points", *along, "Points along each axis of the maps, 2 to 200")
      ->capture_default_str();
  add_format_option(*command, session);
  command->footer(
      "Examples:\n  tpm stability --output out/stability\n  tpm stability --points 5  (a quick "
      "look)");
  command->callback([folder, along, &session] {
    session.run = [folder, along, &session] {
      constexpr std::uint64_t kMost = 200;
      const std::uint64_t points = parse_whole_number(*along, "--points", 2);
      if (points > kMost) {
        throw Error(ExitCode::usage, "--points", *along, fmt::format("2 to {}", kMost));
      }
      return stability(*folder, static_cast<int>(points), session);
    };
  });
}

}  // namespace tpm::app
