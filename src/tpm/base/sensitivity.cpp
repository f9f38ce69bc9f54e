#include "tpm/base/sensitivity.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "tpm/base/distributions.hpp"
#include "tpmkit/error.hpp"

namespace tpm::base {
namespace {

constexpr int kMostInputs = 1833;
constexpr std::uint64_t kMostPoints = std::uint64_t{1} << 31;

void check_design(const SensitivityDesign& design) {
  const std::string where = "a sensitivity design";
  if (design.inputs < 1 || design.inputs > kMostInputs)
    throw bad_input(where, "has " + std::to_string(design.inputs) + " inputs",
                    "1 to " + std::to_string(kMostInputs));
  if (design.points < 2 || design.points > kMostPoints || !std::has_single_bit(design.points))
    throw bad_input(where, "has " + std::to_string(design.points) + " points in a replicate",
                    "a power of two from 2 to " + std::to_string(kMostPoints));
  if (design.replicates < 2)
    throw bad_input(where, "has " + std::to_string(design.replicates) + " replicates",
                    "2 or more: their spread is the error");
}

class SensitivityPoints final : public CubePoints {
 public:
  explicit SensitivityPoints(const SensitivityDesign& design)
      : inputs_(design.inputs), points_(design.points) {
    check_design(design);
    // Seeds of replicates from the numbers of a random set, so that designs whose seeds are
    // neighbours share none.
    const auto seeds = random_points(design.seed);
    for (std::uint64_t r = 0; r < design.replicates; ++r)
      replicates_.push_back(sobol_points(
          2 * inputs_, static_cast<std::uint64_t>(std::ldexp(seeds->coordinate(r, 0), 53))));
  }

  double coordinate(std::uint64_t cell, int dimension) const override {
    const auto matrices = static_cast<std::uint64_t>(inputs_) + 2;
    const std::uint64_t row = cell / matrices;
    const auto matrix = static_cast<int>(cell % matrices);  // A, B, AB_1 ...
    const bool from_b = matrix == 1 || matrix == dimension + 2;
    return replicates_[row / points_]->coordinate(row % points_,
                                                  from_b ? inputs_ + dimension : dimension);
  }

 private:
  int inputs_;
  std::uint64_t points_;
  std::vector<std::unique_ptr<CubePoints>> replicates_;
};

/// Sums over the points of one replicate.
struct Replicate {
  double mean = 0.0;
  double variance = 0.0;
  std::vector<double> first_order, total;
};

Replicate replicate_of(std::span<const double> outputs, std::size_t inputs,
                       std::uint64_t& left_out) {
  const std::size_t matrices = inputs + 2;
  std::vector<std::span<const double>> rows;
  for (std::size_t at = 0; at < outputs.size(); at += matrices) {
    const std::span<const double> row = outputs.subspan(at, matrices);
    if (std::all_of(row.begin(), row.end(), [](double y) { return std::isfinite(y); }))
      rows.push_back(row);
    else
      ++left_out;
  }
  if (rows.size() < 2)
    throw bad_input("a sensitivity study",
                    "has a replicate with less than two points whose outputs are all finite",
                    "outputs for nearly all points");
  const auto count = static_cast<double>(rows.size());
  Replicate r;
  for (const auto& row : rows) r.mean += (row[0] + row[1]) / (2.0 * count);
  for (const auto& row : rows) {
    const double a = row[0] - r.mean, b = row[1] - r.mean;
    r.variance += (a * a + b * b) / (2.0 * count);
  }
  for (std::size_t i = 0; i < inputs; ++i) {
    double known = 0.0, left = 0.0;
    for (const auto& row : rows) {
      const double moved = row[i + 2] - row[0];
      known += (row[1] - r.mean) * moved / count;
      left += moved * moved / (2.0 * count);
    }
    r.first_order.push_back(known / r.variance);
    r.total.push_back(left / r.variance);
  }
  return r;
}

/// Mean of the replicates' values and Student's interval around it.
IndexEstimate estimate(const std::vector<Replicate>& all, std::vector<double> Replicate::*index,
                       std::size_t input, double level) {
  const auto count = static_cast<double>(all.size());
  IndexEstimate e;
  for (const Replicate& r : all) e.value += (r.*index)[input] / count;
  double squares = 0.0;
  for (const Replicate& r : all) squares += std::pow((r.*index)[input] - e.value, 2);
  const double half =
      student_quantile(0.5 + 0.5 * level, count - 1.0) * std::sqrt(squares / (count - 1.0) / count);
  e.low = e.value - half;
  e.high = e.value + half;
  return e;
}

}  // namespace

std::uint64_t SensitivityDesign::cells() const {
  return replicates * points * (static_cast<std::uint64_t>(inputs) + 2);
}

std::unique_ptr<CubePoints> sensitivity_points(const SensitivityDesign& design) {
  return std::make_unique<SensitivityPoints>(design);
}

SensitivityResult sobol_indices(const SensitivityDesign& design, std::span<const double> outputs,
                                double level) {
  check_design(design);
  if (outputs.size() != design.cells())
    throw bad_input("a sensitivity study", "has " + std::to_string(outputs.size()) + " outputs",
                    std::to_string(design.cells()) + ", as many as the design has cells");
  const auto inputs = static_cast<std::size_t>(design.inputs);
  const std::size_t of_replicate = design.points * (inputs + 2);
  SensitivityResult result;
  result.level = level;
  std::vector<Replicate> all;
  double variance = 0.0;
  for (std::uint64_t r = 0; r < design.replicates; ++r) {
    all.push_back(
        replicate_of(outputs.subspan(r * of_replicate, of_replicate), inputs, result.left_out));
    result.mean += all.back().mean / static_cast<double>(design.replicates);
    variance += all.back().variance / static_cast<double>(design.replicates);
  }
  result.standard_deviation = std::sqrt(variance);
  const bool varies = std::all_of(all.begin(), all.end(), [&](const Replicate& r) {
    constexpr double kRoundOff = 1e-26;  // of the mean's square
    return r.variance > kRoundOff * r.mean * r.mean && r.variance > 0.0;
  });
  if (!varies) return result;
  for (std::size_t i = 0; i < inputs; ++i)
    result.inputs.push_back({estimate(all, &Replicate::first_order, i, level),
                             estimate(all, &Replicate::total, i, level)});
  return result;
}

}  // namespace tpm::base
