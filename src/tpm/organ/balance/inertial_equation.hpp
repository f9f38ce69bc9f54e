#pragma once
// The inside of Inertial: the equations of motion, their Jacobian, and Newton's matrix.
#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "tpm/organ/balance/stage_balance.hpp"

namespace tpm::organ {

/// Mass and damping of a network.
struct Inertia {
  Eigen::VectorXd mass_kg;        ///< of each sphere and tool
  double drag_per_s = 0.0;        ///< alpha, of spheres; tools have none
  Eigen::VectorXd dashpot_N_s_m;  ///< along each bond; empty if there are none
  /// Of the dashpot c = 2 ratio sqrt(k m) beside the spring k of each contact, m the effective mass
  /// of its sphere and tool (an imposed tool is infinitely heavy).
  double contact_damping_ratio = 0.0;
};

/// Exchange in an impact of tools on spheres.
struct ToolImpact {
  double on_tissue_N_s = 0.0;  ///< impulse, summed as the response sums forces
  double work_J = 0.0;         ///< of the probe, which keeps its imposed speed
  double lost_J = 0.0;         ///< of kinetic energy
};

/// A network in motion, for calculation: everything of one instant, unpacked from a state vector.
struct TissueMotion {
  Positions position;
  Eigen::Matrix3Xd velocity;
  Eigen::MatrixXd viscous;  ///< m_j by (bond, branch)
  Eigen::VectorXd mean;     ///< y of each bond
};

/// The equations of motion of a driven network as a system of first order. The state vector holds
/// the displacements from rest along free directions (3 a sphere), their velocities (3 a sphere)
/// and the viscous elongations m_j of each bond that relaxes, branch by branch; what is not free or
/// imposed stays 0 in it.
class InertialEquation {
 public:
  using Vector = Eigen::VectorXd;
  using ConstVector = Eigen::Ref<const Eigen::VectorXd>;
  using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t>;

  /// @param tissue must live as long as this
  InertialEquation(const DrivenTissue& tissue, const Positions& rest, Inertia inertia);

  [[nodiscard]] Eigen::Index size() const;
  [[nodiscard]] Eigen::Index coordinates() const { return 3 * rest_.cols(); }
  [[nodiscard]] const DrivenTissue& tissue() const { return tissue_; }
  [[nodiscard]] const Inertia& inertia() const { return inertia_; }
  [[nodiscard]] double driven_mass_kg() const;
  /// The same without tools.
  [[nodiscard]] double driven_sphere_mass_kg() const;

  /// The piece of the protocol that holds from now on, linear in time.
  void set_piece(const Knot& from, const Knot& to);
  /// Value imposed on the first group in the piece, m or N.
  [[nodiscard]] double imposed_value(double time_s) const {
    return tissue_.path().value(0, imposed(time_s));
  }
  /// Rate of the depth imposed on the first group, m/s; 0 under a load.
  [[nodiscard]] double imposed_speed() const;
  /// Velocities that imposed depths give what they drive, m/s; 0 elsewhere.
  [[nodiscard]] Eigen::Matrix3Xd imposed_velocity() const;

  [[nodiscard]] Vector pack(const Positions& position, const Eigen::MatrixXd& viscous) const;
  [[nodiscard]] const TissueMotion& unpack(double time_s, const ConstVector& state);

  void rate(double time_s, const ConstVector& state, Eigen::Ref<Vector> rate);

  /// d rate / d state, every entry that may differ from 0 and the whole diagonal stored.
  [[nodiscard]] Sparse jacobian(double time_s, const ConstVector& state);

  /// Contact force, N, or depth, m, of a group.
  [[nodiscard]] double response(double time_s, const ConstVector& state, std::size_t group = 0);
  /// The part of it that drags the driven sphere itself, N.
  [[nodiscard]] double drag_on_driven_sphere_N() const;

  /// Work of the probe, heat of the bonds, of the damping and of the contacts, W.
  [[nodiscard]] Eigen::Vector4d powers_W(double time_s, const ConstVector& state);
  [[nodiscard]] double kinetic_J(double time_s, const ConstVector& state);
  [[nodiscard]] double stored_J(double time_s, const ConstVector& state);

