// tpm export: the relaxation of a law for finite element programs.
#include <memory>
#include <optional>

#include "command.hpp"
#include "tpm/core/units.hpp"
#include "tpm/law/law_export.hpp"

namespace tpm::app {
namespace {

struct ExportTexts {
  std::string law;
  std::string to;
  std::optional<std::string> radius, cone, punch, area, length, poisson, from, until, terms;
  std::string output;
  bool relaxation_only = false;
};

void set_quantity(std::optional<double>& target, const std::optional<std::string>& text,
                  Dimension dimension, std::string_view option) {
  if (text) target = parse_quantity(*text, dimension, option);
}

ExportOptions options_of(const ExportTexts& texts) {
  ExportOptions options;
  options.target = parse_export_target(texts.to, "--to");
  options.relaxation_only = texts.relaxation_only;
  ContactGeometry& geometry = options.geometry;
  set_quantity(geometry.sphere_radius_m, texts.radius, Dimension::length, "--radius");
  set_quantity(geometry.cone_half_angle_rad, texts.cone, Dimension::angle, "--cone-angle");
  set_quantity(geometry.punch_radius_m, texts.punch, Dimension::length, "--punch-radius");
  set_quantity(geometry.area_m2, texts.area, Dimension::area, "--area");
  set_quantity(geometry.length_m, texts.length, Dimension::length, "--length");
  if (texts.poisson) geometry.poisson_ratio = parse_number(*texts.poisson, "--poisson");
  PronyWindow& window = options.window;
  if (texts.from) window.from_s = parse_quantity(*texts.from, Dimension::time, "--from");
  if (texts.until) window.to_s = parse_quantity(*texts.until, Dimension::time, "--until");
  if (texts.terms) window.times = static_cast<int>(parse_whole_number(*texts.terms, "--terms", 1));
  return options;
}

}  // namespace

void add_export_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("export", "Write the relaxation of a law for a finite element program");
  const auto texts = std::make_shared<ExportTexts>();
  command->add_option("law", texts->law, "Law file (docs/laws.md)")->required();
  command->add_option("--to", texts->to, "abaqus, ansys, febio or json")->required();
  command->add_option("--radius", texts->radius, "Sphere that was pressed in, for moduli in Pa");
  command->add_option("--cone-angle", texts->cone,
                      "Or cone: angle between its axis and its surface, such as \"45 deg\"");
  command->add_option("--punch-radius", texts->punch, "Or flat punch");
  command->add_option("--area", texts->area, "Or cross section of a bar");
  command->add_option("--length", texts->length, "and its length");
  command->add_option("--poisson", texts->poisson, "Poisson's ratio (0.49)");
  command->add_option("--from", texts->from, "Fractional laws: earliest time (0.01 s)");
  command->add_option("--until", texts->until, "Fractional laws: latest time (100 s)");
  command->add_option("--terms", texts->terms, "Fractional laws: relaxation times to choose from");
  command->add_flag("--relaxation-only", texts->relaxation_only,
                    "Leave out a power kernel or tension, which the target cannot say");
  command->add_option("-o,--output", texts->output, "Write here instead of to the terminal");
  command->footer(
      "Example:\n  tpm export law.json --to abaqus --radius \"2 mm\"\n"
      "  tpm export fractional.json --to febio --from \"0.1 s\" --until \"30 s\"");
  command->callback([texts, &session] {
    session.run = [texts] {
      const LawFile law = read_law(texts->law);
      const ExportOptions options = options_of(*texts);
      const std::string text = export_law(law, options);
      for (const std::string& warning : export_warnings(law, options)) {
        tell_user("tpm: warning: {}\n", warning);
      }
      deliver(text, texts->output);
      return 0;
    };
  });
}

}  // namespace tpm::app
