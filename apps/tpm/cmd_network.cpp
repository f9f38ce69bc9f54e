// tpm network: build, check and show the network of spheres that a scene describes.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "option_kinds.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/organ/bonds/local_support.hpp"
#include "tpm/organ/scene/inspection.hpp"
#include "tpm/organ/scene/network_file.hpp"
#include "tpm/plan/show/network_report.hpp"
#include "tpm/show/draw.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace fs = std::filesystem;
namespace {

struct NetworkChoice {
  std::string scene;
  std::string count, layers, spacing, seed, filling;
  std::string output;
};

/// The scene that the options spell, for the common case of a liver.
Json scene_of_options(const NetworkChoice& choice) {
  Json organ{{"kind", "liver"}};
  const auto number = [&](const char* key, const char* option, const std::string& text,
                          std::uint64_t least) {
    if (!text.empty()) organ[key] = parse_whole_number(text, option, least);
  };
  number("count", "--spheres", choice.count, 2);
  number("layers", "--layers", choice.layers, 1);
  number("seed", "--seed", choice.seed, 0);
  if (!choice.spacing.empty()) organ["spacing"] = choice.spacing;
  if (!choice.filling.empty()) organ["filling"] = choice.filling;
  return {{"organ", organ}};
}

Tissue tissue_of(const NetworkChoice& choice) {
  const Json from_options = scene_of_options(choice);
  if (choice.scene.empty()) {
    return of_option([&] { return parse_tissue(from_options, "options", {}); });
  }
  if (from_options.at("organ").size() > 1) {
    throw Error(ExitCode::usage, choice.scene, "beside options of the organ",
                "either a scene or options");
  }
  return read_tissue(choice.scene);
}

/// `tpm network ABOUT` of the same organ.
std::string command_of_organ(const char* about, const NetworkChoice& choice) {
  std::string command = fmt::format("tpm network {}", about);
  if (!choice.scene.empty()) command += " " + shell_word(choice.scene);
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) command += fmt::format(" {} {}", option, shell_quoted(value));
  };
  add("--spheres", choice.count);
  add("--layers", choice.layers);
  add("--spacing", choice.spacing);
  add("--filling", choice.filling);
  add("--seed", choice.seed);
  return command;
}

int build(const NetworkChoice& choice, const Session& session) {
  will_write({fs::path(choice.output).replace_extension(".xdmf")});
  const Tissue tissue = tissue_of(choice);
  require_sound(tissue, choice.scene.empty() ? "options" : choice.scene);
  const fs::path xdmf = write_network(tissue, choice.output);
  const NetworkInspection inspection = inspect(tissue);
  const std::string next = command_of_organ("check", choice);
  if (session.json()) {
    Json json = network_json(tissue, inspection);
    add_end(json, {}, {choice.output, xdmf.string()}, next);
    say("{}", answer_text(session, json));
  } else {
    say("{}wrote {} and {}\n{}", network_text(tissue, inspection), choice.output, xdmf.string(),
        next_line(next));
  }
  return 0;
}

/// A network that would not stand is an answer, not a fault of the file.
int check(const NetworkChoice& choice, const Session& session) {
  const Tissue tissue = tissue_of(choice);
  std::string fault;
  try {
    const std::string_view where =
        choice.scene.empty() ? "options" : std::string_view(choice.scene);
    require_standing(tissue, where);
    const bool has_contacts =
        std::ranges::find(tissue.unused_blocks, "contacts") != tissue.unused_blocks.end();
    if (!has_contacts) require_free_contact(tissue, where);
  } catch (const Error& error) {
    if (error.code() != ExitCode::bad_input) throw;
    fault = error.what();
  }
  const NetworkInspection inspection = inspect(tissue);
  const std::vector<double> support =
      local_support(tissue.bonds(), tissue.network.organ, tissue.constraints());
  const auto least = std::min_element(support.begin(), support.end());
  const std::string next = fault.empty() ? command_of_organ("show", choice) : std::string();
  if (session.json()) {
    Json json = network_json(tissue, inspection);
    json["least_support"] = rounded(*least, 6);
    json["least_supported_sphere"] = least - support.begin() + 1;
    json["stands"] = fault.empty();
    json["fault"] = fault.empty() ? Json(nullptr) : Json(fault);
    json["modes_counted"] = tissue.network.organ.size() <= kMostSpheresForModes;
    add_end(json, {}, {}, next);
    say("{}", answer_text(session, json, {{"network_stands", fault.empty()}}));
  } else {
    say("{}least support: {} at sphere {} (loose below {})\n", network_text(tissue, inspection),
        significant(*least, 3), least - support.begin() + 1, shortest(kLooseSupport));
    if (fault.empty()) {
      say("stands: no sphere is loose{}\n",
          tissue.network.organ.size() <= kMostSpheresForModes
              ? ", no motion is free of energy"
              : "; motions of the whole were not looked for, there are too many spheres");
    }
    say("{}", next_line(next));
  }
  if (!fault.empty()) tell_user("tpm: {}\n", fault);
  return exit_code(fault.empty());
}

