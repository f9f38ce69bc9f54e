// Declared in tpm/plan/plan_relevance.hpp.
// Robustness margins: how far the scene may change before the plan breaks.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/organ/run/validity.hpp"
#include "tpm/plan/plan_relevance.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

constexpr double kStride = 1.5;    // between factors tried
constexpr double kFoundTo = 1.02;  // by bisection
constexpr double kLeastSearch_s = 1.0;
constexpr int kLeastTries = 4;
constexpr double kLongestAnyway_s = 0.1;
constexpr double kLongestTry = 12.0;  // of the runs of the scene as it is
constexpr int kTriesByStrides = 12;   // enough for strides to the end, and to bisect one

/// The changes of a scene, and whether a model survives them.
class Survival {
 public:
  /// @param search_s how long the search for one change may take, at nominal costs
  Survival(const PlanSurrogate& surrogate, const PlanModel& model, const PlanRequest& request,
           double search_s, const PlanAllowance& allowance)
      : surrogate_(surrogate),
        model_(model),
        request_(request),
        allowance_(allowance),
        valid_(passed_limits(surrogate).empty()),
        once_s_(std::max(least_work_of_try_s(), 1e-9)),
        most_tries_(std::max(static_cast<int>(std::ceil(search_s / once_s_)), kLeastTries)) {}

  /// Condition that fails in a changed scene; none if all hold.
  [[nodiscard]] std::optional<std::string> breaks(const PlanScene& scene) const {
    try {
      const PlanSurrogate changed(scene, request_.measure, surrogate_.inertial(), longest_run_s());
      if (auto reason = model_.why_not(changed, request_.budget)) return reason;
      if (valid_) {
        const auto passed = passed_limits(changed);
        if (!passed.empty()) return "validity: " + passed.front().text;
      }
      surrogate_.scene().spent().add(model_.work_to_build(scene));
      const ModelClaim claim = model_.claim(changed, request_.budget);
      if (!(claim.error <= request_.tolerance)) return "tolerance: the claimed error leaves it";
      if (!surrogate_.inertial() && masses_known() &&
          changed.inertia_share() >= std::max(request_.tolerance, kMassesFelt)) {
        return fmt::format("inertia: masses then change the answer by {} % of the peak",
                           significant(100.0 * changed.inertia_share(), 2));
      }
      if (const auto reason =
              over_budget(model_, claim, scene.duration_s(), request_.budget, request_.costs)) {
        return "budget: " + *reason;
      }
      return std::nullopt;
    } catch (const Error& error) {
      if (error.code() != ExitCode::numerical && error.code() != ExitCode::bad_input) throw;
      return std::string(error.what());
    }
  }

  /// The least factor at which something breaks.
  /// @param share of what the plan may still take
  template <class Change>
  [[nodiscard]] PlanChange first(std::string name, double share, Change&& change) const {
    PlanChange result{std::move(name), std::nullopt, 1.0, ""};
    const double until_s = (1.0 - share) * allowance_.left_s();
    double try_s = once_s_;
    // Without a limit both sides are infinite or not a number.
    const auto may_try = [&] { return !(allowance_.left_s() - try_s < until_s); };
    const auto breaks_at = [&](double factor) {
      const double before_s = allowance_.spent_s();
      auto broken = breaks(change(factor));
      if (!broken) try_s = std::max(once_s_, allowance_.spent_s() - before_s);
      return broken;
    };
    int tries = 0;
    // With few tries from the end: what holds there holds, and else halves of the way tell most.
    const double stride = most_tries_ < kTriesByStrides ? kMostChange : kStride;
    for (double factor = stride; !result.factor; factor *= stride) {
      if (result.survived == kMostChange || !may_try()) return result;
      factor = std::min(factor, kMostChange);
      ++tries;
      const auto broken = breaks_at(factor);
      if (broken && allowance_.is_spent()) return result;  // cut short: that breaks nothing
      if (broken) {
        result.factor = factor;
        result.breaks = *broken;
      } else {
        result.survived = factor;
      }
    }
    double broken_at = result.factor.value_or(kMostChange);
    for (; broken_at / result.survived > kFoundTo && tries < most_tries_ && may_try(); ++tries) {
      const double middle = std::sqrt(result.survived * broken_at);
      const auto there = breaks_at(middle);
      if (there && allowance_.is_spent()) break;
      if (there) {
        broken_at = middle;
        result.breaks = *there;
      } else {
        result.survived = middle;
      }
    }
    result.factor = broken_at;
    return result;
  }

 private:
  [[nodiscard]] double least_work_of_try_s() const {
    OperationCount work = surrogate_.work_of_claims();
    work += model_.work_to_build(surrogate_.scene());
    return nominal_costs().seconds_of(work);
  }

  /// Of one run. A scene that is followed for longer is past what breaks, such as a tissue that
  /// buckles.
  [[nodiscard]] double longest_run_s() const {
    return std::min(std::max(kLongestTry * once_s_, kLongestAnyway_s), allowance_.left_s());
  }

  [[nodiscard]] bool masses_known() const {
    return std::all_of(surrogate_.scene().scene().contacts.begin(),
                       surrogate_.scene().scene().contacts.end(),
                       [](const SceneContact& c) { return !c.is_tool() || c.mass_kg; });
  }

  const PlanSurrogate& surrogate_;
  const PlanModel& model_;
  const PlanRequest& request_;
  const PlanAllowance& allowance_;
  bool valid_;
  double once_s_;   ///< what a try takes at least, at nominal costs
  int most_tries_;  ///< of one change
};

}  // namespace

std::vector<Remark> passed_limits(const PlanSurrogate& surrogate) {
  const Validity& validity = surrogate.validity();
  std::vector<Remark> passed;
  for (std::size_t k = 0; k < kValidityLimits; ++k) {
    const auto limit = static_cast<ValidityLimit>(k);
    if (!validity.of(limit).first_time_s) continue;
    passed.push_back({std::string(key_of(limit)), std::string(words_of(limit))});
  }
  return passed;
}

std::vector<PlanChange> plan_changes(const PlanSurrogate& surrogate, const PlanModel& model,
                                     const PlanRequest& request, double reference_s,
                                     const PlanAllowance& allowance) {
  const Survival survival(surrogate, model, request, std::max(reference_s, kLeastSearch_s),
                          allowance);
  const PlanScene& scene = surrogate.scene();
  return {survival.first(
              scene.by_depth() ? "deeper, and as much faster" : "the load, put on as much faster",
              1.0 / 3.0, [&](double f) { return scene.deeper(f); }),
          survival.first(scene.by_depth() ? "faster" : "the speed of loading", 1.0 / 2.0,
                         [&](double f) { return scene.faster(f); }),
          survival.first("stiffer", 1.0, [&](double f) { return scene.stiffer(f); })};
}

}  // namespace tpm::plan
