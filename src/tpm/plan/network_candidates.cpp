// Declared in tpm/plan/plan_model.hpp.
// The nonlinear network: stepped by a servo, by collocation, with fewer moving layers, with masses.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/plan/plan_model.hpp"

namespace tpm::plan {
namespace {

/// The network of a scene with deeper layers fixed, or as it is.
class LayeredCandidate : public PlanModel {
 public:
  /// @param layers that move; 0: all
  explicit LayeredCandidate(int layers) : layers_(layers) {}
  [[nodiscard]] ModelReach reach() const override {
    return layers_ == 0 ? ModelReach::full : ModelReach::reduced;
  }
  [[nodiscard]] std::optional<std::string> why_not(const PlanSurrogate& surrogate,
                                                   const PlanBudget& /*budget*/) const override {
    const Organ& organ = surrogate.scene().network().organ;
    for (const SceneContact& contact : surrogate.scene().scene().contacts) {
      if (layers_ == 0 || organ.layer[contact.probe.sphere] < layers_) continue;
      return "a contact lies in a layer that would be fixed";
    }
    return std::nullopt;
  }

 protected:
  [[nodiscard]] PlanScene own(const PlanScene& scene) const {
    return layers_ == 0 ? scene : scene.with_layers(layers_);
  }
  [[nodiscard]] std::string suffix() const {
    return layers_ == 0 ? "" : fmt::format("_layers_{}", layers_);
  }
  [[nodiscard]] std::string words() const {
    if (layers_ == 0) return "";
    return fmt::format(", {} moving layer{}", layers_, layers_ == 1 ? "" : "s");
  }
  [[nodiscard]] int layers() const { return layers_; }

 private:
  int layers_;
};

class CollocationCandidate final : public LayeredCandidate {
 public:
  CollocationCandidate(double tolerance, int layers)
      : LayeredCandidate(layers), tolerance_(tolerance) {}
  [[nodiscard]] std::string name() const override {
    return fmt::format("collocation_{}{}", shortest(tolerance_), suffix());
  }
  [[nodiscard]] std::string formulation() const override { return "collocation"; }
  [[nodiscard]] bool cheaper_than_reference() const override { return true; }
  [[nodiscard]] std::string settings() const override {
    return fmt::format("tolerance {}{}", shortest(tolerance_), words());
  }
  [[nodiscard]] std::optional<std::string> why_no_servo() const override {
    return "its steps need the protocol beforehand";
  }
  [[nodiscard]] bool last_resort() const override { return tolerance_ < kUsualFinest; }
  [[nodiscard]] OperationCount work_to_claim(const PlanSurrogate& surrogate) const override {
    const OperationCount& run = surrogate.coarse_or_first().work;
    OperationCount work;
    if (layers() > 0 || !surrogate.has_collocation(tolerance_)) work += run;
    if (layers() > 0 || surrogate.inertial()) {
      work += surrogate.work_to_compare();
    } else if (!surrogate.has_collocation_as_fine_as(finer())) {
      work += run;
    }
    return work;
  }

  [[nodiscard]] ModelClaim claim(const PlanSurrogate& surrogate,
                                 const PlanBudget& budget) const override {
    if (layers() > 0) {
      const Trajectory answer = run(surrogate, budget, surrogate.times());
      return {surrogate.claim_of(answer), answer.work, {}};
    }
    const Trajectory& answer = surrogate.collocation(tolerance_);
    if (surrogate.inertial()) return {surrogate.claim_of(answer), answer.work, {}};
    // Against a run much finer: one at a tenth of the tolerance may well take the same steps.
    const double error =
        trajectory_error(answer, surrogate.collocation_as_fine_as(finer()), surrogate.measure());
    return {kSafety * error + kFloor * tolerance_, answer.work, {}};
  }

  [[nodiscard]] Trajectory run(const PlanSurrogate& surrogate, const PlanBudget& /*budget*/,
                               const std::vector<double>& times_s) const override {
    const bool made = layers() == 0 && times_s == surrogate.times();
    if (made) return surrogate.collocation(tolerance_);
    QuasiStaticOptions options;
    options.tolerance = tolerance_;
    return own(surrogate.scene()).quasi_static(options, times_s, surrogate.wants_field());
  }

