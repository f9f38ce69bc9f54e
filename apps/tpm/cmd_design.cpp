
#include <memory>
#include <optional>

#include "command.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpm/fit/show/design_figures.hpp"
#include "tpm/show/draw.hpp"
#include "tpm/show/json_table_csv.hpp"

namespace tpm::app {
namespace {

struct DesignOptions {
  std::string design;
  std::string check = "100";
  std::string seed = "0";
  std::string top = "10";
  std::string folder;
  std::string output;
};

void draw(const DesignResult& result, const std::filesystem::path& folder) {
  const std::string python = find_drawing_python();
  write_file(folder / "figures.json", to_text(to_json(design_figures(result))));
  draw_figures(python, folder / "figures.json", folder);
}

int design(const DesignOptions& options, const Session& session) {
  const auto sets = static_cast<int>(parse_whole_number(options.check, "--check", 0));
  const std::uint64_t seed = parse_whole_number(options.seed, "--seed", 0);
  const auto top = static_cast<std::size_t>(parse_whole_number(options.top, "--top", 1));
  will_write_into(options.folder, {"figures.json"});
  const auto csv = csv_beside(options.output, session);
  const DesignResult result = fit::plan(read_design(options.design));
  std::optional<DesignCheck> check;
  if (sets > 0) {
    check = check_design(result.problem, result.ranked.front().experiment, sets, seed);
  }
  const DesignCheck* checked = check ? &*check : nullptr;
  if (!options.folder.empty()) draw(result, options.folder);
  const Json json = to_json(result, checked, top);
  deliver(session.json() ? to_text(json) : to_terminal_text(result, checked, top), options.output);
  deliver_csv(json_table_csv(json.at("ranked"), "/expected/parameters"), csv);
  return 0;
}

}  // namespace

void add_design_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand(
      "design", "Which experiment would identify the parameters? Expected intervals beforehand");
  auto options = std::make_shared<DesignOptions>();
  command->add_option("DESIGN", options->design, "JSON design (schemas/design.schema.json)")
      ->required();
  command
      ->add_option("--check", options->check,
                   "Simulate and fit the best candidate this many times; 0: not at all, else 10 "
                   "or more")
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Seed of the simulations")->capture_default_str();
  command->add_option("--top", options->top, "How many candidates to list")->capture_default_str();
  command->add_option("--draw", options->folder, "Write figures into this folder");
  add_output_option(*command, options->output);
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm design configs/design_liver.json --draw out/design\n"
      "  tpm design configs/design_meat.json --check 0 --format json");
  set_run(*command, session, [options, &session] { return design(*options, session); });
}

}  // namespace tpm::app
