#include <cmath>

#include "peers.hpp"
#include "tpmkit/error.hpp"

namespace tpm::peers {
using namespace accuracy;

SpringNetwork::SpringNetwork(const BenchmarkCase& benchmark)
    : rest(benchmark.network.rest),
      mass_kg(benchmark.mass.value().mass_kg),
      drag_per_s(benchmark.mass->drag_per_s),
      protocol(benchmark.protocol),
      times_s(benchmark.times_s) {
  const BondSystem& bonds = benchmark.network.bonds;
  constexpr double kForEver_s = 1e6;  // beside fractions of a second of a poke
  if (bonds.relaxation_time_s() < kForEver_s) {
    throw Error(ExitCode::bad_input, "peers", "the bonds relax", "elastic bonds");
  }
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    springs.push_back({static_cast<int>(bonds.end_a()[i]), static_cast<int>(bonds.end_b()[i]),
                       bonds.rest_length_m()[row], bonds.stiffness()[row]});
  }
  const Probe& probe = benchmark.network.probes.front();
  driven = static_cast<int>(probe.sphere);
  direction = probe.direction;
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    const Eigen::Matrix3d& free =
        benchmark.network.constraints.projector(static_cast<std::size_t>(i));
    held.push_back(free.isZero() ? 1 : 0);
  }
}

Eigen::Vector3d SpringNetwork::driven_place(double time_s) const {
  return rest.col(driven) + value_at(protocol, time_s) * direction;
}

double SpringNetwork::contact_force_N(double time_s, const Positions& position) const {
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();
  for (const Spring& spring : springs) {
    if (spring.a != driven && spring.b != driven) continue;
    const int other = spring.a == driven ? spring.b : spring.a;
    const Eigen::Vector3d to_other = position.col(other) - position.col(driven);
    const double length = to_other.norm();
    pull += spring.stiffness_N_per_m * (length - spring.rest_length_m) / length * to_other;
  }
  constexpr double kDifference_s = 1e-9;
  const double speed =
      (value_at(protocol, time_s) - value_at(protocol, time_s - kDifference_s)) / kDifference_s;
  return -pull.dot(direction) + mass_kg[driven] * drag_per_s * speed;
}

MethodRun run_engine(const SpringNetwork& network, Engine& engine, double step_s) {
  MethodRun run;
  run.response.resize(static_cast<Eigen::Index>(network.times_s.size()));
  const double end_s = network.protocol.end_s();
  const long steps = std::lround(end_s / step_s);
  Positions position = network.rest;
  double before_s = 0.0, before_N = 0.0;
  Eigen::Index next = 0;
  for (long i = 1; i <= steps; ++i) {
    const double now_s = end_s * static_cast<double>(i) / static_cast<double>(steps);
    engine.step(network.driven_place(now_s));
    const bool asked = next < run.response.size() &&
                       network.times_s[static_cast<std::size_t>(next)] <= now_s + step_s;
    if (!asked) continue;
    engine.read(position);
    if (!position.allFinite() || (position - network.rest).cwiseAbs().maxCoeff() > 1.0) {
      run.end = MethodEnd::diverged;
      run.reason = "a sphere is further than 1 m from rest";
      run.end_time_s = now_s;
      run.work.steps = i;
      return run;
    }
    const double now_N = network.contact_force_N(now_s, position);
    constexpr double kRounding_s = 1e-12;
    while (next < run.response.size()) {
      const double at_s = network.times_s[static_cast<std::size_t>(next)];
      if (at_s > now_s + kRounding_s) break;
      const double share = (at_s - before_s) / (now_s - before_s);
      run.response[next++] = before_N + share * (now_N - before_N);
    }
    before_s = now_s;
    before_N = now_N;
  }
  run.end_time_s = end_s;
  run.work.steps = steps;
  run.work.rates = steps;
  return run;
}

}  // namespace tpm::peers
