#pragma once
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "tpm/network/network.hpp"
#include "tpm/network/tool.hpp"
#include "tpm/solve/block_ldlt.hpp"

namespace tpm {

/// How lateral bonds pull.
enum class LateralBond {
  elastic,       ///< pulling and pushing
  tension_only,  ///< as a rope
};

/// What the bonds remember, as a function of their elongation l: y = offset + following l.
struct BondMemory {
  Eigen::VectorXd offset;  ///< m, one per bond
  double following = 0.0;  ///< 0 to 1
  /// Which tool contacts are closed, one entry each; none: those that overlap or just touch.
  std::span<const char> closed = {};
};

/// The bonds of a network with the stiffness of a material, as one large nonlinear spring with
/// memory. Every bond pulls with
///
///     N = k l - g y,    l = L - L0,    dy/dt = (l - y) / tau                   (N, m, s)
///
/// where for a radial bond k = w E2 A0/l0 and g = w E2^2/(E1 + E2) A0/l0, so that y = e1 (E1 +
/// E2)/E2 is the elongation that the Kelvin-Voigt unit has caught up with (docs/notation.md),
/// and for a lateral bond k = w E' A0/l0 and g = 0; w is the bond's factor. The force acts along
/// the bond as it lies now.
///
/// Contacts with tools are the last bonds of a system: springs without memory that push only, along
/// the line of centres or a fixed normal. Tools are the last columns of positions.
class BondSystem {
 public:
  BondSystem(const Network& network, const TpmParameters& material,
             LateralBond lateral = LateralBond::elastic);

  /// The same bonds with another material; the graph is shared.
  [[nodiscard]] BondSystem with_material(const Network& network,
                                         const TpmParameters& material) const;

  /// The same bonds and contacts with tools.
  /// @param tools how many columns of positions follow those of the spheres
  [[nodiscard]] BondSystem with_tools(std::size_t tools,
                                      std::span<const ToolContact> contacts) const;

  /// Bonds and contacts.
  [[nodiscard]] std::size_t size() const { return end_a_.size(); }
  [[nodiscard]] std::size_t contact_count() const { return contacts_.size(); }
  /// The number of the first contact among the bonds.
  [[nodiscard]] std::size_t first_contact() const { return size() - contacts_.size(); }
  [[nodiscard]] const std::vector<ToolContact>& contacts() const { return contacts_; }
  /// Columns of positions: spheres and tools.
  [[nodiscard]] std::size_t spheres() const { return spheres_; }
  [[nodiscard]] double relaxation_time_s() const { return relaxation_time_s_; }
  [[nodiscard]] std::span<const std::uint32_t> end_a() const { return end_a_; }
  [[nodiscard]] std::span<const std::uint32_t> end_b() const { return end_b_; }
  [[nodiscard]] const Eigen::VectorXd& rest_length_m() const { return rest_length_; }
  /// It pulls only, as a rope.
  [[nodiscard]] bool is_rope(std::size_t bond) const { return rope_[bond]; }
  /// k of each bond, N/m.
  [[nodiscard]] const Eigen::VectorXd& stiffness() const { return stiffness_; }
  /// g of each bond, N/m, 0 <= g <= k.
  [[nodiscard]] const Eigen::VectorXd& relaxing() const { return relaxing_; }

  /// The contacts that overlap or just touch, as BondMemory::closed.
  [[nodiscard]] std::vector<char> closed_contacts(const Positions& position) const;

  /// l of each bond, m; of a contact its gap, negative where it overlaps.
  void elongations(const Positions& position, Eigen::VectorXd& elongation) const;

  /// What each bond pulls with, N: positive in tension.
  void tensions(const Positions& position, const BondMemory& memory,
                Eigen::VectorXd& tension) const;

  /// Adds to `force` what the bonds pull their spheres with, N, where y = memory.offset +
  /// memory.following l: with following = 0 the offset is what is remembered now; with 1 and no
  /// offset everything has relaxed; between them an implicit step of time.
  void add_forces(const Positions& position, const BondMemory& memory,
                  Eigen::Matrix3Xd& force) const;

  /// Adds the stiffness matrix -d force / d position.
  void add_stiffness(const Positions& position, const BondMemory& memory,
                     BlockMatrix& matrix) const;

  /// The change of each bond's elongation, m, under small displacements of the spheres, m.
  void elongation_changes(const Positions& position, const Eigen::Matrix3Xd& displacement,
                          Eigen::VectorXd& change) const;

  /// Adds the stiffness matrix times displacements of the spheres, N.
  void add_stiffness_times(const Positions& position, const BondMemory& memory,
                           const Eigen::Matrix3Xd& displacement, Eigen::Matrix3Xd& force) const;

  /// What add_forces derives from: minus its gradient are the forces. J.
  [[nodiscard]] double potential_J(const Positions& position, const BondMemory& memory) const;

  /// Energy in the springs, J: of a radial bond that of E2 and E1, of a lateral one that of E'.
  [[nodiscard]] double stored_energy_J(const Positions& position,
                                       const Eigen::VectorXd& remembered) const;

  /// Power that the dashpots turn into heat, W, >= 0.
  [[nodiscard]] double dissipation_W(const Positions& position,
                                     const Eigen::VectorXd& remembered) const;

  /// Minus the derivative of the force on sphere a by the place of sphere a (or b by b), N/m;
  /// minus this block stands at (a, b) and (b, a) of the stiffness matrix.
  [[nodiscard]] Eigen::Matrix3d stiffness_block(std::size_t bond, const Positions& position,
                                                const BondMemory& memory) const;

  /// The graph of the spheres, and where each bond stands on it. Found when first asked for:
  /// factors of large networks do not fit into memory, and what iterates needs none.
  [[nodiscard]] const BlockPattern& pattern() const { return graph().pattern; }
  [[nodiscard]] BlockPattern::Place place(std::size_t bond) const { return graph().place[bond]; }

  /// The same without the bonds of some spheres, for factorisations: what is held has no part in
  /// them.
  struct PartGraph {
    BlockPattern pattern;  ///< of all spheres; those left out have no neighbours
    std::vector<std::optional<BlockPattern::Place>> place;  ///< none for a bond left out
  };
  /// The latest few are kept, for this system and its copies.
  /// @param without for each sphere, whether its bonds are left out
  [[nodiscard]] std::shared_ptr<const PartGraph> part_graph(const std::vector<bool>& without) const;

 private:
  /// How a bond lies.
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
  [[nodiscard]] Pull pull(std::size_t bond, double elongation, const BondMemory& memory) const;
  /// False for a slack rope and an open contact.
  [[nodiscard]] bool carries(std::size_t bond, double elongation,
                             std::span<const char> closed) const;

  void set_material(const Network& network, const TpmParameters& material);

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
  double relaxation_time_s_ = 0.0;
  std::shared_ptr<LazyGraph> graph_ = std::make_shared<LazyGraph>();
};

}  // namespace tpm
