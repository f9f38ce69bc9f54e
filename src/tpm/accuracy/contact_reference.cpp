#include "tpm/accuracy/contact_reference.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpm/organ/balance/buckling.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {
namespace {

constexpr double kBalance = 1e-13;  // of the stiffest bond times 1 m
constexpr int kMostIterations = 60;
constexpr int kSlow = 6;  // iterations after which a factorisation is found anew

Constraints with_contact_held(const TouchedTissue& tissue) {
  Constraints constraints = tissue.constraints;
  constraints.fix(tissue.contact);
  return constraints;
}

/// Forces and displacements as they are found.
class Record {
 public:
  Record(const TouchedTissue& tissue, const ContactMotion& motion, Eigen::Index field_every)
      : rest_(tissue.rest), field_every_(field_every) {
    found_.force_N.resize(3, motion.steps());
    if (field_every > 0) {
      found_.displacement_m.resize(tissue.rest.size(), motion.steps() / field_every);
    }
  }
  void put(Eigen::Index period, const Eigen::Vector3d& force_N, const Positions& position) {
    found_.force_N.col(period) = force_N;
    if (field_every_ == 0 || (period + 1) % field_every_ != 0) return;
    found_.displacement_m.col(period / field_every_) = (position - rest_).reshaped();
  }
  [[nodiscard]] ContactReference take() { return std::move(found_); }

 private:
  const Positions& rest_;
  Eigen::Index field_every_;
  ContactReference found_;
};

ContactReference answers_with(const TouchedTissue& tissue, const ContactMotion& motion,
                              int substeps, Eigen::Index field_every) {
  FineContact fine(tissue, motion.period_s / substeps);
  Record record(tissue, motion, field_every);
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < motion.steps(); ++i) {
    const Eigen::Vector3d to = motion.displacement_m.col(i);
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
    for (int s = 1; s <= substeps; ++s) {
      force_N = fine.step(from + static_cast<double>(s) / substeps * (to - from));
    }
    record.put(i, force_N, fine.position());
    from = to;
  }
  return record.take();
}

}  // namespace

BalancedContact::BalancedContact(const TouchedTissue& tissue)
    : tissue_(tissue),
      constraints_(with_contact_held(tissue)),
      equilibrium_(tissue.bonds, constraints_),
      position_(tissue.rest) {
  require_one_linear_branch(tissue.bonds, "the reference of contact models");
}

Eigen::Vector3d BalancedContact::go_to(const Eigen::Vector3d& displacement_m,
                                       const ViscousState& viscous_state) {
  const auto column = static_cast<Eigen::Index>(tissue_.contact);
  const double tolerance_N = kBalance * tissue_.bonds.stiffness().maxCoeff();
  const Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, position_.cols());
  position_.col(column) = tissue_.rest.col(column) + displacement_m;
  Eigen::Matrix3Xd force;
  for (int iteration = 0;; ++iteration) {
    equilibrium_.forces(position_, viscous_state, load, force);
    Eigen::Matrix3Xd left = force;
    constraints_.project(left);
    const double residual_N = left.cwiseAbs().maxCoeff();
    if (residual_N <= tolerance_N) return force.col(column);
    if (iteration == kMostIterations || !std::isfinite(residual_N)) {
      throw Error(ExitCode::numerical, "contact", "the forces cannot be balanced");
    }
    if (!factorised_ || iteration % kSlow == kSlow - 1) {
      factorised_ = equilibrium_.factorise(position_, viscous_state);
      if (!factorised_ || !equilibrium_.is_stable()) {
        throw Error(ExitCode::numerical, ErrorCause::buckled, "contact",
                    "the tissue buckles" +
                        buckling_place(equilibrium_, position_, viscous_state, position_.cols()));
      }
    }
    equilibrium_.displace(left);
    position_ += left;
  }
}

FineContact::FineContact(const TouchedTissue& tissue, double step_s)
    : bonds_(tissue.bonds),
      balanced_(tissue),
      viscous_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(tissue.bonds.size()))) {
  const RelaxationWeights w = relaxation_weights(step_s / bonds_.relaxation_time_s());
  keep_ = w.r;
  of_start_ = w.w0;
  of_end_ = w.w1;
  bonds_.elongations(position(), elongation_);
}

