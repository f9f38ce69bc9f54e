// Declared in tpm/sweep/sweep.hpp.
// Reading SWEEP.json.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/sensitivity.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/expression/expression.hpp"
#include "tpm/sweep/sweep.hpp"
#include "tpm/sweep/sweep_keys.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

namespace tpm::sweep {
namespace {

/// "/material/E1" becomes "E1".
std::string usual_name(const std::string& target) {
  return target.substr(target.find_last_of("/.") + 1);
}

/// The points of an axis of samples.
struct SampledPoints {
  std::shared_ptr<const CubePoints> set;
  std::uint64_t count = 0;
};

SampledPoints points_of(const AxisKeys& axis, const DocumentPlace& place) {
  const auto dimensions = static_cast<int>(axis.parameters.size());
  const PointKind kind = axis.points;
  const std::uint64_t count = axis.count, seed = axis.seed;
  if (axis.replicates.has_value() != (kind == PointKind::sensitivity)) {
    throw bad_input(place.key("replicates").where, "belongs to samples of kind 'sensitivity'",
                    "a number of replicates there, and nowhere else");
  }
  constexpr std::uint64_t kMostSobol = std::uint64_t{1} << 32U;
  if ((kind == PointKind::sobol || kind == PointKind::plain_sobol) && count > kMostSobol) {
    throw bad_input(place.key("count").where, "more points than the sequence has", "at most 2^32");
  }
  try {
    switch (kind) {
      case PointKind::random:
        return {random_points(seed), count};
      case PointKind::latin_hypercube:
        return {latin_hypercube(count, seed), count};
      case PointKind::sobol:
        return {sobol_points(dimensions, seed), count};
      case PointKind::plain_sobol:
        return {plain_sobol_points(dimensions), count};
      case PointKind::sensitivity:
        break;
    }
    const SensitivityDesign design{dimensions, count, axis.replicates.value(), seed};
    return {sensitivity_points(design), design.cells()};
  } catch (const Error& error) {
    throw error.within(place.where);
  }
}

/// Puts axes and parameters together; every name once.
class AxisReader {
 public:
  AxisReader(Sweep& sweep, const DocumentPlace& place) : sweep_(sweep), place_(place) {}

  void read(const AxisKeys& axis) {
    const DocumentPlace here = place_.key(std::to_string(sweep_.axes.size()));
    switch (axis.kind) {
      case AxisKind::single:
        return single(axis, here);
      case AxisKind::together:
        return together(axis, here.key("together"), here);
      case AxisKind::samples:
        return sampled(axis, here.key("parameters"), here);
    }
  }

 private:
  /// One parameter, whose values are the coordinate.
  void single(const AxisKeys& axis, const DocumentPlace& here) {
    const Dimension dimension =
        sweep_.model->dimension_of(axis.parameter, here.key("parameter").where);
    CountedValues values = values_of(axis.values, dimension, here);
    const std::string name = name_or(axis.name, usual_name(axis.parameter));
    add_axis(name, values.count, here);
    add_parameter(name, axis.parameter, dimension, std::move(values.values), here);
  }

  /// Several parameters with a list each, which go on together.
  void together(const AxisKeys& axis, const DocumentPlace& lists, const DocumentPlace& here) {
    std::uint64_t count = 0;
    for (const auto& [target, said] : axis.parameters) {
      const DocumentPlace at = lists.key(target);
      const Dimension dimension = sweep_.model->dimension_of(target, at.where);
      CountedValues values = values_of(said, dimension, at);
      if (count != 0 && values.count != count) {
        throw bad_input(at.where, fmt::format("{} values beside {}", values.count, count),
                        "lists of one length");
      }
      if (count == 0) add_axis(name_or(axis.name, "case"), count = values.count, here);
      add_parameter(name_or(said.name, usual_name(target)), target, dimension,
                    std::move(values.values), at);
    }
  }

  /// Points in the box between the ends of several parameters.
  void sampled(const AxisKeys& axis, const DocumentPlace& ends, const DocumentPlace& here) {
    const SampledPoints points = points_of(axis, here);
    add_axis(name_or(axis.name, "sample"), points.count, here);
    int dimension_of_cube = 0;
    for (const auto& [target, said] : axis.parameters) {
      const DocumentPlace at = ends.key(target);
      const Dimension dimension = sweep_.model->dimension_of(target, at.where);
      const SweepRange range = range_of(said, dimension, at);
      add_parameter(
          name_or(said.name, usual_name(target)), target, dimension,
          ParameterValues::samples(range.from, range.to, range.scale,
                                   [set = points.set, d = dimension_of_cube++](
                                       std::uint64_t point) { return set->coordinate(point, d); }),
          at);
    }
  }

