#pragma once
// Problems for the step rules, each with a reference that no rule under test has made.
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "loaded_oscillator.hpp"
#include "organ_scene.hpp"
#include "star_network.hpp"
#include "tpm/law/element/closed_form.hpp"
#include "tpm/organ/balance/inertial.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpm/organ/steps/method.hpp"

namespace tpm_test {

using namespace tpm;
using namespace tpm::organ;

/// A problem with its true answers.
struct ReferenceProblem {
  std::string name;
  std::unique_ptr<MethodProblem> problem;
  std::vector<double> times;
  Eigen::VectorXd expected;

  [[nodiscard]] MethodRun run(MethodSettings settings) const {
    return problem->run(settings, times);
  }
  /// The largest difference in parts of the peak.
  [[nodiscard]] double error(const MethodRun& run) const {
    return (run.response - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
  }
  [[nodiscard]] double error(StepRule rule, double step_s) const {
    MethodSettings settings;
    settings.rule = rule;
    settings.step_s = step_s;
    return error(run(settings));
  }
};

inline ReferenceProblem checked_element(std::string name, const TpmParameters& p,
                                        const Protocol& protocol, std::vector<double> times) {
  const ClosedForm exact{ModelOptions{}};
  Eigen::VectorXd expected = exact.respond(protocol, times, to_vector(p), Want::values).value;
  return {std::move(name), element_problem(p, protocol), std::move(times), std::move(expected)};
}

inline MethodMasses one_mass(double mass_kg, double drag_per_s) {
  return {Eigen::VectorXd::Constant(1, mass_kg), drag_per_s};
}

inline ReferenceProblem element_with_mass(const TpmParameters& p, double mass_kg, double drag_per_s,
                                          double load_N, std::vector<double> times) {
  Eigen::VectorXd expected = loaded_oscillator(p, mass_kg, drag_per_s, load_N, times);
  return {"element with mass",
          element_problem(p, creep(load_N, times.back()), one_mass(mass_kg, drag_per_s)),
          std::move(times), std::move(expected)};
}

/// A small organ of two layers.
struct SmallOrgan {
  explicit SmallOrgan(const TpmParameters& p, std::size_t spheres = 24)
      : scene(fill_liver(request(spheres))),
        bonds(scene.network, p),
        driven{bonds, scene.network.organ.position, scene.constraints, Probes(scene.probe), {}},
        mass{sphere_masses_kg(scene.network.organ), 0.0} {}
  SmallOrgan(const SmallOrgan&) = delete;
  SmallOrgan& operator=(const SmallOrgan&) = delete;

  [[nodiscard]] ReferenceProblem massless(std::string name, const Protocol& protocol,
                                          std::vector<double> times) const {
    QuasiStaticOptions options;
    options.tolerance = 1e-11;
    Eigen::VectorXd expected =
        QuasiStatic(bonds, driven.rest, driven.constraints, driven.probes, options)
            .run(protocol, times)
            .response;
    return {std::move(name), network_problem(driven, protocol), std::move(times),
            std::move(expected)};
  }

  [[nodiscard]] ReferenceProblem with_mass(std::string name, const Protocol& protocol,
                                           std::vector<double> times, double damping_ratio) const {
    InertialOptions options;
    options.tolerance = 1e-11;
    options.highest_order = 5;
    options.damping_ratio = damping_ratio;
    const Inertial inertial(bonds, driven.rest, driven.constraints, driven.probes, mass.mass_kg,
                            options);
    MethodMasses damped = mass;
    damped.drag_per_s = 2.0 * damping_ratio * inertial.lowest().angular_frequency();
    Eigen::VectorXd expected = inertial.run(protocol, times).response;
    return {std::move(name), network_problem(driven, protocol, damped), std::move(times),
            std::move(expected)};
  }

  static LiverRequest request(std::size_t spheres) {
    LiverRequest liver;
    liver.count = spheres;
    return liver;
  }

  tpm::testing::OrganScene scene;
  BondSystem bonds;
  DrivenNetwork driven;
  MethodMasses mass;
};

/// log2 of the error at a step over that at half of it.
inline double observed_order(const ReferenceProblem& checked, StepRule rule, double step_s) {
  return std::log2(checked.error(rule, step_s) / checked.error(rule, 0.5 * step_s));
}

/// The same from three runs with halved steps, without a reference: for errors that are smaller
/// than his.
inline double own_order(const ReferenceProblem& checked, StepRule rule, double step_s) {
  const auto at = [&](double step) {
    MethodSettings settings;
    settings.rule = rule;
    settings.step_s = step;
    return checked.run(settings).response;
  };
  const Eigen::VectorXd middle = at(0.5 * step_s);
  return std::log2((at(step_s) - middle).cwiseAbs().maxCoeff() /
                   (middle - at(0.25 * step_s)).cwiseAbs().maxCoeff());
}

/// The step at which a property is lost, found between one at which it holds and one at which it
/// does not, to a share of itself.
template <class Holds>
double bisected_limit(double holds_s, double fails_s, double share, Holds holds) {
  while (fails_s > holds_s * (1.0 + share)) {
    const double middle = std::sqrt(holds_s * fails_s);
    (holds(middle) ? holds_s : fails_s) = middle;
  }
  return std::sqrt(holds_s * fails_s);
}

}  // namespace tpm_test