 private:
  // At fewer times errors between them have been seen to be 3.5 times those at them.
  static constexpr double kSafety = 5.0;
  static constexpr double kFloor = 2e-2;   // of the tolerance: what forces left unbalanced hide
  static constexpr double kFinest = 1e-9;  // ten times that of the reference
  static constexpr double kUsual = 1e-6;
  static constexpr double kUsualFinest = 0.9e-5;

  /// The tolerance of the run that it is compared with.
  [[nodiscard]] double finer() const {
    return std::max(0.01 * tolerance_, last_resort() ? kFinest : kUsual);
  }
  double tolerance_;
};

/// Collocation with one step a period: what a servo can do with the network as it is.
class NetworkStepCandidate final : public LayeredCandidate {
 public:
  explicit NetworkStepCandidate(int layers) : LayeredCandidate(layers) {}
  [[nodiscard]] std::string name() const override { return "network_step" + suffix(); }
  [[nodiscard]] std::string formulation() const override { return "network_step"; }
  [[nodiscard]] bool cheaper_than_reference() const override { return false; }
  [[nodiscard]] std::string settings() const override {
    return fmt::format("a step a period, {} stages{}", kStages, words());
  }
  [[nodiscard]] std::optional<std::string> why_not(const PlanSurrogate& surrogate,
                                                   const PlanBudget& budget) const override {
    if (!budget.rate_Hz) return "steps a servo's period, and there is none";
    return LayeredCandidate::why_not(surrogate, budget);
  }
  [[nodiscard]] OperationCount work_to_claim(const PlanSurrogate& surrogate) const override {
    OperationCount work = newton_iteration_work(surrogate.scene().driven()).times(3.0 * kTried);
    if (layers() > 0) work += surrogate.work_to_compare();
    return work;
  }

  [[nodiscard]] ModelClaim claim(const PlanSurrogate& surrogate,
                                 const PlanBudget& budget) const override {
    const PlanScene scene = own(surrogate.scene());
    // Long protocols are tried at longer steps, of which the error is known to be larger.
    const double period = budget.period_s().value();
    const double step = std::max(period, scene.duration_s() / kTried);
    const Trajectory answer = stepped(scene, step, surrogate.times(), surrogate.wants_field());
    ModelClaim claim;
    claim.of_period = answer.work.times(kWorst / answer.steps);
    claim.work = answer.work.times(scene.duration_s() / period / answer.steps);
    if (layers() > 0 || surrogate.inertial()) {
      claim.error = surrogate.claim_of(answer);
      return claim;
    }
    const Trajectory half = stepped(scene, 0.5 * step, surrogate.times(), surrogate.wants_field());
    const double halved = trajectory_error(answer, half, surrogate.measure());
    claim.error = kSafety * halved * std::min(1.0, period / step) + kFloor * kTolerance;
    return claim;
  }

  [[nodiscard]] Trajectory run(const PlanSurrogate& surrogate, const PlanBudget& budget,
                               const std::vector<double>& times_s) const override {
    return stepped(own(surrogate.scene()), budget.period_s().value(), times_s,
                   surrogate.wants_field());
  }

 private:
  static constexpr int kStages = 2;
  static constexpr double kTolerance = 1e-4;  // of what is left unbalanced
  static constexpr double kFloor = 0.5;       // errors of 0.2 have been seen under a ball
  static constexpr double kTried = 150.0;     // steps of a protocol, for the claim
  static constexpr double kSafety = 2.0;
  static constexpr double kWorst = 2.0;  // iterations of the costliest step, against the mean