int show(const NetworkChoice& choice, const Session& session) {
  fs::path stem = choice.output;
  const fs::path ending = stem.extension();
  const std::vector<std::string> endings{".svg", ".png", ".pdf", ".json"};
  require_ending(choice.output, endings);
  if (std::ranges::find(endings, ending.string()) != endings.end()) stem.replace_extension();
  const fs::path picture = stem.string() + ".json";
  will_write({picture, stem.string() + ".svg", stem.string() + ".png", stem.string() + ".pdf"},
             session.output_naming);
  const Tissue tissue = tissue_of(choice);
  const std::string python = find_drawing_python();
  write_file(picture, to_text(network_picture(tissue)));
  draw_network(python, picture, stem);
  if (python.empty()) {
    say("wrote {}.json\n", stem.string());
  } else {
    say("wrote {0}.svg, {0}.png, {0}.pdf and {0}.json\n", stem.string());
  }
  return 0;
}

std::shared_ptr<NetworkChoice> add_choice(CLI::App& command) {
  auto choice = std::make_shared<NetworkChoice>();
  command.add_option("SCENE", choice->scene,
                     "JSON scene (schemas/scene.schema.json); without one the liver of the paper");
  command.add_option("--spheres", choice->count, "Number of spheres of a liver");
  command.add_option("--layers", choice->layers, "Layers of a shell");
  command.add_option("--spacing", choice->spacing, "Distance of neighbours, e.g. \"20 mm\"");
  command.add_option("--filling", choice->filling, "Filling of an organ: shell or solid")
      ->check(one_of_words({"shell", "solid"}));
  add_seed_option(command, choice->seed, ": the filling");
  return choice;
}

}  // namespace

void add_network_command(CLI::App& app, Session& session) {
  CLI::App* network = app.add_subcommand("network", "Organs of spheres: build, check, show");
  network->require_subcommand(1);
  network->footer(
      "Example:\n  tpm network build configs/liver_scene.json -o liver.h5\n"
      "  tpm network check configs/liver_scene.json");

  CLI::App* build_command = network->add_subcommand("build", "Write a network to HDF5 and XDMF");
  const auto to_build = add_choice(*build_command);
  build_command
      ->add_option("-o,--output", to_build->output, "File to write (HDF5); an XDMF goes beside it")
      ->required();
  add_format_option(*build_command, session);
  build_command->footer(
      "Example:\n  tpm network build --spheres 424 --layers 2 -o organ.h5\n"
      "  tpm network build configs/liver_scene.json -o organ.h5");
  set_run(*build_command, session, [to_build, &session] { return build(*to_build, session); });

  CLI::App* check_command =
      network->add_subcommand("check", "Does it stand? Loose spheres, bond sums, neighbours");
  const auto to_check = add_choice(*check_command);
  add_format_option(*check_command, session);
  check_command->footer("Example:\n  tpm network check configs/liver_scene.json");
  set_run(*check_command, session, [to_check, &session] { return check(*to_check, session); });

  CLI::App* show_command = network->add_subcommand("show", "Draw it from the front and the side");
  const auto to_show = add_choice(*show_command);
  to_show->output = "network";
  show_command
      ->add_option("-o,--output", to_show->output,
                   "File to write (SVG); PNG, PDF and the numbers (JSON) go beside it")
      ->capture_default_str();
  show_command->footer("Example:\n  tpm network show configs/liver_scene.json -o liver");
  set_run(*show_command, session, [to_show, &session] { return show(*to_show, session); });
}

}  // namespace tpm::app
