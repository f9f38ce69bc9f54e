#include "tpm/sweep/show/sweep_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::sweep {
namespace {

constexpr std::size_t kMostPlaces = 200;   ///< of a map along one axis
constexpr std::size_t kMostPoints = 2000;  ///< of a cloud
constexpr std::size_t kLines = 5;          ///< of a family

std::vector<double> in_shown_unit(std::vector<double> values, const Unit& unit) {
  for (double& v : values) v /= unit.to_si;
  return values;
}

/// At most so many numbers from 0 to count - 1, evenly, both ends among them.
std::vector<std::size_t> some_of(std::size_t count, std::size_t most) {
  std::vector<std::size_t> chosen;
  const std::size_t n = std::min(count, most);
  for (std::size_t i = 0; i < n; ++i) {
    chosen.push_back(n == 1 ? 0 : i * (count - 1) / (n - 1));
  }
  return chosen;
}

/// True for steps that grow: such an axis is drawn on a logarithmic scale.
bool even_in_logarithm(const std::vector<double>& places) {
  if (places.size() < 3 || !(places.front() > 0.0)) return false;
  const double first = places[1] / places[0];
  const double last = places.back() / places[places.size() - 2];
  return std::abs(first - last) < 1e-6 * first && std::abs(first - 1.0) > 1e-6;
}

struct FoundRange {
  double least = std::numeric_limits<double>::infinity();
  double largest = -std::numeric_limits<double>::infinity();
};

FoundRange range_of(const SweepReader& sweep, const std::string& name) {
  FoundRange range;
  sweep.each({name, "status"}, [&](const auto& found) {
    for (std::size_t i = 0; i < found[0].size(); ++i) {
      if (found[1][i] != 0.0 || std::isnan(found[0][i])) continue;
      range.least = std::min(range.least, found[0][i]);
      range.largest = std::max(range.largest, found[0][i]);
    }
  });
  return range;
}

/// The unit in which the largest of the values is read most easily.
Unit unit_of(const std::string& si_unit, const std::vector<double>& values) {
  double largest = 0.0;
  for (const double v : values) {
    if (std::isfinite(v)) largest = std::max(largest, std::abs(v));
  }
  return sized_unit(shown_unit_of(si_unit), largest);
}

/// The unit of all panels of a quantity.
Unit unit_of(const SweepReader& sweep, const ReadVariable& v) {
  if (!v.times_s.empty()) return unit_of(v.unit, sweep.curve(v.name, {}));
  const FoundRange range = range_of(sweep, v.name);
  return unit_of(v.unit, {range.least, range.largest});
}

/// "spacing x": a letter is told what it stands for; of a JSON pointer, its last key.
std::string printed_parameter(const SweepReader& sweep, const std::string& name) {
  const std::string target = sweep.parameter_target(name);
  const std::string key = target.substr(target.find_last_of("/.") + 1);
  return name.size() > 1 || key.size() < 2 ? printed(name)
                                           : fmt::format("{} {}", printed(key), name);
}

Axis axis_of(const SweepReader& sweep, const ReadAxis& axis) {
  const bool own = axis.parameters == std::vector{axis.name};
  return {own ? printed_parameter(sweep, axis.name) : printed(axis.name),
          unit_of(axis.unit, axis.places).symbol, even_in_logarithm(axis.places)};
}

/// Its own parameter's place, with the unit; else its number.
std::string place_words(const ReadAxis& axis, std::uint64_t place) {
  return fmt::format("{} = {}", printed(axis.name),
                     value_words(axis.places[place], unit_of(axis.unit, axis.places), 4));
}

std::string slice_words(const SweepReader& sweep, const std::vector<std::string>& free,
                        const FixedPlaces& fixed) {
  std::string words;
  for (const ReadAxis& axis : sweep.axes()) {
    if (std::find(free.begin(), free.end(), axis.name) != free.end()) continue;
    std::uint64_t place = 0;
    for (const auto& [name, at] : fixed) place = name == axis.name ? at : place;
    words += (words.empty() ? " At " : ", ") + place_words(axis, place);
  }
  return words.empty() ? words : words + ".";
}

/// A place on an axis that the figure draws as a whole says nothing.
void refuse_free(const std::vector<std::string>& free, const FixedPlaces& fixed,
                 const std::string& variable) {
  for (const auto& [name, place] : fixed) {
    if (std::find(free.begin(), free.end(), name) == free.end()) continue;
    throw Error(ExitCode::usage, "--at " + name,
                fmt::format("the figure of {} is drawn over that axis", variable),
                "a place on another axis, or other axes with --x and --y");
  }
}

/// Lines need numbers: a cell without one ends a line, and the next begins another of its label.
void add_lines(const std::string& label, const std::vector<double>& x, const std::vector<double>& y,
               std::vector<Series>& series) {
  std::vector<double> part_x, part_y;
  const auto finish = [&] {
    if (!part_x.empty()) series.push_back(line(label, part_x, part_y));
    part_x.clear();
    part_y.clear();
  };
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(y[i])) {
      finish();
      continue;
    }
    part_x.push_back(x[i]);
    part_y.push_back(y[i]);
  }
  finish();
}