  [[nodiscard]] static Trajectory stepped(const PlanScene& scene, double step_s,
                                          const std::vector<double>& times_s, bool with_field) {
    QuasiStaticOptions options;
    options.tolerance = kTolerance;
    options.stages = kStages;
    options.step_s = step_s;
    return scene.quasi_static(options, times_s, with_field);
  }
};

class InertialCandidate final : public PlanModel {
 public:
  explicit InertialCandidate(double tolerance) : tolerance_(tolerance) {}
  [[nodiscard]] std::string name() const override {
    return fmt::format("inertial_{}", shortest(tolerance_));
  }
  [[nodiscard]] std::string formulation() const override { return "inertial"; }
  [[nodiscard]] std::string settings() const override {
    return fmt::format("tolerance {}", shortest(tolerance_));
  }
  [[nodiscard]] ModelReach reach() const override { return ModelReach::full; }
  [[nodiscard]] bool has_masses() const override { return true; }
  [[nodiscard]] bool last_resort() const override { return tolerance_ < kUsualFinest; }
  [[nodiscard]] std::optional<std::string> why_not(const PlanSurrogate& surrogate,
                                                   const PlanBudget& /*budget*/) const override {
    if (!surrogate.inertial()) return "has masses, which scene and reference leave out";
    return std::nullopt;
  }
  [[nodiscard]] std::optional<std::string> why_no_servo() const override {
    return "its steps follow the error: no bound on the cost of a period";
  }
  [[nodiscard]] ModelClaim claim(const PlanSurrogate& surrogate,
                                 const PlanBudget& /*budget*/) const override {
    const Trajectory& answer = surrogate.with_masses(tolerance_);
    const double finest = surrogate.finest_with_masses(0.1 * tolerance_);
    const double error = std::max(
        trajectory_error(answer, surrogate.with_masses(finest), surrogate.measure()), tolerance_);
    const bool trusted = finest <= kTrusted * tolerance_ && !surrogate.scene().has_tools();
    return {(trusted ? kSafetyBesideTrusted : kSafety) * error, answer.work, {}};
  }
  [[nodiscard]] Trajectory run(const PlanSurrogate& surrogate, const PlanBudget& /*budget*/,
                               const std::vector<double>& times_s) const override {
    if (surrogate.inertial() && times_s == surrogate.times()) {
      return surrogate.with_masses(tolerance_);
    }
    return surrogate.scene().inertial(inertial_options(surrogate.scene(), tolerance_), times_s,
                                      surrogate.wants_field());
  }

 private:
  // Errors gather over many periods of ringing: a run at a tenth of the tolerance can err by 0.4 of
  // what is measured against it. Under tools steps follow the instants that are asked for, and the
  // next run may not be as lucky.
  static constexpr double kSafety = 4.0;
  // A run of order 2 at a hundredth of the tolerance, such as the reference, errs by a twentieth.
  static constexpr double kTrusted = 0.0100001, kSafetyBesideTrusted = 1.5;
  static constexpr double kUsualFinest = 0.9e-5;
  double tolerance_;
};

}  // namespace

PlanModels network_step_candidates(const PlanScene& scene) {
  PlanModels models;
  for (int layers = 1; layers < scene.moving_layers(); ++layers) {
    models.push_back(std::make_unique<NetworkStepCandidate>(layers));
  }
  models.push_back(std::make_unique<NetworkStepCandidate>(0));
  return models;
}

PlanModels collocation_candidates(const PlanScene& scene) {
  PlanModels models;
  const auto add = [&](double tolerance, int layers) {
    models.push_back(std::make_unique<CollocationCandidate>(tolerance, layers));
  };
  // That at 1e-3 first: its run is made anyway, and others are tried only while there is time once
  // one meets the tolerance.
  add(1e-3, 0);
  for (int layers = 1; layers < scene.moving_layers(); ++layers) add(1e-3, layers);
  for (const double tolerance : {1e-2, 1e-4, 1e-5, 1e-6, 1e-7}) add(tolerance, 0);
  return models;
}

PlanModels inertial_candidates() {
  PlanModels models;
  for (const double tolerance : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7}) {
    models.push_back(std::make_unique<InertialCandidate>(tolerance));
  }
  return models;
}

}  // namespace tpm::plan
