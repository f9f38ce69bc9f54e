#pragma once
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "tpm/organ/bonds/material_field.hpp"
#include "tpm/organ/bonds/network.hpp"
#include "tpm/organ/bonds/tool.hpp"
#include "tpm/organ/bonds/viscous_law.hpp"
#include "tpm/organ/linear/block_ldlt.hpp"

namespace tpm::organ {

/// A share of the viscous elongation that follows the elongation within a step: one number for all
/// bonds, or one for each law of a BondSystem.
class RelaxationFactor {
 public:
  // NOLINTNEXTLINE(google-explicit-constructor): one number for all bonds is the usual case
  RelaxationFactor(double all = 0.0) : all_(all) {}
  explicit RelaxationFactor(std::vector<double> of_law) : of_law_(std::move(of_law)) {}

  [[nodiscard]] double operator()(std::size_t law) const {
    return of_law_.empty() ? all_ : of_law_[law];
  }
  [[nodiscard]] bool operator==(const RelaxationFactor& other) const = default;

 private:
  double all_ = 0.0;
  std::vector<double> of_law_;
};

/// The mean viscous elongation of the bonds as a function of what they follow, V(l) (for linear
/// branches l itself): y = offset + relaxation_factor V(l).
struct ViscousState {
  Eigen::VectorXd offset;              ///< m, one per bond
  RelaxationFactor relaxation_factor;  ///< 0 to 1
  /// Marks of the tool contacts that are closed, one entry each; none: those that overlap or just
  /// touch.
  std::span<const char> closed = {};
};

/// The bonds of a network with their materials, as one large nonlinear spring with viscous
/// elongations. A bond of elongation l = L - L0 pulls with
///
///     N = (k - g) u(l) + g (V(l) - y),   y = sum_j gamma_j m_j,   dm_j/dt = (V(l) - m_j)/tau_j
///
/// (N, m, s), k its instantaneous stiffness at rest, g the part of it that relaxes, 0 <= g <= k.
/// The law of a bond (viscous_law.hpp) says u, V and gamma_j, tau_j, with u(l) = V(l) = l where
/// nothing stiffens; laws are shared by bonds whose k and g differ. For the paper's element N = k l
/// - g y with k = w E2 A0/l0, g = w E2^2/(E1 + E2) A0/l0 and y = e1 (E1 + E2)/E2
/// (docs/theory.md), for its lateral bonds k = w E' A0/l0 and g = 0; w is the bond's factor. The
/// force acts along the bond as it lies now.
///
/// Force and tangent stiffness depend on the m_j of a bond through the mean y alone (ViscousState).
/// Where every m_j counts, viscous elongations are a matrix with one row per bond and one column
/// per branch of its law, most_branches() in all; the columns that a law does not have stay 0.
///
/// Contacts with tools are the last bonds of a system: springs that push only, along the line of
/// centres or a fixed normal. Tools are the last columns of positions.
class BondSystem {
 public:
  /// Throws Error(bad_input) as BondLaws does.
  BondSystem(const Network& network, const MaterialField& materials);
  /// One material everywhere.
  BondSystem(const Network& network, const BondMaterial& material);

  /// The same bonds with other materials of the same lateral rule; the graph is shared.
  [[nodiscard]] BondSystem with_materials(const Network& network,
                                          const MaterialField& materials) const;

  /// The same bonds and contacts with tools.
  /// @param tools how many columns of positions follow those of the spheres
  [[nodiscard]] BondSystem with_tools(std::size_t tools,
                                      std::span<const ToolContact> contacts) const;

  /// The bonds between spheres alone: no contacts, and no columns of tools.
  [[nodiscard]] BondSystem without_tools() const;

  /// Bonds and contacts.
  [[nodiscard]] std::size_t size() const { return end_a_.size(); }
  [[nodiscard]] std::size_t contact_count() const { return contacts_.size(); }
  /// The number of the first contact among the bonds.
  [[nodiscard]] std::size_t first_contact() const { return size() - contacts_.size(); }
  [[nodiscard]] const std::vector<ToolContact>& contacts() const { return contacts_; }
  /// Columns of positions: spheres and tools.
  [[nodiscard]] std::size_t spheres() const { return spheres_; }

