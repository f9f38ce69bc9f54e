#include "tpm/sweep/cell_block.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "tpm/base/text.hpp"
#include "tpm/fit/expression/expression.hpp"
#include "tpmkit/error.hpp"

namespace tpm::sweep {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// A value that is no finite number, the same on every machine: a NaN has no sign.
std::string_view not_finite(double value) {
  return std::isnan(value) ? "nan" : value > 0.0 ? "inf" : "-inf";
}

}  // namespace

CellBlock empty_block(const Sweep& sweep, std::uint64_t number) {
  CellBlock block;
  block.number = number;
  const std::uint64_t first = number * sweep.block_cells;
  const auto cells = static_cast<std::size_t>(std::min(sweep.block_cells, sweep.cells() - first));
  block.status.assign(cells, CellStatus::done);
  block.reason.assign(cells, 0);
  block.error_estimate.assign(cells, kNothing);
  if (!sweep.model->models().empty()) block.model.assign(cells, kNoModel);
  block.counts.assign(sweep.model->counted().size(), std::vector<std::int64_t>(cells, 0));
  for (const SweepVariable& variable : sweep.variables) {
    block.values.emplace_back(cells * variable.width(), kNothing);
  }
  return block;
}

/// The sweep's conditions and formulas with the names that they may use.
struct CellRunner::Expressions {
  Evaluator evaluator;
  Scope scope;
  std::vector<double*> parameters;  ///< in `scope`, of each swept one

  explicit Expressions(const Sweep& sweep) {
    for (const auto& [name, value] : sweep.model->constants()) scope.values[name] = value;
    parameters.reserve(sweep.parameters.size());
    for (const SweptParameter& p : sweep.parameters) parameters.push_back(&scope.values[p.name]);
  }
};

CellRunner::CellRunner(const Sweep& sweep)
    : sweep_(sweep),
      places_(sweep.axes.size()),
      swept_(sweep.parameters.size()),
      values_(sweep.width()),
      counts_(sweep.model->counted().size()) {
  model_ = sweep.model->cell_model(sweep.swept());
  if (!sweep.skip.empty() || !sweep.formulas.empty()) {
    expressions_ = std::make_unique<Expressions>(sweep);
  }
}

CellRunner::~CellRunner() = default;

CellBlock CellRunner::run(std::uint64_t number) {
  return run_unless(number, {}).value();
}

std::optional<CellBlock> CellRunner::run_unless(std::uint64_t number,
                                                const std::function<bool()>& interrupted) {
  CellBlock block = empty_block(sweep_, number);
  places_ = sweep_.places(number * sweep_.block_cells);
  for (std::size_t i = 0; i < swept_.size(); ++i) {
    swept_[i] = sweep_.parameters[i].values.at(places_[sweep_.parameters[i].axis]);
  }
  for (std::size_t cell = 0; cell < block.cells(); ++cell) {
    if (interrupted && interrupted()) return std::nullopt;
    run_cell(cell, block);
    // On to the next cell: axes change from the last one on.
    std::size_t changed = places_.size();
    while (changed-- > 0 && ++places_[changed] == sweep_.axes[changed].size) places_[changed] = 0;
    for (std::size_t i = 0; i < swept_.size(); ++i) {
      const SweptParameter& p = sweep_.parameters[i];
      if (changed == static_cast<std::size_t>(-1) || p.axis >= changed) {
        swept_[i] = p.values.at(places_[p.axis]);
      }
    }
  }
  return block;
}

void CellRunner::run_cell(std::size_t cell, CellBlock& block) {
  try {
    if (expressions_) {
      for (std::size_t i = 0; i < swept_.size(); ++i) *expressions_->parameters[i] = swept_[i];
      for (const SkipCondition& skip : sweep_.skip) {
        if (expressions_->evaluator.evaluate(skip.when, expressions_->scope, "skip") == 0.0)
          continue;
        return set_aside(cell, CellStatus::skipped, skip.reason.value_or(skip.when), block);
      }
    }
    std::fill(counts_.begin(), counts_.end(), 0);
    const CellAnswer answer = model_->run(swept_, values_, counts_);
    if (expressions_) {
      std::size_t at = 0;
      for (const SweepVariable& v : sweep_.model->variables()) {
        if (v.times_s.empty()) expressions_->scope.values[v.name] = values_[at];
        at += v.width();
      }
      for (const SweepFormula& formula : sweep_.formulas) {
        values_[at] =
            expressions_->evaluator.evaluate(formula.text, expressions_->scope, "formula");
        expressions_->scope.values[formula.name] = values_[at++];
      }
    }
    block.error_estimate[cell] = answer.error_estimate;
    if (!block.model.empty()) block.model[cell] = answer.model;
    require_finite();
  } catch (const Error& error) {
    // An outside cause (no memory for a mesh, no file) is not the cell's own.
    if (error.code() == ExitCode::environment) throw;
    return set_aside(cell, CellStatus::failed, error.what(), block);
  }
  for (std::size_t k = 0; k < counts_.size(); ++k) block.counts[k][cell] = counts_[k];
  std::size_t at = 0;
  for (std::size_t v = 0; v < block.values.size(); ++v) {
    const std::size_t width = sweep_.variables[v].width();
    std::copy_n(values_.begin() + static_cast<std::ptrdiff_t>(at), width,
                block.values[v].begin() + static_cast<std::ptrdiff_t>(cell * width));
    at += width;
  }
}

/// A number that overflowed is no result: what follows would take it for one.
void CellRunner::require_finite() const {
  std::size_t at = 0;
  for (const SweepVariable& variable : sweep_.variables) {
    for (std::size_t i = 0; i < variable.width(); ++i, ++at) {
      if (std::isfinite(values_[at])) continue;
      throw Error(ExitCode::numerical, variable.name,
                  fmt::format("{} is no finite number", not_finite(values_[at])),
                  "parameters within the range of the model");
    }
  }
}

void CellRunner::set_aside(std::size_t cell, CellStatus status, const std::string& reason,
                           CellBlock& block) {
  auto found = std::find(block.reasons.begin(), block.reasons.end(), reason);
  if (found == block.reasons.end()) {
    block.reasons.push_back(reason);
    found = block.reasons.end() - 1;
  }
  block.status[cell] = status;
  block.reason[cell] = static_cast<std::uint16_t>(found - block.reasons.begin() + 1);
}

}  // namespace tpm::sweep
