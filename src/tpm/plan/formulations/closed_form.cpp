// The paper's element: its closed form, and its differential equation under CVODES.
#include <algorithm>

#include "tpm/law/element/closed_form.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/organ/steps/cvodes_element.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

/// The element knows the motion of one sphere along its normal.
void require_along_normal(const ExperimentScene& scene) {
  const Organ& organ = scene.tissue.network.organ;
  const Probe& probe = scene.probe();
  const auto contact = static_cast<Eigen::Index>(probe.sphere);
  if (probe.direction.isApprox(-organ.normal.col(contact))) return;
  throw bad_input(scene.formulation.where, "the star is not pushed along its normal",
                  "a contact without a direction of its own");
}

/// The element stands for the star of four spheres.
template <class ElementModel>
class ElementFormulation final : public Formulation, public ModelMaker, public SceneRunner {
 public:
  explicit ElementFormulation(Entry entry) : Formulation(std::move(entry)) {}

  [[nodiscard]] std::unique_ptr<Model> model(const ModelOptions& options) const override {
    return std::make_unique<ElementModel>(options);
  }

  [[nodiscard]] Trajectory run(const ExperimentScene& scene, const RunNetwork& network,
                               const std::vector<double>& times_s, bool with_field) const override {
    require_along_normal(scene);
    ModelOptions options;
    options.relative_tolerance = std::min(options.relative_tolerance, scene.formulation.tolerance);
    Trajectory answer;
    answer.response =
        ElementModel(options)
            .respond(scene.protocol, times_s,
                     element_constants(scene.tissue.element("the closed form")), Want::values)
            .value;
    answer.steps = static_cast<double>(times_s.size());
    if (!with_field) return answer;
    const bool by_depth = scene.by_depth();
    const Probe& probe = scene.probe();
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      Eigen::Matrix3Xd moved = Eigen::Matrix3Xd::Zero(3, network.network.organ.position.cols());
      const double depth_m = by_depth ? value_at(scene.protocol, times_s[i])
                                      : answer.response[static_cast<Eigen::Index>(i)];
      moved.col(static_cast<Eigen::Index>(probe.sphere)) = depth_m * probe.direction;
      answer.displacement.push_back(std::move(moved));
    }
    return answer;
  }
};

constexpr Capabilities kOfElement{
    .depth = true, .load = true, .jumps = true, .field = true, .derivatives = true};

}  // namespace

Formulations closed_form_formulations() {
  static const ElementFormulation<ClosedForm> exact(
      {"closed_form",
       "the paper's element in closed form, exact for histories linear between "
       "corners and for a constant load",
       kOfElement, 10});
  static const ElementFormulation<CvodesElement> integrated(
      {"cvodes", "the paper's element, its differential equation integrated by CVODES", kOfElement,
       20});
  static const std::vector<const Formulation*> all{&exact, &integrated};
  return all;
}

}  // namespace tpm::plan
