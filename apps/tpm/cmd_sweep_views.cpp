// tpm sweep show, plot, sensitivity, convergence, best: what a file of results says.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/fit/likelihood/fit_keys.hpp"
#include "tpm/show/draw.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpm/sweep/best_cells.hpp"
#include "tpm/sweep/show/sweep_convergence_report.hpp"
#include "tpm/sweep/show/sweep_report.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace fs = std::filesystem;
namespace {

struct SweepViewChoice {
  std::string file, folder = "sweep_figures", x, y, pareto;
  std::string axis, size, figure_folder;
  std::string best_output, count = "1", over, fit, start;
  std::vector<std::string> variables, at;
  bool verbose = false;
};

int show(const SweepViewChoice& choice, const Session& session) {
  const SweepReader sweep(choice.file);
  const std::string next =
      sweep.tally().done > 0 ? "tpm sweep plot " + shell_word(choice.file) : std::string();
  Json json = sweep_json(sweep);
  add_end(json, {}, {}, next);
  say("{}",
      session.json() ? answer_text(session, std::move(json)) : sweep_text(sweep) + next_line(next));
  return 0;
}

/// "rate=4 mm/s": the nearest place on that axis; one that is not the wished one is told.
std::pair<std::string, std::uint64_t> parse_fixed(const std::string& text,
                                                  const SweepReader& sweep) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) {
    throw Error(ExitCode::usage, "--at", fmt::format("'{}'", printable(text)), "AXIS=VALUE");
  }
  const std::string name = text.substr(0, equals);
  const ReadAxis& axis = sweep.axes()[sweep.axis(name)];
  const Dimension dimension =
      axis.unit.empty() ? Dimension::dimensionless : parse_unit(axis.unit, "--at").dimension;
  const double wished = option_quantity(text.substr(equals + 1), dimension, "--at " + name);
  const auto [least, largest] = std::minmax_element(axis.places.begin(), axis.places.end());
  constexpr double kRounding = 1e-9;
  const double slack = kRounding * std::max(std::abs(*least), std::abs(*largest));
  if (!(wished >= *least - slack && wished <= *largest + slack)) {
    throw Error(ExitCode::usage, "--at " + name, fmt::format("{} {}", shortest(wished), axis.unit),
                fmt::format("{} to {} {}", shortest(*least), shortest(*largest), axis.unit));
  }
  const auto nearest = std::ranges::min_element(
      axis.places, [&](double a, double b) { return std::abs(a - wished) < std::abs(b - wished); });
  if (std::abs(*nearest - wished) > slack) {
    tell_user("tpm: --at {}: {} {} lies between places of that axis; {} {} is taken\n", name,
              shortest(wished), axis.unit, shortest(*nearest), axis.unit);
  }
  return {name, static_cast<std::uint64_t>(nearest - axis.places.begin())};
}

/// Prints an answer; pictures beside it, if a folder was named, else the command that draws them.
/// @param all results with `short_answer`
/// @param text everything, for --verbose
template <class Results>
void say_and_draw(const SweepViewChoice& choice, const std::vector<Results>& all,
                  const std::vector<Figure>& figures, Json json, std::string text,
                  const std::string& title, const std::vector<Verdict>& verdicts,
                  const Session& session) {
  const std::string& folder = choice.figure_folder;
  std::vector<std::string> files;
  if (!folder.empty()) files = write_figures(folder, figures);
  const std::string next =
      folder.empty() ? same_command(session, "--folder figures") : next_of_pictures(folder);
  if (session.json()) {
    add_end(json, folder, files, next);
    say("{}", answer_text(session, std::move(json), verdicts));
    return;
  }
  if (choice.verbose) {
    if (!files.empty()) text += written(session, folder, files);
    say("{}{}", text, next_line(next));
    return;
  }
  ShortAnswer answer = short_answer(all, title);
  end_answer(answer, folder, files, next);
  say("{}", to_text(answer));
}

int sensitivity(const SweepViewChoice& choice, const Session& session) {
  will_write_into(choice.figure_folder, {"figures.json"});
  const SweepReader sweep(choice.file);
  FixedPlaces fixed;
  for (const std::string& text : choice.at) fixed.push_back(parse_fixed(text, sweep));
  std::vector<SweepSensitivity> all;
  for (const ReadVariable& v : sweep.variables()) {
    const bool wished = choice.variables.empty() ? v.times_s.empty() && !v.counts
                                                 : std::ranges::count(choice.variables, v.name) > 0;
    if (wished) all.push_back(sensitivity_of(sweep, v.name, fixed));
  }
  for (const std::string& name : choice.variables) static_cast<void>(sweep.variable(name));
  say_and_draw(choice, all, sensitivity_figures(all, sweep.title()), sensitivity_json(all),
               sensitivity_text(all), sweep.title(), {}, session);
  return 0;
}

