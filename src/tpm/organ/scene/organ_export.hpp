#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/organ/scene/scene.hpp"

namespace tpm::organ {

/// The physics engines that an organ can be written for.
enum class OrganTarget {
  sofa,  ///< scene of SOFA 23.12 or later: mechanical object, masses, springs
  mjcf,  ///< model of MuJoCo 2.3 or later: bodies on slides, spatial tendons
};

/// "sofa", "mjcf"
[[nodiscard]] std::vector<std::string> organ_targets();
/// None for another word.
[[nodiscard]] std::optional<OrganTarget> organ_target(std::string_view text);

/// Both engines have, for a bond, a spring with a damper beside it: f = k l + c dl/dt.
struct OrganExportOptions {
  OrganTarget target = OrganTarget::sofa;
  /// Springs of the instantaneous stiffness without dampers, for motions that are fast against
  /// every relaxation time. Else the equilibrium stiffness and c = sum_j g_j tau_j, which is the
  /// bond's law to first order in the frequency: for slow motions.
  bool instantaneous = false;
  double density_kg_m3 = 1060.0;  ///< of the spheres, > 0
  std::string source = {};        ///< what is written, for the comment: a file's name
};

/// The spring and the damper that stand for a bond at rest.
struct ExportedBond {
  std::size_t a = 0, b = 0;  ///< spheres, from 0
  double stiffness_N_per_m = 0.0, damping_N_s_per_m = 0.0, rest_length_m = 0.0;
  bool rope = false;
};
[[nodiscard]] std::vector<ExportedBond> exported_bonds(const Tissue& tissue, bool instantaneous);

/// The spheres, masses, anchors, sliders and bonds of an organ as a document of the engine, SI,
/// with what it leaves out as comments. Spheres are numbered from 0 there. Without gravity, probe
/// and protocol. Throws Error(bad_input) for a density that is not above 0.
[[nodiscard]] std::string export_organ(const Tissue& tissue, const OrganExportOptions& options);

/// Properties of this organ that have no counterpart in the format; each stands among the comments,
/// too.
[[nodiscard]] std::vector<Remark> organ_export_remarks(const Tissue& tissue,
                                                       const OrganExportOptions& options);

}  // namespace tpm::organ