  static std::string name_or(const std::string& name, const std::string& otherwise) {
    return name.empty() ? otherwise : name;
  }

  void add_axis(const std::string& name, std::uint64_t size, const DocumentPlace& here) {
    take_name(name, here);
    sweep_.axes.push_back({name, size});
  }

  void add_parameter(const std::string& name, const std::string& target, Dimension dimension,
                     ParameterValues values, const DocumentPlace& here) {
    if (name != sweep_.axes.back().name) take_name(name, here);
    if (!targets_.insert(target).second) {
      throw bad_input(here.where, fmt::format("'{}' is swept twice", printable(target)),
                      "one axis for a parameter");
    }
    sweep_.parameters.push_back({name, target, std::string(si_symbol(dimension)),
                                 sweep_.axes.size() - 1, std::move(values)});
  }

  void take_name(const std::string& name, const DocumentPlace& here) {
    require_identifier(name, here.where);
    if (names_.insert(name).second) return;
    throw bad_input(here.where, fmt::format("the name '{}' is taken", name),
                    "a 'name' that nothing else has");
  }

  Sweep& sweep_;
  DocumentPlace place_;
  std::set<std::string> names_, targets_;
};

void add_formulas(const std::vector<SweepOutputKeys>& outputs, Sweep& sweep) {
  for (const SweepOutputKeys& output : outputs) {
    if (output.kind) continue;
    sweep.formulas.push_back({output.name, output.formula});
    sweep.variables.push_back({output.name, "", output.formula, {}});
  }
}

/// Names of axes, parameters and variables differ from everything else in the file of results.
/// Those of axes and parameters differ from each other already.
void require_own_names(const Sweep& sweep, const DocumentPlace& axes,
                       const DocumentPlace& outputs) {
  std::set<std::string> taken{"sweep",          "status", "reason", "reasons",
                              "error_estimate", "model",  "models"};
  for (const std::string& name : sweep.model->counted()) taken.insert("count_" + name);
  const auto take = [&](const std::string& name, const DocumentPlace& place) {
    if (taken.insert(name).second) return;
    throw bad_input(place.where, fmt::format("the name '{}' is taken", name),
                    "a name that nothing else has");
  };
  for (const SweepAxis& axis : sweep.axes) take(axis.name, axes);
  for (const SweptParameter& parameter : sweep.parameters) {
    if (parameter.name != sweep.axes[parameter.axis].name) take(parameter.name, axes);
  }
  for (const SweepVariable& variable : sweep.variables) {
    require_identifier(variable.name, outputs.where);
    take(variable.name, outputs);
    if (!variable.times_s.empty()) take(variable.name + "_time_s", outputs);
  }
}

/// Tries expressions with names that stand: a mistake is found before the first cell.
void require_expressions(const Sweep& sweep, const DocumentPlace& place) {
  Evaluator evaluator;
  Scope scope;
  for (const auto& [name, value] : sweep.model->constants()) scope.values[name] = value;
  for (const SweptParameter& p : sweep.parameters) scope.values[p.name] = p.values.at(0);
  const auto require_known = [&](const std::string& text, const std::string& where) {
    for (const std::string& name : evaluator.inputs(text, scope, where)) {
      if (scope.values.contains(name)) continue;
      const auto known =
          mapped<std::string>(scope.values, [](const auto& value) { return value.first; });
      throw bad_input(
          where, fmt::format("unknown symbol '{}'{}", printable(name), did_you_mean(name, known)),
          "a parameter, or a number found before");
    }
  };
  for (std::size_t i = 0; i < sweep.skip.size(); ++i) {
    require_known(sweep.skip[i].when, place.key("skip").key(std::to_string(i)).where);
  }
  for (const SweepVariable& v : sweep.model->variables()) {
    if (v.times_s.empty()) scope.values[v.name] = 1.0;
  }
  for (const SweepFormula& formula : sweep.formulas) {
    require_known(formula.text, place.key("outputs").key(formula.name).where);
    scope.values[formula.name] = 1.0;
  }
}

void read_axes(const std::vector<AxisKeys>& axes, Sweep& sweep, const DocumentPlace& place) {
  AxisReader reader(sweep, place);
  for (const AxisKeys& axis : axes) reader.read(axis);
  double cells = 1.0;
  for (const SweepAxis& axis : sweep.axes) cells *= static_cast<double>(axis.size);
  if (cells > kMostCells) {
    throw bad_input(place.where, fmt::format("{} cells", significant(cells, 3)),
                    fmt::format("at most {}", significant(kMostCells, 1)));
  }
}

std::string sha256_of_mesh(const Json& scene, const std::filesystem::path& folder) {
  const Json::json_pointer mesh("/organ/mesh");
  if (!scene.contains(mesh)) return {};
  return sha256_hex(read_file(folder / scene.at(mesh).get<std::string>()));
}

/// So many cells that their numbers fill some 1.5 MB.
std::uint64_t usual_block(const Sweep& sweep) {
  constexpr std::uint64_t kNumbers = 200'000;
  return std::clamp<std::uint64_t>(kNumbers / std::max<std::size_t>(sweep.width(), 1), 1,
                                   sweep.model->usual_block());
}

}  // namespace

std::uint64_t Sweep::cells() const {
  std::uint64_t cells = 1;
  for (const SweepAxis& axis : axes) cells *= axis.size;
  return cells;
}

std::vector<SweptTarget> Sweep::swept() const {
  constexpr std::uint64_t kLooked = 4096;  // evenly: what lies between changes a range little
  return mapped<SweptTarget>(parameters, [&](const SweptParameter& p) {
    SweptTarget target{p.target, p.axis, axes[p.axis].size, p.values.at(0), p.values.at(0)};
    const std::uint64_t step = (target.places + kLooked - 1) / kLooked;
    for (std::uint64_t i = 0; i < target.places; i += step) {
      target.least = std::min(target.least, p.values.at(i));
      target.largest = std::max(target.largest, p.values.at(i));
    }
    const double last = p.values.at(target.places - 1);
    target.least = std::min(target.least, last);
    target.largest = std::max(target.largest, last);
    return target;
  });
}

std::uint64_t Sweep::blocks() const {
  return (cells() + block_cells - 1) / block_cells;
}

std::vector<std::uint64_t> Sweep::places(std::uint64_t cell) const {
  std::vector<std::uint64_t> places(axes.size());
  for (std::size_t a = axes.size(); a-- > 0; cell /= axes[a].size) places[a] = cell % axes[a].size;
  return places;
}

std::size_t Sweep::width() const {
  std::size_t width = 0;
  for (const SweepVariable& variable : variables) width += variable.width();
  return width;
}

Sweep parse_sweep(const Json& written, std::string_view where,
                  const std::filesystem::path& folder) {
  Json document = checked(written, sweep_kind(), where);
  const DocumentPlace place{std::string(where)};
  SweepKeys keys = sweep_kinds().made(document, place);
  std::filesystem::path scene_folder = folder;
  if (keys.scene.is_string()) {  // the scene stands in the place of its file's name
    const std::filesystem::path file = folder / keys.scene.get<std::string>();
    document["scene"] = keys.scene = without_schema_key(read_json(file));
    scene_folder = file.parent_path();
  }
  Sweep sweep;
  sweep.title = keys.title;
  sweep.description = keys.description;
  sweep.model = keys.subject == SweepSubject::organ ? organ_sweep_model(keys, where, scene_folder)
                                                    : single_contact_model(keys, where);
  read_axes(keys.axes, sweep, place.key("axes"));
  sweep.variables = sweep.model->variables();
  add_formulas(keys.outputs, sweep);
  require_own_names(sweep, place.key("axes"), place.key("outputs"));
  sweep.skip = keys.skip;
  require_expressions(sweep, place);
  sweep.block_cells = keys.block.value_or(usual_block(sweep));
  try {
    static_cast<void>(sweep.model->cell_model(sweep.swept()));
  } catch (const Error& error) {
    throw error.within(where);
  }
  sweep.document = document.dump();
  const std::string mesh = sha256_of_mesh(keys.scene, scene_folder);
  sweep.fingerprint =
      sha256_hex(fmt::format("{}\n{}\n{}\n{}", version(), sweep.block_cells, sweep.document, mesh));
  return sweep;
}

Sweep read_sweep(const std::filesystem::path& path) {
  return parse_sweep(read_json(path), path.string(), path.parent_path());
}

}  // namespace tpm::sweep
