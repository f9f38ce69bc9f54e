#pragma once
// Interface of a problem to a step rule: states, their rates, and implicit stages.
#include "tpm/organ/steps/method.hpp"

namespace tpm::organ {

/// An implicit stage of a step, the velocities and the viscous elongations eliminated:
///
///     x = x* + c v,   v = v* + c a(t, x, y),   y = y* + relaxation_factor V(l(x))
///
/// Without masses there are no x and v in a state and c does not count: x is where the forces
/// balance.
struct ImplicitStage {
  Eigen::VectorXd known;              ///< (x*, v*, y*), as a state
  double c = 0.0;                     ///< s, > 0
  Eigen::VectorXd relaxation_factor;  ///< of each y, 0 to 1

  /// z = known + c rate(t, z) in every part.
  /// @param relaxation_times_s of each y
  [[nodiscard]] static ImplicitStage of(Eigen::VectorXd known, double c,
                                        const Eigen::VectorXd& relaxation_times_s);
};

/// An element or a network as a system of first order for the rules of step_rules.hpp: what all of
/// them need. What only some need stands in the roles below, which a system has as well. A state is
/// (x, v, y) with masses, x and v of the free directions, and (y) without; y are the viscous
/// elongations m_j of all branches, bond by bond, dy/dt = (V(l) - y)/tau. Without masses a system
/// keeps the positions that belong to the last state it saw. Whatever can fail says how.
class StepSystem {
 public:
  using Vector = Eigen::VectorXd;
  using ConstVector = Eigen::Ref<const Eigen::VectorXd>;

  StepSystem() = default;
  StepSystem(const StepSystem&) = delete;
  StepSystem& operator=(const StepSystem&) = delete;
  virtual ~StepSystem() = default;

  /// The piece of the protocol that holds from now on, linear in time.
  virtual void set_piece(const Knot& from, const Knot& to);
  [[nodiscard]] double imposed(double time_s) const {
    return from_.value + slope_ * (time_s - from_.time_s);
  }
  [[nodiscard]] double imposed_rate() const { return slope_; }
  [[nodiscard]] const MethodWork& work() const { return work_; }
  [[nodiscard]] MethodWork& work() { return work_; }

  [[nodiscard]] virtual Eigen::Index coordinates() const = 0;  ///< of x in a state, 0 without mass
  [[nodiscard]] virtual Eigen::Index viscous() const = 0;      ///< of y
  [[nodiscard]] Eigen::Index size() const { return 2 * coordinates() + viscous(); }
  [[nodiscard]] virtual const Vector& relaxation_times_s() const = 0;  ///< of each y
  [[nodiscard]] virtual double drag_per_s() const = 0;
  /// The size that each part of a state may be expected to have, for tolerances and divergence.
  [[nodiscard]] virtual Vector scales() const = 0;

  /// The state at rest, or with everything relaxed under `first` if it is constant for ever before.
  [[nodiscard]] virtual MethodEnd start(const Knot& first, bool relaxed, Vector& state) = 0;
  /// Makes the imposed value jump to another, y constant: positions without masses follow.
  [[nodiscard]] virtual MethodEnd jump(double imposed, const ConstVector& state) = 0;
  /// Contact force, N, or depth, m.
  [[nodiscard]] virtual MethodEnd response(double time_s, const ConstVector& state,
                                           double& response) = 0;

 private:
  Knot from_{0.0, 0.0};
  double slope_ = 0.0;
  MethodWork work_;
};

/// For rules that evaluate rates: explicit ones, CVODE, and the explicit halves of implicit ones.
class RateSystem : public virtual StepSystem {
 public:
  [[nodiscard]] virtual MethodEnd rate(double time_s, const ConstVector& state,
                                       Eigen::Ref<Vector> rate) = 0;
  /// V(l), which it follows, of each y.
  [[nodiscard]] virtual MethodEnd elongations(double time_s, const ConstVector& state,
                                              Vector& elongation) = 0;
};

/// For implicit rules with given steps.
class StageSystem : public virtual StepSystem {
 public:
  /// @param state first guess; the solution
  [[nodiscard]] virtual MethodEnd stage(double time_s, const ImplicitStage& stage,
                                        Vector& state) = 0;
};

/// For position-based dynamics with compliance (XPBD).
class ProjectionSystem : public virtual StepSystem {
 public:
  /// A step of length h that ends at `time_s`. With h = 0 only positions without masses follow.
  /// @param state where it begins; where it ends
  [[nodiscard]] virtual MethodEnd project(double time_s, double h, int sweeps, Vector& state) = 0;
};

/// For integrators that solve their Newton iterations with the problem's own matrix.
class NewtonSystem : public virtual RateSystem {
 public:
  /// Factorises (1 - gamma d rate/d state) at a state.
  [[nodiscard]] virtual MethodEnd factorise(double time_s, const ConstVector& state,
                                            double gamma) = 0;
  /// Replaces a right-hand side by the solution with it.
  virtual void solve(Eigen::Ref<Vector> x) = 0;
};

/// Without masses the same problem is a differential-algebraic one for (positions, y): positions as
/// displacements from rest, those that are not free 0. Systems with masses are not balanced.
class BalanceSystem : public virtual StepSystem {
 public:
  [[nodiscard]] virtual Eigen::Index places() const = 0;
  /// Displacements that belong to the last state seen.
  [[nodiscard]] virtual Vector placed() const = 0;
  /// Minus the forces left, N, and V(l) of each y.
  virtual void imbalance(double time_s, const ConstVector& place, const ConstVector& y,
                         Eigen::Ref<Vector> imbalance, Vector& elongation) = 0;
  /// Factorises the derivative of (imbalance, rate_y - (V(l) - y)/tau) by (places, y) where rate_y
  /// changes by `per_y` times y, 1/s.
  [[nodiscard]] virtual MethodEnd factorise_pair(double time_s, const ConstVector& place,
                                                 const ConstVector& y, double per_y) = 0;
  virtual void solve_pair(Eigen::Ref<Vector> place, Eigen::Ref<Vector> y) = 0;

  /// Positions, to come back to.
  struct Place {
    Vector position;
    double imposed = 0.0;
    Vector y;
  };
  [[nodiscard]] virtual Place place() const = 0;
  virtual void set_place(const Place& place) = 0;
};

/// A system in a role that a rule needs; null if it has none, or is not in balance because it
/// moves.
template <class Role>
[[nodiscard]] Role* role_of(StepSystem& system) {
  return dynamic_cast<Role*>(&system);
}
template <>
[[nodiscard]] inline BalanceSystem* role_of<BalanceSystem>(StepSystem& system) {
  return system.coordinates() > 0 ? nullptr : dynamic_cast<BalanceSystem*>(&system);
}

[[nodiscard]] std::unique_ptr<StepSystem> element_system(const BondElement& material,
                                                         const Protocol& protocol,
                                                         const std::optional<MethodMasses>& mass);

[[nodiscard]] std::unique_ptr<StepSystem> network_system(const DrivenNetwork& network,
                                                         const Protocol& protocol,
                                                         const std::optional<MethodMasses>& mass);

}  // namespace tpm::organ
