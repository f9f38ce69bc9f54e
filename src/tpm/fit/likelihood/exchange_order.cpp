#include "tpm/fit/likelihood/exchange_order.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "tpm/fit/likelihood/config.hpp"

namespace tpm::fit {
namespace {

/// Relative difference below which two keys count as equal.
constexpr double kSameKey = 1e-9;

/// Place of the estimated parameter that stands for a parameter of the law in all data sets.
std::optional<std::size_t> estimated_place(const FitConfig& config, const std::string& name) {
  const std::vector<LawParameter> table = law_parameters(config.law.value());
  for (std::size_t i = 0; i < config.parameters.size(); ++i) {
    const std::vector<Target>& sets = config.parameters[i].sets;
    if (sets.size() != 1 || !sets.front().data.empty()) continue;
    if (table[sets.front().parameter].name == name) return i;
  }
  return std::nullopt;
}

/// Names of the key and its companions, one list for each part.
std::vector<std::vector<std::string>> exchangeable_parts(const LawSpec& law) {
  if (law.fractional == Fractional::kelvin_voigt_pair) return {{"beta", "k2"}, {"alpha", "k1"}};
  if (has_two_springpots(law.fractional)) return {{"beta"}, {"alpha"}};
  const bool series = law.form == BranchForm::series;
  std::vector<std::vector<std::string>> parts;
  for (int i = 1; i <= law.branches; ++i) {
    parts.push_back({fmt::format("{}{}", series ? "T" : "tau", i),
                     fmt::format("{}{}", series ? "kc" : "k", i)});
  }
  return parts;
}

}  // namespace

ExchangeOrder::ExchangeOrder(const FitConfig& config) {
  if (!config.law) return;
  for (const std::vector<std::string>& names : exchangeable_parts(*config.law)) {
    Part part{0, {}};
    for (const std::string& name : names) {
      const auto place = estimated_place(config, name);
      if (!place) {
        parts_.clear();
        return;
      }
      if (&name == &names.front()) {
        part.key = *place;
      } else {
        part.companions.push_back(*place);
      }
    }
    if (!parts_.empty()) {
      const Part& before = parts_.back();
      const auto bounds = [&](std::size_t i) -> const FitParameter& {
        return config.parameters[i].fit;
      };
      bool alike = bounds(before.key).lower <= bounds(part.key).lower &&
                   bounds(before.key).upper <= bounds(part.key).upper;
      for (std::size_t c = 0; c < part.companions.size(); ++c) {
        const FitParameter& a = bounds(before.companions[c]);
        const FitParameter& b = bounds(part.companions[c]);
        alike = alike && a.lower == b.lower && a.upper == b.upper;
      }
      if (!alike) {
        parts_.clear();
        return;
      }
    }
    parts_.push_back(std::move(part));
  }
}

void ExchangeOrder::sort(std::vector<double>& natural) const {
  if (parts_.size() < 2) return;
  const std::vector<double> before = natural;
  std::vector<Part> rising = parts_;
  std::ranges::stable_sort(rising, {}, [&](const Part& a) { return before[a.key]; });
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    natural[parts_[i].key] = before[rising[i].key];
    for (std::size_t c = 0; c < parts_[i].companions.size(); ++c) {
      natural[parts_[i].companions[c]] = before[rising[i].companions[c]];
    }
  }
}

bool ExchangeOrder::is_sorted(std::span<const double> natural) const {
  for (std::size_t i = 1; i < parts_.size(); ++i) {
    const double before = natural[parts_[i - 1].key];
    if (before > natural[parts_[i].key] * (1.0 + kSameKey)) return false;
  }
  return true;
}

std::vector<FitParameter> ExchangeOrder::bounds_around(std::span<const FitParameter> parameters,
                                                       std::size_t held, double value) const {
  std::vector<FitParameter> bounded(parameters.begin(), parameters.end());
  const auto place = std::ranges::find(parts_, held, &Part::key);
  if (place == parts_.end()) return bounded;
  for (auto part = parts_.begin(); part != parts_.end(); ++part) {
    FitParameter& p = bounded[part->key];
    if (part < place) p.upper = std::clamp(value, p.lower, p.upper);
    if (part > place) p.lower = std::clamp(value, p.lower, p.upper);
  }
  return bounded;
}

}  // namespace tpm::fit
