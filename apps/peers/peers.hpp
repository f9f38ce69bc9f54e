#pragma once
// Other engines on the network with masses and elastic bonds: settings for tpm's own benchmark.
#include <vector>

#include "tpm/accuracy/benchmark_case.hpp"

namespace tpm::peers {
using namespace accuracy;

/// Network as an engine takes it: springs that pull along themselves, spheres with mass and drag,
/// some fixed, one driven.
struct SpringNetwork {
  explicit SpringNetwork(const BenchmarkCase& benchmark);

  struct Spring {
    int a = 0, b = 0;
    double rest_length_m = 0.0, stiffness_N_per_m = 0.0;
  };
  Positions rest;
  Eigen::VectorXd mass_kg;
  double drag_per_s = 0.0;
  std::vector<Spring> springs;
  std::vector<char> held;  ///< of each sphere
  int driven = 0;
  Eigen::Vector3d direction;  ///< of the drive, unit vector
  Protocol protocol;
  std::vector<double> times_s;

  /// Where the driven sphere is at a time.
  [[nodiscard]] Eigen::Vector3d driven_place(double time_s) const;
  /// The contact force at a time, N: what the springs pull at the driven sphere and its own drag.
  /// @param position of all spheres then
  [[nodiscard]] double contact_force_N(double time_s, const Positions& position) const;
};

/// An engine that steps the network.
class Engine {
 public:
  virtual ~Engine() = default;
  /// Advances by one step; the driven sphere is at `driven` when it ends.
  virtual void step(const Eigen::Vector3d& driven) = 0;
  /// Positions of all spheres, m.
  virtual void read(Positions& position) const = 0;
};

/// Runs an engine from rest through the protocol with steps of one length and takes the contact
/// force at the asked times, linear between steps.
[[nodiscard]] MethodRun run_engine(const SpringNetwork& network, Engine& engine, double step_s);

/// MuJoCo: spheres on three slides, bonds as spatial tendons. Integrators Euler, implicit and RK4.
[[nodiscard]] std::vector<BenchmarkSetting> mujoco_settings(
    const std::shared_ptr<const SpringNetwork>& network, const std::vector<double>& steps_s);

/// Bullet's soft body: bonds as links whose share of correction is chosen such that one iteration
/// of one step gives their stiffness.
[[nodiscard]] std::vector<BenchmarkSetting> bullet_settings(
    const std::shared_ptr<const SpringNetwork>& network, const std::vector<double>& steps_s);

}  // namespace tpm::peers
