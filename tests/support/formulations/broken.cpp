// A formulation that does not keep its word: the suite has to find it.
#include "tpm/organ/run/scene_runner.hpp"

namespace tpm {
using namespace organ;
namespace {

/// Says that it answers the star as its closed form does. It forgets the tension, pulls at rest,
/// answers otherwise each second time, and gives energy away.
class BrokenFormulation final : public Formulation, public SceneRunner {
 public:
  using Formulation::Formulation;
  [[nodiscard]] Trajectory run(const ExperimentScene& scene, const RunNetwork& /*network*/,
                               const std::vector<double>& times_s,
                               bool /*with_field*/) const override {
    constexpr double kAtRest_N = 1e-3, kGain_N_s_per_m = 5.0;
    const BondElement p = scene.tissue.element("broken");
    const double stiffness = p.instantaneous_Pa() * p.modulus_to_stiffness_m() + (odd_ ? 1.0 : 0.0);
    odd_ = !odd_;
    Trajectory answer;
    answer.response.resize(static_cast<Eigen::Index>(times_s.size()));
    double before_m = 0.0, before_s = -1.0;
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const double depth_m = value_at(scene.protocol, times_s[i]);
      const double speed = (depth_m - before_m) / (times_s[i] - before_s);
      answer.response[static_cast<Eigen::Index>(i)] =
          stiffness * depth_m - kGain_N_s_per_m * speed + kAtRest_N;
      before_m = depth_m;
      before_s = times_s[i];
    }
    return answer;
  }

 private:
  mutable bool odd_ = false;
};

}  // namespace

Formulations broken_formulations() {
  static const BrokenFormulation broken(
      {"broken", "keeps nothing of what it says", {.depth = true, .jumps = true}});
  static const std::vector<const Formulation*> all{&broken};
  return all;
}

}  // namespace tpm
