#pragma once
#include <limits>

#include "tpm/plan/plan_scene.hpp"

namespace tpm::plan {

/// Largest work of a plan, in seconds of nominal costs: on every machine the same.
class PlanAllowance {
 public:
  /// @param scene whose runs, and those of scenes made from it, count
  explicit PlanAllowance(const PlanScene& scene,
                         double most_s = std::numeric_limits<double>::infinity())
      : scene_(scene), most_s_(most_s) {}

  void set_most(double seconds) { most_s_ = seconds; }
  [[nodiscard]] double spent_s() const { return nominal_costs().seconds_of(scene_.spent().all()); }
  /// May be below 0.
  [[nodiscard]] double left_s() const { return most_s_ - spent_s(); }
  /// A run that failed then may have been cut short.
  [[nodiscard]] bool is_spent() const { return left_s() <= 0.0; }
  [[nodiscard]] bool permits(const OperationCount& work) const {
    return nominal_costs().seconds_of(work) <= left_s();
  }

 private:
  const PlanScene& scene_;
  double most_s_;
};

}  // namespace tpm::plan
