#pragma once
// The inside of QuasiStatic: the collocation solve of a step.
#include <array>
#include <optional>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/law/relaxation/exponential_collocation.hpp"
#include "tpm/organ/balance/driven_tissue.hpp"
#include "tpm/organ/balance/lane_bonds.hpp"
#include "tpm/organ/balance/lane_stiffness.hpp"
#include "tpm/organ/linear/anderson.hpp"

namespace tpm::organ {

enum class TissueMove { done, unbalanced, unstable };

struct StepOutcome {
  bool accepted = false;
  bool balanced = false;  ///< the stages were balanced; the error decided
  bool unstable = false;
  double error = 0.0;    ///< estimate, in the unit of the response
  double left = 0.0;     ///< what the last correction leaves, if it shrinks as the one before
  double allowed = 0.0;  ///< in the same unit
};

/// Where in a step a contact with a tool closes or opens.
struct ContactChange {
  std::size_t contact = 0;
  double fraction = 0.0;  ///< of the step, 0 to 1
};

/// Work done and heat made within a step: what is spent at an instant is known at Gauss points, and
/// the polynomial through it is integrated up to any fraction (by Legendre's polynomials).
class StepEnergy {
 public:
  static constexpr int kPoints = 2 * kLanes;
  using Series = Eigen::Matrix<double, kPoints, 1>;

  /// From the start of the step, J.
  /// @param fraction in [0, 1]
  /// @param loads_J DrivenTissue::loads_J() there
  [[nodiscard]] QuasiStaticEnergy until(double fraction, double loads_J) const;
  /// Of the whole step.
  [[nodiscard]] QuasiStaticEnergy whole() const { return until(1.0, loads_at_end_J_); }

  /// The largest absolute response of a group in a step, and the fraction at which it stands.
  struct Extreme {
    double fraction = 0.0, size = 0.0;
  };
  [[nodiscard]] Extreme largest_response(std::size_t group) const;

 private:
  friend class StageBalance;
  [[nodiscard]] static double integral(const Series& series, double fraction);

  /// Coefficients of the series; power per rate of what is imposed: of a depth its force, of a load
  /// minus its depth (F du = d(F u) - u dF).
  Series per_rate_ = Series::Zero(), heat_W_ = Series::Zero();
  std::vector<Series> response_;  ///< of each group
  double h_s_ = 0.0, rate_ = 0.0;
  double loads_at_start_J_ = 0.0, loads_at_end_J_ = 0.0;
};

/// Balances the stages of a step together, side by side in lanes: a fixed-point iteration with one
/// factorisation, with Anderson acceleration. Lanes beyond the last stage repeat it.
class StageBalance {
 public:
  /// @param stages 2 to kLanes
  /// @param choosing steps are chosen by their error: one with too large an error is given up early
  StageBalance(DrivenTissue& tissue, int stages, bool choosing);

  /// Sets what tolerances are parts of: at least the response to a peak of what is imposed, with
  /// the equilibrium stiffness at rest. The factorisation for that serves the first step too.
  /// @param h of that step, s
  void begin(const TissueState& rest, double h, double peak);
  void see(double response) { scale_ = std::max(scale_, std::abs(response)); }
  [[nodiscard]] double scale() const { return scale_; }
  [[nodiscard]] const QuasiStaticWork& work() const { return work_; }

  /// An equilibrium at another imposed value, with y constant or relaxed; the state moves if it is
  /// found. Rejects an equilibrium that moved much farther than the tangent stiffness
  /// predicts: the load step may have jumped over an instability and has to be smaller.
  [[nodiscard]] TissueMove move(TissueState& state, double imposed, bool relaxed, double tolerance);

  /// Balances a step of length h in which the imposed value moves at `rate`; see accept().
  /// @param tolerance of its error, in parts of the scale
  [[nodiscard]] StepOutcome try_step(const TissueState& state, double h, double rate,
                                     double tolerance);
  /// The first contact that was not, in the step just balanced, what it is at the step's start.
  /// @param tolerance of the response, in parts of the scale
  [[nodiscard]] std::optional<ContactChange> contact_change(double tolerance) const;
  /// The next step moves otherwise than the last did.
  void forget_motion() { last_rate_.reset(); }
  /// Closes an open contact or opens a closed one.
  void change_contact(TissueState& state, std::size_t contact);
  /// The responses at fractions of the step just balanced.
  /// @param fractions in [0, 1], at most kLanes of them
  [[nodiscard]] LaneVector responses_within(const TissueState& state,
                                            std::span<const double> fractions, double h,
                                            double rate);
  /// The tissue at fractions of the step just balanced; its forces are balanced once more there,
  /// for all fractions at once.
  /// @param fractions in [0, 1], at most kLanes of them
  /// @param energies also what is stored there, in `energy`
  [[nodiscard]] std::vector<QuasiStaticState> states_within(const TissueState& state,
                                                            std::span<const double> fractions,
                                                            double h, double rate, bool energies);
  /// Work done and heat made within the step just balanced.
  [[nodiscard]] StepEnergy energy_of_step(const TissueState& state, double h, double rate);
  /// Moves the state to the end of the step just balanced, and returns the response there.
  double accept(TissueState& state, double h, double rate);

