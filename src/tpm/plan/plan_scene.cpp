#include "tpm/plan/plan_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tpm/plan/rest_answers.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

ExperimentScene plannable(ExperimentScene scene) {
  if (!scene.formulation.entry().can().course) {
    throw bad_input("scene",
                    fmt::format("the formulation '{}' has no course in time to plan for",
                                scene.formulation.kind),
                    "quasi_static or inertial");
  }
  if (scene.formulation.mass_spring) {
    throw bad_input("scene", "runs the mass-spring model", "the tissue: without a comparison");
  }
  return scene;
}

}  // namespace

double trajectory_error(const Trajectory& model, const Trajectory& reference,
                        const PlanMeasure& measure) {
  constexpr double kPerceived = 0.1;  // of the peak: below, no stiffness is perceived
  if (measure.output == PlanOutput::force) {
    const double peak = reference.response.cwiseAbs().maxCoeff();
    const Eigen::VectorXd difference = (model.response - reference.response).cwiseAbs();
    double error = difference.maxCoeff() / peak;
    for (Eigen::Index i = 0; i < difference.size() && measure.relative_weight > 0.0; ++i) {
      const double size = std::abs(reference.response[i]);
      if (size > kPerceived * peak)
        error = std::max(error, measure.relative_weight * difference[i] / size);
    }
    return error;
  }
  double peak = 0.0, worst = 0.0;
  for (std::size_t i = 0; i < reference.displacement.size(); ++i) {
    peak = std::max(peak, reference.displacement[i].colwise().norm().maxCoeff());
    const Eigen::Matrix3Xd difference = model.displacement.at(i) - reference.displacement[i];
    worst = std::max(worst, difference.colwise().norm().maxCoeff());
  }
  return worst / peak;
}

std::vector<double> sampled_times(const Protocol& protocol, int per_piece, int most) {
  const auto knots = protocol.knots();
  const int pieces = std::max(1, static_cast<int>(knots.size()) - 1);
  const int parts = std::clamp(most / pieces, 1, per_piece);
  std::vector<double> times{knots.front().time_s};
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    const double length = knots[k + 1].time_s - knots[k].time_s;
    if (!(length > 0.0)) continue;
    for (int i = 1; i < parts; ++i) {
      const double place = 0.5 * (1.0 - std::cos(std::numbers::pi * i / parts));
      times.push_back(knots[k].time_s + length * place);
    }
    times.push_back(knots[k + 1].time_s);
  }
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

std::vector<double> sampled_times(const Protocol& protocol, int per_piece, int most, double tau_s) {
  constexpr double kFirst = 0.1;   // in relaxation times
  constexpr double kRatio = 1.35;  // of one time to the one before
  std::vector<double> times = sampled_times(protocol, per_piece, most);
  if (!(tau_s > 0.0) || !std::isfinite(tau_s)) return times;
  const auto knots = protocol.knots();
  const int pieces = std::max(1, static_cast<int>(knots.size()) - 1);
  const int parts = std::max(most / pieces, 1);
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    const double length = knots[k + 1].time_s - knots[k].time_s;
    const double span = std::log(length / (kFirst * tau_s));
    if (!(span > 0.0)) continue;
    const double wanted = std::ceil(span / std::log(kRatio));
    const int count = wanted < parts ? static_cast<int>(wanted) : parts;
    for (int i = 0; i < count; ++i) {
      times.push_back(knots[k].time_s + kFirst * tau_s * std::exp(span * i / count));
    }
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

void WorkSpent::add(const OperationCount& work) {
  const std::scoped_lock lock(mutex_);
  work_ += work;
}

OperationCount WorkSpent::all() const {
  const std::scoped_lock lock(mutex_);
  return work_;
}

PlanScene::PlanScene(ExperimentScene scene)
    : PlanScene(std::move(scene), std::make_shared<WorkSpent>()) {}

PlanScene::PlanScene(ExperimentScene scene, std::shared_ptr<WorkSpent> spent)
    : scene_(plannable(std::move(scene))),
      network_(std::make_shared<const RunNetwork>(network_to_run(scene_))),
      at_rest_(std::make_shared<RestAnswers>()),
      spent_(std::move(spent)) {}

PlanScene::PlanScene(ExperimentScene scene, const PlanScene& same_network)
    : scene_(std::move(scene)),
      network_(same_network.network_),
      at_rest_(scene_.protocol.drive() == same_network.protocol().drive()
                   ? same_network.at_rest_
                   : std::make_shared<RestAnswers>()),
      spent_(same_network.spent_) {}

double PlanScene::duration_s() const {
  return protocol().knots().back().time_s - protocol().start_s();
}

bool PlanScene::single_sphere() const {
  return scene_.contacts.size() == 1 && scene_.contacts.front().kind == ContactKind::sphere;
}

Protocol PlanScene::corners() const {
  const std::vector<DriveGroup>& beside = driven().probes.loading().beside;
  if (beside.empty()) return protocol();
  const ImposedPath path(protocol(), beside);
  return {Drive::displacement, {path.knots().begin(), path.knots().end()}, protocol().name()};
}

bool PlanScene::jumps() const {
  const auto knots = protocol().knots();
  bool jumps = knots.front().value != 0.0 && !protocol().equilibrium_at_start();
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    jumps =
        jumps || (knots[k].time_s == knots[k + 1].time_s && knots[k].value != knots[k + 1].value);
  }
  return jumps;
}

int PlanScene::moving_layers() const {
  const Constraints constraints = scene_.tissue.constraints();
  const std::vector<int>& layer = network().organ.layer;
  int moving = 0;
  for (std::size_t i = 0; i < layer.size(); ++i) {
    if (!constraints.projector(i).isZero(0.0)) moving = std::max(moving, layer[i] + 1);
  }
  return moving;
}

