#include "tpm/sweep/sweep_convergence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tpm/fit/expression/expression.hpp"
#include "tpmkit/error.hpp"

namespace tpm::sweep {
namespace {

void require_no_samples(const SweepReader& sweep, const ReadAxis& axis) {
  if (sweep.said_of(axis).kind != AxisKind::samples) return;
  throw bad_input("sweep", fmt::format("axis '{}' holds samples", axis.name),
                  "an axis of ever finer places");
}

std::vector<double> sizes_along(const SweepReader& sweep, const ReadAxis& axis,
                                const std::string& formula) {
  if (formula.empty()) {
    if (axis.parameters == std::vector{axis.name}) return axis.places;
    throw Error(ExitCode::usage, "--size",
                fmt::format("axis '{}' has no parameter of its name", axis.name),
                fmt::format("a formula of {}", fmt::join(axis.parameters, ", ")));
  }
  const Evaluator evaluator;
  std::vector<std::vector<double>> along;
  for (const std::string& name : axis.parameters) along.push_back(sweep.parameter(name));
  std::vector<double> sizes;
  for (std::size_t place = 0; place < axis.places.size(); ++place) {
    Scope scope;
    for (std::size_t p = 0; p < along.size(); ++p) {
      scope.values[axis.parameters[p]] = along[p][place];
    }
    try {
      sizes.push_back(evaluator.evaluate(formula, scope, "--size"));
    } catch (const Error& error) {
      throw error.with_code(ExitCode::usage);  // the formula stands on the command line
    }
  }
  return sizes;
}

}  // namespace

SweepConvergence convergence_of(const SweepReader& sweep, const std::string& variable,
                                const std::optional<std::string>& wished_axis,
                                const std::string& size, const FixedPlaces& fixed) {
  SweepConvergence found;
  found.variable = variable;
  found.unit = sweep.variable(variable).unit;
  found.axis = wished_axis.value_or(sweep.axes().back().name);
  const ReadAxis& axis = sweep.axes()[sweep.axis(found.axis)];
  require_no_samples(sweep, axis);
  found.fixed = other_places(sweep, axis, fixed);
  found.size_text = size.empty() ? axis.name : size;
  found.size_unit = size.empty() ? axis.unit : "";
  for (const std::string& name : axis.parameters) {
    if (name == size) found.size_unit = sweep.parameter_unit(name);
  }
  const std::vector<double> sizes = sizes_along(sweep, axis, size);
  const std::vector<double> values = sweep.slice(variable, {}, axis.name, fixed);
  std::vector<std::size_t> order(sizes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return sizes[a] > sizes[b]; });
  for (const std::size_t place : order) {
    if (!std::isfinite(values[place])) {
      ++found.left_out;
      continue;
    }
    found.size.push_back(sizes[place]);
    found.value.push_back(values[place]);
  }
  if (found.size.size() < 3) {
    throw bad_input("sweep",
                    fmt::format("'{}' has a number at {} places of axis '{}'", variable,
                                found.size.size(), axis.name),
                    "three sizes or more");
  }
  for (std::size_t k = 0; k + 2 < found.size.size(); ++k) {
    found.threes.push_back(grid_convergence(std::span(found.size).subspan(k, 3),
                                            std::span(found.value).subspan(k, 3)));
  }
  return found;
}

}  // namespace tpm::sweep
