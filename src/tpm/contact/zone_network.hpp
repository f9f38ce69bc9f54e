#pragma once
#include <memory>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/contact/condensed/compared_motion.hpp"
#include "tpm/contact/servo_bonds.hpp"
#include "tpm/contact/step_error.hpp"
#include "tpm/contact/zone_claim.hpp"
#include "tpm/contact/zone_surroundings.hpp"
#include "tpm/organ/linear/aligned_floats.hpp"
#include "tpm/organ/linear/panel_kernels.hpp"
#include "tpmkit/contact_model.hpp"

namespace tpm::contact {

struct ZoneNetworkOptions {
  double period_s = 1e-3;           ///< > 0
  int rings = 3;                    ///< bonds from the contact to the edge of the zone, >= 1
  double linear_depth_m = 3.25e-3;  ///< where what surrounds the zone is linearised, >= 0
  double frozen_depth_m = 4e-3;     ///< where the zone's own stiffness is taken, >= 0
  double deepest_m = 10e-3;         ///< answers beyond are not valid, > 0
  double aside_m = 5e-3;            ///< the same across the normal, > 0
  bool portable = false;            ///< as ServoNetworkOptions
};

/// The network near a contact, and what surrounds it as a linear tissue
/// (docs/theory.md). Bonds of which every movable end lies within some rings of the contact are
/// kept as they are; all others have the stiffness that they have at a depth, and no force at rest.
///
/// The spheres outside follow those at the edge of the zone as they do in a step of the linear
/// tissue, and have a few displacements of their own beside that: those by which the fields of the
/// contact, instantaneous and relaxed, differ from it. On these the linear tissue is projected
/// symmetrically, its viscous part with the same viscous state as every bond has, so that it stores
/// and dissipates as a tissue does (docs/theory.md).
///
/// `error_N` is the sum of what the linear surroundings cost, measured when the model is built: the
/// zone is compared with the quasi-static network along motions on the normal and at equilibria
/// beside it, and claims twice the errors found (ZoneClaim); what linear elongations cost
/// (StepError); and what is left unbalanced.
class ZoneNetwork final : public ContactModel {
 public:
  /// As ServoNetwork, at one sphere or at a patch that moves together. Throws Error(bad_input) for
  /// guided spheres as well.
  ZoneNetwork(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
              const PushedSpheres& contact, const Eigen::Vector3d& into_tissue,
              const ZoneNetworkOptions& options = {});

  void reset() noexcept override;
  ContactAnswer step(const ToolPose& tool) noexcept override;
  [[nodiscard]] double period_s() const noexcept override { return options_.period_s; }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return instantaneous_;
  }
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override {
    return equilibrium_;
  }
  [[nodiscard]] Eigen::Index spheres() const noexcept override {
    return static_cast<Eigen::Index>(zone_role_.size());
  }
  void displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept override;

  /// Of a step.
  [[nodiscard]] BalanceWork work() const noexcept;
  /// Displacements of the surroundings beside those that follow the edge.
  [[nodiscard]] Eigen::Index own_displacements() const noexcept { return own_; }

 private:
  /// A dense matrix for PanelKernels.
  struct Dense {
    AlignedFloats numbers;
    std::size_t stride = 0, columns = 0;
    void put(const Eigen::MatrixXd& matrix);
    [[nodiscard]] FloatPanel panel() const { return {numbers.data(), stride, columns}; }
  };
  /// A dense matrix that only corrects, in half the bytes.
  struct Packed {
    AlignedWords words;
    std::size_t rows = 0, columns = 0;
    void put(const Eigen::MatrixXd& matrix);
    [[nodiscard]] PackedPanel panel() const { return {words.data(), rows, columns}; }
  };
  /// What a zone is made from, whatever its period.
  struct Parts {
    std::vector<ServoBonds::Choice> near, far;
    Eigen::MatrixXd lasting, relaxing;  ///< of the surroundings, by edge and own displacements
    Positions frozen;
    double relaxed = 0.0;  ///< how far the viscous elongations had caught up there
  };
  void choose_zone(const PushedContact& tissue);
  [[nodiscard]] Parts build(PushedContact& tissue);
  /// Steps with these weights from now on.
  void set_weights(const PushedContact& tissue, const Parts& parts, ServoWeights weights);
  /// Finds the claim (zone_comparison.cpp); ends with the weights of the period, at rest.
  void compare(PushedContact& tissue, const Constraints& constraints, const Parts& parts);
  void compare_along(const ComparedMotion& motion);
  void compare_aside(PushedContact& tissue, double relaxed, int steps_there);
  Eigen::Vector3d force_after(const Eigen::Vector3d& displacement_m, int steps_there);
  void add_surroundings() noexcept;
  void gather(std::size_t first) noexcept;

  ZoneNetworkOptions options_;
  Eigen::Vector3d into_;
  ServoWeights weights_;
  const PanelKernels& kernels_;
  PushedSpheres contact_;
  std::vector<std::size_t> zone_;      ///< movable spheres of the zone, those at its edge last
  std::size_t edge_ = 0;               ///< how many of them are at the edge
  std::vector<std::uint32_t> column_;  ///< of each sphere among displacements
  std::vector<char> zone_role_;        ///< of each sphere: 0 held, 1 outside, 2 in the zone
  std::vector<std::size_t> outside_;
  Eigen::Index own_ = 0;
  Eigen::Matrix3d instantaneous_, equilibrium_;

  ServoBonds at_contact_, elsewhere_;
  Packed inverse_;  ///< of the frozen stiffness, by coordinates of zone and own displacements
  Dense stiff_;     ///< of the surroundings in a step, by coordinates of edge and own ones
  Dense relaxing_;  ///< what relaxes of it
  Dense outer_;     ///< displacements outside by those coordinates
  std::array<AlignedFloats, 3> field_;
  std::unique_ptr<StepError> step_error_;
  ZoneClaim claim_;

  AlignedFloats displacement_, force_;
  AlignedFloats right_, change_;              ///< by coordinates of zone and own displacements
  AlignedFloats moved_;                       ///< edge and own displacements
  AlignedFloats offset_, next_offset_;        ///< as of bonds, of edge and own displacements
  std::vector<AlignedFloats> branch_offset_;  ///< the same of each branch, where there are several
  AlignedFloats pull_, offset_pull_, next_pull_;
  double largest_N_ = 0.0;
};

}  // namespace tpm::contact
