#include <fmt/format.h>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/haptics/element_contact.hpp"
#include "tpm/haptics/law_contact.hpp"
#include "tpm/haptics/network_beside.hpp"
#include "tpm/haptics/planned_model.hpp"
#include "tpm/haptics/pushed_scene.hpp"
#include "tpm/haptics/session.hpp"
#include "tpm/haptics/surface_scene.hpp"
#include "tpm/reduce/condensed.hpp"

namespace tpm {
namespace {

LoopModel element_model(const HilSession& session) {
  const Tissue tissue = parse_tissue(session.scene, session.scene_place, {});
  if (session.scene.at("organ").value("kind", "") != "star") {
    throw bad_input(session.scene_place, "is no star",
                    "an organ of the kind star for the model 'element'");
  }
  LoopModel loop;
  loop.model =
      std::make_unique<ElementContact>(tissue.element("the element"), session.servo.period_s);
  loop.name = "element: the paper's star, exact exponential update";
  loop.error_bound = "exact for linear motion within a period, to rounding";
  const std::size_t contact = tissue.network.organ.contact.value();
  loop.shape = shape_of(tissue.network, contact,
                        -tissue.network.organ.normal.col(static_cast<Eigen::Index>(contact)));
  return loop;
}

LoopModel condensed_model(const HilSession& session) {
  const PushedScene scene(session);
  CondensedOptions options;
  options.depth_m = scene.deepest_m;
  options.period_s = session.servo.period_s;
  const CondensedContact condensed =
      build_condensed(scene.tissue.bonds(), scene.rest(), scene.tissue.freedom(),
                      scene.probe.sphere, scene.probe.direction, options);
  LoopModel loop = scene.begun("condensed", "seen from");
  loop.model = std::make_unique<CondensedContact>(condensed);
  loop.shape.field = std::make_shared<CondensedContact>(condensed.with_period(kDrawnEvery_s));
  loop.error_bound = fmt::format("fitted to {} mm of depth; what tpm hil verify measures",
                                 significant(1e3 * options.depth_m, 4));
  return loop;
}

LoopModel network_model(const HilSession& session) {
  const PushedScene scene(session);
  LoopModel loop = scene.begun("network", "stepped every period, pushed at");
  loop.model = scene.network(session.servo.period_s);
  loop.shape.field = scene.network(kDrawnEvery_s);
  loop.error_bound = "its own estimate, row by row; what tpm hil verify measures";
  return loop;
}

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
      StiffnessByDepth(bonds, scene.rest(), scene.tissue.freedom(), scene.probe.sphere,
                       scene.probe.direction, scene.deepest_m),
      session.servo.period_s, threads);
  loop.shape.field = scene.network(kDrawnEvery_s);
  loop.error_bound = "its own estimate, row by row; what tpm hil verify measures";
  return loop;
}

/// A contact by itself: there is no organ to draw but the place that is pushed.
LoopModel law_model(const HilSession& session) {
  constexpr double kDrawnRadius_m = 5e-3;
  const LawFile& law = session.law.value();
  const double trusted = trusted_depth_m(law, deepest_asked_m(session, law.spec.reference));
  const double deepest = deepest_asked_m(session, trusted);
  if (deepest > trusted) {
    throw bad_input("session",
                    fmt::format("goes to a depth of {} mm, the law was fitted to {} mm",
                                significant(1e3 * deepest, 4),
                                significant(1e3 * law.fitted_to.value_or(0.0), 4)),
                    fmt::format("{} mm at most", significant(1e3 * trusted, 4)));
  }
  auto contact =
      std::make_unique<LawContact>(law, LawContactSettings{.period_s = session.servo.period_s,
                                                           .longest_s = session.duration_s(),
                                                           .deepest_m = deepest,
                                                           .trusted_m = trusted});
  LoopModel loop;
  loop.name = fmt::format("law {}: {}", law_name(law.spec), law_words(law.spec));
  loop.error_bound = "each branch exact for a kernel that is linear within a period";
  loop.relaxation_times_s = contact->relaxation_times_s();
  loop.model = std::move(contact);
  loop.shape.rest_m = Eigen::Matrix3Xd::Zero(3, 1);
  loop.shape.radius_m = kDrawnRadius_m;
  return loop;
}

LoopModel model_of(const HilSession& session, bool threads, const PlanningTold& told) {
  switch (session.model) {
    case LoopModelKind::element:
      return element_model(session);
    case LoopModelKind::network:
      return network_model(session);
    case LoopModelKind::network_beside:
      return network_beside_model(session, threads);
    case LoopModelKind::surface:
      return surface_model(session);
    case LoopModelKind::planned:
      return planned_model(session, told);
    case LoopModelKind::law:
      return law_model(session);
    case LoopModelKind::condensed:
      break;
  }
  return condensed_model(session);
}

}  // namespace

LoopModel make_loop_model(const HilSession& session, bool threads, const PlanningTold& told) {
  LoopModel loop = model_of(session, threads, told);
  if (!session.law) {
    const BondSystem bonds = parse_tissue(session.scene, session.scene_place, {}).bonds();
    const std::span<const double> times_s = bonds.relaxation_times_s();
    loop.relaxation_times_s.assign(times_s.begin(), times_s.end());
  }
  loop.stiffness_N_per_m = loop.push.dot(loop.model->instantaneous_stiffness() * loop.push);
  return loop;
}

}  // namespace tpm
