#include "tpm/fit/select/doubtful_contact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "tpm/base/distributions.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/conditional.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm::fit {
namespace {

/// True if the exponent was fitted, and its interval holds that of no probe.
bool has_exponent_of_no_probe(const FitResult& fit) {
  constexpr std::array kOfProbes{1.0, 1.5, 2.0};
  const auto exponent = std::ranges::find_if(
      fit.parameters, [](const ParameterResult& p) { return p.parameter.name == "exponent"; });
  if (exponent == fit.parameters.end()) return false;
  return std::ranges::none_of(kOfProbes, [&](double m) {
    return (!exponent->lower || *exponent->lower <= m) &&
           (!exponent->upper || m <= *exponent->upper);
  });
}

/// True for a coefficient or the exponent of a power of the depth: it is counted from the contact.
bool is_counted_from_contact(const ParameterResult& p) {
  const Dimension dimension = p.parameter.unit.dimension;
  return !p.nuisance && (dimension == Dimension::stiffness || dimension == Dimension::stress ||
                         p.parameter.name == "exponent");
}

/// True if the fit claims to know it much better than what was measured before.
bool is_much_surer(const ParameterResult& p, const Prior& prior) {
  constexpr double kMuchLess = 3.0;  // times the standard error
  return p.standard_error && prior.sd >= kMuchLess * *p.standard_error;
}

/// Distances of the fitted samples of the first loading from the law, in standard deviations.
struct LoadingMisfit {
  double squares = 0.0, largest = 0.0, at_s = 0.0;
  int count = 0;
};

LoadingMisfit misfit_of_loading(const RecordingFit& r, double noise) {
  constexpr double kMoves = 0.01, kLoaded = 0.98;  // of the travel
  LoadingMisfit misfit;
  const double begin = r.drive.front(), travel = std::ranges::max(r.drive) - begin;
  const auto reached = [&](std::size_t i, double share) {
    return r.drive[i] - begin >= share * travel;
  };
  std::size_t i = 0;
  while (i < r.drive.size() && !reached(i, kMoves)) ++i;
  for (bool last = false; i < r.drive.size() && !last; ++i) {
    last = reached(i, kLoaded);
    if (!r.fitted[i] || r.outlier[i]) continue;
    const double z = std::abs(r.standardised[i]) / noise;
    misfit.squares += z * z;
    ++misfit.count;
    if (z <= misfit.largest) continue;
    misfit.largest = z;
    misfit.at_s = r.time_s[i];
  }
  return misfit;
}

}  // namespace

void doubt_loading(FitResult& fit) {
  constexpr double kLevel = 1e-4;
  constexpr double kMuchMore =
      4.0;  // mean square, in that of the noise: one spike moves no contact
  if (!fit.config.law || !(fit.variance_factor > 0.0)) return;
  if (fit.adequacy && fit.adequacy->is_rejected()) return;
  for (const RecordingFit& r : fit.recordings) {
    if (r.drive_quantity != Quantity::indentation_depth || r.drive.empty()) continue;
    const LoadingMisfit misfit = misfit_of_loading(r, std::sqrt(fit.variance_factor));
    if (misfit.count == 0 || !(misfit.squares > kMuchMore * misfit.count)) continue;
    const double square = misfit.largest * misfit.largest;
    if (misfit.count * chi_squared_tail(square, 1.0) >= kLevel) continue;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < fit.parameters.size() && i < fit.config.parameters.size(); ++i) {
      ParameterResult& p = fit.parameters[i];
      const bool contact = p.nuisance && is_contact(fit.config, i) &&
                           fit.config.parameters[i].sets.front().applies_to(r.choice);
      if (p.unconfirmed || !(contact || is_counted_from_contact(p))) continue;
      p.unconfirmed = Remark{"loading_not_described", "the law misses the samples of the loading"};
      p.summary = parameter_words(p, fit.config.level);
      names.push_back(p.parameter.name);
    }
    fit.remarks.push_back(
        {"loading_not_described",
         fmt::format("{}: the law misses the samples of the loading, by {} times its noise at {} "
                     "s: what follows from them is not identified: {}",
                     fit.config.data[r.choice].dataset, significant(misfit.largest, 2),
                     significant(misfit.at_s, 6), fmt::join(names, ", "))});
  }
}

void doubt_contact(FitResult& fit) {
  if (!fit.config.law || fit.config.law->kernel != Kernel::power) return;
  if (!has_exponent_of_no_probe(fit)) return;
  const Remark doubt{kContactOrLoading, "contact or a loading that is no power of the depth"};
  const auto mark = [&](ParameterResult& p) {
    if (p.verdict != Verdict::identified || p.not_separable) return;
    p.not_separable = doubt;
    p.summary = parameter_words(p, fit.config.level);
  };
  bool doubted = false;
  for (std::size_t i = 0; i < fit.parameters.size() && i < fit.config.parameters.size(); ++i) {
    ParameterResult& p = fit.parameters[i];
    const auto& prior = fit.config.parameters[i].prior;
    if (!p.nuisance || !is_contact(fit.config, i) || !prior || p.not_separable) continue;
    // A contact that even the power leaves open, or at the end of its range, is no surer.
    const bool found = p.verdict == Verdict::identified;
    if (found && !is_much_surer(p, *prior)) continue;
    mark(p);
    doubted = true;
  }
  if (!doubted) return;
  for (std::size_t i = 0; i < fit.parameters.size() && i < fit.config.parameters.size(); ++i) {
    ParameterResult& p = fit.parameters[i];
    const auto& prior = fit.config.parameters[i].prior;
    // So is a zero that follows from the power alone.
    const bool zero = p.nuisance && p.parameter.name.starts_with("offset") && prior;
    if (is_counted_from_contact(p) || (zero && is_much_surer(p, *prior))) mark(p);
  }
}

}  // namespace tpm::fit
