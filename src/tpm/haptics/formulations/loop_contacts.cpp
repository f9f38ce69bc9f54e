// Models that only sessions step: a ball on a surface, a law.
#include <fmt/format.h>

#include "tpm/base/text.hpp"
#include "tpm/contact/law_contact.hpp"
#include "tpm/haptics/session/loop_maker.hpp"
#include "tpm/haptics/session/pushed_scene.hpp"
#include "tpm/haptics/session/surface_scene.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
using namespace haptics;
namespace {

class LoopContact final : public Formulation, public LoopMaker {
 public:
  LoopContact(Entry entry, LoopModel (*made)(const HilSession&))
      : Formulation(std::move(entry)), made_(made) {}
  [[nodiscard]] LoopModel loop(const HilSession& session) const override { return made_(session); }

 private:
  LoopModel (*made_)(const HilSession&);
};

/// A contact by itself: there is no organ to draw but the place that is pushed.
LoopModel law_model(const HilSession& session) {
  constexpr double kDrawnRadius_m = 5e-3;
  const LawFile& law = session.law.value();
  const double valid_m = valid_depth_m(law, deepest_asked_m(session, law.spec.reference));
  const double deepest = deepest_asked_m(session, valid_m);
  if (deepest > valid_m) {
    throw bad_input("session",
                    fmt::format("goes to a depth of {} mm, the law was fitted to {} mm",
                                significant(1e3 * deepest, 4),
                                significant(1e3 * law.fitted_to.value_or(0.0), 4)),
                    fmt::format("{} mm at most", significant(1e3 * valid_m, 4)));
  }
  auto contact =
      std::make_unique<LawContact>(law, LawContactSettings{.period_s = session.servo.period_s,
                                                           .longest_s = session.duration_s(),
                                                           .deepest_m = deepest,
                                                           .deepest_valid_m = valid_m});
  LoopModel loop;
  loop.name = fmt::format("law {}: {}", law_name(law.spec), law_words(law.spec));
  loop.error_bound = "each branch exact for a kernel that is linear within a period";
  loop.relaxation_times_s = contact->relaxation_times_s();
  loop.model = std::move(contact);
  loop.shape.rest_m = Eigen::Matrix3Xd::Zero(3, 1);
  loop.shape.radius_m = kDrawnRadius_m;
  return loop;
}

constexpr Capabilities kOfSurface{.network = true,
                                  .depth = true,
                                  .field = true,
                                  .tools = true,
                                  .servo = true,
                                  .branches = true,
                                  .stiffening = true,
                                  .regions = true};

}  // namespace

Formulations loop_contacts_formulations() {
  static const LoopContact surface(
      {"surface", "the whole network in every period under a ball that moves in space", kOfSurface,
       310},
      surface_model);
  static const LoopContact law({"law",
                                "one contact that answers by a law of the family, without an organ",
                                {.depth = true, .servo = true},
                                320},
                               law_model);
  static const std::vector<const Formulation*> all{&surface, &law};
  return all;
}

}  // namespace tpm::haptics
