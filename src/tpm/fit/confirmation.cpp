#include "tpm/fit/confirmation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/fit/verdict.hpp"

namespace tpm::fit {
namespace {

/// Rise of the deviance within which two ends are one minimum.
double same_end(const FitResult& result, const Threshold& threshold, double deviance) {
  constexpr double kOfRise = 0.05;
  constexpr double kRounding = 1e-6;  // of the declared noise
  const double rounding = kRounding * kRounding * static_cast<double>(result.value_count);
  return std::max(kOfRise * threshold.rise(deviance), rounding);
}

}  // namespace

Confirmation confirm(const FitResult& result, const ExperimentResiduals& function,
                     std::span<const FitParameter> parameters, const Threshold& threshold) {
  Confirmation confirmation;
  const std::vector<double>& ends = result.waterfall.deviances;
  if (ends.size() < 2 || !threshold.estimable()) return confirmation;
  const double same = same_end(result, threshold, std::max(ends.front(), result.best.deviance));
  confirmation.starts = static_cast<int>(ends.size());
  confirmation.found = static_cast<int>(
      std::ranges::count_if(ends, [&](double end) { return end - ends.front() <= same; }));
  if (!confirmation.is_doubtful()) return confirmation;
  double deepest = result.best.deviance - same;
  for (const std::vector<double>& start : further_starts(function, parameters)) {
    const Minimum end = minimise_near(function, parameters, start);
    if (!end.usable) continue;
    ++confirmation.starts;
    if (std::abs(end.deviance - result.best.deviance) <= same) ++confirmation.found;
    if (!(end.deviance < deepest)) continue;
    deepest = end.deviance;
    confirmation.deeper = end.natural;
  }
  return confirmation;
}

void mark_unconfirmed(FitResult& result, const Confirmation& confirmation) {
  if (!confirmation.is_doubtful()) return;
  constexpr int kTimes = 10, kFewest = 200;
  for (ParameterResult& p : result.parameters) {
    // Of these nothing is claimed that another minimum could take back.
    if (p.verdict == Verdict::failed || p.verdict == Verdict::flat) continue;
    p.unconfirmed = Remark{
        "one_start",
        fmt::format("found by one start of {}; another start has to end there, too (--starts {}, "
                    "or a law of fewer parameters)",
                    confirmation.starts, std::max(kFewest, kTimes * confirmation.starts))};
    p.summary = parameter_words(p, result.config.level);
  }
}

}  // namespace tpm::fit
