#include "formulation_suite.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asking_materials.hpp"
#include "loaded_oscillator.hpp"
#include "tpm/base/enum_names.hpp"
#include "tpm/haptics/session/loop_maker.hpp"
#include "tpm/law/element/closed_form.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/organ/steps/method.hpp"
#include "tpm/plan/plan_model.hpp"
#include "tpmkit/error.hpp"

namespace tpm::test {
using namespace haptics;

namespace {

using Broken = std::vector<BrokenWord>;

const std::string kMaterial = R"("material": {"eta1": "16800 Pa s"}, )";  // relaxes in 0.7 s
const std::string kRamp = R"("protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s",
  "hold": "2 s"})";
const std::string kLoad = R"("protocol": {"kind": "knots", "knots": [{"time": "0 s", "load": "0 N"},
  {"time": "1 s", "load": "0.2 N"}, {"time": "3 s", "load": "0.2 N"}]})";
const std::string kCreep = R"("protocol": {"kind": "creep", "load": "0.2 N", "duration": "3 s"})";
const std::string kStep = R"("protocol": {"kind": "step_hold", "depth": "2 mm", "hold": "1 s"})";
const std::string kCycle = R"("protocol": {"kind": "knots", "knots": [
  {"time": "0 s", "depth": "0 mm"}, {"time": "1 s", "depth": "4 mm"}, {"time": "2 s", "depth": "0 mm"}]})";
const std::string kLate =
    R"("protocol": {"kind": "knots", "knots": [{"time": "0 s", "depth": "0 mm"},
  {"time": "1 s", "depth": "0 mm"}, {"time": "2 s", "depth": "1 mm"}]})";

ExperimentScene parsed(const std::string& organ, const std::string& blocks, const Formulation& f) {
  const std::string text = R"({"organ": )" + organ + ", " + kMaterial + blocks + "}";
  ExperimentScene scene = parse_experiment(parse_json(text, "scene"), "scene", {});
  scene.formulation.kind = f.name();
  scene.formulation.masses = f.can().masses && !f.takes("masses");
  scene.formulation.where = "scene: key /formulation";
  return scene;
}

ExperimentScene star(const std::string& blocks, const Formulation& f) {
  return parsed(R"({"kind": "star", "spacing": "30 mm"})", blocks, f);
}

/// A small liver, its contact guided along the push as a tool does it: else it goes so far aside
/// that reduced contacts are not valid.
ExperimentScene liver(const std::string& blocks, const Formulation& f) {
  ExperimentScene scene = parsed(R"({"kind": "liver", "count": 40})", blocks, f);
  scene.tissue.sliders.push_back({scene.probe().sphere, scene.probe().direction});
  return scene;
}

/// The simplest organ that it runs on and that all of its kind do: reduced contacts need spheres
/// that follow.
ExperimentScene usual(const std::string& blocks, const Formulation& f) {
  return f.can().network ? liver(blocks, f) : star(blocks, f);
}

/// A formulation that is driven by a depth has one, else a load.
const std::string& usual_push(const Formulation& f) {
  return f.can().depth ? kRamp : kLoad;
}

std::vector<double> even_times(const Protocol& protocol, int count) {
  std::vector<double> times;
  const double begin = protocol.start_s(), length = protocol.end_s() - begin;
  for (int i = 0; i <= count; ++i) times.push_back(begin + length * i / count);
  return times;
}

double apart(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

/// The nominal order of a step rule; 0 for all other formulations.
int order_of(const Formulation& f) {
  const StepRuleEntry* rule = find_entry(kStepRules, f.name());
  return rule == nullptr ? 0 : rule->order;
}

void check(Broken& broken, bool kept, const char* name, const std::string& found) {
  if (!kept) broken.push_back({name, found});
}

/// The closed form of the star, or with everything relaxed.
Eigen::VectorXd exact(const ExperimentScene& scene, const std::vector<double>& times) {
  const BondElement p = scene.tissue.element("the suite");
  if (scene.formulation.entry().can().course) {
    return ClosedForm{ModelOptions{}}
        .respond(scene.protocol, times, element_constants(p), Want::values)
        .value;
  }
  Eigen::VectorXd response(std::ssize(times));
  const TensionLaw tension = p.tension();
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double imposed = value_at(scene.protocol, times[i]);
    response[static_cast<Eigen::Index>(i)] =
        scene.protocol.drive() == Drive::displacement
            ? p.modulus_to_stiffness_m() * (p.equilibrium_Pa * imposed + tension.value(imposed))
            : equilibrium_depth_m(p, p.equilibrium_Pa, imposed);
  }
  return response;
}