Trajectory PlanScene::quasi_static(const QuasiStaticOptions& options,
                                   const std::vector<double>& times_s, bool with_field,
                                   double most_s) const {
  QuasiStaticOptions counting = options;
  counting.on_failure = [&](const QuasiStaticWork& work) {
    spent_->add(counted_work(driven(), work));
  };
  if (std::isfinite(most_s)) {
    const OperationCosts costs = nominal_costs();
    const double iteration_s = costs.seconds_of(counted_work(driven(), {.iterations = 1}));
    const double factorisation_s = costs.seconds_of(counted_work(driven(), {.factorisations = 1}));
    counting.may_go_on = [=](const QuasiStaticWork& work) {
      return work.iterations * iteration_s + work.factorisations * factorisation_s <= most_s;
    };
  }
  Trajectory run = run_quasi_static(scene_, *network_, counting, times_s, with_field);
  spent_->add(run.work);
  return run;
}

Trajectory PlanScene::inertial(const InertialOptions& options, const std::vector<double>& times_s,
                               bool with_field) const {
  std::function<void(double)> reached;
  if (spent_->run_reached) {
    reached = [&](double time_s) {
      spent_->run_reached((time_s - protocol().start_s()) / duration_s());
    };
  }
  Trajectory run = run_inertial(scene_, *network_, options, times_s, with_field, reached);
  spent_->add(run.work);
  return run;
}

PlanScene PlanScene::with_protocol(Protocol protocol) const {
  ExperimentScene scene = scene_;
  scene.protocol = std::move(protocol);
  return {std::move(scene), *this};
}

PlanScene PlanScene::with_all_protocols(
    const std::function<Protocol(const Protocol&)>& change) const {
  if (!has_own_protocols()) return with_protocol(change(protocol()));
  ExperimentScene scene = scene_;
  scene.protocol = change(scene.protocol);
  for (SceneContact& contact : scene.contacts) {
    if (contact.protocol) contact.protocol = change(*contact.protocol);
  }
  return {std::move(scene), spent_};  // those of contacts are part of the network that is driven
}

PlanScene PlanScene::deeper(double factor) const {
  return with_all_protocols([factor](const Protocol& one) { return one.scaled(factor); });
}

PlanScene PlanScene::faster(double factor) const {
  return with_all_protocols([factor](const Protocol& one) {
    std::vector<Knot> knots(one.knots().begin(), one.knots().end());
    const double begin = knots.front().time_s;
    for (Knot& knot : knots) knot.time_s = begin + (knot.time_s - begin) / factor;
    Protocol quick(one.drive(), std::move(knots), one.name());
    quick.set_equilibrium_at_start(one.equilibrium_at_start());
    return quick;
  });
}

PlanScene PlanScene::stiffer(double factor) const {
  return with_materials([factor](BondMaterial& material) {
    material.equilibrium_Pa *= factor;
    material.lateral_Pa *= factor;
    for (BondMaterial::Branch& branch : material.branches) branch.modulus_Pa *= factor;
  });
}

PlanScene PlanScene::nothing_relaxing() const {
  constexpr double kNever = 1e9;  // durations
  const double lasts_s = duration_s() > 0.0 ? duration_s() : 1.0;
  double shortest_s = std::numeric_limits<double>::infinity();
  for (const BondMaterial& material : scene_.tissue.materials.materials) {
    for (const BondMaterial::Branch& branch : material.branches) {
      shortest_s = std::min(shortest_s, branch.relaxation_time_s);
    }
  }
  const double longer = kNever * lasts_s / shortest_s;
  return with_materials([longer](BondMaterial& material) {
    for (BondMaterial::Branch& branch : material.branches) branch.relaxation_time_s *= longer;
  });
}

PlanScene PlanScene::all_relaxed() const {
  // A branch that never relaxes bears half of it: formulations want something that could relax.
  // Under loads next to nothing, since tissue sags as far as what is left of the equilibrium lets
  // it.
  const double share = scene_.dead_load_N.size() > 0 ? 1e-6 : 0.5;
  const auto at_equilibrium = [share](BondMaterial& material) {
    if (material.lateral == LateralBond::relaxing) {
      material.lateral_Pa *= material.equilibrium_Pa / material.instantaneous_Pa();
    }
    material.branches = {{share * material.equilibrium_Pa, 1.0}};
    material.equilibrium_Pa *= 1.0 - share;
    material.kernel = material.potential;
  };
  return with_materials(at_equilibrium).nothing_relaxing();
}

PlanScene PlanScene::with_materials(const std::function<void(BondMaterial&)>& change) const {
  ExperimentScene scene = scene_;
  for (BondMaterial& material : scene.tissue.materials.materials) change(material);
  return {std::move(scene), spent_};
}

PlanScene PlanScene::with_layers(int layers) const {
  ExperimentScene scene = scene_;
  const std::vector<int>& layer = network().organ.layer;
  std::vector<std::size_t>& anchors = scene.tissue.anchors;
  for (std::size_t i = 0; i < layer.size(); ++i) {
    if (layer[i] >= layers) anchors.push_back(i);
  }
  std::sort(anchors.begin(), anchors.end());
  anchors.erase(std::unique(anchors.begin(), anchors.end()), anchors.end());
  std::erase_if(scene.tissue.sliders, [&](const Slider& g) { return layer[g.sphere] >= layers; });
  return {std::move(scene), spent_};
}

}  // namespace tpm::plan
