#pragma once
// The inside of QuasiStatic: the tissue under its probe, and the balance of the stages of a step.
#include <vector>

#include "tpm/network/quasistatic.hpp"
#include "tpm/solve/anderson.hpp"
#include "tpm/solve/exponential_collocation.hpp"

namespace tpm {

/// The tissue at an instant.
struct TissueState {
  double time_s = 0.0;
  double imposed = 0.0;  ///< depth, m, or load, N
  Positions position;
  Eigen::VectorXd elongation;  ///< l of each bond, m
  Eigen::VectorXd remembered;  ///< y of each bond, m
};

/// A network with one sphere driven: by an imposed depth, whose response is the contact force, or
/// by a load, whose response is the depth.
class DrivenTissue {
 public:
  DrivenTissue(const BondSystem& bonds, Positions rest, Freedom freedom, const Probe& probe,
               Drive drive);
  DrivenTissue(const DrivenTissue&) = delete;
  DrivenTissue& operator=(const DrivenTissue&) = delete;

  [[nodiscard]] TissueState at_rest(double time_s) const;
  [[nodiscard]] const BondSystem& bonds() const { return bonds_; }
  [[nodiscard]] const Freedom& freedom() const { return freedom_; }
  [[nodiscard]] const Probe& probe() const { return probe_; }
  [[nodiscard]] bool depth_driven() const { return drive_ == Drive::displacement; }
  [[nodiscard]] Equilibrium& equilibrium() { return equilibrium_; }

  /// Puts the driven sphere where an imposed depth wants it; under a load there is nothing to do.
  void impose(Positions& position, double imposed) const;
  /// Forces from outside, N.
  void load(double imposed, Eigen::Matrix3Xd& force) const;

  /// Contact force or depth, given the forces on all spheres.
  [[nodiscard]] double response(const Positions& position, const Eigen::Matrix3Xd& force) const;
  [[nodiscard]] double response(const TissueState& state) const;

  /// The displacements per unit of what is imposed (probe included), from the last factorisation;
  /// with the sign that makes them the adjoint of the response: a force R left on the free spheres
  /// changes it by -(+) their product under an imposed depth (load).
  void unit_field(const TissueState& state, const BondMemory& memory, Eigen::Matrix3Xd& field,
                  double& stiffness) const;
  [[nodiscard]] double adjoint_sign() const { return depth_driven() ? -1.0 : 1.0; }

  /// Size of the response to a peak of what is imposed, with the relaxed stiffness at rest.
  [[nodiscard]] double linear_response(const TissueState& rest, double peak);

 private:
  const BondSystem& bonds_;
  Positions rest_;
  Freedom freedom_;
  Probe probe_;
  Drive drive_;
  Equilibrium equilibrium_;
};

enum class TissueMove { done, unbalanced, unstable };

struct StepOutcome {
  bool accepted = false;
  bool balanced = false;  ///< the stages were balanced; the error decided
  bool unstable = false;
  double error = 0.0;   ///< estimate, in the unit of the response
  double growth = 1.0;  ///< factor of the step that would just do
};

/// Balances the stages of a step together: a fixed point iteration with one factorisation, with
/// Anderson acceleration.
class StageBalance {
 public:
  StageBalance(DrivenTissue& tissue, int stages);

  /// Size of the response that tolerances are parts of: at least `least`, N or m.
  void set_scale(double least) { scale_ = std::abs(least); }
  void see(double response) { scale_ = std::max(scale_, std::abs(response)); }
  [[nodiscard]] const QuasiStaticWork& work() const { return work_; }

  /// An equilibrium at another imposed value, at once or relaxed; the state moves if it is done.
  [[nodiscard]] TissueMove move(TissueState& state, double imposed, bool relaxed, double tolerance);

  /// Balances a step of length h in which the imposed value moves at `rate`; see accept().
  /// @param tolerance of its error, in parts of the scale
  [[nodiscard]] StepOutcome try_step(const TissueState& state, double h, double rate,
                                     double tolerance);
  /// The response at the fraction c of the step just balanced.
  [[nodiscard]] double response_within(const TissueState& state, double c, double h, double rate);
  /// Moves the state to the end of the step just balanced.
  void accept(TissueState& state, double h, double rate);

 private:
  [[nodiscard]] bool refactorise(const TissueState& state, double following);
  void predict(const TissueState& state, double h, double rate);
  [[nodiscard]] bool balance(const TissueState& state, double tolerance);
  /// The forces left on the free spheres of every stage, and from them the next correction.
  void residuals(const TissueState& state);
  [[nodiscard]] double error_of(double z) const;
  [[nodiscard]] Eigen::Map<Positions> stage(Eigen::Index j);
  [[nodiscard]] double corrected_response(const Positions& position, const BondMemory& memory,
                                          double imposed);

  DrivenTissue& tissue_;
  int stages_;
  Eigen::Index coordinates_;
  ExponentialCollocation full_;   ///< through the start and the stages
  ExponentialCollocation inner_;  ///< through the stages alone
  Anderson anderson_;
  QuasiStaticWork work_;
  double scale_ = 0.0;

  // The factorisation in use.
  bool factorised_ = false;
  double following_ = 0.0;
  int last_iterations_ = 0;
  Eigen::Matrix3Xd field_;       ///< displacement per unit imposed
  Eigen::VectorXd goal_;         ///< change of the response per change of each bond's y
  double path_stiffness_ = 0.0;  ///< bounds a response by the energy of an imbalance

  // The step being balanced.
  Eigen::VectorXd x_, d_;        ///< positions of all stages and their correction
  Eigen::MatrixXd elongation_;   ///< bond by (start and stages)
  Eigen::MatrixXd remembered_;   ///< bond by stage
  Eigen::MatrixXd weights_;      ///< (start and stages) by stage
  Eigen::VectorXd decay_;        ///< of each stage
  std::vector<double> imposed_;  ///< at each stage
  double imbalance_ = 0.0;       ///< bound of the response's error from forces left, N or m
  BondMemory memory_;
  Eigen::Matrix3Xd force_;
  // The step before, for the prediction of the next.
  bool has_last_ = false;
  double last_h_ = 0.0, last_rate_ = 0.0;
  Eigen::MatrixXd last_path_;  ///< coordinate by (start and stages)
};

}  // namespace tpm