  /// The laws of the bonds, and the number of a bond's law. Contacts have the first, of which they
  /// use nothing.
  [[nodiscard]] std::span<const ViscousLaw> laws() const { return laws_; }
  [[nodiscard]] std::size_t law_of(std::size_t bond) const { return law_[bond]; }
  /// The different relaxation times of all laws, rising, s.
  [[nodiscard]] std::span<const double> relaxation_times_s() const { return times_s_; }
  [[nodiscard]] double shortest_relaxation_time_s() const;  ///< infinite if nothing relaxes
  [[nodiscard]] double longest_relaxation_time_s() const;   ///< 0 if nothing relaxes
  /// Of one bond, at least 1.
  [[nodiscard]] Eigen::Index most_branches() const { return most_branches_; }
  /// True if all bonds that relax do so by one function of time (they have one law).
  [[nodiscard]] bool relaxes_alike() const;
  [[nodiscard]] bool is_linear() const { return linear_; }
  /// The relaxation time of a system that has one; infinite if nothing relaxes.
  /// Throws Error(bad_input) for a system with several: see require_one_linear_branch.
  [[nodiscard]] double relaxation_time_s() const;
  [[nodiscard]] std::span<const std::uint32_t> end_a() const { return end_a_; }
  [[nodiscard]] std::span<const std::uint32_t> end_b() const { return end_b_; }
  [[nodiscard]] const Eigen::VectorXd& rest_length_m() const { return rest_length_; }
  /// It pulls only, as a rope.
  [[nodiscard]] bool is_rope(std::size_t bond) const { return rope_[bond]; }
  /// k of each bond, the instantaneous stiffness at rest, N/m.
  [[nodiscard]] const Eigen::VectorXd& stiffness() const { return stiffness_; }
  /// g of each bond, N/m, 0 <= g <= k.
  [[nodiscard]] const Eigen::VectorXd& relaxing() const { return relaxing_; }
  /// The stiffness of each bond at rest of which a share has relaxed, k - relaxation_factor g, N/m.
  [[nodiscard]] Eigen::VectorXd stiffness_when(const RelaxationFactor& relaxation_factor) const;

  /// The contacts that overlap or just touch, as ViscousState::closed.
  [[nodiscard]] std::vector<char> closed_contacts(const Positions& position) const;

  /// l of each bond, m; of a contact its gap, negative where it overlaps.
  void elongations(const Positions& position, Eigen::VectorXd& elongation) const;
  /// V(l) of each bond, which its viscous elongations follow, m; of a contact its gap.
  void followed(const Positions& position, Eigen::VectorXd& followed) const;
  /// The mean viscous elongation y of each bond.
  /// @param viscous m_j by (bond, branch)
  [[nodiscard]] Eigen::VectorXd mean_viscous(const Eigen::MatrixXd& viscous) const;
  /// The viscous state with mean viscous elongations y at this instant, of which a share follows.
  [[nodiscard]] ViscousState viscous_state_at(const Eigen::VectorXd& y,
                                              const Eigen::VectorXd& followed,
                                              RelaxationFactor relaxation_factor,
                                              std::span<const char> closed = {}) const;

  /// Force of each bond, N: positive in tension.
  void tensions(const Positions& position, const ViscousState& viscous_state,
                Eigen::VectorXd& tension) const;

  /// Adds to `force` what the bonds pull their spheres with, N: with relaxation_factor = 0 the
  /// offset is the mean viscous elongation now; with 1 and no offset everything is at equilibrium;
  /// between them it is an implicit step of time.
  void add_forces(const Positions& position, const ViscousState& viscous_state,
                  Eigen::Matrix3Xd& force) const;

  /// Adds the stiffness matrix -d force / d position.
  void add_stiffness(const Positions& position, const ViscousState& viscous_state,
                     BlockMatrix& matrix) const;

  /// The change of each bond's elongation, m, under small displacements of the spheres, m.
  void elongation_changes(const Positions& position, const Eigen::Matrix3Xd& displacement,
                          Eigen::VectorXd& change) const;
  /// V'(l) of each bond; 1 for contacts.
  void kernel_slopes(const Positions& position, Eigen::VectorXd& slope) const;

  /// Adds the stiffness matrix times displacements of the spheres, N.
  void add_stiffness_times(const Positions& position, const ViscousState& viscous_state,
                           const Eigen::Matrix3Xd& displacement, Eigen::Matrix3Xd& force) const;

