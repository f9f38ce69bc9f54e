#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/plan/plan_surrogate.hpp"
#include "tpmkit/contact_model.hpp"

namespace tpm::plan {

/// Budget of a model: its largest delay, in periods, and its rate.
struct PlanBudget {
  std::optional<double> rate_Hz;       ///< of a servo loop: every period needs its answer
  std::optional<double> wall_s_per_s;  ///< computing time per simulated second
  [[nodiscard]] std::optional<double> period_s() const {
    if (!rate_Hz) return std::nullopt;
    return 1.0 / *rate_Hz;
  }
};

/// Claim of a model before it is verified.
struct ModelClaim {
  double error = 0.0;        ///< bound, in parts of the peak
  OperationCount work;       ///< of the whole protocol; at a servo rate of all its periods
  OperationCount of_period;  ///< the costliest period, where the model can be stepped by a servo
};

/// Part of the tissue that a model knows.
enum class ModelReach {
  reduced,  ///< the contact alone
  full,     ///< the nonlinear network
};

/// One candidate: a formulation with its settings.
class PlanModel {
 public:
  PlanModel() = default;
  PlanModel(const PlanModel&) = delete;
  PlanModel& operator=(const PlanModel&) = delete;
  virtual ~PlanModel() = default;

  [[nodiscard]] virtual std::string name() const = 0;         ///< "linear_2"
  [[nodiscard]] virtual std::string formulation() const = 0;  ///< "linear"
  [[nodiscard]] virtual std::string settings() const = 0;     ///< in words; may be empty
  [[nodiscard]] virtual ModelReach reach() const { return ModelReach::reduced; }
  /// It has masses.
  [[nodiscard]] virtual bool has_masses() const { return false; }
  /// Takes less than the reference: verified even if it is not picked, so that the frontier shows
  /// how far claims are off.
  [[nodiscard]] virtual bool cheaper_than_reference() const {
    return reach() == ModelReach::reduced;
  }
  /// Tried only if no coarser network meets the tolerance: nearly as dear as the reference.
  [[nodiscard]] virtual bool last_resort() const { return false; }

  /// About what building it takes, beside runs of the network.
  [[nodiscard]] virtual OperationCount work_to_build(const PlanScene& /*scene*/) const {
    return {};
  }
  /// About what the runs for its claim take that were not made yet: by default that which models
  /// are compared with.
  [[nodiscard]] virtual OperationCount work_to_claim(const PlanSurrogate& surrogate) const {
    return surrogate.work_to_compare();
  }

  /// Why the model has no answer to a scene at all; none if it has.
  [[nodiscard]] virtual std::optional<std::string> why_not(const PlanSurrogate& surrogate,
                                                           const PlanBudget& budget) const = 0;
  /// Why a servo cannot step it, whatever it costs; none if it can.
  [[nodiscard]] virtual std::optional<std::string> why_no_servo() const { return std::nullopt; }
  /// contacts() has models.
  [[nodiscard]] virtual bool for_loop() const { return false; }
  /// Model that a servo loop steps, at rest, one for each period; none unless for_loop(). Throws as
  /// claim() does.
  [[nodiscard]] virtual std::vector<std::unique_ptr<ContactModel>> contacts(
      const PlanSurrogate& /*surrogate*/, std::span<const double> /*periods_s*/) const {
    return {};
  }
  /// Throws Error(numerical) where the model fails.
  [[nodiscard]] virtual ModelClaim claim(const PlanSurrogate& surrogate,
                                         const PlanBudget& budget) const = 0;
  /// The answer over the protocol, as the model would be used under the budget.
  [[nodiscard]] virtual Trajectory run(const PlanSurrogate& surrogate, const PlanBudget& budget,
                                       const std::vector<double>& times_s) const = 0;
};

using PlanModels = std::vector<std::unique_ptr<PlanModel>>;

/// Has candidates for plans: a role of a formulation (formulation/formulation.hpp). A formulation
/// with the capability `planned` that runs scenes and has no such role has one candidate, which
/// claims what its difference from the coarse run of the network shows (run_candidate.cpp).
class PlanOffer {
 public:
  PlanOffer() = default;
  PlanOffer(const PlanOffer&) = delete;
  PlanOffer& operator=(const PlanOffer&) = delete;
  virtual ~PlanOffer() = default;
  [[nodiscard]] virtual PlanModels candidates(const PlanScene& scene) const = 0;
};

/// All candidates for a scene: those of every formulation, by rank.
[[nodiscard]] PlanModels plan_models(const PlanScene& scene);

// The candidates of the formulations that a plan knows well.
[[nodiscard]] PlanModels linear_candidates();
[[nodiscard]] PlanModels element_candidates();
[[nodiscard]] PlanModels curves_candidates();
[[nodiscard]] PlanModels condensed_candidates();
[[nodiscard]] PlanModels servo_network_candidates();
[[nodiscard]] PlanModels network_step_candidates(const PlanScene& scene);
[[nodiscard]] PlanModels collocation_candidates(const PlanScene& scene);
[[nodiscard]] PlanModels inertial_candidates();
/// That of any formulation that runs scenes.
[[nodiscard]] std::unique_ptr<PlanModel> run_candidate(const Formulation& formulation);

/// Runs a scene by a candidate, which is made for it, at the step of the scene's formulation or a
/// millisecond. Throws Error(bad_input) with the reason where the candidate has no answer.
[[nodiscard]] Trajectory run_candidate_on(const PlanModel& candidate, const ExperimentScene& scene,
                                          const std::vector<double>& times_s, bool with_field);

}  // namespace tpm::plan
