#include "tpm/contact/condensed/compared_motion.hpp"

#include <cmath>

#include "tpmkit/error.hpp"

namespace tpm::contact {
namespace {

constexpr double kReferenceTolerance = 1e-5;

Protocol ramp_hold_release(double ramp_s, double depth_m, bool released) {
  std::vector<Knot> knots{{0.0, 0.0}, {ramp_s, depth_m}, {2.0 * ramp_s, depth_m}};
  if (released) knots.insert(knots.end(), {{3.0 * ramp_s, 0.0}, {4.0 * ramp_s, 0.0}});
  return Protocol(Drive::displacement, std::move(knots), "to compare a reduced model with");
}

std::vector<double> ends_of_steps(const Protocol& protocol, double step_s) {
  std::vector<double> times_s;
  const auto count = std::lround(protocol.end_s() / step_s);
  for (long i = 1; i < count; ++i) times_s.push_back(step_s * static_cast<double>(i));
  times_s.push_back(protocol.end_s());
  return times_s;
}

/// Finds the forces of the network.
class Reference {
 public:
  Reference(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
            const Probes& probes, bool contact_forces)
      : bonds_(bonds),
        probes_(probes),
        contact_forces_(contact_forces),
        network_(bonds, rest, guided(constraints, probes), probes,
                 {.tolerance = kReferenceTolerance}) {}

  void run(const Protocol& protocol, double spacing_s, ComparedMotion& motion) const {
    const std::vector<double> times_s = ends_of_steps(protocol, spacing_s);
    if (!contact_forces_) {
      motion.force_N = network_.run(protocol, times_s).response;
      return;
    }
    Eigen::Matrix3Xd contact_N(3, static_cast<Eigen::Index>(times_s.size()));
    Eigen::Index at = 0;
    Eigen::Matrix3Xd force_N;
    motion.force_N =
        network_
            .run(protocol, times_s,
                 [&](const QuasiStaticState& state) {
                   force_N.setZero(3, state.position.cols());
                   bonds_.add_forces(state.position, {bonds_.mean_viscous(state.viscous), 0.0},
                                     force_N);
                   Eigen::Vector3d sum_N = Eigen::Vector3d::Zero();
                   for (const Probe& probe : probes_) {
                     sum_N += force_N.col(static_cast<Eigen::Index>(probe.sphere));
                   }
                   contact_N.col(at++) = sum_N;
                 })
            .response;
    motion.contact_N = std::move(contact_N);
  }

 private:
  static Constraints guided(Constraints constraints, const Probes& probes) {
    for (const Probe& probe : probes) constraints.slide(probe.sphere, probe.direction);
    return constraints;
  }

  const BondSystem& bonds_;
  Probes probes_;
  bool contact_forces_;
  QuasiStatic network_;
};

}  // namespace

double mean_relaxation_time_s(const std::vector<WeightedTime>& branches) {
  if (branches.empty()) return 0.0;
  double sum = 0.0;
  for (const WeightedTime& b : branches) sum += b.share * std::log(b.relaxation_time_s);
  return std::exp(sum);
}

std::vector<ComparedMotion> compared_motions(const BondSystem& bonds, const Positions& rest,
                                             const Constraints& constraints, const Probes& probes,
                                             const ComparedMotions& asked) {
  const Reference reference(bonds, rest, constraints, probes, asked.contact_forces);
  std::vector<ComparedMotion> motions;
  for (const double duration : asked.durations) {
    ComparedMotion motion;
    double ramp_s = duration * asked.mean_relaxation_time_s;
    motion.step_s = ramp_s / asked.steps_of_ramp;
    if (motion.step_s < asked.least_step_s) {
      motion.step_s = asked.least_step_s;
      ramp_s = asked.steps_of_ramp * motion.step_s;
    }
    if (!motions.empty() && motions.back().step_s == motion.step_s) continue;
    const Protocol protocol = ramp_hold_release(ramp_s, asked.depth_m, true);
    const double spacing_s = motion.step_s * asked.every;
    try {
      reference.run(protocol, spacing_s, motion);
    } catch (const Error& error) {
      if (error.code() != ExitCode::numerical) throw;
      reference.run(ramp_hold_release(ramp_s, asked.depth_m, false), spacing_s, motion);
    }
    for (Eigen::Index i = 0; i < asked.every * motion.force_N.size(); ++i) {
      motion.depth_m.push_back(value_at(protocol, motion.step_s * static_cast<double>(i + 1)));
    }
    motions.push_back(std::move(motion));
  }
  return motions;
}

}  // namespace tpm::contact
