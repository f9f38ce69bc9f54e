// tpm hil stability: what can be rendered passively, and what stays stable.

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/show/boundary_report.hpp"
#include "tpm/show/draw.hpp"
#include "tpm/show/short_answer.hpp"

namespace tpm::app {

void add_hil_stability_command(CLI::App& hil, Session& session) {
  CLI::App* command = hil.add_subcommand(
      "stability", "Largest stiffness that is passive, and stable, against rate, delay, friction");
  struct Options {
    std::string folder;
    bool verbose = false;
  };
  auto options = std::make_shared<Options>();
  add_folder_option(*command, options->folder, ": figures and boundaries.json, with every number");
  add_verbose_option(*command, options->verbose,
                     "every rate, delay and friction, rules, impacts, devices");
  add_format_option(*command, session);
  command->footer("Example:\n  tpm hil stability --folder hil_borders");
  set_run(*command, session, [options, &session] {
    const std::filesystem::path folder = options->folder;
    will_write_into(folder, {"boundaries.json", "figures.json"}, session.folder_naming());
    const BoundaryStudy study = study_boundaries({});
    Json json = boundary_json(study);
    std::vector<std::string> files;
    std::string next = same_command(session, "--folder hil_borders");
    if (!folder.empty()) {
      files = write_figures(options->folder, boundary_figures(study));
      write_file(folder / "boundaries.json", to_text(json));
      files.insert(files.begin(), "boundaries.json");
      next = next_of_pictures(folder);
    }
    add_end(json, folder, files, next);
    if (session.json()) {
      say("{}", answer_text(session, std::move(json)));
    } else if (options->verbose) {
      say("{}{}{}", boundary_text(study),
          files.empty() ? std::string() : written(session, options->folder, files),
          next_line(next));
    } else {
      ShortAnswer answer = short_answer(study);
      end_answer(answer, options->folder, files, next);
      say("{}", to_text(answer));
    }
    return 0;
  });
}

}  // namespace tpm::app
