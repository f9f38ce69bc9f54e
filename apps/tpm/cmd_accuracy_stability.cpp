// tpm accuracy stability: where each step rule fails.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "option_kinds.hpp"
#include "tpm/accuracy/show/stability_report.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/files/writable.hpp"
#include "tpm/show/draw.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

/// Names of the files that are written.
std::vector<std::string> files_of(const StabilityStudy& study, const StabilityParts& parts,
                                  const std::string& python) {
  std::vector<std::string> names{"report.html", "report.md", "stability.json"};
  if (parts.limits) names.emplace_back("limits.csv");
  if (parts.limiting_cases) names.emplace_back("limiting_cases.csv");
  if (parts.servo) names.emplace_back("servo.csv");
  for (const std::string& id : each_once(study.maps, &StabilityMap::id)) {
    names.push_back(fmt::format("map_{}.csv", id));
  }
  if (parts.maps) names.emplace_back(python.empty() ? "figures.json" : "figures");
  return names;
}

/// All of them if none is named.
StabilityParts parts_of(const std::vector<std::string>& names) {
  if (names.empty()) return {};
  const auto named = [&](const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  return {named("maps"), named("limits"), named("limiting_cases"), named("servo")};
}

int stability(const std::string& folder, int along, const StabilityParts& parts,
              const Session& session) {
  const std::string python = find_drawing_python();  // before the work, not after
  will_write_into(folder, {"report.html", "report.md", "stability.json", "figures.json"},
                  session.folder_naming());
  require_writable_folder(folder);
  const auto start = std::chrono::steady_clock::now();
  const StabilityStudy study = run_stability_study(along, parts);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  write_stability(study, folder, python, took.count());
  const std::vector<std::string> files = files_of(study, parts, python);
  const std::string next = parts.maps ? next_of_pictures(folder) : std::string();
  if (session.json()) {
    Json json = to_json(study);
    add_end(json, folder, files, next);
    say("{}", answer_text(session, std::move(json)));
    return 0;
  }
  for (const std::string& sentence : stability_sentences(study)) say("- {}\n", sentence);
  say("written to {}: {}\n{}", folder, fmt::join(files, ", "), next_line(next));
  return 0;
}

}  // namespace

void add_stability_command(CLI::App& accuracy, Session& session) {
  CLI::App* command = accuracy.add_subcommand(
      "stability", "Where each step rule fails: maps, limits against theory, limiting cases");
  auto folder = std::make_shared<std::string>("out/stability");
  add_folder_option(*command, *folder)->capture_default_str();
  auto along = std::make_shared<std::string>(std::to_string(kPointsAlongMaps));
  command->add_option("--points", *along, "Points along each axis of the maps, 2 to 200")
      ->capture_default_str();
  auto only = std::make_shared<std::vector<std::string>>();
  command
      ->add_option("--only", *only,
                   "Parts to run: maps, limits, limiting_cases, servo (default: all)")
      ->delimiter(',')
      ->check(one_of_words({"maps", "limits", "limiting_cases", "servo"}));
  add_format_option(*command, session);
  command->footer(
      "Examples:\n  tpm accuracy stability --folder out/stability\n  tpm accuracy stability "
      "--points 5\n  tpm accuracy stability --only limiting_cases,servo");
  set_run(*command, session, [folder, along, only, &session] {
    constexpr std::uint64_t kMost = 200;
    const std::uint64_t points = parse_whole_number(*along, "--points", 2);
    if (points > kMost) {
      throw Error(ExitCode::usage, "--points", *along, fmt::format("2 to {}", kMost));
    }
    return stability(*folder, static_cast<int>(points), parts_of(*only), session);
  });
}

}  // namespace tpm::app
