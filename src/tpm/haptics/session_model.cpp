#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/haptics/element_contact.hpp"
#include "tpm/haptics/session.hpp"
#include "tpm/scene/scene.hpp"

namespace tpm {
namespace {

constexpr const char* kScenePlace = "model: scene";

LoopModel element_model(const HilSession& session) {
  const Tissue tissue = parse_tissue(session.scene, kScenePlace, session.folder);
  if (session.scene.at("organ").value("kind", "") != "star") {
    throw bad_input(kScenePlace, "is no star", "an organ of the kind star for the model 'element'");
  }
  LoopModel loop;
  loop.model = std::make_unique<ElementContact>(tissue.material, session.servo.period_s);
  loop.name = "element: the paper's star, exact exponential update";
  loop.error_bound = "exact for linear motion within a period, to rounding";
  return loop;
}

}  // namespace

LoopModel make_loop_model(const HilSession& session) {
  switch (session.model) {
    case LoopModelKind::element:
      return element_model(session);
  }
  throw bad_input("model", "has no known kind");
}

}  // namespace tpm
