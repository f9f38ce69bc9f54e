#include "tpm/sweep/best_cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/text.hpp"
#include "tpm/files/document_place.hpp"
#include "tpmkit/error.hpp"

namespace tpm::sweep {
namespace {

/// Numbers of all cells, the axis that is summed over taken out.
std::vector<double> summed_values(const SweepReader& sweep, const std::string& output,
                                  std::optional<std::size_t> over) {
  std::uint64_t inside = 1, along = 1;
  if (over) {
    along = sweep.axes()[*over].places.size();
    for (std::size_t a = *over + 1; a < sweep.axes().size(); ++a) {
      inside *= sweep.axes()[a].places.size();
    }
  }
  std::vector<double> sums(sweep.cells() / along, 0.0);
  std::uint64_t cell = 0;
  sweep.each({output, "status"}, [&](const auto& found) {
    for (std::size_t i = 0; i < found[0].size(); ++i, ++cell) {
      const std::uint64_t place = cell / (inside * along) * inside + cell % inside;
      const bool done = found[1][i] == 0.0 && std::isfinite(found[0][i]);
      sums[place] += done ? found[0][i] : std::numeric_limits<double>::infinity();
    }
  });
  return sums;
}

/// The cell's value of a parameter that sets several of the model's.
std::optional<CellParameter> found_in_cell(const BestCell& cell,
                                           const std::vector<std::string>& sets,
                                           const DocumentPlace& place) {
  constexpr double kSame = 1e-9;
  std::optional<CellParameter> found;
  for (const CellParameter& p : cell.parameters) {
    const std::string word = p.target.substr(p.target.rfind('/') + 1);
    if (std::ranges::find(sets, word) == sets.end()) continue;
    if (found && std::abs(found->value - p.value) > kSame * std::abs(p.value)) {
      throw bad_input(place.where,
                      fmt::format("the cell has {} = {} and {} = {}", found->name,
                                  shortest(found->value), p.name, shortest(p.value)),
                      "one value for what it sets: an axis of 'together'");
    }
    if (!found) found = p;
  }
  return found;
}

}  // namespace

std::vector<BestCell> best_cells(const SweepReader& sweep, const std::string& output,
                                 std::size_t count, const std::optional<std::string>& over) {
  if (!sweep.variable(output).times_s.empty()) {
    throw bad_input("sweep", fmt::format("'{}' is a curve in each cell", output), "a number");
  }
  std::optional<std::size_t> summed;
  if (over) summed = sweep.axis(*over);
  const std::vector<double> values = summed_values(sweep, output, summed);
  std::vector<std::uint64_t> order;
  for (std::uint64_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) order.push_back(i);
  }
  if (order.empty()) throw bad_input("sweep", "no cell is done", "cells to choose from");
  const auto kept = static_cast<std::ptrdiff_t>(std::min(count, order.size()));
  std::partial_sort(order.begin(), order.begin() + kept, order.end(),
                    [&](std::uint64_t a, std::uint64_t b) {
                      return values[a] != values[b] ? values[a] < values[b] : a < b;
                    });
  std::vector<BestCell> best(static_cast<std::size_t>(kept));
  for (std::size_t i = 0; i < best.size(); ++i) {
    best[i].value = values[order[i]];
    best[i].places.assign(sweep.axes().size(), 0);
    std::uint64_t rest = order[i];
    for (std::size_t a = sweep.axes().size(); a-- > 0;) {
      if (a == summed) continue;
      best[i].places[a] = rest % sweep.axes()[a].places.size();
      rest /= sweep.axes()[a].places.size();
    }
  }
  for (std::size_t a = 0; a < sweep.axes().size(); ++a) {
    if (a == summed) continue;
    for (const std::string& name : sweep.axes()[a].parameters) {
      const std::vector<double> along = sweep.parameter(name);
      for (BestCell& cell : best) {
        cell.parameters.push_back({name, sweep.parameter_target(name), sweep.parameter_unit(name),
                                   along[cell.places[a]]});
      }
    }
  }
  return best;
}

Json fit_from_cell(Json fit, const BestCell& cell, std::string_view where) {
  const DocumentPlace place = DocumentPlace{std::string(where)}.key("parameters");
  bool any = false;
  for (auto& [name, block] : fit.at("parameters").items()) {
    const auto sets = block.value("sets", std::vector<std::string>{name});
    const DocumentPlace here = place.key(name);
    const auto found = found_in_cell(cell, sets, here);
    if (!found) continue;
    const std::string text = fmt::format("{} {}", shortest(found->value), found->unit);
    const Dimension dimension = parse_unit(found->unit, here.where).dimension;
    for (const char* end : {"lower", "upper"}) {
      if (!block.contains(end)) continue;
      const double bound = quantity_at(block, end, dimension, here);
      if (end == std::string_view("lower") ? found->value >= bound : found->value <= bound)
        continue;
      throw bad_input(here.key(end).where, fmt::format("the cell has {}", text),
                      "a cell within the bounds of the fit");
    }
    block["start"] = text;
    any = true;
  }
  if (!any) {
    throw bad_input(place.where, "the cell has none of them", "a sweep over what is estimated");
  }
  fit["starts"] = {{"count", 1}};
  return fit;
}

}  // namespace tpm::sweep
