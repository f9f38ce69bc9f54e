#include "tpm/fit/validate/requirement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tpm/base/distributions.hpp"
#include "tpm/base/enum_names.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/plan/perception.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

struct VerdictWord {
  ModelVerdict meaning;
  std::string_view text, words;
};
constexpr auto kVerdicts = std::to_array<VerdictWord>({
    {ModelVerdict::no_requirement, "no_requirement", "no requirement in its unit"},
    {ModelVerdict::adequate, "adequate", "adequate"},
    {ModelVerdict::not_adequate, "not_adequate", "not adequate"},
    {ModelVerdict::undetermined, "undetermined", "undetermined"},
    {ModelVerdict::not_seen, "not_seen", "no model error is seen above the uncertainty"},
    {ModelVerdict::seen, "seen", "a model error"},
    {ModelVerdict::residual, "calibration_residual", "calibration residual"},
});
constexpr double kVerdictLevel = 0.95;
constexpr double kManyDegrees = 1e7;  // no different from infinitely many

}  // namespace

Requirement parse_requirement(std::string_view text, std::string_view where) {
  const std::string expected = "a share such as 10%, an amount such as \"20 mN\", or jnd";
  Requirement r;
  r.stated = std::string(text);
  if (text == "jnd" || text == "JND") {
    r.value = kForceJnd;
    r.of_force = true;
    r.stated = fmt::format("jnd, {} %", significant(100.0 * kForceJnd, 3));
    return r;
  }
  if (const auto share = find_share(text)) {
    r.value = *share;
    if (text.find('%') == std::string_view::npos) {
      if (r.value >= 1.0) {  // the 20 of "20 mN" would allow anything
        throw bad_input(where, fmt::format("'{}' has no unit", printable(text)), expected);
      }
      r.stated = fmt::format("{} %", significant(100.0 * *share, 6));
    }
    if (r.value >= 1.0) {
      throw bad_input(where,
                      fmt::format("'{}' allows an error as large as the quantity", printable(text)),
                      "below 100 %, such as 10%, or an amount such as \"20 mN\"");
    }
  } else {
    const QuantityText parts = split_quantity(text);
    if (!is_unit(parts.unit) || !find_number(parts.number)) {
      throw bad_input(where, fmt::format("'{}'", printable(text)), expected);
    }
    r.share = false;
    r.dimension = parse_unit(parts.unit, where).dimension;
    r.value = parse_quantity(text, r.dimension, where);
  }
  if (!(r.value > 0.0)) throw bad_input(where, fmt::format("'{}'", printable(text)), "above 0");
  return r;
}

std::string_view verdict_words(ModelVerdict verdict) noexcept {
  return entry_of(kVerdicts, verdict).words;
}

std::string_view verdict_key(ModelVerdict verdict) noexcept {
  return entry_of(kVerdicts, verdict).text;
}

void CombinedUncertainty::add(double u, double degrees) {
  square_ += u * u;
  if (degrees < kManyDegrees) fourth_over_degrees_ += u * u * u * u / degrees;
}

void CombinedUncertainty::add_difference(double u, double whole, double degrees) {
  square_ += u * u;
  fourth_over_degrees_ += whole * whole * whole * whole / degrees;
}

double CombinedUncertainty::u() const {
  return std::sqrt(square_);
}

double CombinedUncertainty::degrees() const {
  if (!(fourth_over_degrees_ > 0.0)) return std::numeric_limits<double>::infinity();
  return std::max(square_ * square_ / fourth_over_degrees_, 1.0);
}

bool CombinedUncertainty::untold() const {
  return square_ * square_ < fourth_over_degrees_;
}

double coverage_factor(double degrees) {
  const double p = 0.5 + 0.5 * kVerdictLevel;
  return degrees < kManyDegrees ? student_quantile(p, degrees) : normal_quantile(p);
}

ModelVerdict judge_error(const ErrorWithUncertainty& e, std::optional<double> limit) {
  const double size = std::abs(e.error), expanded = e.expanded();
  if (!limit) return size <= expanded ? ModelVerdict::not_seen : ModelVerdict::seen;
  if (size + expanded <= *limit) return ModelVerdict::adequate;
  return size - expanded > *limit ? ModelVerdict::not_adequate : ModelVerdict::undetermined;
}

double error_p_value(const ErrorWithUncertainty& e, std::optional<double> limit) {
  const double beyond = std::abs(e.error) - limit.value_or(0.0);
  if (!(beyond > 0.0)) return 1.0;
  if (!(e.u_val > 0.0)) return 0.0;
  const double t = beyond / e.u_val;
  // The square of Student's t is F with one degree in the numerator.
  return e.degrees < kManyDegrees ? fisher_tail(t * t, 1.0, e.degrees)
                                  : chi_squared_tail(t * t, 1.0);
}

std::vector<bool> holm_rejects(const std::vector<double>& p_values, double level) {
  std::vector<std::size_t> order(p_values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return p_values[a] < p_values[b]; });
  std::vector<bool> rejected(p_values.size(), false);
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (p_values[order[i]] > level / static_cast<double>(order.size() - i)) break;
    rejected[order[i]] = true;
  }
  return rejected;
}

std::string what_must_shrink(const ErrorWithUncertainty& e, double limit,
                             std::vector<UncertaintyPart> parts, const Unit& unit) {
  const double target = std::abs(std::abs(e.error) - limit) / e.coverage;
  if (!(target > 0.0)) return {};
  std::stable_sort(parts.begin(), parts.end(),
                   [](const auto& a, const auto& b) { return a.u > b.u; });
  const auto shown = [&](double u) { return significant(u / unit.to_si, 2); };
  double excess = e.u_val * e.u_val - target * target;
  std::string words;
  for (const UncertaintyPart& part : parts) {
    constexpr double kMatters = 0.1;  // of u_val
    if (part.u < kMatters * e.u_val || !(excess > 0.0)) break;
    const double left = std::sqrt(std::max(part.u * part.u - excess, 0.0));
    excess -= part.u * part.u;
    words += fmt::format("{}{} from u = {} to {}", words.empty() ? "" : " and ", part.name,
                         shown(part.u), with_unit(left > 0.0 ? shown(left) : "nearly 0", unit));
  }
  return words;
}

std::optional<Remark> shrink_remark(const ErrorWithUncertainty& e, double limit,
                                    std::vector<UncertaintyPart> parts, const Unit& unit) {
  std::string words = what_must_shrink(e, limit, std::move(parts), unit);
  if (words.empty()) return std::nullopt;
  return Remark{kMustShrink, std::move(words)};
}

}  // namespace tpm::fit