 private:
  friend class StageTangents;

  /// Weights of the viscous elongations of one law over a step, lane by lane.
  struct LawWeights {
    ViscousWeights mean;                 ///< of_viscous only where there is one branch
    std::vector<ViscousWeights> branch;  ///< one for each branch
  };
  using Places = std::vector<ExponentialCollocation::Place>;  ///< one per lane
  /// One for each group of relaxing bonds.
  using StepWeights = std::vector<LawWeights>;
  [[nodiscard]] StepWeights weights_at(const Places& places, std::span<const double> fractions,
                                       double h) const;
  /// Viscous elongations at the start of a step, of the relaxing bonds.
  struct Start {
    Eigen::RowVectorXd followed, mean;
    Eigen::MatrixXd viscous;  ///< by (branch, bond)
  };
  [[nodiscard]] Start start_of(const TissueState& state) const;
  /// The part of the mean viscous elongations that the start decides, in every lane, of the groups
  /// with several branches.
  void find_known(const StepWeights& weights, const Start& start, LaneMatrix& known) const;
  /// The mean viscous elongations in every lane.
  void apply(const StepWeights& weights, const LaneMatrix& followed, const Start& start,
             const LaneMatrix& known, LaneMatrix& mean) const;
  /// Every viscous elongation in one lane, by (branch, bond).
  void viscous_in_lane(const StepWeights& weights, const LaneMatrix& followed, const Start& start,
                       Eigen::Index lane, Eigen::MatrixXd& viscous) const;
  /// Energy that is stored because branches differ from their bond's mean, J.
  /// @param viscous of one lane
  [[nodiscard]] double spread_J(const Eigen::MatrixXd& viscous) const;
  /// Puts viscous elongations of the relaxing bonds among those of all.
  void put_viscous(const Eigen::MatrixXd& viscous, Eigen::MatrixXd& of_bonds) const;

  /// Weights by which states at fractions of a step follow from its stages, lane by lane.
  struct Shapes {
    LaneSquare interpolation;  ///< of the way from the start
    StepWeights weights;
  };
  [[nodiscard]] Shapes shapes(std::span<const double> fractions, double h) const;
  /// Change of the viscous elongation of one branch of a group at fractions of a step per change of
  /// ln tau, with what it follows and the start held.
  [[nodiscard]] LaneMatrix aging(const Places& places, std::span<const double> fractions, double h,
                                 std::size_t group, std::size_t branch) const;
  /// The fractions of the step at which the lanes stand.
  [[nodiscard]] const std::array<double, kLanes>& lane_nodes() const { return lane_nodes_; }
  /// A factorisation at a state, for what follows a move.
  void require_factor(const TissueState& state, const RelaxationFactor& relaxation_factor);

  /// States within a step, one per lane.
  struct Within {
    LaneVector imposed;
    LaneMatrix position, mean_viscous;
    StepWeights weights;
  };
  [[nodiscard]] Within within(const TissueState& state, std::span<const double> fractions, double h,
                              double rate) const;
  [[nodiscard]] LaneVector responses(const Within& states);
  /// The responses of every group, of the first those that are given.
  [[nodiscard]] std::vector<LaneVector> responses_of_groups(const Within& states,
                                                            const LaneVector& first) const;
  /// Power per rate of the path's coordinate (StepEnergy).
  [[nodiscard]] LaneVector powers_per_rate(const Within& states,
                                           const std::vector<LaneVector>& responses) const;
  /// Power that the branches turn into heat.
  [[nodiscard]] LaneVector heat_W(const Within& states) const;

  /// By how much the depth of each group may change with a load before it is suspected that the
  /// tissue has snapped to another place; infinite where the depth is imposed or the load stays,
  /// none if the stiffness says already that it would go too far, or has no inverse and says
  /// nothing.
  [[nodiscard]] std::optional<std::vector<double>> furthest_depth_changes_m(
      const TissueState& state, const ViscousState& viscous_state, double imposed);

  enum class Balance { found, hopeless, failed };

