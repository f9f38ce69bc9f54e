#pragma once
// The problems of the study, each with a reference that no step rule computed.
#include <memory>
#include <vector>

#include "tpm/accuracy/stability/theory.hpp"
#include "tpm/accuracy/stability/verdict.hpp"
#include "tpm/organ/balance/driven_network.hpp"
#include "tpm/organ/bonds/network.hpp"

namespace tpm::accuracy {

struct CheckedProblem {
  std::unique_ptr<MethodProblem> problem;
  std::vector<double> times_s;
  Eigen::VectorXd reference;
  double peak = 0.0;
  bool moves = false;

  [[nodiscard]] StabilityVerdict verdict(const MethodSettings& settings) const;
};

/// The last `count` ends of steps before a time, rising.
[[nodiscard]] std::vector<double> last_steps(double end_s, double step_s, int count);

/// Steps of a run of a map, and how many of them are compared.
inline constexpr double kStudySteps = 300.0;
inline constexpr int kComparedSteps = 32;

/// The element without mass; the closed form is the reference. With frozen tension (E' = 0) any
/// history of loads, else constant ones.
[[nodiscard]] CheckedProblem massless_problem(const BondElement& p, const Protocol& protocol,
                                              double step_s);

/// The element with mass and E' = 0 under a constant load from rest.
[[nodiscard]] CheckedProblem problem_with_mass(const BondElement& p, double mass_kg,
                                               double drag_per_s, double load_N, double end_s,
                                               double step_s);

/// kg, of a sphere of 10 mm radius and 1060 kg/m^3.
inline constexpr double kSphereMass_kg = 1060.0 * 4.0 / 3.0 * 3.14159265358979 * 1e-6;

/// A liver of few spheres, two layers, its far side fixed.
struct StudyOrgan {
  StudyOrgan(const BondElement& p, std::size_t spheres);
  StudyOrgan(const StudyOrgan&) = delete;
  StudyOrgan& operator=(const StudyOrgan&) = delete;

  Network network;
  BondSystem bonds;
  DrivenNetwork driven;
};

}  // namespace tpm::accuracy
