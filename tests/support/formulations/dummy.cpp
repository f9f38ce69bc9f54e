// The worked example of docs/adding.md, "A formulation": one file, and nothing else.
#include "tpm/organ/balance/mass_spring.hpp"
#include "tpm/organ/run/scene_runner.hpp"

namespace tpm {
using namespace organ;
namespace {

/// The contact as an elastic spring with the network's equilibrium stiffness at rest:
///
///     F = K D,   K of contact_stiffness_N_per_m() with everything relaxed.
class DummyFormulation final : public Formulation, public SceneRunner {
 public:
  using Formulation::Formulation;

  [[nodiscard]] Trajectory run(const ExperimentScene& scene, const RunNetwork& network,
                               const std::vector<double>& times_s,
                               bool /*with_field*/) const override {
    const double stiffness =
        contact_stiffness_N_per_m(network.driven.bonds, network.network.organ.position,
                                  scene.tissue.constraints(), scene.probe(), 1.0);
    const bool by_depth = scene.protocol.drive() == Drive::displacement;
    Trajectory answer;
    answer.response.resize(static_cast<Eigen::Index>(times_s.size()));
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const double imposed = value_at(scene.protocol, times_s[i]);
      answer.response[static_cast<Eigen::Index>(i)] =
          by_depth ? stiffness * imposed : imposed / stiffness;
    }
    answer.steps = static_cast<double>(times_s.size());
    answer.work.add(Operation::scalar_step, answer.steps);
    return answer;
  }
};

}  // namespace

Formulations dummy_formulations() {
  static const DummyFormulation spring(
      {"dummy",
       "the contact as an elastic spring with the network's equilibrium stiffness",
       {.network = true, .depth = true, .load = true, .jumps = true, .planned = true}});
  static const std::vector<const Formulation*> all{&spring};
  return all;
}

}  // namespace tpm
