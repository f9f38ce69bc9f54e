#include "tpm/organ/balance/tool_impact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr int kMostSweeps = 20'000;
constexpr double kSettled = 1e-14;  // of the largest approach speed
// Roundings of a speed in a sum of three products: no approach slower than that is told from none.
constexpr double kImpulseRoundings = 8.0 * std::numeric_limits<double>::epsilon();

/// Change due to an impulse along the normal.
struct Answer {
  Eigen::Vector3d of_sphere, of_tool;  ///< velocities per impulse, 1/kg
  double of_gap = 0.0;                 ///< rate of the gap per impulse, 1/kg
};

Answer answer_of(const TouchingPair& pair, const Constraints& constraints,
                 const Eigen::VectorXd& mass_kg) {
  const auto moved = [&](Eigen::Index column) {
    return Eigen::Vector3d(constraints.projector(static_cast<std::size_t>(column)) * pair.normal /
                           mass_kg[column]);
  };
  Answer answer{-moved(pair.sphere), moved(pair.tool), 0.0};
  answer.of_gap = pair.normal.dot(answer.of_tool - answer.of_sphere);
  return answer;
}

}  // namespace

Eigen::VectorXd inelastic_impact(std::span<const TouchingPair> pairs,
                                 const Constraints& constraints, const Eigen::VectorXd& mass_kg,
                                 Eigen::Matrix3Xd& velocity) {
  std::vector<Answer> answers;
  double scale = 0.0, speed = 0.0;
  const auto gap_rate = [&](const TouchingPair& pair) {
    return pair.normal.dot(velocity.col(pair.tool) - velocity.col(pair.sphere));
  };
  for (const TouchingPair& pair : pairs) {
    answers.push_back(answer_of(pair, constraints, mass_kg));
    scale = std::max(scale, -gap_rate(pair));
    speed = std::max({speed, velocity.col(pair.tool).norm(), velocity.col(pair.sphere).norm()});
  }
  Eigen::VectorXd impulse = Eigen::VectorXd::Zero(std::ssize(pairs));
  if (!(scale > 0.0)) return impulse;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double changed = 0.0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Answer& answer = answers[i];
      if (!(answer.of_gap > 0.0)) continue;
      double& p = impulse[static_cast<Eigen::Index>(i)];
      const double more = std::max(-p, -gap_rate(pairs[i]) / answer.of_gap);
      p += more;
      velocity.col(pairs[i].sphere) += more * answer.of_sphere;
      velocity.col(pairs[i].tool) += more * answer.of_tool;
      changed = std::max(changed, std::abs(more) * answer.of_gap);
    }
    if (changed <= std::max(kSettled * scale, kImpulseRoundings * speed)) return impulse;
  }
  throw Error(ExitCode::numerical, "tools", "the impulses of an impact do not settle");
}

}  // namespace tpm::organ
