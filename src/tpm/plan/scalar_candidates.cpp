// Declared in tpm/plan/plan_model.hpp.
// Models of the contact alone: the element, linear and with two static curves.
#include <fmt/format.h>

#include "tpm/organ/scene/exponentials.hpp"
#include "tpm/plan/plan_model.hpp"
#include "tpm/plan/scalar_contact.hpp"
#include "tpm/plan/scalar_run.hpp"

namespace tpm::plan {
namespace {

/// Common part of these candidates: a ScalarModel made for the scene and stepped over the protocol.
class ScalarCandidate : public PlanModel {
 public:
  [[nodiscard]] std::optional<std::string> why_not(const PlanSurrogate& surrogate,
                                                   const PlanBudget& /*budget*/) const override {
    if (surrogate.scene().has_tools()) return "a tool touches and leaves spheres";
    if (surrogate.scene().has_own_protocols()) return "knows one protocol, not those of contacts";
    if (surrogate.wants_field() && !knows_field()) return "knows the contact's force only";
    return std::nullopt;
  }

  [[nodiscard]] ModelClaim claim(const PlanSurrogate& surrogate,
                                 const PlanBudget& budget) const override {
    const Trajectory answer = run(surrogate, budget, surrogate.times());
    return {surrogate.claim_of(answer), answer.work, of_step(surrogate)};
  }

  [[nodiscard]] Trajectory run(const PlanSurrogate& surrogate, const PlanBudget& budget,
                               const std::vector<double>& times_s) const override;

  [[nodiscard]] bool for_loop() const override { return true; }
  [[nodiscard]] std::vector<std::unique_ptr<ContactModel>> contacts(
      const PlanSurrogate& surrogate, std::span<const double> periods_s) const override {
    constexpr double kBuiltRange = 1.05;  // as of other contact models
    const ContactSpectrum& spectrum = surrogate.spectrum();
    const ScalarContact::Range range{spectrum.instantaneous(), spectrum.equilibrium(),
                                     kBuiltRange * surrogate.scene().protocol().peak()};
    std::vector<std::unique_ptr<ContactModel>> models;
    for (const double period_s : periods_s) {
      models.push_back(std::make_unique<ScalarContact>(
          model(surrogate), surrogate.scene().scene().probe().direction, range, period_s));
    }
    return models;
  }

 protected:
  [[nodiscard]] virtual ScalarModel model(const PlanSurrogate& surrogate) const = 0;
  [[nodiscard]] virtual bool knows_field() const { return true; }
  [[nodiscard]] virtual double terms() const = 0;  ///< exponentials, curves and roots in a step

  /// The operations of a step, under a load those of the search for the depth.
  [[nodiscard]] OperationCount of_step(const PlanSurrogate& surrogate) const {
    constexpr double kSearch = 4.0;
    OperationCount step;
    step.add(Operation::scalar_step, 1.0).add(Operation::scalar_term, terms());
    if (!surrogate.scene().by_depth()) step = step.times(kSearch);
    if (surrogate.wants_field()) {
      step.add(Operation::dense_flop,
               6.0 * static_cast<double>(surrogate.scene().network().organ.size()));
    }
    return step;
  }
};

Trajectory ScalarCandidate::run(const PlanSurrogate& surrogate, const PlanBudget& budget,
                                const std::vector<double>& times_s) const {
  constexpr double kSteps = 400.0;  // of a protocol, where no rate is given
  const PlanScene& scene = surrogate.scene();
  ScalarRun run(scene.protocol(), model(surrogate),
                budget.period_s().value_or(scene.duration_s() / kSteps));
  Trajectory answer;
  answer.response.resize(std::ssize(times_s));
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const double response = run.at(times_s[i]);
    answer.response[static_cast<Eigen::Index>(i)] = response;
    if (!surrogate.wants_field()) continue;
    // The part that has not relaxed yet, as a depth.
    const ScalarModel& at = run.model();
    const double stiffness = at.relaxing().stiffness_N_per_m;
    double followed = 0.0;
    for (std::size_t k = 0; k < at.branches().size(); ++k) {
      followed += at.branches()[k].share * at.viscous_N()[k];
    }
    const double fresh = stiffness > 0.0 ? at.depth_m() - followed / stiffness : 0.0;
    const ContactSpectrum& spectrum = surrogate.spectrum();
    answer.displacement.emplace_back(spectrum.field_relaxed * at.depth_m() +
                                     (spectrum.field_instantaneous - spectrum.field_relaxed) *
                                         fresh);
  }
  answer.steps = budget.rate_Hz ? scene.duration_s() * *budget.rate_Hz : run.steps();
  answer.work = of_step(surrogate).times(answer.steps);
  return answer;
}

class LinearCandidate : public ScalarCandidate {
 public:
  explicit LinearCandidate(int branches) : branches_(branches) {}
  [[nodiscard]] std::string name() const override { return fmt::format("linear_{}", branches_); }
  [[nodiscard]] std::string formulation() const override { return "linear"; }
  [[nodiscard]] std::string settings() const override {
    return fmt::format("{} exponential{}", branches_, branches_ == 1 ? "" : "s");
  }

