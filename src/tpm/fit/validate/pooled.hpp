#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/fit/validate/area_metric.hpp"
#include "tpm/fit/validate/comparison.hpp"

namespace tpm::fit {

/// One quantity over several recordings.
struct PooledQuantity {
  std::string name;
  Unit unit;
  int recordings = 0;
  /// E is a share of |S| of each recording, because the protocols differ; else in the unit.
  bool relative = false;
  double simulated = 0.0,
         measured = 0.0;   ///< means; of `relative` those of the named protocol, or 0
  ErrorWithUncertainty e;  ///< of the mean over recordings
  double between = 0.0;    ///< standard deviation between recordings beyond their own u (REML)
  double u_shared = 0.0;   ///< part of u_val that all recordings share
  std::optional<double> limit;
  /// Of `relative`, if an amount is required: the recording whose S is the largest. The limit is
  /// the amount over that S.
  std::optional<std::string> limit_at;
  ModelVerdict verdict = ModelVerdict::not_seen;
  double p_value = 1.0;
  bool rejected = false;
  std::optional<Remark> remark;
  bool unknown = false;  ///< a part of u_val of a recording is not known: the remark says which
  /// In the unit of the quantity; of `relative` standardised, or at the protocol that was named.
  std::optional<AreaMetric> area;
  std::optional<std::string> area_at;  ///< recording whose protocol it was carried to
};

struct PooledOptions {
  std::optional<Requirement> requirement;
  std::optional<std::string> at;  ///< recording whose protocol pooled areas are carried to
};

/// True if depth, rate and duration of the recordings agree to 2 %.
[[nodiscard]] bool equal_protocols(std::span<const Applicability> motions);

/// A quantity of a recording that is the same as one of another: creep and relaxation have none in
/// common. Null: it has none.
[[nodiscard]] const QuantityComparison* same_quantity(const RecordingComparison& recording,
                                                      const QuantityComparison& quantity);

/// Every quantity of the recordings once, as the first that has it has it.
[[nodiscard]] std::vector<QuantityComparison> each_quantity(
    std::span<const RecordingComparison> recordings);

/// The mean E of each quantity that two or more recordings have, by random effects with Hartung and
/// Knapp's modified standard error (random_effects()) over the recordings' own uncertainties, and
/// beside it, not reduced by their number, what they share: the law, one instrument, one probe. The
/// area metric by u-pooling, with draws that share the same. `rejected` is left to whoever judges
/// all.
[[nodiscard]] std::vector<PooledQuantity> pool_recordings(
    std::span<const RecordingComparison> recordings, std::span<const Applicability> motions,
    double degrees_of_law, const PooledOptions& options);

}  // namespace tpm::fit
