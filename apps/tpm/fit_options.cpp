#include "fit_options.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "answer.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/select/fixed_times.hpp"
#include "tpm/fit/show/fit_csv.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {

std::optional<ContactGeometry> probe_of(const FitOptions& options) {
  ContactGeometry probe;
  const auto set = [](std::optional<double>& size, const std::string& text, Dimension dimension,
                      const char* option) {
    if (!text.empty()) size = option_quantity(text, dimension, option);
  };
  set(probe.sphere_radius_m, options.radius, Dimension::length, "--radius");
  set(probe.cone_half_angle_rad, options.cone_angle, Dimension::angle, "--cone-angle");
  set(probe.punch_radius_m, options.punch_radius, Dimension::length, "--punch-radius");
  if (!options.poisson.empty()) probe.poisson_ratio = option_number(options.poisson, "--poisson");
  if (probe.is_given()) {
    of_option([&] { return modulus_Pa(LawSpec{}, 1.0, probe); });  // refuses what cannot be
    return probe;
  }
  if (options.poisson.empty()) return std::nullopt;
  throw Error(ExitCode::usage, "--poisson", "without a probe",
              "--radius, --cone-angle or --punch-radius");
}

std::optional<LawSpec> only_law(const SelectionOptions& selection) {
  return selection.laws.size() == 1 ? std::optional(selection.laws.front()) : std::nullopt;
}

SelectionOptions selection_options(const FitOptions& options) {
  SelectionOptions selection;
  if (!options.laws.empty()) selection.laws = chosen_laws(options.laws, {});
  selection.only_listed = !options.laws.empty();
  if (!options.margin.empty()) selection.margin = option_number(options.margin, "--margin");
  selection.held_out = !options.no_held_out;
  selection.setup.profiles = !options.no_profiles;
  if (!options.times.empty()) {
    if (options.laws.size() > 1) {
      throw Error(ExitCode::usage, "--times", fmt::format("with {} laws", options.laws.size()),
                  "one law at most");
    }
    selection.setup.times_s = parse_times(options.times, "--times");
    selection.laws = {
        law_of_times(selection.laws.empty() ? std::nullopt : std::optional(selection.laws.front()),
                     selection.setup.times_s, "--times")};
    selection.only_listed = true;
  }
  if (const auto probe = probe_of(options)) {
    selection.setup.exponent = probe_exponent(*probe);
    if (selection.laws.empty()) {
      selection.laws = laws_of_probe(chosen_laws({}, options.family), *probe);
    }
  }
  if (selection.laws.empty() && !options.family.empty()) {
    selection.laws = chosen_laws({}, options.family);
  }
  if (!options.starts.empty()) {
    selection.setup.starts = parse_whole_number(options.starts, "--starts", 1);
  }
  if (!options.seed.empty()) selection.setup.seed = parse_whole_number(options.seed, "--seed", 0);
  return selection;
}

void set_reference(const FitOptions& options, const std::vector<PreparedRecording>& recordings,
                   SelectionOptions& selection) {
  if (options.reference.empty()) return;
  const Dimension drive = quantity_dimension(law_drive(recordings.front().recording));
  selection.setup.reference = option_quantity(options.reference, drive, "--reference");
  if (*selection.setup.reference > 0.0) return;
  throw Error(ExitCode::usage, "--reference", fmt::format("'{}'", printable(options.reference)),
              "a depth above 0, such as \"4 mm\"");
}

void require_indentation(const FitOptions& options,
                         const std::vector<PreparedRecording>& recordings) {
  if (!probe_of(options)) return;
  for (const PreparedRecording& r : recordings) {
    if (r.recording.drive_quantity == Quantity::indentation_depth) continue;
    throw Error(ExitCode::usage, "--radius, --cone-angle, --punch-radius",
                fmt::format("'{}' is no indentation", printable(r.name)),
                "them with a contact force over an indentation depth");
  }
}

std::string figure_folder(const FitOptions& options, const std::string& input) {
  if (!options.folder.empty()) return options.folder;
  std::filesystem::path path = std::filesystem::absolute(input).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  return path.stem().string() + "_fit";
}

void announce_figures(const FitOptions& options, const std::string& input,
                      std::initializer_list<const char*> names) {
  if (options.no_draw) return;
  will_write_into(figure_folder(options, input), names,
                  options.folder.empty() ? Naming::by_default : Naming::folder);
}

void write_moduli(const std::filesystem::path& folder, const std::optional<YoungModuli>& moduli,
                  std::vector<std::string>& files) {
  if (!moduli) return;
  write_file(folder / "young_moduli.json", to_text(to_json(*moduli)));
  write_file(folder / "young_moduli.csv", moduli_csv(*moduli));
  files.insert(files.end(), {"young_moduli.json", "young_moduli.csv"});
}

void append_moduli(Json& json, std::string& text, const std::optional<YoungModuli>& moduli) {
  if (!moduli) return;
  json["young_moduli"] = to_json(*moduli);
  text += "\n" + to_terminal_text(*moduli);
}

std::string answer_with_files(const FitOptions& options, const Session& session, Json json,
                              std::string text, ShortAnswer answer, const std::string& folder,
                              const std::vector<std::string>& files, const std::string& next) {
  if (session.json()) {
    add_end(json, folder, files, next);
    return answer_text(session, std::move(json));
  }
  if (options.verbose) return files.empty() ? text : text + written(session, folder, files);
  end_answer(answer, folder, files, next);
  return to_text(answer);
}

std::string next_of_figures(const std::string& folder) {
  return fmt::format("tpm view {}",
                     shell_word((std::filesystem::path(folder) / "figures.json").string()));
}

}  // namespace tpm::app
