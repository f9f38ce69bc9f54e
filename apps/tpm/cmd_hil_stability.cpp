// tpm hil stability: what can be rendered passively, and what stays stable.

#include <filesystem>
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/haptics/show/boundary_report.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::app {

void add_hil_stability_command(CLI::App& hil, Session& session) {
  CLI::App* command = hil.add_subcommand(
      "stability", "Largest stiffness that is passive, and stable, against rate, delay, friction");
  auto figures = std::make_shared<std::string>();
  add_folder_option(*command, *figures, ": figures (SVG, PNG)");
  add_format_option(*command, session);
  command->footer("Example:\n  tpm hil stability --folder hil_borders");
  set_run(*command, session, [figures, &session] {
    const BoundaryStudy study = study_boundaries({});
    std::vector<std::string> files;
    if (!figures->empty()) files = write_figures(*figures, boundary_figures(study));
    const std::string next =
        figures->empty()
            ? same_command(session, "--folder hil_borders")
            : "tpm view " + shell_word((std::filesystem::path(*figures) / "figures.json").string());
    Json json = boundary_json(study);
    add_end(json, *figures, files, next);
    std::string text = boundary_text(study);
    if (!files.empty()) text += written(session, *figures, files);
    say("{}", session.json() ? answer_text(session, json) : text + next_line(next));
    return 0;
  });
}

}  // namespace tpm::app
