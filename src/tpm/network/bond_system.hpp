#pragma once
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "tpm/network/network.hpp"
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
};

/// The bonds of a network with the stiffness of a material, as one large nonlinear spring with
/// memory. Every bond pulls with
///
///     N = k l - g y,    l = L - L0,    dy/dt = (l - y) / tau                   (N, m, s)
///
/// where for a radial bond k = w E2 A0/l0 and g = w E2^2/(E1 + E2) A0/l0, so that y = e1 (E1 +
/// E2)/E2 is the elongation that the Kelvin-Voigt unit has caught up with (MODEL.md, section 1),
/// and for a lateral bond k = w E' A0/l0 and g = 0; w is the bond's factor. The force acts along
/// the bond as it lies now.
class BondSystem {
 public:
  BondSystem(const Network& network, const TpmParameters& material,
             LateralBond lateral = LateralBond::elastic);

  /// The same bonds with another material; the graph is shared.
  [[nodiscard]] BondSystem with_material(const Network& network,
                                         const TpmParameters& material) const;

  [[nodiscard]] std::size_t size() const { return end_a_.size(); }
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

  /// l of each bond, m.
  void elongations(const Positions& position, Eigen::VectorXd& elongation) const;

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

 private:
  /// N and dN/dl of a bond; a slack rope has neither.
  struct Pull {
    double force, slope;
  };
  [[nodiscard]] Pull pull(std::size_t bond, double elongation, const BondMemory& memory) const;

  void set_material(const Network& network, const TpmParameters& material);

  struct Graph {
    BlockPattern pattern;
    std::vector<BlockPattern::Place> place;
  };
  /// A graph that is found once, also if several threads ask; copies of the system share it.
  struct LazyGraph {
    std::once_flag once;
    std::optional<Graph> graph;
  };
  [[nodiscard]] const Graph& graph() const;

  std::size_t spheres_;
  std::vector<std::uint32_t> end_a_, end_b_;
  Eigen::VectorXd rest_length_, stiffness_, relaxing_;
  std::vector<bool> rope_;
  double relaxation_time_s_ = 0.0;
  std::shared_ptr<LazyGraph> graph_ = std::make_shared<LazyGraph>();
};

}  // namespace tpm
