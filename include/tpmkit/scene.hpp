#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/bond_element.hpp"
#include "tpmkit/organ.hpp"
#include "tpmkit/protocol.hpp"
#include "tpmkit/simulation.hpp"

namespace tpm::organ {

/// A tissue, its contacts and loads, and its network, from a scene file (docs/data_formats.md).
/// Copies share one immutable scene; several threads may use it.
///
///     const Scene scene("liver_fig3.json");
///     const Trajectory answer = scene.run({0.0, 0.5, 1.0});   // forces in N
class Scene {
 public:
  /// Reads a file. Throws Error(bad_input) with the key.
  explicit Scene(const std::filesystem::path& file);
  /// The same from the text of a scene.
  /// @param folder that paths in the scene are relative to
  [[nodiscard]] static Scene parse(std::string_view json, const std::filesystem::path& folder = {});
  /// View of a scene for a SceneRunner. Both arguments must outlive this object and its copies.
  Scene(const ExperimentScene& scene, const RunNetwork& network);

  [[nodiscard]] const std::string& title() const;
  /// The spheres at rest, without tools.
  [[nodiscard]] const Organ& organ() const;
  [[nodiscard]] std::size_t bonds() const;
  /// Imposed depth or load over time.
  [[nodiscard]] const Protocol& protocol() const;
  /// Index, from 0, of the driven sphere or of the sphere that the tool meets first.
  [[nodiscard]] std::size_t contact() const;
  /// Direction of the push there, a unit vector into the tissue.
  [[nodiscard]] const Eigen::Vector3d& direction() const;
  /// Name of the formulation that runs it.
  [[nodiscard]] const std::string& formulation() const;
  /// The element of a tissue of one material with one linear branch. Throws Error(bad_input) for
  /// another tissue.
  [[nodiscard]] BondElement element() const;
  /// Instantaneous stiffness of the contact for small depths, N/m. Throws Error(bad_input) if the
  /// contact cannot move.
  [[nodiscard]] double instantaneous_stiffness_N_per_m() const;
  /// Equilibrium stiffness of the contact, N/m. Throws as above.
  [[nodiscard]] double equilibrium_stiffness_N_per_m() const;

  /// The response at given times: forces in N under an imposed depth, depths in m under a load.
  /// @param times_s rising, within the protocol
  /// @param with_field also the displacements of all spheres, where the formulation knows them
  /// Throws Error(bad_input) beyond the capabilities of the formulation, Error(numerical) if it
  /// fails.
  [[nodiscard]] Trajectory run(const std::vector<double>& times_s, bool with_field = false) const;
  /// Runs the scene and writes the result as HDF5, with a file beside it that ParaView opens.
  /// Throws as run() does, and Error(environment) where the file cannot be written.
  /// @return both files
  std::vector<std::filesystem::path> simulate(const std::filesystem::path& result) const;

 private:
  Scene(std::shared_ptr<const ExperimentScene> scene, std::shared_ptr<const RunNetwork> network);
  [[nodiscard]] double stiffness_N_per_m(double relaxation_factor) const;

  std::shared_ptr<const ExperimentScene> scene_;
  std::shared_ptr<const RunNetwork> network_;
};

}  // namespace tpm::organ
