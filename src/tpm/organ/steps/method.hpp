#pragma once
// The methods that step an element or a network through a protocol, behind one interface.
#include <Eigen/Core>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "tpm/organ/balance/driven_network.hpp"
#include "tpmkit/bond_element.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::organ {

/// A rule by which a motion is advanced.
enum class StepRule {
  forward_euler,
  semi_implicit_euler,
  rk4,
  backward_euler,
  implicit_midpoint,
  newmark,  ///< average acceleration, beta = 1/4, gamma = 1/2
  tr_bdf2,
  exponential,  ///< viscous elongations advance exactly under linear motion
  xpbd,         ///< position-based dynamics with compliance
  cvode_adams,
  cvode_bdf,
  ida,
};

/// Properties of a rule.
struct StepRuleEntry {
  StepRule meaning;
  std::string_view text;  ///< its word in files, options and charts
  int order;              ///< nominal, for smooth problems; 0: the rule chooses its order itself
  bool adaptive;          ///< steps are chosen by a tolerance, not given
  std::string_view words;
};

inline constexpr std::array<StepRuleEntry, 12> kStepRules{{
    {StepRule::forward_euler, "forward_euler", 1, false, "explicit Euler, order 1"},
    {StepRule::semi_implicit_euler, "semi_implicit_euler", 1, false,
     "velocities by the forces at the start, positions by the new velocities, order 1"},
    {StepRule::rk4, "rk4", 4, false, "the classical Runge-Kutta rule, order 4"},
    {StepRule::backward_euler, "backward_euler", 1, false,
     "implicit Euler, order 1, strongly damping"},
    {StepRule::implicit_midpoint, "implicit_midpoint", 2, false,
     "implicit midpoint rule, order 2, conserves quadratic energies"},
    {StepRule::newmark, "newmark", 2, false, "average acceleration (beta 1/4, gamma 1/2), order 2"},
    {StepRule::tr_bdf2, "tr_bdf2", 2, false,
     "trapezoidal rule and BDF2 in one step, order 2, strongly damping"},
    {StepRule::exponential, "exponential", 2, false,
     "viscous elongations exact for linear motion within a step, positions by the trapezoidal "
     "rule"},
    {StepRule::xpbd, "xpbd", 1, false, "position-based dynamics with compliance, order 1"},
    {StepRule::cvode_adams, "cvode_adams", 0, true, "CVODE, Adams formulae, steps by a tolerance"},
    {StepRule::cvode_bdf, "cvode_bdf", 0, true,
     "CVODE, backward differentiation formulae, steps by a tolerance"},
    {StepRule::ida, "ida", 0, true,
     "IDA, balance of forces as a differential-algebraic equation, steps by a tolerance"},
}};

/// Its word in kStepRules.
[[nodiscard]] inline std::string step_rule_name(StepRule rule) {
  return std::string(kStepRules[static_cast<std::size_t>(rule)].text);
}

/// Settings of a rule.
struct MethodSettings {
  StepRule rule = StepRule::exponential;
  double step_s = 1e-3;     ///< of a rule with fixed steps, > 0; pieces of a protocol end on a step
  double tolerance = 1e-6;  ///< of an adaptive rule, relative, 1e-13 to 0.1
  int sweeps = 1;           ///< of XPBD over the bonds, a step, >= 1
  long most_rates = 50'000'000;  ///< evaluations of the forces after which it is `too_much_work`
};

/// Ends of a run.
enum class MethodEnd {
  completed,
  diverged,  ///< a value is not finite, or beyond 1e3 times what was imposed
  newton_failed,
  buckled,  ///< the tangent stiffness is no longer positive definite
  too_much_work,
  not_applicable,  ///< the rule needs masses, or has no meaning without them
};

struct MethodWork {
  long steps = 0;
  long rates = 0;           ///< evaluations of the forces of all bonds, or of the right-hand side
  long factorisations = 0;  ///< of a stiffness or Newton matrix
  long solves = 0;
};

struct MethodRun {
  MethodEnd end = MethodEnd::completed;
  std::string reason;       ///< in words, where it did not complete
  double end_time_s = 0.0;  ///< reached
  Eigen::VectorXd
      response;  ///< contact force, N, or depth, m, at each asked time; NaN if not reached
  MethodWork work;
};

/// Masses and drag of a problem in motion.
struct MethodMasses {
  Eigen::VectorXd mass_kg;  ///< of each sphere (element: one), > 0
  double drag_per_s = 0.0;  ///< force -drag m v, >= 0
};

class StepSystem;

/// An element or a network with its protocol: what a method steps. Without masses forces balance at
/// each instant and only viscous elongations have a rate; with masses spheres move by Newton's law.
class MethodProblem {
 public:
  using Equations = std::function<std::unique_ptr<StepSystem>(const Protocol&)>;
  MethodProblem(Protocol protocol, Equations equations)
      : protocol_(std::move(protocol)), equations_(std::move(equations)) {}
  [[nodiscard]] const Protocol& protocol() const { return protocol_; }
  /// @param times_s rising, within the protocol
  /// Throws Error(bad_input) for settings out of range; what a method cannot do is in the result.
  [[nodiscard]] MethodRun run(const MethodSettings& settings,
                              std::span<const double> times_s) const;

 private:
  Protocol protocol_;
  Equations equations_;
};

/// One sphere on an element with one branch, moved along its normal.
/// @param mass its mass: under an imposed depth it is dragged along and has no part in the motion
[[nodiscard]] std::unique_ptr<MethodProblem> element_problem(const BondElement& material,
                                                             Protocol protocol,
                                                             std::optional<MethodMasses> mass = {});

/// A network under its probe, contacts with tools left out.
/// @param network must live as long as the problem
[[nodiscard]] std::unique_ptr<MethodProblem> network_problem(const DrivenNetwork& network,
                                                             Protocol protocol,
                                                             std::optional<MethodMasses> mass = {});

}  // namespace tpm::organ
