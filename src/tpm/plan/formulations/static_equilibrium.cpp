// Everything has relaxed under what is imposed at each time.
#include <algorithm>
#include <optional>

#include "tpm/organ/run/recorder.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/organ/run/static_path.hpp"

namespace tpm::plan {
namespace {

// A static run takes some factorisations at each stride: it iterates earlier than a quasi-static
// one, which shares a factorisation between many solutions.
constexpr double kStaticOperations = 2e11;

/// The value before a jump at a time; none if nothing jumps there.
std::optional<double> value_before_jump(const Protocol& protocol, double time_s) {
  const auto knots = protocol.knots();
  const auto at = std::ranges::lower_bound(knots, time_s, {}, &Knot::time_s);
  if (knots.end() - at < 2 || at->time_s != time_s || std::next(at)->time_s != time_s) {
    return std::nullopt;
  }
  return at->value;
}

class StaticFormulation final : public Formulation, public SceneRunner, public StateRunner {
 public:
  using Formulation::Formulation;

  [[nodiscard]] Trajectory run(const ExperimentScene& scene, const RunNetwork& network,
                               const std::vector<double>& times_s, bool with_field) const override {
    StaticPath path = path_of(scene, network);
    Trajectory answer;
    answer.response.resize(std::ssize(times_s));
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const QuasiStaticState state = path.move_to(value_at(scene.protocol, times_s[i]), times_s[i]);
      answer.response[static_cast<Eigen::Index>(i)] = state.response;
      if (with_field) {
        answer.displacement.emplace_back(network.spheres(state.position) -
                                         network.network.organ.position);
      }
    }
    answer.steps = static_cast<double>(times_s.size());
    return answer;
  }

  [[nodiscard]] SimulationRun simulate(const ExperimentScene& scene, const RunNetwork& network,
                                       const SimulationControls& controls) const override {
    StaticPath path = path_of(scene, network);
    const auto run_part = [&](Recorder& recorder, std::span<const double> times) {
      if (recorder.latest()) path.start_from(*recorder.latest());
      for (const double time : times) {
        if (const auto before = value_before_jump(scene.protocol, time)) {
          QuasiStaticState state = path.move_to(*before, time);
          state.between = true;
          recorder.see(state);
        }
        recorder.see(path.move_to(value_at(scene.protocol, time), time));
      }
      recorder.close_part(0.0);
    };
    SimulationRun result = run_in_parts(scene, network, controls, run_part);
    result.solver = path.solver();
    return result;
  }

 private:
  [[nodiscard]] static StaticPath path_of(const ExperimentScene& scene, const RunNetwork& network) {
    const DrivenNetwork& driven = network.driven;
    return {driven.bonds,
            driven.rest,
            network.network.organ.spacing,
            driven.constraints,
            driven.probes,
            scene.protocol.drive(),
            scene.protocol.peak(),
            scene.formulation.tolerance,
            {.solver = scene.formulation.solver, .most_operations = kStaticOperations}};
  }
};

}  // namespace

Formulations static_equilibrium_formulations() {
  static const StaticFormulation equilibrium({"static",
                                              "the equilibrium under what is imposed at each time",
                                              with_any_material({.network = true,
                                                                 .depth = true,
                                                                 .load = true,
                                                                 .jumps = true,
                                                                 .field = true,
                                                                 .several_contacts = true,
                                                                 .tools = true,
                                                                 .course = false}),
                                              150,
                                              {"solver"}});
  static const std::vector<const Formulation*> all{&equilibrium};
  return all;
}

}  // namespace tpm::plan