  /// Potential of add_forces: minus its gradient are the forces. J.
  [[nodiscard]] double potential_J(const Positions& position,
                                   const ViscousState& viscous_state) const;

  /// Energy stored in the bonds, J: U(l) + sum_j g_j [P(l) + P*(m_j) - l m_j] (bond_law.hpp).
  /// @param viscous m_j by (bond, branch), most_branches() columns
  [[nodiscard]] double stored_energy_J(const Positions& position,
                                       const Eigen::Ref<const Eigen::MatrixXd>& viscous) const;

  /// Power that the branches turn into heat, W, >= 0.
  /// @param viscous as above
  [[nodiscard]] double dissipation_W(const Positions& position,
                                     const Eigen::Ref<const Eigen::MatrixXd>& viscous) const;

  /// Minus the derivative of the force on sphere a by the place of sphere a (or b by b), N/m;
  /// minus this block stands at (a, b) and (b, a) of the stiffness matrix.
  [[nodiscard]] Eigen::Matrix3d stiffness_block(std::size_t bond, const Positions& position,
                                                const ViscousState& viscous_state) const;

  /// The graph of the spheres, and where each bond stands on it. Found when first asked for:
  /// factors of large networks do not fit into memory, and what iterates needs none.
  [[nodiscard]] const BlockPattern& pattern() const { return graph().pattern; }
  [[nodiscard]] BlockPattern::Place place(std::size_t bond) const { return graph().place[bond]; }

  /// The same without the bonds of some spheres, for factorisations: fixed ones have no part in
  /// them.
  struct PartGraph {
    BlockPattern pattern;  ///< of all spheres; those left out have no neighbours
    std::vector<std::optional<BlockPattern::Place>> place;  ///< none for a bond left out
  };
  /// The latest few are kept, for this system and its copies.
  /// @param without for each sphere, whether its bonds are left out
  [[nodiscard]] std::shared_ptr<const PartGraph> part_graph(const std::vector<bool>& without) const;

 private:
  /// Direction and length of a bond.
  struct Line {
    Eigen::Vector3d direction;  ///< unit vector from a to b
    double elongation;          ///< l, m
    double per_length;          ///< 1/length, 1/m: how it turns; 0 for a contact with a flat face
  };
  [[nodiscard]] Line line(std::size_t bond, const Positions& position) const;

  /// N and dN/dl of a bond; a slack rope and an open contact have neither.
  struct Pull {
    double force, slope;
  };
  [[nodiscard]] Pull pull(std::size_t bond, double elongation,
                          const ViscousState& viscous_state) const;
  /// False for a slack rope and an open contact.
  [[nodiscard]] bool carries(std::size_t bond, double elongation,
                             std::span<const char> closed) const;

  void set_materials(const Network& network, const MaterialField& materials);
  /// The number of a law, which is new or not.
  [[nodiscard]] std::uint16_t number_of(const ViscousLaw& law);
  void number_times();
  void require_branches(const Eigen::Ref<const Eigen::MatrixXd>& viscous) const;

  struct Graph {
    BlockPattern pattern;
    std::vector<BlockPattern::Place> place;
  };
  /// A graph that is found once, also if several threads ask; copies of the system share it.
  struct LazyGraph {
    std::once_flag once;
    std::optional<Graph> graph;
    std::mutex part_guard;
    /// The latest last.
    std::vector<std::pair<std::vector<bool>, std::shared_ptr<const PartGraph>>> part;
  };
  [[nodiscard]] const Graph& graph() const;

  std::size_t spheres_;
  std::vector<std::uint32_t> end_a_, end_b_;
  Eigen::VectorXd rest_length_, stiffness_, relaxing_;
  std::vector<bool> rope_;
  std::vector<ToolContact> contacts_;
  std::vector<ViscousLaw> laws_;
  std::vector<std::uint16_t> law_;  ///< of each bond
  std::vector<double> times_s_;
  Eigen::Index most_branches_ = 1;
  bool linear_ = true;
  std::shared_ptr<LazyGraph> graph_ = std::make_shared<LazyGraph>();
};

/// Refuses materials that a formulation does not take. Throws Error(bad_input) that names those
/// that do, unless the bonds are linear and have at most one relaxation time.
/// @param formulation in words, such as "the condensed model"
void require_one_linear_branch(const BondSystem& bonds, std::string_view formulation);

}  // namespace tpm::organ