  [[nodiscard]] double node(int lane) const;
  void set_weights(double h);
  void set_error_weights(double h);
  void choose_error_places();
  /// For sweeps over linear bonds: a view of weights, start and known part of the step.
  void set_following();
  /// The share of the viscous elongation of each law that follows in a step, the mean over stages.
  [[nodiscard]] RelaxationFactor relaxation_factor_of_step() const;
  /// The largest difference of two such shares.
  [[nodiscard]] double difference(const RelaxationFactor& a, const RelaxationFactor& b) const;
  [[nodiscard]] bool refactorise(const TissueState& state,
                                 const RelaxationFactor& relaxation_factor);
  /// @param change of the elongation of each bond with the adjoint displacement
  void set_relaxing_shares(const TissueState& state, const Eigen::VectorXd& change,
                           const DrivenTissue::UnitField& field);
  /// Errors of the other groups' responses are added to those of the first, in parts of theirs.
  void weigh_groups_beside(const TissueState& state, const ViscousState& viscous_state);
  /// Dependence of the corrections of the stages on each other, since each follows the others:
  /// where all bonds relax alike, the inverse of that.
  [[nodiscard]] LaneSquare mixing(const StepWeights& weights) const;
  /// Correction of the stages where forces are left on their free spheres.
  /// @return bound of what the forces do to the response, N or m
  double correction(const LaneMatrix& force, const LaneSquare& mixing, LaneMatrix& d);
  void predict(const TissueState& state, double h, double rate);
  /// @param allowed error of the response that forces may leave
  [[nodiscard]] Balance balance(double allowed);
  /// The forces left on the free spheres of every stage, and from them the next correction.
  void residuals();
  void update_viscous();
  /// Gap of a contact at a fraction of the step just balanced, m.
  [[nodiscard]] double gap_m(const ToolContact& contact, double fraction) const;
  /// Estimate for the stages as they are, in the unit of the response.
  [[nodiscard]] double error() const;

  DrivenTissue& tissue_;
  int stages_;
  bool choosing_;
  Eigen::Index coordinates_;
  LaneBonds bonds_;
  ExponentialCollocation inner_;  ///< through the stages alone
  ExponentialCollocation full_;   ///< through the start and the stages
  Places stage_places_;           ///< of full_, where the lanes stand
  std::array<double, kLanes> lane_nodes_{};
  Places full_error_places_, inner_error_places_;  ///< where the error is measured
  LaneStiffness factor_;
  Anderson anderson_;
  QuasiStaticWork work_;
  double scale_ = 0.0;              ///< size of the response, N or m
  double unit_response_ = 0.0;      ///< per unit of what is imposed: turns forces into lengths
  std::vector<double> per_beside_;  ///< scale_ over that of each group beside the first

  // The factorisation in use.
  bool factorised_ = false;
  RelaxationFactor relaxation_factor_;
  int last_iterations_ = 0;
  Eigen::RowVectorXd lane_field_;    ///< displacement per unit imposed, by coordinate
  Eigen::VectorXd adjoint_;          ///< change of the response per change of each bond's y
  double bounding_stiffness_ = 0.0;  ///< bounds a response by the energy of an imbalance
  /// The part of the instantaneous stiffness that relaxes, by law, as mixing() counts it.
  std::vector<double> relaxing_share_;
  double rounding_ = 0.0;  ///< what rounding of positions does to the response, N or m

  // The step being balanced, stages in lanes.
  std::vector<char> closed_;  ///< contacts
  Eigen::RowVectorXd start_;  ///< positions where it begins, by coordinate
  Start begin_;
  LaneMatrix x_, d_, force_, solved_;
  LaneSquare mixing_;
  LaneVector plain_response_;  ///< to x_, with forces left
  double end_response_ = 0.0;  ///< at the end of a balanced step
  LaneMatrix followed_;        ///< of relaxing bonds
  LaneMatrix mean_viscous_;    ///< of relaxing bonds, where they are not linear
  LaneMatrix known_;           ///< find_known()
  StepWeights weights_;
  std::vector<LaneBonds::Following> following_;
  LaneVector imposed_;
  /// Difference of the two collocations, for one relaxation time: by place measured, the
  /// stages' and two more; beyond them 0.
  static constexpr int kErrorPlaces = 2 * kLanes;
  using AtErrorPlaces = Eigen::Matrix<double, kErrorPlaces, 1>;
  struct ErrorWeights {
    Eigen::Matrix<double, kErrorPlaces, kLanes> of_stages =
        Eigen::Matrix<double, kErrorPlaces, kLanes>::Zero();
    AtErrorPlaces of_start = AtErrorPlaces::Zero();
  };
  /// Sums over the bonds of a group, with what each bond does to the response.
  struct ErrorSums {
    LaneVector stages = LaneVector::Zero();      ///< of what is followed at the stages
    double start = 0.0;                          ///< at the start of the step
    AtErrorPlaces size = AtErrorPlaces::Zero();  ///< of absolute differences
  };
  [[nodiscard]] ErrorSums error_sums(const LaneBonds::Group& group,
                                     const ErrorWeights& weights) const;
  std::vector<ErrorWeights> error_weights_;  ///< of each relaxation time of the system
  double differing_share_ = 0.0;  ///< of differences of either sign, of what does not cancel
  double imbalance_ = 0.0;        ///< bound of the response's error from forces left, N or m
  double left_ = 0.0;             ///< of it once a step is balanced
  // The step before, for the prediction of the next.
  double last_h_ = 0.0;
  std::optional<double> last_rate_;   ///< none: the state has been moved since
  Eigen::RowVectorXd last_velocity_;  ///< over its second half, m/s, by coordinate
};

}  // namespace tpm::organ
