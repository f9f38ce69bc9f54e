#pragma once
#include <vector>

#include "tpmkit/protocol.hpp"

namespace tpm::plan {

/// A function of the depth: a stiffness, or a curve through even points, cubic between them.
struct DepthCurve {
  double stiffness_N_per_m = 0.0;  ///< used where there are no points
  std::vector<double> force_N{};   ///< at even depths from first_m to last_m; at least 4, or none
  double first_m = 0.0, last_m = 0.0;
  /// Added, if given: 2 E' A0/l0, N/m, and x, of the pull of two lateral bonds.
  double tension_N_per_m = 0.0, spacing_m = 1.0;

  /// Beyond its ends the curve goes on along the cubic there.
  [[nodiscard]] double operator()(double depth_m) const;
};

/// A share of what relaxes, and its time.
struct ScalarBranch {
  double share = 1.0;
  double time_s = 1.0;  ///< > 0
};

/// A contact seen along its own direction, with two static curves and a few exponentials:
///
///     F = R(u) + sum_i share_i (B(u) - w_i),   dw_i/dt = (B(u) - w_i)/tau_i
///
/// where R is the relaxed force and B the relaxing part of the instantaneous force. Over a step
/// B(u) is taken as linear in time, under which the w_i are advanced exactly. With B rising and the
/// shares not negative it is passive (docs/theory.md, passivity, with V = B).
class ScalarModel {
 public:
  /// @param period_s of a step, > 0
  ScalarModel(DepthCurve equilibrium, DepthCurve relaxing, std::vector<ScalarBranch> branches,
              double period_s);

  /// Relaxed at a depth.
  void settle(double depth_m);
  /// A step at whose end the depth is given; the force there, N.
  double step_to(double depth_m);
  /// A step at whose end the load is given; the depth there, m. Throws Error(numerical) if there is
  /// none.
  double step_under(double load_N);
  /// The depth, or the load, jumps; the response.
  double jump_to(double depth_m);
  double jump_under(double load_N);
  void set_period(double period_s);

  [[nodiscard]] double depth_m() const { return depth_m_; }
  [[nodiscard]] const std::vector<double>& viscous_N() const { return viscous_; }
  [[nodiscard]] const DepthCurve& relaxing() const { return relaxing_; }
  [[nodiscard]] const std::vector<ScalarBranch>& branches() const { return branches_; }

 private:
  struct Weights {
    double viscous = 0.0, start = 0.0, end = 0.0;
  };
  [[nodiscard]] double force_at(double depth_m, const std::vector<Weights>& weights) const;
  [[nodiscard]] double depth_under(double load_N, const std::vector<Weights>& weights) const;
  void accept(double depth_m, const std::vector<Weights>& weights);

  DepthCurve equilibrium_, relaxing_;
  std::vector<ScalarBranch> branches_;
  std::vector<Weights> weights_, instantaneous_;
  std::vector<double> viscous_;
  double depth_m_ = 0.0, start_N_ = 0.0;  ///< and B there
};

}  // namespace tpm::plan
