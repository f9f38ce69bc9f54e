#include "tpm/fit/unpredicted.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/text.hpp"
#include "tpmkit/law.hpp"

namespace tpm::fit {
namespace {

/// The samples of a recording that are to be fitted, and those without a prediction among them.
struct Unpredicted {
  std::size_t fitted = 0, count = 0;
  double first_s = std::numeric_limits<double>::infinity();
  double last_s = -std::numeric_limits<double>::infinity();
  double predicted_to_s = -std::numeric_limits<double>::infinity();  ///< the last before first_s
};

Unpredicted unpredicted_of(const ExperimentResiduals& function, const Experiment& experiment,
                           const Eigen::VectorXd& predicted) {
  Unpredicted u;
  for (const std::size_t i : experiment.data) {
    const FitDatum& datum = function.data()[i];
    if (datum.held_out) continue;
    ++u.fitted;
    if (std::isfinite(predicted[static_cast<Eigen::Index>(i)])) {
      if (u.count == 0) u.predicted_to_s = datum.time_s;
      continue;
    }
    ++u.count;
    u.first_s = std::min(u.first_s, datum.time_s);
    u.last_s = std::max(u.last_s, datum.time_s);
  }
  return u;
}

}  // namespace

std::optional<Error> unpredicted_window(const ExperimentResiduals& function,
                                        std::span<const double> natural) {
  const FitConfig& config = function.config();
  if (!config.law) return std::nullopt;
  const Eigen::VectorXd predicted = function.predict(natural, nullptr);
  for (const Experiment& experiment : function.experiments()) {
    if (!experiment.is_recording) continue;
    const Unpredicted u = unpredicted_of(function, experiment, predicted);
    if (u.count == 0) continue;
    const std::string other = "a law with a linear or power kernel";
    return Error(ExitCode::numerical, config.data[experiment.choice].dataset,
                 fmt::format("{} of the {} samples to be fitted, from {} s to {} s, are not "
                             "predicted by {}: the contact shrinks or grows again in a way that "
                             "the law does not cover (docs/laws.md)",
                             u.count, u.fitted, significant(u.first_s, 5), significant(u.last_s, 5),
                             law_name(*config.law)),
                 std::isfinite(u.predicted_to_s)
                     ? fmt::format("a window that ends by {} s (\"to\" of the data set), or {}",
                                   significant(u.predicted_to_s, 5), other)
                     : other);
  }
  return std::nullopt;
}

}  // namespace tpm::fit
