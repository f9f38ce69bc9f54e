#pragma once
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "tpm/organ/balance/equilibrium.hpp"
#include "tpm/organ/balance/probes.hpp"
#include "tpm/organ/linear/lanes.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::organ {

/// Changes of one law of a BondSystem (viscous_law.hpp).
struct LawChange {
  std::vector<double> share;               ///< of each gamma_j; they add up to 0
  std::vector<double> log_time;            ///< of each ln tau_j
  std::vector<double> spring_share;        ///< of each part of u
  std::vector<ShapeValues> spring_values;  ///< of the parameters of each part's function
  ShapeValues kernel_values{};             ///< of the parameters of V
};

/// A direction in which material and imposed history may change: a run can answer derivatives. They
/// are found to an accuracy in parts of the response: choose units that make them of its size.
struct TangentDirection {
  Eigen::VectorXd stiffness;         ///< change of k of each bond, N/m
  Eigen::VectorXd relaxing;          ///< change of g of each bond, N/m
  double log_relaxation_time = 0.0;  ///< change of ln tau of every branch
  double imposed = 0.0;              ///< change of a factor on all that is imposed
  std::vector<LawChange> laws =
      {};  ///< one for each law of the system; empty: nothing else changes
};

/// Cost of a run.
struct QuasiStaticWork {
  int steps = 0, rejected = 0;
  int iterations = 0;  ///< of all stages of a step at once
  int factorisations = 0;
  int back_solves = 0;
  int contact_changes = 0;  ///< contacts with tools that closed or opened between steps
};

struct QuasiStaticOptions {
  /// Error of the response that steps are chosen for, in parts of its largest value; 1e-12 to 0.1.
  double tolerance = 1e-6;
  int stages = kLanes;  ///< of a step, 2 to kLanes
  /// If given, s: all steps are that long (but for the last of a piece of the protocol), whatever
  /// their error, and what is left unbalanced is still compared with the tolerance.
  std::optional<double> step_s = std::nullopt;
  /// If given, asked after each step that was tried: where it says no, the run throws
  /// Error(numerical).
  std::function<bool(const QuasiStaticWork&)> may_go_on = nullptr;
  /// If given, told what a run took that throws Error.
  std::function<void(const QuasiStaticWork&)> on_failure = nullptr;
  bool energies = false;  ///< work and dissipation are integrated along
  /// With energies: the observer is shown, besides the asked times, every state in which a response
  /// is larger than in all states shown before and smaller soon after, so that the largest response
  /// shown does not depend on the times asked for.
  bool extremes = false;
  EquilibriumOptions equilibrium = {.solver = StiffnessSolver::automatic};
  std::vector<TangentDirection> directions = {};  ///< of the derivatives to be found
  /// Tolerance of the balance of a derivative, as `tolerance`; none: that.
  std::optional<double> derivative_tolerance = std::nullopt;
};

/// Where the energy went. In exact arithmetic work = stored + dissipated.
struct QuasiStaticEnergy {
  double work_J = 0.0;        ///< done by the probe since the start
  double dissipated_J = 0.0;  ///< by the dashpots, >= 0
  double stored_J = 0.0;      ///< in the springs at the end
};

/// The network at an instant of a run; a run can go on from there.
struct QuasiStaticState {
  double time_s = 0.0;
  double imposed = 0.0;                     ///< depth, m, or load, N
  double response = 0.0;                    ///< contact force, N, or depth, m
  Positions position;                       ///< of all spheres, m
  Eigen::MatrixXd viscous;                  ///< m_j by (bond, branch), m; see BondSystem
  std::optional<QuasiStaticEnergy> energy;  ///< if asked for; until here
  std::vector<double> beside = {};          ///< responses of the other groups (Loading)
  bool between = false;                     ///< an extreme of a response that was not asked for
  /// True if spheres have mass and a tool has just struck one: contact forces are still those of
  /// the contact's own vibration.
  bool settling = false;
};

/// Gets the state at every asked time, in the order of time. What it throws ends the run.
using QuasiStaticObserver = std::function<void(const QuasiStaticState&)>;

struct QuasiStaticRun {
  Eigen::VectorXd response;     ///< contact force, N, or depth, m, at each asked time
  Eigen::MatrixXd derivative;   ///< of each response (row) along each direction (column)
  double error_estimate = 0.0;  ///< sum of the steps' error estimates, N or m
  QuasiStaticWork work;
  SolverChoice solver;
  std::optional<QuasiStaticEnergy> energy;  ///< if asked for
  Positions position;                       ///< where the run ended
  Eigen::MatrixXd viscous;                  ///< m_j by (bond, branch) there, m
};

/// The quasi-static network: force balance on every free sphere at each instant
/// (docs/theory.md). What the bonds follow within a step, V(l), is a polynomial through its Radau
/// nodes, under which every viscous elongation is advanced exactly; the stages are balanced
/// together with one factorisation, that many steps share. Steps follow an estimate of the error of
/// the response, found with the displacement field of the probe as its own adjoint.
///
/// Over a step the same contacts with tools are closed; a step in which one would change ends
/// there.
class QuasiStatic {
 public:
  /// @param rest of spheres and tools
  /// @param constraints of the network without the probe: fixed and guided spheres
  /// @param bonds must live as long as this
  /// Throws Error(bad_input) for options out of range or a probe that cannot move.
  QuasiStatic(const BondSystem& bonds, Positions rest, Constraints constraints, Probes probes,
              QuasiStaticOptions options = {});

  /// @param times_s any order, within the protocol
  /// Throws Error(bad_input) for times outside it, Error(numerical) where the tissue buckles, snaps
  /// through or cannot be balanced; the message says when and at which depth or load.
  /// @param observer if any, sees the state at each asked time; the responses do not change by it
  /// @param from if any, where to go on in the protocol instead of beginning at rest: a state of an
  ///        earlier run of the same network, at which all jumps up to its time are over. No time
  ///        before it can be asked for.
  [[nodiscard]] QuasiStaticRun run(const Protocol& protocol, std::span<const double> times_s,
                                   const QuasiStaticObserver& observer = {},
                                   const QuasiStaticState* from = nullptr) const;

 private:
  const BondSystem& bonds_;
  Positions rest_;
  Constraints constraints_;
  Probes probes_;
  QuasiStaticOptions options_;
};

}  // namespace tpm::organ
