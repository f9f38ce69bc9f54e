// Declared in tpm/plan/plan_model.hpp.
// Contact models that a servo steps: the network seen from one sphere in three directions.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/plan/plan_model.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

constexpr double kParallel = 1e-9;
constexpr double kRange = 1.05;  // that models are built for, in parts of the depth

/// A model built for a scene, and what its steps take.
struct BuiltContact {
  std::unique_ptr<ContactModel> model;
  OperationCount of_step;  ///< beside its balances
  OperationCount of_balance;
  int most_balances = 0;               ///< a step
  std::function<int()> balances = {};  ///< of the last step; none: 0
};

/// The scene lets the sphere slide along its own push.
bool is_guided(const PlanScene& scene) {
  const Probe& probe = scene.scene().probe();
  const auto& sliders = scene.scene().tissue.sliders;
  return std::any_of(sliders.begin(), sliders.end(),
                     [&](const Slider& slider) { return slider.sphere == probe.sphere; });
}

/// Of the tissue, the contact free: where it is, a ContactModel is told.
Constraints freedom_around(const PlanScene& scene) {
  Tissue tissue = scene.scene().tissue;
  const std::size_t contact = scene.scene().probe().sphere;
  std::erase_if(tissue.sliders, [&](const Slider& slider) { return slider.sphere == contact; });
  return tissue.constraints();
}

/// A ContactModel moved through a protocol of depths. Where the scene leaves its sphere free across
/// the push, and a ContactModel wants to be told, it is taken along by what the linear network
/// says, and put right each period by the force across of the period before.
class ContactRun {
 public:
  ContactRun(const PlanScene& scene, const BuiltContact& built)
      : protocol_(scene.protocol()),
        built_(built),
        model_(*built.model),
        into_(scene.scene().probe().direction),
        across_(across(into_)),
        period_s_(model_.period_s()),
        time_s_(protocol_.start_s()) {
    model_.reset();
    if (is_guided(scene)) return;
    const Eigen::Matrix3d k = model_.instantaneous_stiffness();
    const Eigen::Matrix2d free = across_.transpose() * k * across_;
    compliance_ = free.inverse();
    follows_ = -compliance_ * (across_.transpose() * k * into_);
  }

  /// The response at a time, between the periods around it.
  double at(double time_s) {
    while (time_s_ < time_s) {
      before_s_ = time_s_;
      before_N_ = force_N_;
      time_s_ = protocol_.start_s() + ++periods_ * period_s_;
      step();
    }
    const double share = time_s_ > before_s_ ? (time_s - before_s_) / (time_s_ - before_s_) : 1.0;
    return before_N_ + std::clamp(share, 0.0, 1.0) * (force_N_ - before_N_);
  }
  [[nodiscard]] double mean_balances() const { return balances_ / std::max(periods_, 1.0); }
  [[nodiscard]] bool trusted() const { return trusted_; }

 private:
  static Eigen::Matrix<double, 3, 2> across(const Eigen::Vector3d& into) {
    Eigen::Matrix<double, 3, 2> axes;
    axes.col(0) = into.unitOrthogonal();
    axes.col(1) = into.cross(axes.col(0));
    return axes;
  }

  void step() {
    const double depth = value_at(protocol_, time_s_);
    aside_ += follows_ * (depth - depth_m_);
    depth_m_ = depth;
    const ContactAnswer answer = model_.step(depth * into_ + across_ * aside_);
    // The force of the tissue on the contact pushes it back.
    force_N_ = -answer.force_N.dot(into_);
    aside_ += compliance_ * (across_.transpose() * answer.force_N);
    if (built_.balances) balances_ += built_.balances();
    trusted_ = trusted_ && answer.valid;
  }

