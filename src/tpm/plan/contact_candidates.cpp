// Contact models that a servo steps: the network seen from one sphere in three directions.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/plan/plan_model.hpp"
#include "tpm/reduce/condensed.hpp"
#include "tpm/reduce/servo_network.hpp"

namespace tpm {
namespace {

/// A ContactModel moved through a protocol of depths. The scene leaves its sphere free across the
/// push, where a ContactModel wants to be told: it is taken along by what the linear network says,
/// and put right each period by the force across of the period before.
class ContactRun {
 public:
  ContactRun(const PlanScene& scene, ContactModel& model)
      : protocol_(scene.protocol()),
        model_(model),
        into_(scene.scene().probe().direction),
        across_(across(into_)),
        period_s_(model.period_s()),
        time_s_(protocol_.start_s()) {
    const Eigen::Matrix3d k = model.instantaneous_stiffness();
    const Eigen::Matrix2d free = across_.transpose() * k * across_;
    compliance_ = free.inverse();
    follows_ = -compliance_ * (across_.transpose() * k * into_);
    model_.reset();
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
  [[nodiscard]] double largest_error_N() const { return largest_error_N_; }
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
    largest_error_N_ = std::max(largest_error_N_, answer.error_N);
    trusted_ = trusted_ && answer.trusted;
  }

  const Protocol& protocol_;
  ContactModel& model_;
  Eigen::Vector3d into_;
  Eigen::Matrix<double, 3, 2> across_;
  Eigen::Matrix2d compliance_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d follows_ = Eigen::Vector2d::Zero(), aside_ = Eigen::Vector2d::Zero();
  double period_s_, time_s_, before_s_ = 0.0, periods_ = 0.0;
  double depth_m_ = 0.0, force_N_ = 0.0, before_N_ = 0.0;
  double largest_error_N_ = 0.0;
  bool trusted_ = true;
};

/// What is common to them.
class ContactCandidate : public PlanModel {
 public:
  [[nodiscard]] std::optional<std::string> why_not(const PlanScout& scout,
                                                   const PlanBudget& budget) const override {
    const PlanScene& scene = scout.scene();
    if (!budget.rate_Hz) return "steps a servo's period, and there is none";
    if (!scene.single_sphere() || !scene.by_depth()) return "sees one sphere that is moved";
    if (scene.jumps()) return "a servo's contact does not jump";
    const std::size_t sphere = scene.scene().probe().sphere;
    if (!scene.driven().freedom.is_free(sphere)) return "the contact is guided";
    if (scout.wants_field()) return "is planned for its force only";
    for (const Knot& knot : scene.protocol().knots()) {
      if (knot.value < 0.0) return "its range is a push";
    }
    return std::nullopt;
  }

  [[nodiscard]] ModelClaim claim(const PlanScout& scout, const PlanBudget& budget) const override {
    const PlanTrajectory answer = run(scout, budget, scout.times());
    return {scout.claim_of(answer), answer.work, work_of_step(scout.scene())};
  }

  [[nodiscard]] PlanTrajectory run(const PlanScout& scout, const PlanBudget& budget,
                                   const std::vector<double>& times_s) const override {
    const PlanScene& scene = scout.scene();
    const std::unique_ptr<ContactModel> model = build(scene, budget.period_s().value());
    ContactRun run(scene, *model);
    PlanTrajectory answer;
    answer.response.resize(std::ssize(times_s));
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      answer.response[static_cast<Eigen::Index>(i)] = run.at(times_s[i]);
    }
    if (!run.trusted()) {
      throw Error(ExitCode::numerical, name(), "does not trust its answer within the protocol");
    }
    answer.steps = scene.duration_s() / model->period_s();
    answer.work = work_of_step(scene).times(answer.steps);
    return answer;
  }

 protected:
  [[nodiscard]] virtual std::unique_ptr<ContactModel> build(const PlanScene& scene,
                                                            double period_s) const = 0;
  [[nodiscard]] virtual OperationCount work_of_step(const PlanScene& scene) const = 0;
};

/// The network on its slow manifold (docs/reduction.md).
class CondensedCandidate final : public ContactCandidate {
 public:
  [[nodiscard]] std::string name() const override { return "condensed"; }
  [[nodiscard]] std::string formulation() const override { return "condensed"; }
  [[nodiscard]] std::string settings() const override { return "potential of a slow manifold"; }

 protected:
  [[nodiscard]] std::unique_ptr<ContactModel> build(const PlanScene& scene,
                                                    double period_s) const override {
    constexpr double kAside = 0.25;  // of the depth, across
    const double depth = scene.protocol().peak();
    CondensedOptions options;
    options.depth_m = depth;
    options.tangential_m = kAside * depth;
    options.period_s = period_s;
    const DrivenNetwork& driven = scene.driven();
    const Probe& probe = scene.scene().probe();
    return std::make_unique<CondensedContact>(build_condensed(
        driven.bonds, driven.rest, driven.freedom, probe.sphere, probe.direction, options));
  }
  [[nodiscard]] OperationCount work_of_step(const PlanScene& /*scene*/) const override {
    // Polynomials with gradients, two evaluations a step: docs/reduction.md times them.
    constexpr double kFlops = 1500.0;
    return OperationCount().add(Operation::scalar_step, 1.0).add(Operation::dense_flop, kFlops);
  }
};

/// The nonlinear network with a stiffness that was factorised beforehand, in single precision.
class ServoCandidate final : public ContactCandidate {
 public:
  [[nodiscard]] std::string name() const override { return "servo_network"; }
  [[nodiscard]] std::string formulation() const override { return "servo_network"; }
  [[nodiscard]] std::string settings() const override { return "factorised at half the depth"; }
  [[nodiscard]] ModelReach reach() const override { return ModelReach::full; }

 protected:
  [[nodiscard]] std::unique_ptr<ContactModel> build(const PlanScene& scene,
                                                    double period_s) const override {
    ServoNetworkOptions options;
    options.period_s = period_s;
    options.frozen_depth_m = 0.5 * scene.protocol().peak();
    options.deepest_m = 1.05 * scene.protocol().peak();
    options.portable = true;  // the same answer on every machine
    const DrivenNetwork& driven = scene.driven();
    const Probe& probe = scene.scene().probe();
    return std::make_unique<ServoNetwork>(driven.bonds, driven.rest, driven.freedom, probe.sphere,
                                          probe.direction, options);
  }
  [[nodiscard]] OperationCount work_of_step(const PlanScene& scene) const override {
    // Two balances a step; a bond and a block in single precision take about a lane's share.
    constexpr double kBalances = 2.0;
    return scene.iteration_work().times(kBalances / kLanes);
  }
};

}  // namespace

void add_contact_models(PlanModels& models) {
  models.push_back(std::make_unique<CondensedCandidate>());
  models.push_back(std::make_unique<ServoCandidate>());
}

}  // namespace tpm
