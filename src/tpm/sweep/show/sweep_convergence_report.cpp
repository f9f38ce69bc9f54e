#include "tpm/sweep/show/sweep_convergence_report.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/base/lists.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/sweep/show/sweep_report.hpp"

namespace tpm::sweep {
namespace {

using Behaviour = GridConvergence::Behaviour;

/// The index of the finest size in parts of the extrapolated value.
double relative_index(const GridConvergence& g) {
  return g.index / std::abs(g.extrapolated);
}

std::string percent_of(double share) {
  return std::isfinite(share) ? significant(100.0 * share, 3) + " %" : "-";
}

std::string verdict(const SweepConvergence& c) {
  const GridConvergence& finest = c.threes.back();
  const Unit unit = shown_unit_of(c.unit);
  switch (finest.behaviour) {
    case Behaviour::exact:
      return "the finest three agree to rounding: nothing is left to converge";
    case Behaviour::diverging:
      return "no convergence: the last change is not smaller than the one before; there is no "
             "order and no limit";
    case Behaviour::oscillating:
      return fmt::format(
          "no monotone convergence: the finest three turn back, so there is no order and no "
          "extrapolated value; the last change is {}",
          percent_of(std::abs(c.value.back() - c.value[c.value.size() - 2]) /
                     std::abs(c.value.back())));
    case Behaviour::monotone:
      break;
  }
  std::string text = fmt::format(
      "order {}; extrapolated {}; the finest value is uncertain by {} (grid convergence index)",
      significant(finest.order, 3), value_words(finest.extrapolated, unit, 5),
      percent_of(relative_index(finest)));
  if (c.threes.size() == 1) return text + "; one set of three says nothing about that order";
  const GridConvergence& before = c.threes[c.threes.size() - 2];
  if (before.behaviour != Behaviour::monotone) {
    return text + "; the three before are not monotone, so the order is not to be trusted";
  }
  return text + fmt::format("; by the three before order {}, extrapolated {}",
                            significant(before.order, 3),
                            significant(before.extrapolated / unit.to_si, 5));
}

Figure convergence_figure(const SweepConvergence& c, const std::string& title) {
  const Unit unit = sized_unit(shown_unit_of(c.unit), c.value.back()),
             unit_size = sized_unit(shown_unit_of(c.size_unit), c.size.front());
  const std::string name = printed(c.variable), size_name = printed(c.size_text);
  const GridConvergence& finest = c.threes.back();
  Figure figure{figure_id("convergence", c.variable), name,
                fmt::format("{}: {} over {}{}: {}.", title, name, size_name,
                            fixed_words(c.fixed, 5), verdict(c))};
  const Axis size_axis{size_name, unit_size.symbol, true};
  Series cells = line("model", {}, {});
  for (std::size_t i = 0; i < c.size.size(); ++i) {
    cells.add(c.size[i] / unit_size.to_si, c.value[i] / unit.to_si);
  }
  Series dots = cells;
  dots.kind = Series::Kind::points;
  dots.label = "sizes";
  dots.provenance = "model";
  Panel values{"", size_axis, {name, unit.symbol}, {cells, std::move(dots)}};
  if (!c.monotone()) {
    figure.panels.push_back(std::move(values));
    return figure;
  }
  const double limit = finest.extrapolated / unit.to_si;
  values.series.push_back(line("extrapolated", {cells.x.front(), cells.x.back()}, {limit, limit}));
  figure.panels.push_back(std::move(values));
  Series away = line("model", {}, {}), slope = line("", {}, {});
  slope.label = fmt::format("order {}", significant(finest.order, 3));
  const double last = std::abs(c.value.back() - finest.extrapolated);
  for (std::size_t i = 0; i < c.size.size(); ++i) {
    const double distance = std::abs(c.value[i] - finest.extrapolated);
    if (!(distance > 0.0)) continue;
    away.add(c.size[i] / unit_size.to_si, distance / unit.to_si);
    slope.add(c.size[i] / unit_size.to_si,
              last * std::pow(c.size[i] / c.size.back(), finest.order) / unit.to_si);
  }
  Panel distances{"",
                  size_axis,
                  {fmt::format("distance of {} from the extrapolated", name), unit.symbol, true},
                  {std::move(away), std::move(slope)}};
  figure.panels.push_back(std::move(distances));
  return figure;
}

}  // namespace

std::string convergence_text(const std::vector<SweepConvergence>& all) {
  std::string text;
  for (const SweepConvergence& c : all) {
    const Unit unit = shown_unit_of(c.unit), unit_size = shown_unit_of(c.size_unit);
    text += fmt::format("{}{} over axis {}", text.empty() ? "" : "\n",
                        named_in_unit(c.variable, unit), c.axis);
    text += fixed_words(c.fixed, 5);
    if (c.left_out > 0) text += fmt::format(", {} places without a number left out", c.left_out);
    text += fmt::format("\n{:>20} {:>14} {:>12} {:>8} {:>14} {:>10}\n",
                        named_in_unit(c.size_text, unit_size), "value", "behaviour", "order",
                        "extrapolated", "index");
    for (std::size_t i = 0; i < c.size.size(); ++i) {
      text += fmt::format("{:>20} {:>14}", significant(c.size[i] / unit_size.to_si, 5),
                          significant(c.value[i] / unit.to_si, 8));
      if (i >= 2) {
        const GridConvergence& g = c.threes[i - 2];
        const bool limit = g.behaviour == Behaviour::monotone;
        text += fmt::format(" {:>12} {:>8} {:>14} {:>10}", to_string(g.behaviour),
                            limit ? significant(g.order, 3) : "-",
                            limit ? significant(g.extrapolated / unit.to_si, 8) : "-",
                            limit ? percent_of(relative_index(g)) : "-");
      }
      text += "\n";
    }
    text += verdict(c) + "\n";
  }
  return text;
}

ShortAnswer short_answer(const std::vector<SweepConvergence>& all, const std::string& title) {
  ShortAnswer answer;
  if (!title.empty()) answer.conclusion.push_back(title);
  if (all.size() == 1) {
    std::vector<std::string> lines = separate_lines(convergence_text(all));
    answer.conclusion.push_back(std::move(lines.back()));  // the verdict
    lines.pop_back();
    answer.head.assign(lines.begin(), lines.begin() + 2);  // what over which axis, columns
    answer.rows.assign(lines.begin() + 2, lines.end());
    return answer;
  }
  for (const SweepConvergence& c : all) {
    answer.rows.push_back(fmt::format("{} over {}{}: {}", c.variable, c.size_text,
                                      fixed_words(c.fixed, 5), verdict(c)));
  }
  return answer;
}

Json convergence_json(const std::vector<SweepConvergence>& all) {
  Json list = array_json(all, [](const SweepConvergence& c) {
    Json threes = Json::array();
    for (std::size_t k = 0; k < c.threes.size(); ++k) {
      const GridConvergence& g = c.threes[k];
      const bool limit = g.behaviour == Behaviour::monotone;
      Json entry{{"finest_size", c.size[k + 2]}, {"behaviour", to_string(g.behaviour)}};
      entry["order"] = limit ? Json(rounded(g.order)) : Json();
      entry["extrapolated"] = limit ? Json(rounded(g.extrapolated, 12)) : Json();
      entry["index"] = limit ? Json(rounded(g.index)) : Json();
      threes.push_back(std::move(entry));
    }
    return Json{{"variable", c.variable},   {"unit", c.unit},
                {"axis", c.axis},           {"fixed", fixed_json(c.fixed)},
                {"size_is", c.size_text},   {"size", c.size},
                {"value", c.value},         {"places_left_out", c.left_out},
                {"monotone", c.monotone()}, {"threes", std::move(threes)}};
  });
  return Json{{"convergence", std::move(list)}};
}

std::vector<Figure> convergence_figures(const std::vector<SweepConvergence>& all,
                                        const std::string& title) {
  return mapped<Figure>(all,
                        [&](const SweepConvergence& c) { return convergence_figure(c, title); });
}

}  // namespace tpm::sweep