/// Formulations without claims answer the star as its closed form does, to their tolerance or with
/// their order. Spheres with mass: against the oscillator, below.
void closed_forms(const Formulation& f, Broken& broken) {
  constexpr double kTimesTolerance = 30.0;  // errors gather over a run
  constexpr int kSweeps = 50;               // XPBD has its order once the bonds agree
  const bool follows_tolerance = f.as<StateRunner>() != nullptr && !f.can().masses;
  if (f.can().planned && !follows_tolerance) return;
  for (const std::string* push : {&kRamp, &kCreep}) {
    const bool by_depth = push == &kRamp;
    if (!(by_depth ? f.can().depth : f.can().load && f.can().jumps)) continue;
    ExperimentScene scene = star(*push, f);
    const std::vector<double> times = even_times(scene.protocol, 12);
    const Eigen::VectorXd expected = exact(scene, times);
    scene.formulation.sweeps = kSweeps;
    const auto error = [&](double step_s) {
      scene.formulation.step_s = step_s;
      return apart(run_scene(scene, times, false).response, expected);
    };
    if (order_of(f) == 0) {
      const double found = error(1e-3);
      check(broken, found <= kTimesTolerance * scene.formulation.tolerance, "closed form",
            fmt::format("{} of the peak from it at a tolerance of {}", found,
                        scene.formulation.tolerance));
      continue;
    }
    constexpr double kStep_s = 0.05, kRounding = 1e-12, kShort = 0.35;
    const double coarse = error(kStep_s), fine = error(0.5 * kStep_s);
    const double order = std::log2(coarse / fine);
    check(broken, fine <= kRounding || order >= order_of(f) - kShort, "order",
          fmt::format("{} where {} is stated ({} and {} of the peak)", order, order_of(f), coarse,
                      fine));
  }
}

/// A sphere with mass on the star, loaded at once, without tension: its closed form.
void oscillator(const Formulation& f, Broken& broken) {
  if (!f.can().masses || !f.can().load || !f.can().jumps) return;
  ExperimentScene scene =
      star(R"("protocol": {"kind": "creep", "load": "0.05 N", "duration": "0.1 s"})", f);
  set_value(scene.tissue.materials.materials.front(), "Eprime", 0.0, "the suite");
  const BondElement element = scene.tissue.element("the suite");
  scene.formulation.masses = true;
  scene.formulation.damping_ratio = 0.1;
  scene.formulation.tolerance = 1e-8;
  const RunNetwork network = network_to_run(scene);
  const Eigen::VectorXd mass = masses_kg(scene, network);
  const LowestMode lowest =
      lowest_mode(network.driven.bonds, network.driven.rest, network.driven.constraints, mass);
  const double drag = 2.0 * scene.formulation.damping_ratio * lowest.angular_frequency();
  const std::vector<double> times = even_times(scene.protocol, 10);
  const Eigen::VectorXd expected = tpm_test::loaded_oscillator(
      element, mass[static_cast<Eigen::Index>(scene.probe().sphere)], drag, 0.05, times);
  const auto error = [&](double step_s) {
    scene.formulation.step_s = step_s;
    return apart(run_scene(scene, times, false).response, expected);
  };
  if (order_of(f) == 0) {
    const double found = error(1e-3);
    check(broken, found <= 1e-4, "oscillator", fmt::format("{} of the peak from it", found));
    return;
  }
  constexpr double kStep_s = 2.5e-4, kShort = 0.35;
  const double coarse = error(kStep_s), fine = error(0.5 * kStep_s);
  check(broken, std::log2(coarse / fine) >= order_of(f) - kShort, "order with mass",
        fmt::format("{} where {} is stated", std::log2(coarse / fine), order_of(f)));
}

/// Before anything is imposed nothing answers.
void equality_at_rest(const Formulation& f, Broken& broken) {
  if (!f.can().depth) return;
  const ExperimentScene scene = usual(kLate, f);
  const double most = run_scene(scene, {0.0, 0.5, 0.99}, false).response.cwiseAbs().maxCoeff();
  check(broken, most <= 1e-12, "rest", fmt::format("{} N without a depth", most));
}

void determinism(const Formulation& f, Broken& broken) {
  const ExperimentScene scene = usual(usual_push(f), f);
  const std::vector<double> times = even_times(scene.protocol, 20);
  const Eigen::VectorXd first = run_scene(scene, times, false).response;
  check(broken, first == run_scene(scene, times, false).response, "determinism",
        "a second run answers other bits");
}