Panel sweep_map(const SweepReader& sweep, const ReadVariable& v, const Unit& unit,
                const std::string& x, const std::string& y, const FixedPlaces& fixed) {
  const ReadAxis& across = sweep.axes()[sweep.axis(x)];
  const ReadAxis& up = sweep.axes()[sweep.axis(y)];
  const std::vector<double> all = sweep.slice(v.name, y, x, fixed);
  const auto columns = some_of(across.places.size(), kMostPlaces);
  const auto rows = some_of(up.places.size(), kMostPlaces);
  const Unit unit_x = unit_of(across.unit, across.places), unit_y = unit_of(up.unit, up.places);
  Series heat{.kind = Series::Kind::heat, .label = printed(v.name), .provenance = "model"};
  for (const std::size_t c : columns) heat.x.push_back(across.places[c] / unit_x.to_si);
  for (const std::size_t r : rows) {
    heat.y.push_back(up.places[r] / unit_y.to_si);
    for (const std::size_t c : columns) {
      heat.z.push_back(all[r * across.places.size() + c] / unit.to_si);
    }
  }
  return {named_in_unit(printed(v.name), unit),
          axis_of(sweep, across),
          axis_of(sweep, up),
          {std::move(heat)}};
}

Panel sweep_family(const SweepReader& sweep, const ReadVariable& v, const Unit& unit,
                   const std::string& x, const std::optional<std::string>& of,
                   const FixedPlaces& fixed) {
  const ReadAxis& across = sweep.axes()[sweep.axis(x)];
  const std::string name = printed(v.name);
  Panel panel{named_in_unit(name, unit), axis_of(sweep, across), {name, unit.symbol}};
  const std::vector<double> places =
      in_shown_unit(across.places, unit_of(across.unit, across.places));
  if (!of) {
    add_lines(name, places, in_shown_unit(sweep.slice(v.name, {}, x, fixed), unit), panel.series);
    return panel;
  }
  const ReadAxis& other = sweep.axes()[sweep.axis(*of)];
  for (const std::size_t place : some_of(other.places.size(), kLines)) {
    FixedPlaces here = fixed;
    here.emplace_back(*of, place);
    add_lines(place_words(other, place), places,
              in_shown_unit(sweep.slice(v.name, {}, x, here), unit), panel.series);
  }
  return panel;
}

Panel sweep_curves(const SweepReader& sweep, const ReadVariable& v, const Unit& unit,
                   const std::string& of, const FixedPlaces& fixed) {
  const ReadAxis& axis = sweep.axes()[sweep.axis(of)];
  const std::string quantity = printed(v.name);
  Panel panel{quantity, {"time", "s", even_in_logarithm(v.times_s)}, {quantity, unit.symbol}};
  for (const std::size_t place : some_of(axis.places.size(), kLines)) {
    FixedPlaces here = fixed;
    here.emplace_back(of, place);
    add_lines(place_words(axis, place), v.times_s, in_shown_unit(sweep.curve(v.name, here), unit),
              panel.series);
  }
  return panel;
}

/// The parameter's samples are spread evenly in its logarithm.
bool sampled_in_logarithm(const SweepReader& sweep, const ReadAxis& axis, const std::string& name) {
  const std::string target = sweep.parameter_target(name);
  const AxisKeys said = sweep.said_of(axis);
  return std::ranges::any_of(said.parameters, [&](const auto& one) {
    return one.first == target && one.second.scale == AxisScale::logarithmic;
  });
}

/// A number over each parameter of an axis of samples.
std::vector<Panel> sweep_clouds(const SweepReader& sweep, const ReadVariable& v, const Unit& unit,
                                const ReadAxis& axis, const FixedPlaces& fixed) {
  const std::string quantity = printed(v.name);
  const auto found = in_shown_unit(sweep.slice(v.name, {}, axis.name, fixed), unit);
  const auto chosen = some_of(found.size(), kMostPoints);
  std::vector<Panel> panels;
  for (const std::string& name : axis.parameters) {
    const std::vector<double> values = sweep.parameter(name);
    const Unit unit_x = unit_of(sweep.parameter_unit(name), values);
    Series cloud{.kind = Series::Kind::points, .label = quantity, .provenance = "model"};
    for (const std::size_t i : chosen) {
      if (!std::isfinite(found[i])) continue;
      cloud.add(values[i] / unit_x.to_si, found[i]);
    }
    panels.push_back(
        {printed(name),
         {printed_parameter(sweep, name), unit_x.symbol, sampled_in_logarithm(sweep, axis, name)},
         {quantity, unit.symbol}});
    if (!cloud.x.empty()) panels.back().series.push_back(std::move(cloud));
  }
  return panels;
}

