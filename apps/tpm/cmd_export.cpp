// tpm export: the relaxation of a law for finite element programs, an organ for physics engines.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "command.hpp"
#include "option_kinds.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/blocks/law_export.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/json.hpp"
#include "tpm/files/other_kind.hpp"
#include "tpm/organ/scene/organ_export.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace {

struct ExportTexts {
  std::string law;
  std::string to;
  std::optional<std::string> radius, cone, punch, area, length, poisson, from, until, terms;
  std::optional<std::string> density;
  std::string output;
  bool relaxation_only = false, instantaneous = false;
};

void set_quantity(std::optional<double>& target, const std::optional<std::string>& text,
                  Dimension dimension, std::string_view option) {
  if (text) target = option_quantity(*text, dimension, option);
}

/// Programs for laws and engines for organs.
std::vector<std::string> all_targets() {
  std::vector<std::string> words = export_targets();
  for (std::string& word : organ_targets()) words.push_back(std::move(word));
  return words;
}

ExportOptions options_of(const ExportTexts& texts) {
  ExportOptions options;
  options.target = parse_export_target(texts.to, "--to");
  if (texts.density || texts.instantaneous) {
    throw Error(ExitCode::usage, texts.density ? "--density" : "--instantaneous", "with a law",
                "--to sofa or mjcf, and a scene");
  }
  options.relaxation_only = texts.relaxation_only;
  ContactGeometry& geometry = options.geometry;
  set_quantity(geometry.sphere_radius_m, texts.radius, Dimension::length, "--radius");
  set_quantity(geometry.cone_half_angle_rad, texts.cone, Dimension::angle, "--cone-angle");
  set_quantity(geometry.punch_radius_m, texts.punch, Dimension::length, "--punch-radius");
  set_quantity(geometry.area_m2, texts.area, Dimension::area, "--area");
  set_quantity(geometry.length_m, texts.length, Dimension::length, "--length");
  if (texts.poisson) geometry.poisson_ratio = option_number(*texts.poisson, "--poisson");
  PronyWindow& window = options.window;
  if (texts.from) window.from_s = option_quantity(*texts.from, Dimension::time, "--earliest");
  if (texts.until) window.to_s = option_quantity(*texts.until, Dimension::time, "--latest");
  if (texts.terms) window.times = static_cast<int>(parse_whole_number(*texts.terms, "--terms", 1));
  return options;
}

/// Throws Error(usage) for an organ, which other programs take.
void require_no_scene(const Json& document, const ExportTexts& texts) {
  if (!document.is_object() || !document.contains("organ")) return;
  throw Error(ExitCode::usage, "--to " + texts.to,
              fmt::format("exports a law, and {} is a scene", printable(texts.law)),
              fmt::format("for a scene --to {}", fmt::join(organ_targets(), " or ")));
}

int export_law_file(const ExportTexts& texts) {
  const ExportOptions options = options_of(texts);
  const Json document = read_json_of(texts.law, "law");
  require_no_scene(document, texts);
  const LawFile law = law_from_json(document, texts.law);
  const std::string text = export_law(law, options);
  for (const Remark& remark : export_remarks(law, options)) {
    tell_user("tpm: warning: {}\n", remark.text);
  }
  deliver(text, texts.output);
  return 0;
}

int export_scene(const ExportTexts& texts, OrganTarget target) {
  for (const auto* given : {&texts.radius, &texts.cone, &texts.punch, &texts.area, &texts.length,
                            &texts.poisson, &texts.from, &texts.until, &texts.terms}) {
    if (!*given && !texts.relaxation_only) continue;
    throw Error(ExitCode::usage, "--to " + texts.to, "exports a scene with an organ, not a law",
                "for a law --to abaqus, ansys, febio or json; for a scene no other option than "
                "--density and --instantaneous");
  }
  OrganExportOptions options;
  options.target = target;
  options.instantaneous = texts.instantaneous;
  options.source = std::filesystem::path(texts.law).filename().string();
  if (texts.density) {
    options.density_kg_m3 = option_number(*texts.density, "--density");
  }
  const Json scene = read_json(texts.law);
  const Tissue tissue =
      parse_tissue(scene, texts.law, std::filesystem::path(texts.law).parent_path());
  require_sound(tissue, texts.law);
  const std::string text = export_organ(tissue, options);
  for (const Remark& remark : organ_export_remarks(tissue, options)) {
    tell_user("tpm: warning: {} does not express {}\n", texts.to, remark.text);
  }
  deliver(text, texts.output);
  return 0;
}

}  // namespace

void add_export_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("export",
                         "Write a law for a finite element program, or an organ for a physics "
                         "engine");
  const auto texts = std::make_shared<ExportTexts>();
  command->add_option("LAW|SCENE", texts->law, "Law file (docs/laws.md), or an organ (JSON scene)")
      ->required();
  command
      ->add_option(
          "--to", texts->to,
          "Program to write for; of a law: abaqus, ansys, febio or json; of an organ: sofa or mjcf")
      ->check(one_of_words(all_targets()))
      ->required();
  command->add_option("--radius", texts->radius,
                      "Radius of the sphere that was pressed in, for moduli in Pa");
  command->add_option("--cone-angle", texts->cone,
                      "Angle between axis and surface of a cone, such as \"45 deg\"");
  command->add_option("--punch-radius", texts->punch, "Radius of a flat punch");
  command->add_option("--area", texts->area, "Cross section, of a bar");
  command->add_option("--length", texts->length, "Length of a bar");
  command->add_option("--poisson", texts->poisson, "Poisson's ratio (default 0.49)");
  command->add_option("--earliest", texts->from,
                      "Earliest time of a fractional law (default 0.01 s)");
  command->add_option("--latest", texts->until, "Latest time of a fractional law (default 100 s)");
  command->add_option("--terms", texts->terms,
                      "Relaxation times to choose from, for a fractional law");
  command->add_flag("--relaxation-only", texts->relaxation_only,
                    "Leave out a power kernel or tension, which the target cannot say");
  command->add_option("--density", texts->density,
                      "Density of the spheres of an organ, kg/m^3 (default 1060)");
  command->add_flag(
      "--instantaneous", texts->instantaneous,
      "Springs of the instantaneous stiffness without dampers, of an organ: for fast motions");
  command->add_option("-o,--output", texts->output, "File to write (default: the terminal)");
  command->footer(
      "Example:\n  tpm export law.json --to abaqus --radius \"2 mm\"\n"
      "  tpm export fractional.json --to febio --earliest \"0.1 s\" --latest \"30 s\"\n"
      "  tpm export on_liver/scene.json --to mjcf -o liver.xml");
  set_run(*command, session, [texts] {
    const auto engine = organ_target(texts->to);
    return engine ? export_scene(*texts, *engine) : export_law_file(*texts);
  });
}

}  // namespace tpm::app
