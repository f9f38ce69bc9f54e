#include "tpm/fit/select/function_starts.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "tpm/fit/likelihood/least_squares.hpp"
#include "tpm/fit/likelihood/starts.hpp"
#include "tpm/law/relaxation.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kMostReadings = 40;  // that starts are compared with
constexpr std::size_t kLookedAtPerStart = 10;
constexpr std::size_t kFollowedStarts = 6;
constexpr Eigen::Index kGridTimes = 40;  // of the spectrum
constexpr double kBeyondReadings = 3.0;  // that its grid reaches

/// Some of the readings at times above 0, spread over the logarithm of the time.
struct FewReadings {
  Eigen::VectorXd time_s, value, weight;
};

FewReadings few_readings(const Recording& function) {
  std::vector<std::pair<double, double>> rows;
  double largest = 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < function.response.size(); ++i) {
    const double value = function.response[i];
    if (!(function.time_s[i] > 0.0) || !std::isfinite(value)) continue;
    rows.emplace_back(function.time_s[i], value);
    largest = std::max(largest, std::abs(value));
    least = std::min(least, value);
  }
  std::ranges::stable_sort(rows, {}, &std::pair<double, double>::first);
  std::vector<std::pair<double, double>> kept;
  if (!rows.empty()) {
    const double first = std::log(rows.front().first);
    const double step =
        (std::log(rows.back().first) - first) / static_cast<double>(kMostReadings - 1);
    double next = first;
    for (const auto& row : rows) {
      if (std::log(row.first) < next && rows.size() > kMostReadings) continue;
      kept.push_back(row);
      next = std::max(next + step, std::log(row.first) + 0.5 * step);
    }
  }
  const auto n = std::ssize(kept);
  FewReadings few{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& [time, value] = kept[static_cast<std::size_t>(i)];
    few.time_s[i] = time;
    few.value[i] = value;
    few.weight[i] = 1.0 / (least > 0.0 ? value : largest);
  }
  return few;
}

bool is_stiffness(const FitParameter& p) {
  return p.unit.dimension == Dimension::stiffness || p.unit.dimension == Dimension::stress;
}

void put_within_bounds(std::span<const FitParameter> parameters, std::vector<double>& start) {
  for (std::size_t i = 0; i < start.size(); ++i) {
    start[i] = std::clamp(start[i], parameters[i].lower, parameters[i].upper);
  }
}

/// Deviance of the readings from J at a start whose stiffnesses are scaled to come near them.
double scaled_to_readings(const FitConfig& config, std::span<const FitParameter> parameters,
                          const FewReadings& readings, std::vector<double>& start) {
  const std::vector<double> values = model_parameters(config, start, 0);
  const law::StepResponse response(*config.law, values);
  double both = 0.0, model = 0.0, data = 0.0;
  for (Eigen::Index i = 0; i < readings.time_s.size(); ++i) {
    const double j = readings.weight[i] * response.creep(readings.time_s[i]).value;
    const double y = readings.weight[i] * readings.value[i];
    both += j * y;
    model += j * j;
    data += y * y;
  }
  if (!(both > 0.0) || !std::isfinite(model)) return std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < start.size(); ++i) {
    if (is_stiffness(parameters[i])) start[i] *= model / both;
  }
  return data - both * both / model;
}

std::vector<std::vector<double>> nearest_compliances(const FitConfig& config,
                                                     std::span<const FitParameter> parameters,
                                                     const FewReadings& readings) {
  const std::size_t count = kLookedAtPerStart * std::max<std::size_t>(config.starts, 1);
  std::vector<std::pair<double, std::vector<double>>> ranked;
  for (auto& start : latin_hypercube_starts(parameters, count, config.seed)) {
    const double deviance = scaled_to_readings(config, parameters, readings, start);
    put_within_bounds(parameters, start);
    if (std::isfinite(deviance)) ranked.emplace_back(deviance, std::move(start));
  }
  std::ranges::stable_sort(ranked, [](const auto& a, const auto& b) { return a.first < b.first; });
  if (ranked.size() > kFollowedStarts) ranked.resize(kFollowedStarts);
  std::vector<std::vector<double>> starts;
  for (auto& [deviance, start] : ranked) starts.push_back(std::move(start));
  return starts;
}

/// A discrete spectrum: the instantaneous and the equilibrium part, the flow, and weights at times.
struct DiscreteSpectrum {
  double constant = 0.0;  ///< k_inf of G, or 1/k0 of J
  double flow = 0.0;      ///< 1/eta of J
  std::vector<double> weight, time_s;
};

