#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "tpmkit/operation_count.hpp"

namespace tpm::organ {

struct ExperimentScene;  // the content of a scene file; Scene (tpmkit/scene.hpp) has accessors
struct RunNetwork;       // the network of the scene

/// Limits of the model that a run can pass.
enum class ValidityLimit : std::size_t {
  indentation,  ///< beyond 10 mm, the range of the paper
  damage,       ///< beyond 12 mm: liver is damaged
  turning,      ///< a lateral bond has turned by more than 30 degrees from rest
};
inline constexpr std::size_t kValidityLimits = 3;

[[nodiscard]] std::string_view key_of(ValidityLimit limit);
[[nodiscard]] std::string_view words_of(ValidityLimit limit);

/// When and where a run passed one limit.
struct ValidityBreach {
  std::optional<double> first_time_s;  ///< none: never
  std::vector<std::size_t> spheres;    ///< indices from 0 of the spheres that passed it, rising
};

/// Limits that a run has passed so far.
struct Validity {
  std::array<ValidityBreach, kValidityLimits> breach;
  double deepest_m = 0.0;        ///< largest indentation of any sphere
  double most_turned_rad = 0.0;  ///< largest turn of any lateral bond

  [[nodiscard]] const ValidityBreach& of(ValidityLimit limit) const {
    return breach[static_cast<std::size_t>(limit)];
  }
  [[nodiscard]] bool whole() const;
};

/// Response of a scene over its protocol.
struct Trajectory {
  Eigen::VectorXd response;                    ///< N or m, at each time
  std::vector<Eigen::Matrix3Xd> displacement;  ///< of all spheres, m, at each time; if asked for
  Validity validity;  ///< for networks without masses: limits passed at the requested times
  OperationCount work;
  double steps = 0.0;
  double error_estimate = 0.0;  ///< the formulation's own, N or m; 0 where it has none
};

/// Role of a formulation that runs scenes and sweeps (tpmkit/formulation.hpp). Scene(scene,
/// network) gives access to its arguments.
class SceneRunner {
 public:
  SceneRunner() = default;
  SceneRunner(const SceneRunner&) = delete;
  SceneRunner& operator=(const SceneRunner&) = delete;
  virtual ~SceneRunner() = default;

  /// @param scene one that the formulation can run (require_runnable)
  /// @param network network_to_run(scene)
  /// @param times_s rising, within the protocol
  /// @param with_field fill Trajectory::displacement; only of formulations with that capability
  /// Throws Error(numerical) if the formulation fails, Error(bad_input) for a request beyond its
  /// capabilities.
  [[nodiscard]] virtual Trajectory run(const ExperimentScene& scene, const RunNetwork& network,
                                       const std::vector<double>& times_s,
                                       bool with_field) const = 0;
};

}  // namespace tpm::organ
