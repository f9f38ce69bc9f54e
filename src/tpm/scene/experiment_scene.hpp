#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/network/mass_spring.hpp"
#include "tpm/protocol/protocol.hpp"
#include "tpm/scene/scene.hpp"

namespace tpm {

enum class FormulationKind {
  quasi_static,  ///< forces balance at each instant; what the bonds remember relaxes in time
  inertial,      ///< spheres have mass
  relaxed,       ///< static: everything has relaxed under what is imposed at each time
};

/// The word for it in scenes and results: quasi_static, inertial, static.
[[nodiscard]] std::string_view word_of(FormulationKind kind);

/// By which equations a network moves, and which network.
struct Formulation {
  FormulationKind kind = FormulationKind::quasi_static;
  double damping_ratio = 0.1;     ///< inertial: of the lowest mode, 0 to 10
  double density_kg_m3 = 1060.0;  ///< inertial: of the spheres, > 0
  bool mass_spring = false;       ///< the mass-spring model on the same spheres, not the tissue
  SpringRule springs = SpringRule::like_the_bonds;
  double tolerance = 1e-6;  ///< QuasiStaticOptions, InertialOptions

  [[nodiscard]] bool inertial() const { return kind == FormulationKind::inertial; }
};

/// What is kept of a run besides positions.
struct Outputs {
  std::vector<double> times_s;  ///< rising
  bool force = true;
  bool bond_force = true;
  bool remembered = false;
};

/// A tissue and what is done to it.
struct ExperimentScene {
  Tissue tissue;
  Probe probe;
  Protocol protocol;
  Formulation formulation;
  Outputs outputs;
  std::string text;  ///< of the scene, for the record
};

/// How far the organ reaches behind the probe, along its direction, m; infinite where the probe
/// pulls away from the outermost sphere.
[[nodiscard]] double tissue_behind_m(const Organ& organ, const Probe& probe);

/// Reads all blocks of a scene (docs/simulate.md). Without a block `protocol` there is nothing to
/// do, which is an error.
/// @param where for messages, usually the file
/// @param folder that a mesh path is relative to
/// Throws Error(bad_input) with the key, also for a network that does not stand.
[[nodiscard]] ExperimentScene parse_experiment(const Json& scene, std::string_view where,
                                               const std::filesystem::path& folder);

/// The same from a file, whose bytes become the record's text.
[[nodiscard]] ExperimentScene read_experiment(const std::filesystem::path& scene);

}  // namespace tpm