/// Non-negative weights on a grid of times; neighbours that are not 0 count as one.
DiscreteSpectrum discrete_spectrum(const FewReadings& readings, bool compliance, bool solid) {
  const double longest = readings.time_s.maxCoeff() * kBeyondReadings;
  const double shortest = readings.time_s.minCoeff() / kBeyondReadings;
  const Eigen::Index first = 2;  // columns of the constant and of the flow
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(readings.time_s.size(), first + kGridTimes);
  std::vector<double> grid(static_cast<std::size_t>(kGridTimes));
  if (compliance || solid) a.col(0).setOnes();
  if (compliance && !solid) a.col(1) = readings.time_s;
  for (Eigen::Index j = 0; j < kGridTimes; ++j) {
    const double share = static_cast<double>(j) / static_cast<double>(kGridTimes - 1);
    const double time = shortest * std::pow(longest / shortest, share);
    grid[static_cast<std::size_t>(j)] = time;
    const Eigen::ArrayXd decayed = (-readings.time_s.array() / time).exp();
    a.col(first + j) = compliance ? 1.0 - decayed : decayed;
  }
  a = readings.weight.asDiagonal() * a;
  const Eigen::VectorXd size = a.colwise().norm().transpose();
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    if (size[j] > 0.0) a.col(j) /= size[j];
  }
  const Eigen::VectorXd b = readings.weight.cwiseProduct(readings.value);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(a.cols());
  const Eigen::VectorXd endless =
      Eigen::VectorXd::Constant(a.cols(), std::numeric_limits<double>::infinity());
  const Eigen::VectorXd x = bounded_minimum(a.transpose() * a, a.transpose() * b, none, endless)
                                .cwiseQuotient((size.array() > 0.0).select(size, 1.0).matrix());
  DiscreteSpectrum spectrum;
  spectrum.constant = x[0];
  spectrum.flow = x[1];
  bool apart = true;
  for (Eigen::Index j = 0; j < kGridTimes; ++j) {
    const double weight = x[first + j];
    const double time = grid[static_cast<std::size_t>(j)];
    if (!(weight > 0.0)) {
      apart = true;
    } else if (apart) {
      spectrum.weight.push_back(weight);
      spectrum.time_s.push_back(time);
      apart = false;
    } else {
      double& sum = spectrum.weight.back();
      double& mean = spectrum.time_s.back();
      mean *= std::pow(time / mean, weight / (sum + weight));
      sum += weight;
    }
  }
  return spectrum;
}

/// Joins the neighbours whose joining changes least, or halves the largest weight, until there are
/// `count`. False if there is nothing to halve.
bool bring_to(std::size_t count, DiscreteSpectrum& s) {
  const auto at = [](std::vector<double>& v, std::size_t i) {
    return v.begin() + static_cast<std::ptrdiff_t>(i);
  };
  if (count == 0) {
    s.weight.clear();
    s.time_s.clear();
  }
  while (s.weight.size() > count) {
    std::size_t least = 0;
    double cost = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i + 1 < s.weight.size(); ++i) {
      const double apart = std::log(s.time_s[i + 1] / s.time_s[i]);
      const double change =
          s.weight[i] * s.weight[i + 1] / (s.weight[i] + s.weight[i + 1]) * apart * apart;
      if (change < cost) {
        cost = change;
        least = i;
      }
    }
    const double sum = s.weight[least] + s.weight[least + 1];
    s.time_s[least] *= std::pow(s.time_s[least + 1] / s.time_s[least], s.weight[least + 1] / sum);
    s.weight[least] = sum;
    s.weight.erase(at(s.weight, least + 1));
    s.time_s.erase(at(s.time_s, least + 1));
  }
  constexpr double kApart = 1.5;  // from the time that two halves come from
  while (s.weight.size() < count) {
    if (s.weight.empty()) return false;
    const auto i = static_cast<std::size_t>(std::ranges::max_element(s.weight) - s.weight.begin());
    s.weight[i] *= 0.5;
    const double late = s.time_s[i] * kApart;
    s.time_s[i] /= kApart;
    s.weight.insert(at(s.weight, i + 1), s.weight[i]);
    s.time_s.insert(at(s.time_s, i + 1), late);
  }
  return true;
}

/// Parameters of the law whose spectrum comes near the readings; empty if there is none.
std::vector<double> start_of_spectrum(const LawSpec& law, const FewReadings& readings,
                                      bool compliance) {
  const auto branches = static_cast<std::size_t>(law.branches);
  if (readings.time_s.size() < 3) return {};
  DiscreteSpectrum s = discrete_spectrum(readings, compliance, law.solid);
  Prony prony{s.constant, s.weight, s.time_s};
  if (!compliance) {
    if (!bring_to(branches, s)) return {};
    prony = {s.constant, s.weight, s.time_s};
  } else {
    if (!bring_to(law.solid ? branches : branches - 1, s)) return {};
    constexpr double kLeastShare =
        1e-3;  // of the least compliance: a law has an instantaneous stiffness
    KelvinChain chain;
    chain.k0 = 1.0 / std::max(s.constant, kLeastShare * readings.value.minCoeff());
    for (const double weight : s.weight) chain.k.push_back(1.0 / weight);
    chain.T_s = s.time_s;
    const double slowest = readings.value.maxCoeff() / readings.time_s.maxCoeff();
    if (!law.solid) chain.eta = 1.0 / std::max(s.flow, kLeastShare * slowest);
    if (!(chain.k0 > 0.0) || !std::isfinite(chain.k0)) return {};
    prony = to_parallel(chain);
  }
  if (prony.k.size() != branches) return {};
  std::vector<double> start;
  if (law.solid) start.push_back(prony.k_inf);
  start.insert(start.end(), prony.k.begin(), prony.k.end());
  start.insert(start.end(), prony.tau_s.begin(), prony.tau_s.end());
  return start;
}

}  // namespace

std::vector<std::vector<double>> function_starts(const FitConfig& config,
                                                 const Recording& function) {
  const std::vector<FitParameter> parameters = searched_parameters(config);
  const FewReadings readings = few_readings(function);
  const LawSpec& law = *config.law;
  const bool compliance = function.response_quantity == Quantity::creep_compliance;
  std::vector<std::vector<double>> starts;
  if (readings.time_s.size() == 0) return starts;
  if (law.branches > 0 && law.form == BranchForm::parallel) {
    std::vector<double> start = start_of_spectrum(law, readings, compliance);
    if (start.size() == parameters.size()) {
      put_within_bounds(parameters, start);
      starts.push_back(std::move(start));
    }
  }
  if (compliance) {
    std::ranges::move(nearest_compliances(config, parameters, readings),
                      std::back_inserter(starts));
  }
  return starts;
}

}  // namespace tpm::fit
