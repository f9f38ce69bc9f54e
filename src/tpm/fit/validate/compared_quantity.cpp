// Declared in tpm/fit/validate/comparison.hpp.
#include <algorithm>
#include <array>
#include <cmath>

#include "tpm/fit/select/history_before_window.hpp"
#include "tpm/fit/validate/comparison.hpp"

namespace tpm::fit {

bool is_of_response(QuantityKind kind) {
  return kind == QuantityKind::peak || kind == QuantityKind::end_of_hold ||
         kind == QuantityKind::at_time || kind == QuantityKind::at_depth;
}

Unit quantity_unit(const QuantityOfInterest& quantity, Quantity drive, Quantity response) {
  switch (quantity.kind) {
    case QuantityKind::relaxation_ratio:
      return {"", Dimension::dimensionless, 1.0};
    case QuantityKind::half_time:
      return {"s", Dimension::time, 1.0};
    case QuantityKind::rate: {
      const std::string symbol(si_symbol(quantity_dimension(response)));
      return {symbol.empty() ? "1/s" : symbol + "/s", Dimension::dimensionless, 1.0};
    }
    case QuantityKind::work: {
      const bool indents = drive == Quantity::indentation_depth;
      return {indents ? "J" : "J/m^3", Dimension::dimensionless, 1.0};
    }
    default:
      break;
  }
  const Dimension d = quantity_dimension(response);
  return {std::string(si_symbol(d)), d, 1.0};
}

Unit scaled_unit(const Unit& unit, double size) {
  if (unit.symbol.empty() || unit.symbol.starts_with("1/") || !(size > 0.0) || !std::isfinite(size))
    return unit;
  struct Prefix {
    double factor;
    const char* text;
  };
  constexpr auto kPrefixes = std::to_array<Prefix>({{1e6, "M"},
                                                    {1e3, "k"},
                                                    {1.0, ""},
                                                    {1e-3, "m"},
                                                    {1e-6, "u"},
                                                    {1e-9, "n"},
                                                    {1e-12, "p"},
                                                    {1e-15, "f"}});
  for (const Prefix& prefix : kPrefixes) {
    if (size / unit.to_si < prefix.factor) continue;
    if (prefix.factor > 1.0 && unit.dimension == Dimension::time) continue;
    return {prefix.text + unit.symbol, unit.dimension, unit.to_si * prefix.factor};
  }
  return unit;
}

std::optional<double> limit_of(const Requirement& requirement, const QuantityComparison& quantity,
                               Dimension response, double peak) {
  if (requirement.of_force &&
      !(is_of_response(quantity.quantity.kind) && response == Dimension::force)) {
    return std::nullopt;
  }
  if (!requirement.share) {
    const bool of_response = is_of_response(quantity.quantity.kind);
    const Dimension own = of_response ? response : quantity.unit.dimension;
    const bool has_dimension = quantity.quantity.kind != QuantityKind::work &&
                               quantity.quantity.kind != QuantityKind::rate;
    if (!has_dimension || own != requirement.dimension) return std::nullopt;
    return requirement.value;
  }
  constexpr double kTold = 5.0;
  const double size = std::abs(quantity.measured);
  if (size >= kTold * quantity.u_D) return requirement.value * size;
  if (quantity.quantity.kind == QuantityKind::relaxation_ratio) return requirement.value;
  return requirement.value * (is_of_response(quantity.quantity.kind) ? std::max(peak, size) : size);
}

void lack_history(RecordingComparison& comparison, const LawFile& law,
                  const PreparedRecording& recording) {
  if (comparison.calibration) return;  // a residual has no verdict that could lack it
  const auto remark = history_before_window(law.spec, law.values, recording, "the comparison");
  if (!remark) return;
  for (QuantityComparison& q : comparison.quantities) {
    q.remark = remark;
    q.unknown = true;
  }
}

void judge_quantities(RecordingComparison& r, const std::optional<Requirement>& requirement,
                      Dimension response, double peak) {
  for (const QuantityComparison& q : r.quantities) {
    if (is_of_response(q.quantity.kind)) peak = std::max(peak, std::abs(q.measured));
  }
  std::vector<double> p_values;
  for (QuantityComparison& q : r.quantities) {
    if (requirement) q.limit = limit_of(*requirement, q, response, peak);
    q.verdict = judge_error(q.e, q.limit);
    q.p_value = error_p_value(q.e, q.limit);
    if (requirement && !q.limit) q.verdict = ModelVerdict::no_requirement;
    if (q.unknown) {
      q.verdict = ModelVerdict::undetermined;
      q.p_value = 1.0;
      r.joint.unknown.push_back(q.name);
    } else if (q.verdict == ModelVerdict::undetermined && !r.calibration) {
      q.remark = shrink_remark(q.e, *q.limit, q.parts,
                               scaled_unit(q.unit, std::max(std::abs(q.measured), q.e.expanded())));
    }
    if (r.calibration) q.verdict = ModelVerdict::residual;
    p_values.push_back(q.verdict == ModelVerdict::no_requirement ? 1.0 : q.p_value);
  }
  const std::vector<bool> rejected = holm_rejects(p_values);
  for (std::size_t i = 0; i < rejected.size(); ++i) r.quantities[i].rejected = rejected[i];
  r.verdict = verdict_of_all(r.quantities);
}

ModelVerdict verdict_of_all(const std::vector<QuantityComparison>& quantities) {
  bool required = false, all_adequate = true, rejected = false, unknown = false, any = false;
  for (const QuantityComparison& q : quantities) {
    if (q.verdict == ModelVerdict::residual) return ModelVerdict::residual;
    if (q.verdict == ModelVerdict::no_requirement) continue;
    any = true;
    rejected = rejected || q.rejected;
    unknown = unknown || q.verdict == ModelVerdict::undetermined;
    if (q.limit) {
      required = true;
    }
    all_adequate = all_adequate && q.verdict == ModelVerdict::adequate;
  }
  if (!any && !quantities.empty()) return ModelVerdict::no_requirement;
  if (required) {
    if (rejected) return ModelVerdict::not_adequate;
    return all_adequate ? ModelVerdict::adequate : ModelVerdict::undetermined;
  }
  if (rejected) return ModelVerdict::seen;
  return unknown ? ModelVerdict::undetermined : ModelVerdict::not_seen;
}

RecordingComparison begun_comparison(const PreparedRecording& recording,
                                     const ComparisonOptions& options) {
  RecordingComparison begun;
  begun.name = recording.name;
  begun.session = options.motion.session;
  begun.press = options.motion.press;
  if (options.motion.knots.empty()) begun.rises = unseen_rises(recording);
  return begun;
}

}  // namespace tpm::fit
