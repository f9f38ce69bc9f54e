#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "tpmkit/operation_count.hpp"

namespace tpm {

struct ExperimentScene;  // a scene as it was read; Scene (tpmkit/scene.hpp) shows what is in it
struct RunNetwork;       // the network that it is run on

/// Limits of the model that a run can pass.
enum class ValidityLimit : std::size_t {
  indentation,  ///< beyond 10 mm: the paper vouches for no more
  damage,       ///< beyond 12 mm: liver is damaged
  turning,      ///< a lateral bond has turned by more than 30 degrees from rest
};
inline constexpr std::size_t kValidityLimits = 3;

[[nodiscard]] std::string_view key_of(ValidityLimit limit);
[[nodiscard]] std::string_view words_of(ValidityLimit limit);

/// What a run has passed of one limit.
struct ValidityBreach {
  std::optional<double> first_time_s;  ///< none: never
  std::vector<std::size_t> spheres;    ///< that were ever beyond it, rising, from 0
};

/// What a run has passed so far.
struct Validity {
  std::array<ValidityBreach, kValidityLimits> breach;
  double deepest_m = 0.0;        ///< largest indentation of any sphere
  double most_turned_rad = 0.0;  ///< largest turn of any lateral bond

  [[nodiscard]] const ValidityBreach& of(ValidityLimit limit) const {
    return breach[static_cast<std::size_t>(limit)];
  }
  [[nodiscard]] bool whole() const;
};

/// How a scene answers over its protocol.
struct Trajectory {
  Eigen::VectorXd response;                    ///< N or m, at each time
  std::vector<Eigen::Matrix3Xd> displacement;  ///< of all spheres, m, at each time; if asked for
  Validity validity;  ///< of networks without masses: limits passed at the times asked for
  OperationCount work;
  double steps = 0.0;
  double error_estimate = 0.0;  ///< the formulation's own, N or m; 0 where it has none
};

/// Answers scenes at given times: the role of a formulation that runs scenes and sweeps
/// (tpmkit/formulation.hpp). Scene(scene, network) shows what it is asked.
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
  /// Throws Error(numerical) where the formulation fails, Error(bad_input) for what its
  /// capabilities do not say.
  [[nodiscard]] virtual Trajectory run(const ExperimentScene& scene, const RunNetwork& network,
                                       const std::vector<double>& times_s,
                                       bool with_field) const = 0;
};

}  // namespace tpm