  /// The gap of each contact with a tool, m; negative where they overlap.
  void gaps(double time_s, const ConstVector& state, Eigen::Ref<Vector> gap);
  /// True if a tool meets a sphere in this very instant: their gap is none, and closing.
  [[nodiscard]] bool meets(double time_s, const ConstVector& state);
  /// Force by which each contact pushes its sphere and tool apart, N: spring and dashpot, never
  /// pulling.
  [[nodiscard]] Vector contact_pushes_N(double time_s, const ConstVector& state);
  /// The inelastic impact of all that touches (inelastic_impact): changes velocities of the state.
  [[nodiscard]] ToolImpact strike(double time_s, Eigen::Ref<Vector> state);

  /// Time that the slowest contact takes to settle after an impact, s: kSettled radians of its
  /// sphere and tool on its spring. Critically damped, 1e-7 of a transient are left.
  [[nodiscard]] double settling_time_s() const;

  /// Factorises 1 - gamma times the Jacobian with the velocities and m_j eliminated: on the free
  /// coordinates M (1 + gamma alpha) + gamma C + gamma^2 K, where of y a share sum_j gamma_j
  /// (gamma/tau_j)/(1 + gamma/tau_j) follows in K. The turning of the bonds' dashpots is left out
  /// of it (it is not symmetric, and small like the velocities). False if it cannot be factorised.
  [[nodiscard]] bool factorise(double time_s, const ConstVector& state, double gamma);
  /// Replaces a right-hand side by the solution, with the last factorisation.
  void solve(Eigen::Ref<Vector> x);

 private:
  [[nodiscard]] double imposed(double time_s) const;
  /// Somewhere within the piece, as a coordinate of the path.
  [[nodiscard]] double within_piece() const { return from_.value + 0.5 * to_rise_; }
  /// The part of a group's response in the motion unpacked that drags what it drives, N.
  [[nodiscard]] double drag_N(std::size_t group) const;
  /// All forces on the spheres but the drag, load included.
  void forces(double time_s, Eigen::Matrix3Xd& force);
  void add_dashpot_forces(const Positions& position, const Eigen::Matrix3Xd& velocity,
                          Eigen::Matrix3Xd& force) const;
  /// Of the contacts that `pressing` names.
  void add_contact_dashpot_forces(const Positions& position, const Eigen::Matrix3Xd& velocity,
                                  std::span<const char> pressing, Eigen::Matrix3Xd& force) const;
  /// Unit vector along a bond or contact, and the length by which it turns, infinite at a face.
  [[nodiscard]] Eigen::Vector3d along(std::size_t bond, const Positions& position,
                                      double& length) const;
  /// Gap of a contact and its rate where the motion was unpacked.
  struct Gap {
    double now_m = 0.0, rate_m_s = 0.0;
    Eigen::Vector3d normal;  ///< from the sphere to the tool
  };
  [[nodiscard]] Gap gap(std::size_t contact) const;
  /// Marks the contacts whose spring and dashpot push in the motion unpacked.
  void find_pressing();
  /// c of a bond's dashpot in the motion unpacked, N s/m; of a contact 0 unless it presses.
  [[nodiscard]] double dashpot_N_s_m(std::size_t bond) const;
  void add_bond_entries(std::vector<Eigen::Triplet<double, std::int64_t>>& entries,
                        std::size_t bond, const BlockMatrix& stiffness) const;

  const DrivenTissue& tissue_;
  Positions rest_;
  Inertia inertia_;
  /// The branches of a bond, whose m_j follow each other in the state.
  [[nodiscard]] const std::vector<ViscousLaw::Branch>& branches_of(std::size_t bond) const {
    return tissue_.bonds().laws()[tissue_.bonds().law_of(bond)].branches;
  }

  std::vector<Eigen::Index> viscous_of_;  ///< of each bond: its first m_j in the state, or -1
  std::vector<std::size_t> relaxing_;     ///< bonds that relax
  Eigen::Index size_ = 0;
  Vector tissue_mass_kg_;         ///< mass, 0 of tools
  Vector drag_per_s_;             ///< of each column
  Vector contact_dashpot_N_s_m_;  ///< of each contact
  Knot from_{0.0, 0.0};
  double slope_ = 0.0, to_rise_ = 0.0;  ///< of the path's coordinate: rate, and over the piece

  TissueMotion motion_;
  Eigen::Matrix3Xd force_;
  Vector followed_;
  std::vector<char> pressing_;  ///< contacts, as ViscousState::closed

  // Newton's matrix.
  BlockMatrix matrix_;
  BlockLdlt factor_;
  double gamma_ = 0.0;
  Positions factorised_at_;
  Vector kernel_slope_;  ///< V'(l) of each bond there
  std::vector<char> factorised_pressing_;
};

}  // namespace tpm::organ