Figure sweep_figure(const SweepReader& sweep, const ReadVariable& v, const SweepFigures& wished) {
  const auto& axes = sweep.axes();
  const auto is_fixed = [&](const std::string& name) {
    return std::ranges::any_of(wished.fixed, [&](const auto& h) { return h.first == name; });
  };
  std::string x = wished.x.value_or(axes.back().name);
  for (std::size_t a = axes.size(); a-- > 0 && !wished.x && is_fixed(x);) {
    if (!is_fixed(axes[a].name)) x = axes[a].name;
  }
  const ReadAxis& across = axes[sweep.axis(x)];
  std::optional<std::string> y = wished.y;
  for (std::size_t a = axes.size(); a-- > 0 && !y;) {
    if (axes[a].name != x && !is_fixed(axes[a].name)) y = axes[a].name;
  }
  const Unit unit = unit_of(sweep, v);
  Figure figure{v.name, printed(v.name), fmt::format("{}: {}.", sweep.title(), v.meaning)};
  std::vector<std::string> free{x};
  if (!v.times_s.empty()) {
    figure.panels.push_back(sweep_curves(sweep, v, unit, x, wished.fixed));
  } else if (across.parameters != std::vector{across.name}) {
    figure.panels = sweep_clouds(sweep, v, unit, across, wished.fixed);
  } else {
    if (y) {
      free.push_back(*y);
      figure.panels.push_back(sweep_map(sweep, v, unit, x, *y, wished.fixed));
    }
    figure.panels.push_back(sweep_family(sweep, v, unit, x, y, wished.fixed));
  }
  if (!v.times_s.empty() || across.parameters != std::vector{across.name}) free = {x};
  refuse_free(free, wished.fixed, v.name);
  const std::string slice = slice_words(sweep, free, wished.fixed);
  figure.caption += slice;
  figure.note = slice.empty() ? slice : slice.substr(1);
  return figure;
}

Figure pareto_figure(const SweepReader& sweep, const std::string& first,
                     const std::string& second) {
  std::vector<std::pair<double, double>> front;
  Series cloud{.kind = Series::Kind::points, .label = "cells", .provenance = "model"};
  const std::uint64_t stride = sweep.cells() / kMostPoints + 1;
  std::uint64_t cell = 0;
  const Unit unit_x = unit_of(sweep, sweep.variable(second)),
             unit_y = unit_of(sweep, sweep.variable(first));
  sweep.each({second, first, "status"}, [&](const auto& found) {
    for (std::size_t i = 0; i < found[0].size(); ++i, ++cell) {
      if (found[2][i] != 0.0) continue;
      front.emplace_back(found[0][i], found[1][i]);
      if (cell % stride != 0) continue;
      cloud.add(found[0][i] / unit_x.to_si, found[1][i] / unit_y.to_si);
    }
    front = pareto_front(std::move(front));  // what was seen so far needs no more
  });
  if (front.empty()) throw bad_input("sweep", "no cell is done", "cells to choose from");
  Series best = line("Pareto front", {}, {});
  for (const auto& [x, y] : front) {
    best.add(x / unit_x.to_si, y / unit_y.to_si);
  }
  Panel panel{"", {printed(second), unit_x.symbol}, {printed(first), unit_y.symbol}};
  if (!cloud.x.empty()) panel.series.push_back(std::move(cloud));
  Series ends = best;
  ends.kind = Series::Kind::points;
  ends.label = "best cells";
  panel.series.push_back(std::move(best));
  panel.series.push_back(std::move(ends));
  return {"pareto",
          fmt::format("{} against {}", printed(first), printed(second)),
          fmt::format("{} cells that no other betters in both.", front.size()),
          {std::move(panel)}};
}

}  // namespace

std::string printed(std::string name) {
  std::ranges::replace(name, '_', ' ');
  return name;
}

std::string named_in_unit(const std::string& name, const Unit& unit) {
  return unit.symbol.empty() ? name : fmt::format("{} [{}]", name, unit.symbol);
}

std::string value_words(double value, const Unit& unit, int digits) {
  return with_unit(significant(value / unit.to_si, digits), unit);
}

std::string fixed_words(const std::vector<FixedValue>& fixed, int digits) {
  std::string words;
  for (const FixedValue& h : fixed) {
    words += fmt::format("{} {} = {}", words.empty() ? " at" : ",", h.axis,
                         value_words(h.value, shown_unit_of(h.unit), digits));
  }
  return words;
}

