// tpm view: a file as one page that is opened in a browser.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
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

/// Content of a page as JSON; null for parts that its file lacks.
Json json_of(const ViewPage& page) {
  const Json& shown = page.description;
  const Json organ = shown.value("organ", Json::object());
  return {{"kind", shown.at("kind")},
          {"plots", shown.at("plots").size()},
          {"samples", shown.value("samples", Json())},
          {"samples_per_value", shown.value("samples_per_value", Json())},
          {"spheres", organ.value("spheres", Json())},
          {"organ_shown", organ.value("shown", Json())},
          {"simulated", shown.value("simulated", Json())}};
}

Json json_of(const Viewed& viewed, const std::filesystem::path& output, std::size_t bytes) {
  Json json{{"file", output.string()}, {"bytes", bytes}};
  json["results"] = Json::array();
  for (std::size_t i = 0; i < viewed.pages.size(); ++i) {
    Json result{{"file", viewed.files[i].string()}};
    result["title"] = viewed.pages[i].description.at("title");
    result.update(json_of(viewed.pages[i]));
    json["results"].push_back(std::move(result));
  }
  json["not_shown"] = Json::array();
  for (const NotShown& other : viewed.not_shown) {
    json["not_shown"].push_back({{"file", other.file.string()}, {"message", other.reason.what()}});
  }
  const Json alone = viewed.pages.size() == 1 ? json_of(viewed.pages.front()) : Json();
  json.update(alone.is_null() ? Json{{"kind", "folder"}} : alone);
  return json;
}

/// @param name of the file of several, with a colon
void tell_result(const Json& shown, const std::string& name) {
  say("{}{}: {}\n", name, shown.at("kind").get<std::string>(),
      shown.at("title").get<std::string>());
  if (shown.contains("organ")) {
    say("{}organ: {} spheres; {}\n", name, shown["organ"]["spheres"].get<std::size_t>(),
        shown["organ"]["shown"].get<std::string>());
  }
  if (shown.contains("samples")) {
    const auto part = shown["samples_per_value"].get<std::size_t>();
    say("{}curves: {} samples{}\n", name, shown["samples"].get<std::size_t>(),
        part == 1 ? "" : fmt::format(", the least and the largest value of each {}", part));
  }
}

int view(const ViewChoice& choice, const Session& session) {
  // Absolute, so that "." has the name of its folder.
  const std::filesystem::path given = std::filesystem::absolute(choice.file).lexically_normal();
  const std::filesystem::path name = given.has_filename() ? given : given.parent_path();
  const std::filesystem::path output = choice.output.empty()
                                           ? name.filename().replace_extension(".html")
                                           : std::filesystem::path(choice.output);
  require_ending(choice.output, {".html", ".htm"});
  will_write({output}, choice.output.empty() ? Naming::by_default : Naming::file);
  ViewOptions options;
  options.organ = !choice.no_organ;
  options.progress = OrganProgress();
  const Viewed viewed = view_path(choice.file, options);
  const std::string html = viewed.html();
  write_file(output, html);
  if (session.json()) {
    Json json = json_of(viewed, output, html.size());
    add_end(json, {}, {output.string()}, {});
    say("{}", answer_text(session, std::move(json)));
    return 0;
  }
  for (std::size_t i = 0; i < viewed.pages.size(); ++i) {
    const bool alone = viewed.pages.size() == 1 && viewed.not_shown.empty();
    tell_result(viewed.pages[i].description, alone ? "" : viewed.names[i] + ": ");
  }
  for (const NotShown& other : viewed.not_shown) say("not shown: {}\n", other.reason.what());
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
                   "HDF5 of tpm simulate, a recording of tpm hil run, law.json, figures.json, "
                   "validation.json or the JSON answer of tpm fit; or a folder of them")
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
