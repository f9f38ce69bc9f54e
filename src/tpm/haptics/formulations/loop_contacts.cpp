// What only sessions step: a network beside the loop, a ball on a surface, a law.
#include <fmt/format.h>

#include "tpm/base/text.hpp"
#include "tpm/contact/law_contact.hpp"
#include "tpm/haptics/session/loop_maker.hpp"
#include "tpm/haptics/session/network_beside.hpp"
#include "tpm/haptics/session/pushed_scene.hpp"
#include "tpm/haptics/session/surface_scene.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
using namespace haptics;
namespace {

class LoopContact final : public Formulation, public LoopMaker {
 public:
  LoopContact(Entry entry, LoopModel (*made)(const HilSession&, bool))
      : Formulation(std::move(entry)), made_(made) {}
  [[nodiscard]] LoopModel loop(const HilSession& session, bool threads) const override {
    return made_(session, threads);
  }

 private:
  LoopModel (*made_)(const HilSession&, bool);
};

LoopModel network_beside_model(const HilSession& session, bool threads) {
  constexpr double kShortest_s = 0.1;
  const PushedScene scene(session);
  const double tau_s = scene.tissue.bonds().shortest_relaxation_time_s();
  if (tau_s < kShortest_s) {
    throw bad_input(session.scene_place,
                    fmt::format("has a relaxation time of {} s, too short for the model "
                                "'network_beside'",
                                significant(tau_s, 4)),
                    "0.1 s or more, or the model 'network'");
  }
  const int every = NetworkBeside::periods_between(session.servo.period_s);
  const BondSystem bonds = scene.tissue.bonds();
  LoopModel loop = scene.begun("network_beside", "stepped beside the loop, pushed at");
  loop.model = std::make_unique<NetworkBeside>(
      scene.network(every * session.servo.period_s),
      StiffnessByDepth(bonds, scene.rest(), scene.tissue.constraints(), scene.only_sphere(),
                       scene.probe().direction, scene.deepest_m),
      session.servo.period_s, threads);
  loop.shape.field = scene.network(kDrawnEvery_s);
  loop.error_bound = "its own estimate, row by row; what tpm hil verify measures";
  return loop;
}

/// A contact by itself: there is no organ to draw but the place that is pushed.
LoopModel law_model(const HilSession& session, bool /*threads*/) {
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

constexpr Capabilities kOfServoNetwork{.network = true,
                                       .depth = true,
                                       .field = true,
                                       .servo = true,
                                       .branches = true,
                                       .stiffening = true,
                                       .regions = true};

Capabilities with_tools(Capabilities can) {
  can.tools = true;
  return can;
}

LoopModel ball_model(const HilSession& session, bool /*threads*/) {
  return surface_model(session);
}

}  // namespace

Formulations loop_contacts_formulations() {
  static const LoopContact beside(
      {"network_beside",
       "the whole network at 200 Hz beside the loop, which uses its last force "
       "and stiffness",
       kOfServoNetwork, 300},
      network_beside_model);
  static const LoopContact surface(
      {"surface", "the whole network in every period under a ball that moves in space",
       with_tools(kOfServoNetwork), 310},
      ball_model);
  static const LoopContact law({"law",
                                "one contact that answers by a law of the family, without an organ",
                                {.depth = true, .servo = true},
                                320},
                               law_model);
  static const std::vector<const Formulation*> all{&beside, &surface, &law};
  return all;
}

}  // namespace tpm::haptics
