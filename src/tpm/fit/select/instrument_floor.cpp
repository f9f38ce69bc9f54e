#include "tpm/fit/select/instrument_floor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "tpm/base/median.hpp"
#include "tpm/fit/select/reading_scatter.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm::fit {
namespace {

/// The last decimal place to which a reading was written.
double written_step(double reading) {
  const std::string text = fmt::format("{:.12e}", reading);  // -d.dddddddddddde+xx
  const auto end = text.find('e');
  const auto last = text.find_last_not_of('0', end - 1);
  const auto point = text.find('.');
  const int decimals = last > point ? static_cast<int>(last - point) : 0;
  return std::pow(10.0, std::stoi(text.substr(end + 1)) - decimals);
}

/// The smallest stiffness that the readings show; none if one of them is not above 0.
std::optional<double> least_stiffness(const FitResult& fit) {
  double least = std::numeric_limits<double>::infinity();
  for (const FittedDatum& d : fit.data) {
    if (!d.datum.value || !(*d.datum.value > 0.0)) return std::nullopt;
    const Quantity q = d.datum.quantity;
    const bool lags = q == Quantity::loss_modulus || q == Quantity::loss_stiffness;
    if (lags || d.datum.held_out) continue;
    const bool compliance = q == Quantity::creep_compliance;
    least = std::min(least, compliance ? 1.0 / *d.datum.value : *d.datum.value);
  }
  return std::isfinite(least) ? std::optional(least) : std::nullopt;
}

}  // namespace

std::optional<FloorOfReadings> find_floor(const Recording& step, const FitResult& fit) {
  constexpr std::size_t kFewest = 4, kTimes = 3;
  constexpr double kNear = 3.0;      // times the least reading
  constexpr double kRounded = 10.0;  // times the last decimal
  std::map<double, std::size_t> counts;
  for (const double reading : step.response) ++counts[reading];
  FloorOfReadings floor{counts.begin()->second, counts.begin()->first};
  std::size_t elsewhere = 0;
  for (auto other = std::next(counts.begin()); other != counts.end(); ++other) {
    elsewhere = std::max(elsewhere, other->second);
  }
  if (floor.count < kFewest || floor.count <= kTimes * elsewhere) return std::nullopt;
  double squares = 0.0, count = 0.0;
  double written = std::numeric_limits<double>::infinity();
  for (const FittedDatum& d : fit.data) {
    if (!d.datum.value || *d.datum.value == floor.value) continue;
    squares += std::pow((d.predicted - *d.datum.value) / *d.datum.value, 2);
    count += 1.0;
    if (std::abs(*d.datum.value) < kNear * std::abs(floor.value)) {
      written = std::min(written, written_step(*d.datum.value));
    }
  }
  const double scatter = std::sqrt(squares / std::max(count, 1.0)) * std::abs(floor.value);
  if (!(scatter > kRounded * written)) return std::nullopt;
  const auto first = std::ranges::find(step.response, floor.value) - step.response.begin();
  if (first == 0) return std::nullopt;
  floor.last_s = step.time_s[static_cast<std::size_t>(first) - 1];
  floor.behind = step.response.size() - static_cast<std::size_t>(first);
  return floor;
}

std::optional<double> floor_as_scatter(const FitResult& fit, const FloorOfReadings& floor) {
  constexpr double kOfMedian = 1.4826;
  if (fit.config.data.front().noise.kind != NoiseKind::relative_to_datum) return std::nullopt;
  std::vector<double> shares;
  for (const FittedDatum& d : fit.data) {
    if (d.datum.held_out || !d.datum.value || !(*d.datum.value > 0.0)) continue;
    shares.push_back(std::abs(d.predicted / *d.datum.value - 1.0));
  }
  if (shares.empty()) return std::nullopt;
  const double share = kOfMedian * base::median(std::move(shares));
  return share > 0.0 ? std::optional(floor.value / share) : std::nullopt;
}

bool doubt_small_plateau(FitResult& fit, bool times_stated) {
  constexpr double kScatters = 3.0, kOfLeast = 0.5;
  const auto least = least_stiffness(fit);
  if (!least || fit.config.data.size() != 1) return false;
  bool doubted = false;
  const auto scatter = most_scatter_of_small(fit);
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    ParameterResult& p = fit.parameters[i];
    const bool closed = p.verdict == Verdict::identified || p.verdict == Verdict::lower_only;
    if (p.parameter.name != "k_inf" || !closed || p.not_separable) continue;
    const bool compliance = fit.data.front().datum.quantity == Quantity::creep_compliance;
    if (!compliance && scatter && p.estimate < kScatters * *scatter) {
      p.not_separable = Remark{kPlateauOrFloor, "the plateau or a floor of the instrument"};
    } else if (!times_stated && p.estimate < kOfLeast * *least) {
      p.not_separable = Remark{kPlateauOrBranch, "the plateau or a slower branch"};
    } else {
      continue;
    }
    fit.config.parameters[i].not_separable = p.not_separable;
    p.summary = parameter_words(p, fit.config.level);
    doubted = true;
  }
  return doubted;
}

void doubt_what_depends_on_plateau(FitResult& fit, const FitResult& fluid) {
  const auto lasting = std::ranges::find_if(
      fit.parameters, [](const ParameterResult& p) { return p.parameter.name == "k_inf"; });
  if (lasting == fit.parameters.end() || !lasting->not_separable) return;
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    ParameterResult& p = fit.parameters[i];
    const auto other = std::ranges::find_if(fluid.parameters, [&](const ParameterResult& q) {
      return q.parameter.name == p.parameter.name;
    });
    if (other == fluid.parameters.end() || p.nuisance || p.not_separable) continue;
    const bool within =
        (!p.lower || *p.lower <= other->estimate) && (!p.upper || other->estimate <= *p.upper);
    if (within) continue;
    p.not_separable = lasting->not_separable;
    fit.config.parameters[i].not_separable = p.not_separable;
    p.summary = parameter_words(p, fit.config.level);
  }
}

}  // namespace tpm::fit
