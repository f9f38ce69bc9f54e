#pragma once
// Benchmark cases: a driven network, and the settings of every method on them.
#include <initializer_list>

#include "tpm/accuracy/problem.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpmkit/organ.hpp"

namespace tpm::accuracy {

/// A network with what is done to it; shared by the settings that run it.
struct BenchmarkCase {
  BenchmarkCase(DrivenNetwork driven, Protocol imposed, std::vector<double> asked_s);
  BenchmarkCase(const BenchmarkCase&) = delete;
  BenchmarkCase& operator=(const BenchmarkCase&) = delete;

  /// Gives every sphere its mass, and the drag that is `damping_ratio` of the lowest mode.
  void set_masses(Eigen::VectorXd mass_kg, double ratio);

  DrivenNetwork network;
  Protocol protocol;
  std::vector<double> times_s;  ///< at which responses are compared, rising
  std::optional<MethodMasses> mass;
  double damping_ratio = 0.0;
};

/// The star of four spheres as a driven network: B guided along its normal, A, C and D fixed.
[[nodiscard]] DrivenNetwork driven_star(const BondElement& material);

/// 0, spacing, 2 spacing, ... up to the end, which is a multiple of the spacing.
/// @param first number of the first multiple
[[nodiscard]] std::vector<double> times_every(double spacing_s, double end_s, int first = 0);

/// These times and moments after each kink of the protocol, the last left out: what happens there
/// is over before the next of times that are far apart. 0.25, 0.5, 1 and 2 ms.
/// @param times_s rising, further apart than the moments, kinks among them
[[nodiscard]] std::vector<double> with_moments_after_kinks(std::vector<double> times_s,
                                                           const Protocol& protocol);

/// The rules of method.hpp on a benchmark case, which is kept alive.
[[nodiscard]] std::shared_ptr<const MethodProblem> rules_on(
    const std::shared_ptr<const BenchmarkCase>& benchmark);

/// Settings of the rules of method.hpp.
struct RuleSettings {
  std::vector<double> steps_s;     ///< of the rules with fixed steps, longest first
  std::vector<double> tolerances;  ///< of the adaptive ones, loosest first
  std::vector<int> sweeps{1};      ///< of XPBD; a curve each
  long most_rates = 50'000'000;
};

/// Every rule of kStepRules at every setting.
/// @param problem kept alive by the settings
[[nodiscard]] std::vector<BenchmarkSetting> rule_settings(
    const std::shared_ptr<const MethodProblem>& problem, const std::vector<double>& times_s,
    const RuleSettings& settings);

/// The network in balance at each instant (`collocation`, QuasiStatic) at tolerances. Of a network
/// with masses it leaves the masses out.
[[nodiscard]] std::vector<BenchmarkSetting> collocation_settings(
    const std::shared_ptr<const BenchmarkCase>& benchmark,
    std::initializer_list<double> tolerances);

/// The network with masses under CVODES (`inertial`, Inertial) at tolerances, at highest orders 2
/// and 5.
[[nodiscard]] std::vector<BenchmarkSetting> inertial_settings(
    const std::shared_ptr<const BenchmarkCase>& benchmark,
    std::initializer_list<double> tolerances);

/// One setting of every formulation of this program that the library does not ship
/// (tpmkit/formulation.hpp), as it runs the scene at its defaults. One whose capabilities the scene
/// exceeds is not applicable, and says why.
/// @param scene kept alive by the settings; its formulation is not used
[[nodiscard]] std::vector<BenchmarkSetting> own_formulation_settings(
    const std::shared_ptr<const ExperimentScene>& scene, const std::vector<double>& times_s);

/// One setting of one rule.
[[nodiscard]] BenchmarkSetting rule_setting(const std::shared_ptr<const MethodProblem>& problem,
                                            const std::vector<double>& times_s,
                                            const MethodSettings& method);

/// A method that cannot solve the problem, with the reason.
[[nodiscard]] BenchmarkSetting not_applicable(std::string method, std::string reason);

/// The answer of one run of a setting. Throws Error(numerical) unless it completed.
[[nodiscard]] BenchmarkAnswer answer_of(const BenchmarkSetting& setting, std::string words);

/// Appends.
void add(std::vector<BenchmarkSetting>& all, std::vector<BenchmarkSetting> more);

}  // namespace tpm::accuracy
