#include "tpm/benchmark/contact_reference.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/core/error.hpp"
#include "tpm/network/quasistatic.hpp"
#include "tpm/solve/relaxation_filter.hpp"

namespace tpm {
namespace {

constexpr double kBalance = 1e-13;  // of the stiffest bond times 1 m
constexpr int kMostIterations = 60;
constexpr int kSlow = 6;  // iterations after which a factorisation is found anew

Freedom with_contact_held(const TouchedTissue& tissue) {
  Freedom freedom = tissue.freedom;
  freedom.hold(tissue.contact);
  return freedom;
}

Eigen::Matrix3Xd forces_with(const TouchedTissue& tissue, const ContactMotion& motion,
                             int substeps) {
  FineContact fine(tissue, motion.period_s / substeps);
  Eigen::Matrix3Xd force(3, motion.steps());
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < motion.steps(); ++i) {
    const Eigen::Vector3d to = motion.displacement_m.col(i);
    for (int s = 1; s <= substeps; ++s) {
      force.col(i) = fine.step(from + static_cast<double>(s) / substeps * (to - from));
    }
    from = to;
  }
  return force;
}

}  // namespace

FineContact::FineContact(const TouchedTissue& tissue, double step_s)
    : tissue_(tissue),
      freedom_(with_contact_held(tissue)),
      equilibrium_(tissue.bonds, freedom_),
      position_(tissue.rest),
      remembered_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(tissue.bonds.size()))) {
  const RelaxationWeights w = relaxation_weights(step_s / tissue.bonds.relaxation_time_s());
  keep_ = w.r;
  of_start_ = w.w0;
  of_end_ = w.w1;
  tissue.bonds.elongations(position_, elongation_);
}

Eigen::Vector3d FineContact::step(const Eigen::Vector3d& displacement_m) {
  const auto column = static_cast<Eigen::Index>(tissue_.contact);
  const double tolerance_N = kBalance * tissue_.bonds.stiffness().maxCoeff();
  const BondMemory memory{keep_ * remembered_ + of_start_ * elongation_, of_end_};
  const Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, position_.cols());
  position_.col(column) = tissue_.rest.col(column) + displacement_m;
  Eigen::Matrix3Xd force;
  for (int iteration = 0;; ++iteration) {
    equilibrium_.forces(position_, memory, load, force);
    Eigen::Matrix3Xd left = force;
    freedom_.project(left);
    const double residual_N = left.cwiseAbs().maxCoeff();
    if (residual_N <= tolerance_N) break;
    if (iteration == kMostIterations || !std::isfinite(residual_N)) {
      throw Error(ExitCode::numerical, "contact", "the forces cannot be balanced");
    }
    if (!factorised_ || iteration % kSlow == kSlow - 1) {
      factorised_ = equilibrium_.factorise(position_, memory);
      if (!factorised_ || !equilibrium_.is_stable()) {
        throw Error(ExitCode::numerical, "contact", "the tissue buckles");
      }
    }
    equilibrium_.displace(left);
    position_ += left;
  }
  tissue_.bonds.elongations(position_, elongation_);
  remembered_ = memory.offset + of_end_ * elongation_;
  return force.col(column);
}

double FineContact::stored_J() const {
  return tissue_.bonds.stored_energy_J(position_, remembered_);
}

ContactReference fine_reference(const TouchedTissue& tissue, const ContactMotion& motion,
                                int substeps) {
  const Eigen::Matrix3Xd coarse = forces_with(tissue, motion, substeps);
  const Eigen::Matrix3Xd fine = forces_with(tissue, motion, 2 * substeps);
  const Eigen::Matrix3Xd change = (fine - coarse) / 3.0;
  return {fine + change, change.colwise().norm().maxCoeff()};
}

Eigen::VectorXd line_reference(const TouchedTissue& tissue, const ContactMotion& motion,
                               double tolerance) {
  if (!motion.line) {
    throw bad_input("motion", fmt::format("'{}' is not along a line", motion.name),
                    "a motion along a line through rest");
  }
  Freedom freedom = tissue.freedom;
  freedom.guide(tissue.contact, motion.direction);
  const QuasiStatic solver(tissue.bonds, tissue.rest, freedom,
                           Probe{tissue.contact, motion.direction}, {.tolerance = tolerance});
  std::vector<double> times;
  for (Eigen::Index i = 1; i <= motion.steps(); ++i) {
    times.push_back(std::min(static_cast<double>(i) * motion.period_s, motion.line->end_s()));
  }
  // The response is the force of the contact on the tissue.
  return -solver.run(*motion.line, times).response;
}

}  // namespace tpm