Json fixed_json(const std::vector<FixedValue>& fixed) {
  return array_json(fixed, [](const FixedValue& h) {
    return Json{{"axis", h.axis}, {"value", h.value}, {"unit", h.unit}};
  });
}

Unit shown_unit_of(const std::string& si_unit) {
  if (si_unit.empty()) return {"", Dimension::dimensionless, 1.0};
  return shown_unit(parse_unit(si_unit, "unit").dimension);
}

std::vector<std::pair<double, double>> pareto_front(std::vector<std::pair<double, double>> pairs) {
  std::sort(pairs.begin(), pairs.end());
  std::vector<std::pair<double, double>> front;
  for (const auto& pair : pairs) {
    if (front.empty() || pair.second < front.back().second) front.push_back(pair);
  }
  return front;
}

std::string sweep_text(const SweepReader& sweep) {
  const CellTally tally = sweep.tally();
  std::string text = sweep.title().empty() ? "" : sweep.title() + "\n";
  text += fmt::format("{} cells: {} done, {} skipped, {} failed\n", sweep.cells(), tally.done,
                      tally.skipped, tally.failed);
  for (const std::string& reason : tally.reasons)
    text += fmt::format("- {}\n", printable(reason, 160));
  if (const auto models = sweep.models(); !models.empty()) {
    text += fmt::format("models: {}\n", sweep.choice_of_models());
    for (const auto& [name, cells] : models) {
      if (cells > 0) text += fmt::format("  {}: {} cells\n", name, cells);
    }
  }
  for (const ReadAxis& axis : sweep.axes()) {
    text += fmt::format("axis {}: {}", axis.name, axis.places.size());
    if (axis.parameters == std::vector{axis.name}) {
      text += fmt::format(" from {} to {}", place_words(axis, 0).substr(axis.name.size() + 3),
                          place_words(axis, axis.places.size() - 1).substr(axis.name.size() + 3));
    } else {
      for (const std::string& name : axis.parameters) {
        text += fmt::format("{}{}", name == axis.parameters.front() ? " of " : ", ", name);
      }
    }
    text += "\n";
  }
  for (const ReadVariable& v : sweep.variables()) {
    const Unit unit = shown_unit_of(v.unit);
    text += fmt::format("{}: ", named_in_unit(v.name, unit));
    if (!v.times_s.empty()) {
      text += fmt::format("curves at {} times", v.times_s.size());
    } else if (const FoundRange range = range_of(sweep, v.name); range.least <= range.largest) {
      text += fmt::format("{} to {}", significant(range.least / unit.to_si, 4),
                          significant(range.largest / unit.to_si, 4));
    } else {
      text += "nothing found";
    }
    text += fmt::format(" ({})\n", v.meaning);
  }
  return text;
}

Json sweep_json(const SweepReader& sweep) {
  const CellTally tally = sweep.tally();
  Json json{{"title", sweep.title()},   {"cells", sweep.cells()},    {"done", tally.done},
            {"skipped", tally.skipped}, {"failed", tally.failed},    {"reasons", tally.reasons},
            {"axes", Json::array()},    {"variables", Json::array()}};
  if (const auto models = sweep.models(); !models.empty()) {
    json["choice_of_models"] = sweep.choice_of_models();
    for (const auto& [name, cells] : models) json["models"][name] = cells;
  }
  for (const ReadAxis& axis : sweep.axes()) {
    json["axes"].push_back({{"name", axis.name},
                            {"unit", axis.unit},
                            {"size", axis.places.size()},
                            {"first", axis.places.front()},
                            {"last", axis.places.back()},
                            {"parameters", axis.parameters}});
  }
  for (const ReadVariable& v : sweep.variables()) {
    Json entry{{"name", v.name}, {"unit", v.unit}, {"meaning", v.meaning}};
    if (!v.times_s.empty()) {
      entry["times_s"] = v.times_s;
    } else if (const FoundRange range = range_of(sweep, v.name); range.least <= range.largest) {
      entry["least"] = range.least;
      entry["largest"] = range.largest;
    }
    json["variables"].push_back(std::move(entry));
  }
  return json;
}

std::vector<Figure> sweep_figures(const SweepReader& sweep, const SweepFigures& wished) {
  std::vector<Figure> figures;
  for (const ReadVariable& v : sweep.variables()) {
    const bool named = std::ranges::find(wished.variables, v.name) != wished.variables.end();
    if (named || (wished.variables.empty() && !v.counts)) {
      figures.push_back(sweep_figure(sweep, v, wished));
    }
  }
  for (const std::string& name : wished.variables) static_cast<void>(sweep.variable(name));
  if (wished.pareto) {
    figures.push_back(pareto_figure(sweep, wished.pareto->first, wished.pareto->second));
  }
  return figures;
}

}  // namespace tpm::sweep
