#pragma once
#include <limits>
#include <optional>

#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"

namespace tpm::organ {

/// Solver of the linear systems of CVODE's Newton iteration.
enum class NewtonSolver {
  /// y and the velocities eliminated by hand; 3x3 blocks, one a sphere, are left.
  eliminated,
  /// The whole Jacobian, sparse, through KLU: the reference.
  klu,
};

/// Family of formulas by which CVODES steps.
enum class MotionFormula {
  bdf,
  /// The trapezoidal rule (Adams and Moulton's formula of order 2): it damps nothing by itself, and
  /// errs otherwise than BDF.
  trapezoidal,
};

struct InertialOptions {
  /// Error that a step may have, root mean square over the coordinates, in parts of the largest
  /// depth (velocities: of that depth times the lowest angular frequency); 1e-12 to 0.1.
  double tolerance = 1e-5;
  /// Highest order of the BDF formulae, 1 to 5. Those above 2 are not stable on the imaginary axis,
  /// where vibrations live: they keep the step short for as long as something rings.
  int highest_order = 2;
  MotionFormula formula = MotionFormula::bdf;
  NewtonSolver newton = NewtonSolver::eliminated;
  /// Of the lowest mode of the network without its probe, 0 to 10; what the bonds' own dashpots add
  /// is not in it.
  double damping_ratio = 0.1;
  /// Share of that ratio that comes from a dashpot along each bond, in proportion to its stiffness;
  /// the rest is in proportion to mass and slows every velocity alike. 0 to 1.
  double stiffness_share = 0.0;
  /// Of each contact of a sphere with a tool, 0 to 10: a dashpot beside its spring, so that what
  /// the spring's stiffness would make ring comes to rest. 1: the sphere on its contact is
  /// critically damped.
  double contact_damping_ratio = 1.0;
  bool energy = false;  ///< keep account of the energy (InertialRun::energy)
};

/// Cost of a run.
struct InertialWork {
  long steps = 0;
  long rejected = 0;  ///< error tests failed
  long rates = 0;     ///< evaluations of the equations of motion
  long newton_iterations = 0;
  long newton_failures = 0;
  long factorisations = 0;
};

/// Energy balance of a run, J: the work of the probe is the sum of all else.
struct InertialEnergy {
  double work = 0.0;          ///< of the probe
  double stored = 0.0;        ///< in the springs, change since the start
  double kinetic = 0.0;       ///< at the end; at the start all spheres stand still
  double bond_heat = 0.0;     ///< of the dashpots in the Zener bonds
  double damping_heat = 0.0;  ///< of the damping
  double contact_heat = 0.0;  ///< of impacts of tools on spheres, and of the contacts' dashpots
  [[nodiscard]] double missing() const {
    return work - stored - kinetic - bond_heat - damping_heat - contact_heat;
  }
};

/// An impact: speeds that change in an instant. The probe changes that of what it drives where an
/// imposed depth changes its rate, and a tool that of the spheres that it meets.
struct ProbeImpact {
  double time_s = 0.0;
  double impulse_N_s = 0.0;            ///< of the probe, on tool and tissue
  double impulse_on_tissue_N_s = 0.0;  ///< the part of it that the tissue takes
};

/// Where a run stands; another run can go on from there.
struct InertialState {
  double time_s = 0.0;
  Eigen::VectorXd motion;  ///< the integrator's: displacements, velocities, viscous elongations
  /// Work, heat of bonds, of damping and of contacts.
  Eigen::Vector4d spent_J = Eigen::Vector4d::Zero();
  double impact_work_J = 0.0;
  double stored_at_start_J = 0.0;
  /// Contacts that tools have struck have settled by then.
  double settled_s = std::numeric_limits<double>::lowest();
};

/// Gets the state at every asked time in turn (no energies), and what each contact with a tool
/// pushes it and its sphere apart with then, N.
using InertialObserver =
    std::function<void(const QuasiStaticState&, const Eigen::VectorXd& contact_push_N)>;

/// Told of the steps of a run, so that extremes between asked times can be found.
struct StepObserver {
  /// Gets the state at the end of each step.
  InertialObserver step;
  /// Told where what follows is not smooth with what was before: at a corner or an impact.
  std::function<void()> corner;
};

struct InertialRun {
  /// Contact force, N, or depth, m, at each asked time. The force is what the probe exerts on the
  /// tissue, impacts left out: on the driven sphere, which is tissue, or through the contacts of a
  /// tool, whose own inertia is not in it.
  Eigen::VectorXd response;
  /// The part of the contact force that the driven sphere itself takes, N: its mass times (its
  /// acceleration, which is 0 between kinks, + alpha its velocity). 0 under a load, and for tools.
  Eigen::VectorXd of_driven_sphere;
  std::vector<ProbeImpact> impacts;
  InertialWork work;
  std::optional<InertialEnergy> energy;
  Positions position;         ///< where the run ended
  Eigen::Matrix3Xd velocity;  ///< there, m/s
  Eigen::MatrixXd viscous;    ///< m_j by (bond, branch) there, m; 0 where nothing relaxes
  InertialState end;
};

/// The inertial network (docs/network.md): spheres with mass, joined by bonds
/// with viscous elongations m_j (BondSystem), damped:
///
///     dx/dt = v,   m dv/dt = f(x, y) - alpha m v - beta sum of k_w (dl/dt) along the bond,
///     dm_j/dt = (V(l(x)) - m_j)/tau_j,   y = sum_j gamma_j m_j
///
/// with alpha = 2 zeta omega (1 - s), 0 for tools, beta = 2 zeta s/omega, zeta the damping ratio, s
/// the stiffness share, omega that of lowest_mode() and k_w the bond's storage stiffness there. A
/// tool meets a sphere by inelastic_impact(), which leaves no speed of approach; from then on their
/// contact pushes with max(0, k d + c dd/dt), d > 0 the overlap and c by the contact damping ratio.
/// As k rises, forces tend to those of rigid tools: the error falls with 1/k.
///
/// Integrated by CVODES (BDF, Newton), restarted at every kink of the protocol and every impact.
/// See docs/network.md.
class Inertial {
 public:
  /// @param constraints of the network without the probe: fixed and guided spheres
  /// @param mass_kg one per sphere, > 0
  /// @param bonds must live as long as this
  /// Throws Error(bad_input) for options out of range, masses that are not positive, a probe that
  /// cannot move, and a network with zero-energy modes.
  Inertial(const BondSystem& bonds, Positions rest, Constraints constraints, Probes probes,
           Eigen::VectorXd mass_kg, InertialOptions options = {});

  /// @param times_s any order, finite, within the protocol; at a jump the value just after it
  /// Throws Error(bad_input) for times outside it and for a jump of depth, which would need an
  /// infinite force; Error(numerical) where CVODES gives up, with the time.
  /// @param observer if any, sees positions, viscous elongations and contacts at each asked time in
  /// turn
  /// @param steps if any, told of every step
  /// @param from if any, where to go on in the protocol instead of beginning at rest: the end of a
  ///        run of the same network and options. No time before it can be asked for; the account of
  ///        the energy and `stored_at_start_J` go on, the impacts and the work counted do not.
  [[nodiscard]] InertialRun run(const Protocol& protocol, std::span<const double> times_s,
                                const InertialObserver& observer = {},
                                const InertialState* from = nullptr,
                                const StepObserver& steps = {}) const;

  /// The mode that the damping ratio is one of.
  [[nodiscard]] const LowestMode& lowest() const { return lowest_; }

 private:
  const BondSystem& bonds_;
  Positions rest_;
  Constraints constraints_;
  Probes probes_;
  Eigen::VectorXd mass_kg_;
  InertialOptions options_;
  LowestMode lowest_;
};

}  // namespace tpm::organ
