#include "tpm/fit/likelihood/surrogate_minimum.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tpm::fit {
namespace {

constexpr int kMostSteps = 60;
constexpr double kSmallGain = 1e-6;  // of the mean squared residual
/// The same with parameters fixed: points of a profile, which rises by more than 1.
constexpr double kSmallHeldGain = 1e-4;
constexpr double kFirstPull = 0.02;  // of the residuals' own curvature
constexpr double kRaise = 8.0;
constexpr double kMostPull = 1e8;
constexpr double kGoodShare = 0.5;  // of the gain that was promised

/// The surrogate with what it lacks at a point, and below its residuals the pull towards that
/// point.
class CorrectedSurrogate final : public ResidualFunction {
 public:
  CorrectedSurrogate(const ResidualFunction& surrogate, std::span<const FitParameter> parameters)
      : surrogate_(surrogate), parameters_(parameters) {}

  /// Corrects it at a point; false if the surrogate cannot be evaluated there.
  [[nodiscard]] bool correct_at(const KnownPoint& point) {
    KnownPoint own{point.natural, {}, {}, {}};
    if (!own.evaluate(surrogate_, parameters_)) return false;
    const RowMatrix slope = point.jacobian - own.jacobian;
    if (theta_.size() > 0) learn(point.theta - theta_, slope - slope_lacking_);
    theta_ = point.theta;
    lacking_ = point.residual - own.residual;
    slope_lacking_ = slope;
    unit_ = point.jacobian.colwise().norm().transpose();
    return true;
  }
  void set_pull(double pull) { root_pull_ = std::sqrt(pull); }

  [[nodiscard]] Eigen::Index residual_count() const override {
    return surrogate_.residual_count() + std::ssize(parameters_);
  }

  [[nodiscard]] bool evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const override {
    if (!surrogate_.evaluate(natural, residual, jacobian)) return false;
    const Eigen::VectorXd moved = theta_of(parameters_, natural) - theta_;
    const Eigen::VectorXd pull = root_pull_ * unit_;
    const RowMatrix bend = bend_along(moved);
    residual += lacking_ + slope_lacking_ * moved + 0.5 * bend * moved;
    residual.conservativeResize(residual_count());
    residual.tail(moved.size()) = pull.cwiseProduct(moved);
    if (jacobian == nullptr) return true;
    const Eigen::VectorXd per_natural = natural_slopes(parameters_, theta_ + moved).cwiseInverse();
    *jacobian += (slope_lacking_ + bend) * per_natural.asDiagonal();
    jacobian->conservativeResize(residual_count(), Eigen::NoChange);
    jacobian->bottomRows(moved.size()) = RowMatrix(pull.cwiseProduct(per_natural).asDiagonal());
    return true;
  }

  /// Sum of squares without the pull.
  [[nodiscard]] double cost_at(std::span<const double> natural) const {
    Eigen::VectorXd residual;
    if (!evaluate(natural, residual, nullptr)) return std::numeric_limits<double>::infinity();
    return residual.head(surrogate_.residual_count()).squaredNorm();
  }

 private:
  /// Second derivatives of what the surrogate lacks, times a step: one row per residual.
  [[nodiscard]] RowMatrix bend_along(const Eigen::VectorXd& step) const {
    RowMatrix bend = RowMatrix::Zero(surrogate_.residual_count(), step.size());
    for (std::size_t i = 0; i < bend_.size(); ++i) {
      bend.row(static_cast<Eigen::Index>(i)) = bend_[i] * step;
    }
    return bend;
  }

  /// The least symmetric change of the second derivatives that tells the slopes' change over a step
  /// (Powell's symmetric Broyden update), in the residuals' own scales.
  void learn(const Eigen::VectorXd& step, const RowMatrix& change) {
    bend_.resize(static_cast<std::size_t>(change.rows()),
                 Eigen::MatrixXd::Zero(step.size(), step.size()));
    const Eigen::VectorXd weighted = unit_.cwiseAbs2().cwiseProduct(step);
    const double length2 = weighted.dot(step);
    if (!(length2 > 0.0)) return;
    const Eigen::VectorXd w = weighted / length2;
    for (std::size_t i = 0; i < bend_.size(); ++i) {
      const Eigen::VectorXd off =
          change.row(static_cast<Eigen::Index>(i)).transpose() - bend_[i] * step;
      bend_[i] += off * w.transpose() + w * off.transpose() - off.dot(step) * w * w.transpose();
    }
  }

  const ResidualFunction& surrogate_;
  std::span<const FitParameter> parameters_;
  Eigen::VectorXd theta_, lacking_, unit_;
  RowMatrix slope_lacking_;
  std::vector<Eigen::MatrixXd> bend_;  ///< by residual
  double root_pull_ = 0.0;
};

}  // namespace

Minimum minimise_by_surrogate(const ResidualFunction& function, const ResidualFunction& surrogate,
                              std::span<const FitParameter> parameters,
                              std::span<const double> start, const FixedMask& fixed) {
  KnownPoint here{{start.begin(), start.end()}, {}, {}, {}};
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!fixed.empty() && fixed[i]) continue;
    here.natural[i] = std::clamp(start[i], parameters[i].lower, parameters[i].upper);
  }
  Minimum minimum;
  minimum.natural = here.natural;
  CorrectedSurrogate corrected(surrogate, parameters);
  if (!here.evaluate(function, parameters) || !corrected.correct_at(here)) {
    return minimum;
  }
  const bool held = std::find(fixed.begin(), fixed.end(), true) != fixed.end();
  const double small = held ? kSmallHeldGain : kSmallGain;
  double pull = 0.0;
  while (!minimum.converged && minimum.iterations < kMostSteps) {
    ++minimum.iterations;
    corrected.set_pull(pull);
    KnownPoint next;
    next.natural = minimise_near(corrected, parameters, here.natural, fixed).natural;
    const double promised = here.cost() - corrected.cost_at(next.natural);
    const auto count = static_cast<double>(here.residual.size());
    // A pull of this many times the curvature hides up to as many times what is promised.
    minimum.converged = promised * (1.0 + pull) <= small * here.cost() / count;
    if (minimum.converged || pull > kMostPull) break;
    const bool known = next.evaluate(function, parameters);
    const double gained = known ? here.cost() - next.cost() : -1.0;
    if (gained < kGoodShare * promised) {
      pull = std::max(kRaise * pull, kFirstPull);
    } else {
      pull = pull > kFirstPull ? pull / kRaise : 0.0;
    }
    if (!(gained > 0.0)) continue;
    here = std::move(next);
    if (!corrected.correct_at(here)) break;
  }
  minimum.natural = here.natural;
  minimum.deviance = here.cost() - function.offset();
  minimum.usable = true;
  minimum.message = minimum.converged ? "corrected surrogate: nothing left to gain"
                                      : "corrected surrogate: out of steps";
  return minimum;
}

}  // namespace tpm::fit
