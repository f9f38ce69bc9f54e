#pragma once
// The inside of Inertial: CVODES on the equations of motion.
#include "tpm/organ/balance/inertial.hpp"
#include "tpm/organ/balance/inertial_equation.hpp"
#include "tpm/organ/linear/sundials.hpp"

namespace tpm::organ {

/// One integration by CVODES (BDF, Newton), restarted wherever the equations change.
class InertialIntegration {
 public:
  /// @param equation must live as long as this
  /// @param error that a step may make in each entry of the state
  /// @param energy_error that a step may make in work and heat, J; none if they are not asked for
  /// @param spent_J at the start, as spent_J() gives it
  InertialIntegration(InertialEquation& equation, const InertialOptions& options,
                      const Eigen::VectorXd& start, const Eigen::VectorXd& error,
                      std::optional<double> energy_error, const Eigen::Vector4d& spent_J);

  /// Begins a piece that ends at `stop_s`, from the state reached.
  void restart(double time_s, double stop_s);
  /// Reason for the end of a step.
  enum class Reached { within, target, meeting };
  /// One step, at most up to `time_s`, which tools may not step over: to the first time at which
  /// one meets a sphere. Throws Error(numerical) with the time where CVODES gives up.
  Reached step_towards(double time_s);
  /// Tools are watched: a contact force is not interpolated between steps, for gaps are small
  /// differences of places. Steps end at asked times then.
  [[nodiscard]] bool watches_gaps() const { return watches_gaps_; }
  /// The time reached.
  [[nodiscard]] double time_s() const { return time_s_; }
  /// The state within the last step.
  [[nodiscard]] Eigen::Map<const Eigen::VectorXd> state_at(double time_s);
  /// The impact of what touches, now; to be followed by restart().
  ToolImpact strike(double time_s);

  [[nodiscard]] Eigen::Map<const Eigen::VectorXd> state() const;
  /// Work of the probe, heat of the bonds, of the damping and of the contacts since the start, J.
  [[nodiscard]] Eigen::Vector4d spent_J() const;
  /// Adds to that.
  void spend(double work_J, double contact_heat_J);
  /// Of all pieces so far.
  [[nodiscard]] InertialWork work() const;

 private:
  void use_klu();
  void use_elimination();
  void watch_gaps();
  [[nodiscard]] InertialWork work_of_piece() const;

  InertialEquation& equation_;
  sundials::Context context_;
  sundials::Vector state_, error_, within_, energy_;
  double time_s_ = 0.0;
  sundials::Matrix matrix_;
  sundials::LinearSolver solver_;
  sundials::Cvodes memory_;
  bool watches_gaps_ = false;
  bool started_ = false;
  InertialWork before_;  ///< of the pieces that are over
};

}  // namespace tpm::organ
