#include "tpm/accuracy/stability/checked_problem.hpp"

#include <fmt/format.h>

#include "tpm/accuracy/stability/study.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/element/closed_form.hpp"
#include "tpm/organ/body/liver.hpp"

namespace tpm::accuracy {

namespace {

/// In place of the modulus of an element without springs, for the size of its forces.
constexpr double kSoft_Pa = 12e3;

}  // namespace

StabilityVerdict CheckedProblem::verdict(const MethodSettings& settings) const {
  return classify_run(problem->run(settings, times_s), reference, peak, moves);
}

std::vector<double> last_steps(double end_s, double step_s, int count) {
  std::vector<double> times;
  for (int i = count - 1; i >= 0; --i) times.push_back(end_s - i * step_s);
  return times;
}

CheckedProblem massless_problem(const BondElement& p, const Protocol& protocol, double step_s) {
  CheckedProblem checked;
  checked.times_s = last_steps(protocol.end_s(), step_s, kComparedSteps);
  ModelOptions options;
  if (p.lateral_Pa == 0.0) options.tension = TensionRule::frozen(0.0);
  const ClosedForm exact(options);
  checked.reference =
      exact.respond(protocol, checked.times_s, element_constants(p), Want::values).value;
  // The peak of the whole protocol, not of the part that is compared.
  const double unit = p.modulus_to_stiffness_m();
  checked.peak = checked.reference.cwiseAbs().maxCoeff();
  if (protocol.drive() == Drive::displacement) {
    const double instantaneous = p.instantaneous_Pa() > 0.0 ? p.instantaneous_Pa() : kSoft_Pa;
    checked.peak = unit * (instantaneous * protocol.peak() + p.tension().value(protocol.peak()));
  }
  checked.problem = element_problem(p, protocol);
  return checked;
}

CheckedProblem problem_with_mass(const BondElement& p, double mass_kg, double drag_per_s,
                                 double load_N, double end_s, double step_s) {
  CheckedProblem checked;
  checked.moves = true;
  checked.times_s = last_steps(end_s, step_s, kComparedSteps);
  LinearElement linear = linear_element(p, 0.0);
  linear.mass_kg = mass_kg;
  linear.drag_per_s = drag_per_s;
  checked.reference = linear_motion_m(linear, load_N, checked.times_s);
  checked.peak = load_N / (linear.stiffness_N_per_m - linear.relaxing_N_per_m);
  checked.problem = element_problem(
      p, creep(load_N, end_s), MethodMasses{Eigen::VectorXd::Constant(1, mass_kg), drag_per_s});
  return checked;
}

namespace {

Network small_liver(std::size_t spheres) {
  LiverRequest request;
  request.count = spheres;
  return build_network(fill_liver(request), {}, "study");
}

constexpr double kFarShare = 0.6;  // of the organ's extent along the push: fixed from there on

DrivenNetwork pushed(const Network& network, const BondSystem& bonds) {
  const Organ& organ = network.organ;
  const std::size_t contact = organ.contact.value_or(0);
  const Eigen::Vector3d direction = -organ.normal.col(static_cast<Eigen::Index>(contact));
  const Eigen::VectorXd along = organ.position.transpose() * direction;
  const double near = along[static_cast<Eigen::Index>(contact)];
  Constraints constraints(organ.size());
  for (std::size_t i = 0; i < organ.size(); ++i) {
    const double further = along[static_cast<Eigen::Index>(i)] - near;
    if (organ.layer[i] == 0 && further > kFarShare * (along.maxCoeff() - near)) constraints.fix(i);
  }
  return {
      bonds, organ.position, std::move(constraints), Probes(Probe{contact, direction, 1.0}), {}};
}

}  // namespace

std::string study_organ_words() {
  return fmt::format(
      "The networks of 24 and 424 spheres are livers of two layers. Spheres of the outer layer "
      "further "
      "than {} of the organ's extent along the push are fixed; all others, the inner layer "
      "included, are "
      "free. Limits of a network hold for these supports.",
      shortest(kFarShare));
}

StudyOrgan::StudyOrgan(const BondElement& p, std::size_t spheres)
    : network(small_liver(spheres)), bonds(network, p), driven(pushed(network, bonds)) {}

}  // namespace tpm::accuracy