Eigen::Vector3d FineContact::step(const Eigen::Vector3d& displacement_m) {
  const ViscousState viscous_state{keep_ * viscous_ + of_start_ * elongation_, of_end_};
  Eigen::Vector3d force_N = balanced_.go_to(displacement_m, viscous_state);
  bonds_.elongations(position(), elongation_);
  viscous_ = viscous_state.offset + of_end_ * elongation_;
  return force_N;
}

double FineContact::stored_J() const {
  return bonds_.stored_energy_J(position(), viscous_);
}

ContactReference fine_reference(const TouchedTissue& tissue, const ContactMotion& motion,
                                int substeps, Eigen::Index field_every) {
  const ContactReference coarse = answers_with(tissue, motion, substeps, field_every);
  ContactReference fine = answers_with(tissue, motion, 2 * substeps, field_every);
  const Eigen::Matrix3Xd change = (fine.force_N - coarse.force_N) / 3.0;
  fine.force_N += change;
  fine.error_N = change.colwise().norm().maxCoeff();
  fine.displacement_m += ((fine.displacement_m - coarse.displacement_m) / 3.0).eval();
  return fine;
}

ContactReference runge_kutta_reference(const TouchedTissue& tissue, const ContactMotion& motion,
                                       int substeps, Eigen::Index field_every) {
  const double step_s = motion.period_s / substeps;
  const double tau_s = tissue.bonds.relaxation_time_s();
  BalancedContact balanced(tissue);
  ViscousState viscous_state{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(tissue.bonds.size())),
                             0.0};
  Eigen::VectorXd elongation;
  const auto rate = [&](const Eigen::Vector3d& displacement_m, const Eigen::VectorXd& y) {
    viscous_state.offset = y;
    balanced.go_to(displacement_m, viscous_state);
    tissue.bonds.elongations(balanced.position(), elongation);
    return Eigen::VectorXd((elongation - y) / tau_s);
  };
  Eigen::VectorXd viscous = viscous_state.offset;
  Record record(tissue, motion, field_every);
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < motion.steps(); ++i) {
    const Eigen::Vector3d to = motion.displacement_m.col(i);
    for (int s = 0; s < substeps; ++s) {
      const auto at = [&](double share) -> Eigen::Vector3d {
        return from + (s + share) / substeps * (to - from);
      };
      const Eigen::VectorXd first = rate(at(0.0), viscous);
      const Eigen::VectorXd second = rate(at(0.5), viscous + 0.5 * step_s * first);
      const Eigen::VectorXd third = rate(at(0.5), viscous + 0.5 * step_s * second);
      const Eigen::VectorXd fourth = rate(at(1.0), viscous + step_s * third);
      viscous += step_s / 6.0 * (first + 2.0 * second + 2.0 * third + fourth);
    }
    viscous_state.offset = viscous;
    const Eigen::Vector3d force_N = balanced.go_to(to, viscous_state);
    record.put(i, force_N, balanced.position());
    from = to;
  }
  return record.take();
}

Eigen::VectorXd line_reference(const TouchedTissue& tissue, const ContactMotion& motion,
                               double tolerance) {
  if (!motion.line) {
    throw bad_input("motion", fmt::format("'{}' is not along a line", motion.name),
                    "a motion along a line through rest");
  }
  Constraints constraints = tissue.constraints;
  constraints.slide(tissue.contact, motion.direction);
  const QuasiStatic solver(tissue.bonds, tissue.rest, constraints,
                           Probe{tissue.contact, motion.direction}, {.tolerance = tolerance});
  std::vector<double> times;
  for (Eigen::Index i = 1; i <= motion.steps(); ++i) {
    times.push_back(std::min(static_cast<double>(i) * motion.period_s, motion.line->end_s()));
  }
  // The response is the force of the contact on the tissue.
  return -solver.run(*motion.line, times).response;
}

}  // namespace tpm::accuracy