int convergence(const SweepViewChoice& choice, const Session& session) {
  will_write_into(choice.figure_folder, {"figures.json"});
  const SweepReader sweep(choice.file);
  FixedPlaces fixed;
  for (const std::string& text : choice.at) fixed.push_back(parse_fixed(text, sweep));
  std::optional<std::string> axis;
  if (!choice.axis.empty()) axis = choice.axis;
  std::vector<std::string> names = choice.variables;
  for (const ReadVariable& v : sweep.variables()) {
    if (!choice.variables.empty() || !v.times_s.empty() || v.counts) continue;
    names.push_back(v.name);
  }
  const auto all = mapped<SweepConvergence>(names, [&](const std::string& name) {
    return convergence_of(sweep, name, axis, choice.size, fixed);
  });
  const bool monotone = std::ranges::any_of(all, &SweepConvergence::monotone);
  say_and_draw(choice, all, convergence_figures(all, sweep.title()), convergence_json(all),
               convergence_text(all), sweep.title(), {{"monotone", monotone}}, session);
  return exit_code(monotone);
}

/// Paths in a configuration of tpm fit are relative to it: they are kept when it is moved.
void move_scene(Json& fit, const fs::path& from, const fs::path& to) {
  if (!fit.contains("scene") || !fit.at("scene").is_string()) return;
  const fs::path scene = from.parent_path() / fit.at("scene").get<std::string>();
  const fs::path folder = to.has_parent_path() ? to.parent_path() : fs::path(".");
  fit["scene"] = fs::proximate(fs::absolute(scene), fs::absolute(folder)).string();
}

int best(const SweepViewChoice& choice, const Session& session) {
  will_write({choice.start});
  const SweepReader sweep(choice.file);
  std::optional<std::string> over;
  if (!choice.over.empty()) over = choice.over;
  const auto count = parse_whole_number(choice.count, "--top", 1);
  const auto cells = best_cells(sweep, choice.best_output, count, over);
  if (choice.fit.empty() != choice.start.empty()) {
    throw Error(ExitCode::usage, "--configuration", "alone",
                "--configuration FIT.json with --write-configuration START.json");
  }
  if (!choice.fit.empty()) {
    Json fit = checked(read_json(choice.fit), fit_kind(), choice.fit);
    fit = fit_from_cell(std::move(fit), cells.front(), choice.fit);
    move_scene(fit, choice.fit, choice.start);
    write_file(choice.start, to_text(fit));
  }
  std::vector<std::string> files;
  std::string next;
  if (!choice.start.empty()) {
    files = {choice.start};
    next = "tpm fit " + shell_word(choice.start);
  }
  if (session.json()) {
    Json list = array_json(cells, [&](const BestCell& cell) {
      Json parameters;
      for (const CellParameter& p : cell.parameters) {
        parameters[p.name] = {{"target", p.target}, {"unit", p.unit}, {"value", p.value}};
      }
      return Json{{"places", cell.places},
                  {choice.best_output, cell.value},
                  {"parameters", std::move(parameters)}};
    });
    Json json{{"best", std::move(list)}};
    add_end(json, {}, files, next);
    say("{}", answer_text(session, std::move(json)));
    return 0;
  }
  for (const BestCell& cell : cells) {
    say("{} = {}:", choice.best_output, significant(cell.value, 6));
    for (const CellParameter& p : cell.parameters) {
      say(" {} = {}", p.name, value_words(p.value, shown_unit_of(p.unit), 6));
    }
    say("\n");
  }
  if (!files.empty()) say("wrote {}\n{}", files.front(), next_line(next));
  return 0;
}

int plot(const SweepViewChoice& choice, const Session& session) {
  will_write_into(choice.folder, {"figures.json"}, session.folder_naming());
  const SweepReader sweep(choice.file);
  SweepFigures wished;
  wished.variables = choice.variables;
  if (!choice.x.empty()) wished.x = choice.x;
  if (!choice.y.empty()) wished.y = choice.y;
  for (const std::string& text : choice.at) wished.fixed.push_back(parse_fixed(text, sweep));
  if (!choice.pareto.empty()) {
    const std::size_t comma = choice.pareto.find(',');
    if (comma == std::string::npos) {
      throw Error(ExitCode::usage, "--pareto", fmt::format("'{}'", printable(choice.pareto)),
                  "MISFIT,COST: two variables");
    }
    wished.pareto = {choice.pareto.substr(0, comma), choice.pareto.substr(comma + 1)};
  }
  const auto files = write_figures(choice.folder, sweep_figures(sweep, wished));
  say("wrote {} into {}\n{}", fmt::join(files, ", "), choice.folder,
      next_line(next_of_pictures(choice.folder)));
  return 0;
}