/// A closed cycle of depth takes no energy out of the tissue.
void passivity(const Formulation& f, Broken& broken) {
  if (!f.can().depth) return;
  const ExperimentScene scene = usual(kCycle, f);
  constexpr int kParts = 400;
  const std::vector<double> times = even_times(scene.protocol, kParts);
  const Eigen::VectorXd force = run_scene(scene, times, false).response;
  double work_J = 0.0, moved_J = 0.0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double way_m =
        value_at(scene.protocol, times[i]) - value_at(scene.protocol, times[i - 1]);
    const auto k = static_cast<Eigen::Index>(i);
    const double part_J = 0.5 * (force[k] + force[k - 1]) * way_m;
    work_J += part_J;
    moved_J += std::abs(part_J);
  }
  check(broken, work_J >= -1e-3 * moved_J, "energy",
        fmt::format("a cycle gives {} J of {} J that go in and out", -work_J, moved_J));
}

/// The account of whole states: work = stored + dissipated (+ kinetic).
void energy_account(const Formulation& f, Broken& broken) {
  const auto* states = f.as<StateRunner>();
  if (states == nullptr || !f.can().course) return;
  const ExperimentScene scene = liver(kRamp, f);
  const SimulationRun run = states->simulate(scene, network_to_run(scene), {});
  const QuasiStaticEnergy& e = run.record.curve.back().energy;
  const auto& moving = run.record.inertial_energy;
  const double work_J = moving ? moving->work : e.work_J;
  const double missing_J = moving ? moving->missing() : e.work_J - e.stored_J - e.dissipated_J;
  check(broken, work_J > 0.0 && std::abs(missing_J) <= 1e-3 * work_J, "energy account",
        fmt::format("{} J missing of {} J", missing_J, work_J));
}

/// Displacements of the driven sphere are what is imposed on it.
void field(const Formulation& f, Broken& broken) {
  if (!f.can().field || !f.can().depth) return;
  const ExperimentScene scene = usual(kRamp, f);
  const std::vector<double> times = even_times(scene.protocol, 4);
  const Trajectory answer = run_scene(scene, times, true);
  check(broken, answer.displacement.size() == times.size(), "field",
        fmt::format("{} of {} displacements", answer.displacement.size(), times.size()));
  const Probe& probe = scene.probe();
  for (std::size_t i = 0; i < answer.displacement.size(); ++i) {
    const double depth_m =
        probe.direction.dot(answer.displacement[i].col(static_cast<Eigen::Index>(probe.sphere)));
    const double imposed_m = value_at(scene.protocol, times[i]);
    check(broken, std::abs(depth_m - imposed_m) <= 1e-9, "field",
          fmt::format("the sphere is {} m deep where {} m are imposed", depth_m, imposed_m));
  }
}

/// What it cannot is refused in one line that names others.
void refusals(const Formulation& f, Broken& broken) {
  struct Asked {
    bool Capabilities::*capability;
    std::string blocks;
    bool star;
  };
  const std::string tool =
      R"("contacts": [{"kind": "ball", "radius": "10 mm", "mass_kg": 0.01}], )";
  const std::string patch = R"("contacts": [{"kind": "patch", "radius": "25 mm"}], )";
  for (const Asked& asked :
       {Asked{&Capabilities::depth, kRamp, true}, Asked{&Capabilities::load, kLoad, true},
        Asked{&Capabilities::jumps, f.can().load ? kCreep : kStep, true},
        Asked{&Capabilities::network, usual_push(f), false},
        Asked{&Capabilities::tools, tool + usual_push(f), false},
        Asked{&Capabilities::several_contacts, patch + usual_push(f), false}}) {
    if (f.can().*asked.capability) continue;
    if (!asked.star && !f.can().network && asked.capability != &Capabilities::network) continue;
    const ExperimentScene scene = asked.star ? star(asked.blocks, f) : liver(asked.blocks, f);
    std::string said;
    try {
      require_runnable(scene);
    } catch (const Error& refusal) {
      said = refusal.what();
    }
    const bool names = said.find("one of ") != std::string::npos &&
                       said.find(f.name()) != std::string::npos &&
                       said.find('\n') == std::string::npos;
    check(broken, names, "refusal", "says '" + said + "' where it cannot");
  }
}

ExperimentScene with_material(const Asking& asking, const Formulation& f) {
  const std::string text =
      R"({"organ": {"kind": "liver", "count": 40}, )" + asking.blocks + ", " + kRamp + "}";
  ExperimentScene scene = parse_experiment(parse_json(text, "scene"), "scene", {});
  scene.tissue.sliders.push_back({scene.probe().sphere, scene.probe().direction});
  scene.formulation.kind = f.name();
  scene.formulation.masses = f.can().masses && !f.takes("masses");
  scene.formulation.where = "scene: key /formulation";
  return scene;
}

