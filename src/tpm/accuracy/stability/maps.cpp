// Declared in tpm/accuracy/stability/study.hpp.
// Maps of each rule over a property of the problem and the step.
#include <array>
#include <cmath>
#include <functional>

#include "tpm/accuracy/stability/checked_problem.hpp"
#include "tpm/accuracy/stability/study.hpp"
#include "tpm/base/evenly.hpp"
#include "tpm/work/progress.hpp"

namespace tpm::accuracy {
namespace {

/// Varied quantities, and the problem at given values of them.
struct MapPlan {
  std::string id, quantity, unit, problem;
  std::vector<double> x, step_s;
  std::function<CheckedProblem(double x, double step_s)> build;
  std::function<LinearElement(double x)> linear;
};

constexpr double kMapDepth_m = 0.004;
constexpr double kMapTau_s = 0.1;
constexpr double kMapDrag_per_s = 20.0;

MapPlan over_relaxation_time(int along) {
  return {"relaxation_time",
          "relaxation time",
          "s",
          "element, a depth of 4 mm in a step and held",
          evenly_in_log(1e-4, 1e2, along),
          evenly_in_log(1e-5, 1e3, along),
          [](double tau, double h) {
            return massless_problem(paper_element(tau), step_and_hold(kMapDepth_m, kStudySteps * h),
                                    h);
          },
          [](double tau) {
            LinearElement e = linear_element(paper_element(tau), 0.0);
            e.depth_imposed = true;
            return e;
          }};
}

BondElement without_tension(double tau_s) {
  BondElement p = paper_element(tau_s);
  p.lateral_Pa = 0.0;
  return p;
}

MapPlan over_load_rate(int along) {
  constexpr double kLoad_N = 0.3;
  return {"load_rate",
          "load rate",
          "N/s",
          "element without tension, tau = 0.1 s, a load rising to 0.3 N and held",
          evenly_in_log(0.1, 1e3, along),
          evenly_in_log(1e-3, 10.0, along),
          [](double rate, double h) {
            const double rises = kLoad_N / rate;
            const double ends = rises + kStudySteps * h;
            return massless_problem(
                without_tension(kMapTau_s),
                Protocol(Drive::force, {{0.0, 0.0}, {rises, kLoad_N}, {ends, kLoad_N}}), h);
          },
          [](double) { return linear_element(without_tension(kMapTau_s), 0.0); }};
}

MapPlan over_depth(int along) {
  const auto load = [](double depth) {
    const BondElement p = paper_element(kMapTau_s);
    return p.modulus_to_stiffness_m() * (p.equilibrium_Pa * depth + p.tension().value(depth));
  };
  return {"depth",
          "depth in the end",
          "m",
          "element with tension, tau = 0.1 s, a load in a step and held that leads to the depth",
          evenly_in_log(1e-3, 4e-2, along),
          evenly_in_log(1e-3, 1e3, along),
          [load](double depth, double h) {
            return massless_problem(paper_element(kMapTau_s), creep(load(depth), kStudySteps * h),
                                    h);
          },
          [](double depth) { return linear_element(paper_element(kMapTau_s), depth); }};
}

/// A sphere of an element without tension, under a load that leads to 4 mm.
MapPlan in_motion(std::string id, std::string quantity, std::string unit, std::string problem,
                  std::vector<double> x, std::function<LinearElement(double)> linear,
                  std::function<BondElement(double)> material) {
  std::vector<double> steps = evenly_in_log(1e-6, 1e2, static_cast<int>(x.size()));
  MapPlan plan{std::move(id),
               std::move(quantity),
               std::move(unit),
               std::move(problem),
               std::move(x),
               std::move(steps),
               {},
               linear};
  plan.build = [linear = std::move(linear), material = std::move(material)](double at, double h) {
    const LinearElement e = linear(at);
    const double load = kMapDepth_m * (e.stiffness_N_per_m - e.relaxing_N_per_m);
    return problem_with_mass(material(at), e.mass_kg, e.drag_per_s, load, kStudySteps * h, h);
  };
  return plan;
}

LinearElement sphere(const BondElement& p, double mass_kg, double drag_per_s) {
  LinearElement e = linear_element(p, 0.0);
  e.mass_kg = mass_kg;
  e.drag_per_s = drag_per_s;
  return e;
}

MapPlan over_stiffness(int along) {
  const auto material = [](double modulus) {
    BondElement p = without_tension(kMapTau_s);
    p.equilibrium_Pa = p.branches.front().modulus_Pa = 0.5 * modulus;
    return p;
  };
  return in_motion(
      "stiffness", "E1 = E2", "Pa",
      "sphere of 4.4 g, drag 20 1/s, tau = 0.1 s, a load in a step and held that leads to 4 mm",
      evenly_in_log(1e2, 1e8, along),
      [material](double x) { return sphere(material(x), kSphereMass_kg, kMapDrag_per_s); },
      material);
}

MapPlan over_mass(int along) {
  return in_motion(
      "mass", "mass", "kg",
      "E1 = E2 = 12 kPa, drag 20 1/s, tau = 0.1 s, a load in a step and held that leads to 4 mm",
      evenly_in_log(1e-8, 1e1, along),
      [](double x) { return sphere(without_tension(kMapTau_s), x, kMapDrag_per_s); },
      [](double) { return without_tension(kMapTau_s); });
}

MapPlan over_damping(int along) {
  return in_motion(
      "damping", "drag", "1/s",
      "sphere of 4.4 g, E1 = E2 = 12 kPa, tau = 0.1 s, a load in a step and held that leads to 4 "
      "mm",
      evenly_in_log(1e-1, 1e6, along),
      [](double x) { return sphere(without_tension(kMapTau_s), kSphereMass_kg, x); },
      [](double) { return without_tension(kMapTau_s); });
}

void add_limits(StabilityMap& map, const MapPlan& plan) {
  for (const double x : plan.x) {
    const auto limit = stable_step_s(map.rule, plan.linear(x));
    if (!limit || *limit <= 0.0) continue;
    map.limit_x.push_back(x);
    map.limit_step_s.push_back(*limit);
  }
}

void draw_plan(const MapPlan& plan, std::vector<StabilityMap>& maps, Progress& progress) {
  const std::size_t first = maps.size();
  for (const StepRuleEntry& entry : kStepRules) {
    if (entry.adaptive) continue;
    StabilityMap map{plan.id, plan.quantity, plan.unit, plan.problem, entry.meaning, {}, {}, {}};
    add_limits(map, plan);
    maps.push_back(std::move(map));
  }
  for (const double x : plan.x) {
    for (const double h : plan.step_s) {
      const CheckedProblem checked = plan.build(x, h);
      for (std::size_t i = first; i < maps.size(); ++i) {
        MethodSettings settings;
        settings.rule = maps[i].rule;
        settings.step_s = h;
        maps[i].points.push_back({x, h, checked.verdict(settings)});
      }
      progress.advance();
    }
  }
}

}  // namespace

std::vector<StabilityMap> stability_maps(int along) {
  const std::array plans{over_relaxation_time(along), over_load_rate(along),
                         over_stiffness(along),       over_mass(along),
                         over_damping(along),         over_depth(along)};
  std::size_t points = 0;
  for (const MapPlan& plan : plans) points += plan.x.size() * plan.step_s.size();
  Progress progress("points of maps", points);
  std::vector<StabilityMap> maps;
  for (const MapPlan& plan : plans) draw_plan(plan, maps, progress);
  return maps;
}

}  // namespace tpm::accuracy
