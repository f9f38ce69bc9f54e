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
            const Probes& probes)
      : network_(bonds, rest, guided(constraints, probes), probes,
                 {.tolerance = kReferenceTolerance}) {}

  [[nodiscard]] Eigen::VectorXd force_N(const Protocol& protocol, double step_s) const {
    return network_.run(protocol, ends_of_steps(protocol, step_s)).response;
  }

 private:
  static Constraints guided(Constraints constraints, const Probes& probes) {
    for (const Probe& probe : probes) constraints.slide(probe.sphere, probe.direction);
    return constraints;
  }

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
  const Reference reference(bonds, rest, constraints, probes);
  std::vector<ComparedMotion> motions;
  for (const double duration : asked.durations) {
    ComparedMotion motion;
    const double ramp_s = duration * asked.mean_relaxation_time_s;
    motion.step_s = ramp_s / asked.steps_of_ramp;
    if (!motions.empty() && motions.back().step_s == motion.step_s) continue;
    const Protocol protocol = ramp_hold_release(ramp_s, asked.depth_m, true);
    try {
      motion.force_N = reference.force_N(protocol, motion.step_s);
    } catch (const Error& error) {
      if (error.code() != ExitCode::numerical) throw;
      motion.force_N =
          reference.force_N(ramp_hold_release(ramp_s, asked.depth_m, false), motion.step_s);
    }
    for (Eigen::Index i = 0; i < motion.force_N.size(); ++i) {
      motion.depth_m.push_back(value_at(protocol, motion.step_s * static_cast<double>(i + 1)));
    }
    motions.push_back(std::move(motion));
  }
  return motions;
}

}  // namespace tpm::contact