/// What it takes of materials it answers as the quasi-static network does: by its tolerance, with
/// its order, or in kind. What it does not take it refuses in one line that names others.
void materials(const Formulation& f, Broken& broken) {
  constexpr double kInKind = 0.3;           // reductions claim their errors elsewhere
  constexpr double kTimesTolerance = 30.0;  // errors gather over a run
  if (!f.can().depth || !f.can().network) return;
  for (const Asking& asking : asking_materials()) {
    const std::string name(words_of(asking.capability));
    ExperimentScene scene = with_material(asking, f);
    if (!(f.can().*asking.capability)) {
      std::string said;
      try {
        require_runnable(scene);
      } catch (const Error& refusal) {
        said = refusal.what();
      }
      const auto refused_for = [&](bool Capabilities::*lacking) {
        const std::string words = "is no formulation that " + std::string(words_of(lacking));
        return !(f.can().*lacking) && said.find(words) != std::string::npos;
      };
      // A region of another material is a region, too.
      const bool names =
          (refused_for(asking.capability) ||
           (asking.capability == &Capabilities::mixed && refused_for(&Capabilities::regions))) &&
          said.find("quasi_static") != std::string::npos && said.find('\n') == std::string::npos;
      check(broken, names, "materials",
            "says '" + said + "' where it is asked for one that " + name);
      continue;
    }
    const std::vector<double> times = even_times(scene.protocol, 12);
    if (!f.can().course) {
      check(broken, run_scene(scene, times, false).response.allFinite(), "materials", name);
      continue;
    }
    ExperimentScene other = scene;
    other.formulation.kind = "quasi_static";
    other.formulation.masses = false;
    other.formulation.tolerance = 1e-10;
    const Eigen::VectorXd expected = run_scene(other, times, false).response;
    constexpr int kSweeps = 100;
    scene.formulation.sweeps = kSweeps;
    const auto error = [&](double step_s) {
      scene.formulation.step_s = step_s;
      return apart(run_scene(scene, times, false).response, expected);
    };
    if (order_of(f) > 0) {
      constexpr double kStep_s = 0.05, kShort = 0.35;
      const double coarse = error(kStep_s), fine = error(0.5 * kStep_s);
      check(broken, std::log2(coarse / fine) >= order_of(f) - kShort, "materials",
            fmt::format("{}: order {} where {} is stated ({} and {} of the peak)", name,
                        std::log2(coarse / fine), order_of(f), coarse, fine));
      continue;
    }
    const bool by_tolerance = !f.can().planned || (f.as<StateRunner>() && !f.can().masses);
    const double allowed = by_tolerance ? kTimesTolerance * scene.formulation.tolerance : kInKind;
    const double found = error(1e-3);
    check(broken, found <= allowed, "materials",
          fmt::format("{}: {} of the peak off, {} allowed", name, found, allowed));
  }
}

/// Exact derivatives against differences.
void derivatives(const Formulation& f, Broken& broken) {
  const auto* maker = f.as<ModelMaker>();
  if (maker == nullptr || !f.can().derivatives) return;
  const std::unique_ptr<Model> model = maker->model({});
  const Protocol protocol = ramp_and_hold(4e-3, 4e-3, 2.0);
  const std::vector<double> times{0.5, 1.0, 2.0};
  const TpmVector at = to_vector(TpmParameters{}.with_relaxation_time(0.7));
  const Response response = model->respond(protocol, times, at, Want::values_and_sensitivity);
  for (std::size_t i = 0; i < at.size(); ++i) {
    constexpr double kRelative = 1e-4;
    TpmVector more = at, less = at;
    more[i] *= 1.0 + kRelative;
    less[i] *= 1.0 - kRelative;
    const Eigen::VectorXd slope = (model->respond(protocol, times, more, Want::values).value -
                                   model->respond(protocol, times, less, Want::values).value) /
                                  (2.0 * kRelative * at[i]);
    const Eigen::VectorXd exact_slope = response.sensitivity.col(static_cast<Eigen::Index>(i));
    const double found =
        at[i] * (slope - exact_slope).cwiseAbs().maxCoeff() / response.value.cwiseAbs().maxCoeff();
    check(broken, found <= 1e-5, "derivatives",
          fmt::format("by parameter {}: {} of the peak off", i, found));
  }
}

