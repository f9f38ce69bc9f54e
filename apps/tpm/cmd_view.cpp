// tpm view: a file as one page that is opened in a browser.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/haptics/show/view_file.hpp"
#include "tpm/work/progress.hpp"

namespace tpm::app {
namespace {

struct ViewChoice {
  std::string file, output;
  bool no_organ = false;
};

/// Pictures of a recording's organ, told on the terminal.
class OrganProgress {
 public:
  void operator()(std::size_t done, std::size_t total) {
    if (!progress_) progress_ = std::make_shared<Progress>("the organ of the recording", total);
    progress_->advance(done - before_);
    before_ = done;
  }

 private:
  std::shared_ptr<Progress> progress_;
  std::size_t before_ = 0;
};

int view(const ViewChoice& choice, const Session& session) {
  // Absolute, so that "." has the name of its folder.
  const std::filesystem::path given = std::filesystem::absolute(choice.file).lexically_normal();
  const std::filesystem::path name = given.has_filename() ? given : given.parent_path();
  const std::filesystem::path output = choice.output.empty()
                                           ? name.filename().replace_extension(".html")
                                           : std::filesystem::path(choice.output);
  will_write({output}, choice.output.empty() ? Naming::by_default : Naming::file);
  ViewOptions options;
  options.organ = !choice.no_organ;
  options.progress = OrganProgress();
  const ViewPage page = view_file(shown_file(choice.file), options);
  const std::string html = page.html();
  write_file(output, html);
  const Json& shown = page.description;
  if (session.json()) {
    say("{}", answer_text(
                  session,
                  Json{{"file", output.string()},
                       {"kind", shown.at("kind")},
                       {"bytes", html.size()},
                       {"plots", shown.at("plots").size()},
                       {"samples", shown.value("samples", Json())},
                       {"samples_per_value", shown.value("samples_per_value", Json())},
                       {"spheres", shown.contains("organ") ? shown["organ"]["spheres"] : Json()},
                       {"organ_shown", shown.contains("organ") ? shown["organ"]["shown"] : Json()},
                       {"simulated", shown.value("simulated", Json())}}));
    return 0;
  }
  say("{}: {}\n", shown.at("kind").get<std::string>(), shown.at("title").get<std::string>());
  if (shown.contains("organ")) {
    say("organ: {} spheres; {}\n", shown["organ"]["spheres"].get<std::size_t>(),
        shown["organ"]["shown"].get<std::string>());
  }
  if (shown.contains("samples")) {
    const auto part = shown["samples_per_value"].get<std::size_t>();
    say("curves: {} samples{}\n", shown["samples"].get<std::size_t>(),
        part == 1 ? "" : fmt::format(", the least and the largest value of each {}", part));
  }
  say("wrote {}: open it in a browser\n", output.string());
  return 0;
}

}  // namespace

void add_view_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand(
      "view", "Show a result, a recorded session or a fit as one interactive HTML page");
  auto choice = std::make_shared<ViewChoice>();
  command
      ->add_option("FILE", choice->file,
                   "HDF5 of tpm simulate, a recording of tpm hil run, law.json, figures.json or "
                   "the JSON answer of tpm fit; or a folder with one of them")
      ->required();
  command->add_option(
      "-o,--output", choice->output,
      "File to write (HTML; default: the name of FILE ending in .html, in this folder)");
  command->add_flag(
      "--no-organ", choice->no_organ,
      "Show the curves of a recording only, without recomputing the organ from the motion");
  add_force_option(*command, session);
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm simulate configs/liver_indentation.json -o results.h5\n"
      "  tpm view results.h5 -o results.html");
  set_run(*command, session, [choice, &session] { return view(*choice, session); });
}

}  // namespace tpm::app