  const Protocol& protocol_;
  const BuiltContact& built_;
  ContactModel& model_;
  Eigen::Vector3d into_;
  Eigen::Matrix<double, 3, 2> across_;
  Eigen::Matrix2d compliance_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d follows_ = Eigen::Vector2d::Zero(), aside_ = Eigen::Vector2d::Zero();
  double period_s_, time_s_, before_s_ = 0.0, periods_ = 0.0;
  double depth_m_ = 0.0, force_N_ = 0.0, before_N_ = 0.0;
  double balances_ = 0.0;
  bool trusted_ = true;
};

OperationCount counted(const BalanceWork& work) {
  return OperationCount()
      .add(Operation::servo_bond, static_cast<double>(work.bonds))
      .add(Operation::servo_block, static_cast<double>(work.blocks))
      .add(Operation::panel_product, static_cast<double>(work.products));
}

/// Common part of these candidates.
class ContactCandidate : public PlanModel {
 public:
  [[nodiscard]] std::optional<std::string> why_not(const PlanSurrogate& surrogate,
                                                   const PlanBudget& budget) const override {
    const PlanScene& scene = surrogate.scene();
    if (!budget.rate_Hz) return "steps a servo's period, and there is none";
    if (!scene.by_depth()) return "sees spheres that are moved";
    if (scene.has_loads()) return "begins without loads";
    if (!scene.single_sphere()) return "sees one sphere that is moved";
    if (scene.jumps()) return "a servo's contact does not jump";
    const Probe& probe = scene.scene().probe();
    const Constraints constraints = scene.scene().tissue.constraints();
    const Eigen::Vector3d along = constraints.projector(probe.sphere) * probe.direction;
    if (!along.isApprox(probe.direction, kParallel)) return "the contact is guided elsewhere";
    if (surrogate.wants_field()) return "is planned for its force only";
    for (const Knot& knot : scene.protocol().knots()) {
      if (knot.value < 0.0) return "its range is a push";
    }
    return std::nullopt;
  }

  [[nodiscard]] ModelClaim claim(const PlanSurrogate& surrogate,
                                 const PlanBudget& budget) const override {
    const BuiltContact built = build(surrogate.scene(), budget.period_s().value(), kPortable);
    const Trajectory answer = moved(surrogate.scene(), built, surrogate.times());
    OperationCount worst = built.of_balance.times(built.most_balances);
    worst += built.of_step;
    return {surrogate.claim_of(answer), answer.work, worst};
  }

  [[nodiscard]] Trajectory run(const PlanSurrogate& surrogate, const PlanBudget& budget,
                               const std::vector<double>& times_s) const override {
    return moved(surrogate.scene(), build(surrogate.scene(), budget.period_s().value(), kPortable),
                 times_s);
  }

  [[nodiscard]] bool for_loop() const override { return true; }
  [[nodiscard]] std::vector<std::unique_ptr<ContactModel>> contacts(
      const PlanSurrogate& surrogate, std::span<const double> periods_s) const override {
    std::vector<std::unique_ptr<ContactModel>> models;
    for (const double period_s : periods_s) {
      models.push_back(build(surrogate.scene(), period_s, !kPortable).model);
    }
    return models;
  }

 protected:
  /// @param portable the same answer on every machine, where the model has the choice
  [[nodiscard]] virtual BuiltContact build(const PlanScene& scene, double period_s,
                                           bool portable) const = 0;

 private:
  static constexpr bool kPortable = true;
  [[nodiscard]] Trajectory moved(const PlanScene& scene, const BuiltContact& built,
                                 const std::vector<double>& times_s) const {
    ContactRun run(scene, built);
    Trajectory answer;
    answer.response.resize(std::ssize(times_s));
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      answer.response[static_cast<Eigen::Index>(i)] = run.at(times_s[i]);
    }
    if (!run.trusted()) {
      throw Error(ExitCode::numerical, name(), "does not trust its answer within the protocol");
    }
    answer.steps = scene.duration_s() / built.model->period_s();
    answer.work = built.of_step.times(answer.steps);
    answer.work += built.of_balance.times(answer.steps * run.mean_balances());
    return answer;
  }
};