/// What candidates claim they keep, against collocation at 1e-9.
void claims(const Formulation& f, Broken& broken) {
  if (!f.can().planned) return;
  const bool moving = f.can().masses;
  ExperimentScene scene = liver(
      R"("protocol": {"kind": "ramp_hold", "depth": "3 mm", "rate": "30 mm/s", "hold": "0.2 s"})",
      f);
  scene.formulation.masses = moving;
  const PlanSurrogate surrogate(PlanScene(scene), {}, moving);
  PlanBudget budget;
  budget.rate_Hz = 1000.0;
  Trajectory expected;
  const std::vector<double> times = even_times(scene.protocol, 40);
  if (moving) {
    expected = surrogate.scene().inertial(inertial_options(surrogate.scene(), 1e-8), times, false);
  } else {
    QuasiStaticOptions options;
    options.tolerance = 1e-9;
    expected = surrogate.scene().quasi_static(options, times, false);
  }
  PlanModels all;
  if (const auto* offer = f.as<PlanOffer>()) {
    all = offer->candidates(surrogate.scene());
  } else {
    all.push_back(run_candidate(f));
  }
  check(broken, !all.empty(), "claims", "no candidate");
  for (const auto& candidate : all) {
    if (candidate->why_not(surrogate, budget)) continue;
    const double claimed = candidate->claim(surrogate, budget).error;
    const double found = trajectory_error(candidate->run(surrogate, budget, times), expected, {});
    check(broken, found <= claimed, "claims",
          fmt::format("{} claims {} and is {} off", candidate->name(), claimed, found));
  }
}

}  // namespace

Broken broken_words(const Formulation& f) {
  Broken broken;
  check(broken, !f.name().empty() && !f.meaning().empty() && f.meaning().back() != '.', "entry",
        "a name and a sentence without a full stop");
  check(broken, f.can().depth || f.can().load, "entry", "nothing drives it");
  derivatives(f, broken);
  if (f.as<SceneRunner>() == nullptr) return broken;
  closed_forms(f, broken);
  oscillator(f, broken);
  equality_at_rest(f, broken);
  determinism(f, broken);
  passivity(f, broken);
  energy_account(f, broken);
  field(f, broken);
  refusals(f, broken);
  materials(f, broken);
  claims(f, broken);
  return broken;
}

Broken broken_in_loop(const Formulation& f, HeapCalls heap_calls) {
  Broken broken;
  // A law needs a file of its own: tests/contact/test_law_contact.cpp.
  if (f.name() == "law") return broken;
  const std::string organ = f.name() == "element" ? R"({"kind": "star", "spacing": "30 mm"})"
                                                  : R"({"kind": "liver", "count": 40})";
  const Json session = parse_json(R"({"model": {"kind": ")" + std::string(f.name()) +
                                      R"(", "scene": {"organ": )" + organ + ", " + kMaterial +
                                      R"("title": "t"}},
    "indentations": {"depths": ["3 mm"], "rates": ["10 mm/s"], "hold": "0.2 s", "rest": "0.2 s"}})",
                                  "session");
  const LoopModel loop = make_loop_model(parse_session(session, "session", {}));
  ContactModel& model = *loop.model;
  constexpr std::size_t kPeriods = 300;
  std::vector<double> first(kPeriods), second(kPeriods);
  // At rest, then 2 mm in within 200 periods, and held.
  const auto moved = [&](std::vector<double>& forces_N) {
    model.reset();
    const double rest_N = model.step(Eigen::Vector3d::Zero()).force_N.norm();
    for (std::size_t i = 0; i < kPeriods; ++i) {
      const double depth_m = 2e-3 * std::min(1.0, static_cast<double>(i) / 200.0);
      forces_N[i] = loop.push.dot(model.step(depth_m * loop.push).force_N);
    }
    return rest_N;
  };
  const long before = heap_calls();
  const double rest_N = moved(first);
  const long calls = heap_calls() - before;
  check(broken, calls == 0, "heap",
        fmt::format("{} calls of the heap in {} steps", calls, kPeriods + 1));
  check(broken, rest_N <= 1e-6, "rest", fmt::format("{} N without a displacement", rest_N));
  (void)moved(second);
  check(broken, first == second, "determinism", "after reset() it answers other bits");
  check(broken, first.back() < 0.0, "push", fmt::format("{} N along the push", first.back()));
  return broken;
}

std::string listed(const Broken& broken) {
  std::string text;
  for (const BrokenWord& word : broken) text += word.check + ": " + word.found + "\n";
  return text;
}

}  // namespace tpm::test