 protected:
  [[nodiscard]] double terms() const override { return branches_; }
  [[nodiscard]] ScalarModel model(const PlanSurrogate& surrogate) const override {
    return linear_contact(surrogate.spectrum(), branches_);
  }

 private:
  int branches_;
};

/// The paper's element with the contact's stiffness, and the tension of its two lateral bonds.
class ElementCandidate final : public LinearCandidate {
 public:
  ElementCandidate() : LinearCandidate(1) {}
  [[nodiscard]] std::string name() const override { return "element"; }
  [[nodiscard]] std::string formulation() const override { return "element"; }
  [[nodiscard]] std::string settings() const override { return "with the contact's stiffness"; }

 protected:
  [[nodiscard]] double terms() const override { return 2.0; }
  [[nodiscard]] ScalarModel model(const PlanSurrogate& surrogate) const override {
    const ContactSpectrum& spectrum = surrogate.spectrum();
    const Tissue& tissue = surrogate.scene().scene().tissue;
    const BondMaterial& material = tissue.materials.materials.front();
    DepthCurve equilibrium{
        .stiffness_N_per_m = spectrum.equilibrium(),
        .tension_N_per_m = 2.0 * material.lateral_Pa * material.modulus_to_stiffness_m(),
        .spacing_m = tissue.network.organ.spacing};
    return {std::move(equilibrium),
            {.stiffness_N_per_m = spectrum.instantaneous() - spectrum.equilibrium()},
            fitted_branches(spectrum, 1),
            1.0};
  }
};

/// Static curves of the nonlinear network instantaneous and relaxed, and the linear network's
/// shares.
class CurvesCandidate final : public ScalarCandidate {
 public:
  explicit CurvesCandidate(int branches) : branches_(branches) {}
  [[nodiscard]] std::string name() const override { return fmt::format("curves_{}", branches_); }
  [[nodiscard]] std::string formulation() const override { return "curves"; }
  [[nodiscard]] std::string settings() const override {
    return fmt::format("{} exponential{}", branches_, branches_ == 1 ? "" : "s");
  }
  [[nodiscard]] std::optional<std::string> why_not(const PlanSurrogate& surrogate,
                                                   const PlanBudget& budget) const override {
    if (!surrogate.scene().by_depth() && !surrogate.scene().single_sphere()) {
      return "under a load the spheres of a patch do not move alike";
    }
    return ScalarCandidate::why_not(surrogate, budget);
  }
  [[nodiscard]] OperationCount work_to_claim(const PlanSurrogate& surrogate) const override {
    OperationCount work = surrogate.work_to_compare();
    // One curve instantaneous, one at equilibrium.
    if (!surrogate.has_curves()) work += surrogate.coarse_or_first().work.times(2.0);
    return work;
  }

 protected:
  [[nodiscard]] bool knows_field() const override { return false; }
  [[nodiscard]] double terms() const override { return branches_ + 6.0; }
  [[nodiscard]] ScalarModel model(const PlanSurrogate& surrogate) const override {
    return curves_contact(surrogate.curves(), surrogate.spectrum(), branches_);
  }

 private:
  int branches_;
};

}  // namespace

PlanModels linear_candidates() {
  PlanModels models;
  for (int branches = 1; branches <= most_exponentials("linear"); ++branches) {
    models.push_back(std::make_unique<LinearCandidate>(branches));
  }
  return models;
}

PlanModels element_candidates() {
  PlanModels models;
  models.push_back(std::make_unique<ElementCandidate>());
  return models;
}

PlanModels curves_candidates() {
  PlanModels models;
  for (int branches = 1; branches <= most_exponentials("curves"); ++branches) {
    models.push_back(std::make_unique<CurvesCandidate>(branches));
  }
  return models;
}

}  // namespace tpm::plan