/// The network on its slow manifold (docs/theory.md).
class CondensedCandidate final : public ContactCandidate {
 public:
  [[nodiscard]] std::string name() const override { return "condensed"; }
  [[nodiscard]] std::string formulation() const override { return "condensed"; }
  [[nodiscard]] std::string settings() const override { return "potential of a slow manifold"; }
  [[nodiscard]] OperationCount work_to_build(const PlanScene& scene) const override {
    return newton_iteration_work(scene.driven()).times(600.0);
  }
  [[nodiscard]] std::vector<std::unique_ptr<ContactModel>> contacts(
      const PlanSurrogate& surrogate, std::span<const double> periods_s) const override {
    std::vector<std::unique_ptr<ContactModel>> models;
    if (periods_s.empty()) return models;
    const CondensedContact fitted = condensed(surrogate.scene(), periods_s.front());
    for (const double period_s : periods_s) {
      models.push_back(std::make_unique<CondensedContact>(fitted.with_period(period_s)));
    }
    return models;
  }

 protected:
  [[nodiscard]] BuiltContact build(const PlanScene& scene, double period_s,
                                   bool /*portable*/) const override {
    BuiltContact built;
    built.model = std::make_unique<CondensedContact>(condensed(scene, period_s));
    built.of_step.add(Operation::condensed_step, 1.0);
    return built;
  }

 private:
  [[nodiscard]] static CondensedContact condensed(const PlanScene& scene, double period_s) {
    constexpr double kAside = 0.25;  // of the depth, across
    const double depth = scene.protocol().peak();
    CondensedOptions options;
    options.depth_m = depth;
    options.tangential_m = kAside * depth;
    options.period_s = period_s;
    const DrivenNetwork& driven = scene.driven();
    const Probe& probe = scene.scene().probe();
    return build_condensed(driven.bonds, driven.rest, freedom_around(scene), probe.sphere,
                           probe.direction, options);
  }
};

/// The nonlinear network with a stiffness that was factorised beforehand, in single precision.
class ServoCandidate final : public ContactCandidate {
 public:
  [[nodiscard]] std::string name() const override { return "servo_network"; }
  [[nodiscard]] std::string formulation() const override { return "servo_network"; }
  [[nodiscard]] std::string settings() const override { return "factorised at half the depth"; }
  [[nodiscard]] OperationCount work_to_build(const PlanScene& scene) const override {
    return newton_iteration_work(scene.driven()).times(30.0);
  }
  [[nodiscard]] ModelReach reach() const override { return ModelReach::full; }

 protected:
  [[nodiscard]] BuiltContact build(const PlanScene& scene, double period_s,
                                   bool portable) const override {
    ServoNetworkOptions options;
    options.period_s = period_s;
    options.frozen_depth_m = 0.5 * scene.protocol().peak();
    options.deepest_m = kRange * scene.protocol().peak();
    options.portable = portable;
    const DrivenNetwork& driven = scene.driven();
    const Probe& probe = scene.scene().probe();
    auto network = std::make_unique<ServoNetwork>(driven.bonds, driven.rest, freedom_around(scene),
                                                  probe.sphere, probe.direction, options);
    BuiltContact built;
    built.of_step.add(Operation::contact_step, 1.0);
    built.of_balance = counted(network->work());
    built.most_balances = options.most_balances;
    built.balances = [&counting = *network] { return counting.balances(); };
    built.model = std::move(network);
    return built;
  }
};

}  // namespace

PlanModels condensed_candidates() {
  PlanModels models;
  models.push_back(std::make_unique<CondensedCandidate>());
  return models;
}

PlanModels servo_network_candidates() {
  PlanModels models;
  models.push_back(std::make_unique<ServoCandidate>());
  return models;
}

}  // namespace tpm::plan