void add_file(CLI::App& command, SweepViewChoice& choice) {
  command.add_option("FILE", choice.file, "HDF5 file of tpm sweep")->required();
}

void add_variables(CLI::App& command, SweepViewChoice& choice) {
  command.add_option("--variable", choice.variables,
                     "Quantity of the sweep (default: all numbers but counts)");
}

}  // namespace

void add_sweep_views(CLI::App& sweep, Session& session) {
  auto choice = std::make_shared<SweepViewChoice>();
  CLI::App* showing = sweep.add_subcommand("show", "What a file of results holds");
  add_file(*showing, *choice);
  add_format_option(*showing, session);
  showing->footer("Example:\n  tpm sweep show sweep.h5");
  set_run(*showing, session, [choice, &session] { return show(*choice, session); });
  CLI::App* command = sweep.add_subcommand("sensitivity", "Sobol indices with their intervals");
  add_file(*command, *choice);
  add_variables(*command, *choice);
  command->add_option("--at", choice->at, "Place on an axis, AXIS=VALUE: beside the samples");
  add_folder_option(*command, choice->figure_folder, ": figures (SVG, PNG)");
  add_verbose_option(*command, choice->verbose, "both indices of every parameter");
  add_force_option(*command, session);
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm sweep configs/sweep_sensitivity.json -o samples.h5\n"
      "  tpm sweep sensitivity samples.h5");
  set_run(*command, session, [choice, &session] { return sensitivity(*choice, session); });
  CLI::App* refining = sweep.add_subcommand(
      "convergence", "Order, extrapolated value and grid convergence index along an axis");
  add_file(*refining, *choice);
  refining->add_option("--axis", choice->axis, "Axis of ever finer places (default: the last)");
  refining->add_option(
      "--size", choice->size,
      "Formula of the size, such as 'count^(-1/3)' (default: the axis' parameter)");
  add_variables(*refining, *choice);
  refining->add_option("--at", choice->at, "Place on an axis, AXIS=VALUE: another than --axis");
  add_folder_option(*refining, choice->figure_folder, ": figures (SVG, PNG)");
  add_verbose_option(*refining, choice->verbose, "every size, with its order and limit");
  add_force_option(*refining, session);
  add_format_option(*refining, session);
  refining->footer(
      "Example:\n  tpm sweep configs/sweep_convergence_spheres.json -o spheres.h5\n"
      "  tpm sweep convergence spheres.h5 --size 'count^(-1/3)'");
  set_run(*refining, session, [choice, &session] { return convergence(*choice, session); });
  CLI::App* choosing = sweep.add_subcommand("best", "The cells with the least value of an output");
  add_file(*choosing, *choice);
  choosing
      ->add_option("--objective", choice->best_output,
                   "Quantity that is to be smallest, such as a misfit")
      ->required();
  choosing->add_option("--top", choice->count, "How many to list: cells")->capture_default_str();
  choosing->add_option("--over", choice->over, "Axis that the output is summed over");
  choosing->add_option("--configuration", choice->fit,
                       "Configuration of tpm fit to be started there");
  choosing->add_option("--write-configuration", choice->start,
                       "File for the configuration with these starts");
  add_format_option(*choosing, session);
  choosing->footer(
      "Example:\n  tpm sweep configs/sweep_misfit_organ.json -o organ.h5\n"
      "  tpm sweep best organ.h5 --objective misfit --over indentation");
  set_run(*choosing, session, [choice, &session] { return best(*choice, session); });
  CLI::App* plotting = sweep.add_subcommand("plot", "Maps, families of lines, Pareto fronts");
  add_file(*plotting, *choice);
  add_folder_option(*plotting, choice->folder, ": figures (SVG, PNG)")->capture_default_str();
  plotting->add_option("--variable", choice->variables,
                       "Quantity of the sweep (default: all but counts)");
  plotting->add_option("--x", choice->x, "Axis drawn across (default: the last)");
  plotting->add_option("--y", choice->y, "Axis drawn upwards, and of families");
  plotting->add_option("--at", choice->at, "Place on an axis, AXIS=VALUE: that is not drawn");
  plotting->add_option("--pareto", choice->pareto,
                       "Draw the cells that no other improves in two variables: MISFIT,COST");
  plotting->footer(
      "Example:\n  tpm sweep configs/sweep_x_depth.json -o sweep.h5\n"
      "  tpm sweep plot sweep.h5 --folder figures");
  set_run(*plotting, session, [choice, &session] { return plot(*choice, session); });
}

}  // namespace tpm::app
