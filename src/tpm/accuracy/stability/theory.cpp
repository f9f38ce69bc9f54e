#include "tpm/accuracy/stability/theory.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <complex>

namespace tpm::accuracy {
namespace {

using Matrix = Eigen::MatrixXd;

/// d(x, v, y)/dt, or d(y)/dt without mass.
Matrix rates(const LinearElement& e) {
  const double tau = e.relaxation_time_s;
  if (e.mass_kg == 0.0 || e.depth_imposed) {
    const double follows = e.depth_imposed ? 0.0 : e.relaxing_N_per_m / e.stiffness_N_per_m;
    return Matrix::Constant(1, 1, (follows - 1.0) / tau);
  }
  Matrix a(3, 3);
  a << 0, 1, 0,                                                                         //
      -e.stiffness_N_per_m / e.mass_kg, -e.drag_per_s, e.relaxing_N_per_m / e.mass_kg,  //
      1 / tau, 0, -1 / tau;
  return a;
}

/// Matrix that multiplies a state in a step. Only rules with a limit.
Matrix amplification(StepRule rule, const LinearElement& e, double h) {
  const Matrix a = h * rates(e);
  const Matrix one = Matrix::Identity(a.rows(), a.cols());
  if (rule == StepRule::forward_euler) return one + a;
  if (rule == StepRule::rk4) {
    return one + a * (one + a / 2 * (one + a / 3 * (one + a / 4)));
  }
  // Semi-implicit Euler: velocity, then position, then viscous elongation.
  const double held = 1.0 + h * e.drag_per_s;
  Matrix velocity = one;
  velocity.row(1) << -h * e.stiffness_N_per_m / e.mass_kg / held, 1.0 / held,
      h * e.relaxing_N_per_m / e.mass_kg / held;
  Matrix position = one;
  position(0, 1) = h;
  const double ratio = h / e.relaxation_time_s;
  Matrix viscous = one;
  viscous.row(2) << ratio / (1.0 + ratio), 0.0, 1.0 / (1.0 + ratio);
  return viscous * position * velocity;
}

bool is_stable(StepRule rule, const LinearElement& e, double h) {
  constexpr double kRounding = 1e-12;
  return amplification(rule, e, h).eigenvalues().cwiseAbs().maxCoeff() <= 1.0 + kRounding;
}

}  // namespace

LinearElement linear_element(const BondElement& p, double depth_m) {
  const double unit = p.modulus_to_stiffness_m();
  LinearElement e;
  e.stiffness_N_per_m = unit * (p.instantaneous_Pa() + p.tension().slope(depth_m));
  e.relaxing_N_per_m = unit * p.relaxing_Pa();
  e.relaxation_time_s = p.relaxation_time_s();
  return e;
}

std::optional<double> stable_step_s(StepRule rule, const LinearElement& e) {
  const bool moves = e.mass_kg > 0.0 && !e.depth_imposed;
  const bool limited = rule == StepRule::forward_euler || rule == StepRule::rk4 ||
                       (rule == StepRule::semi_implicit_euler && moves);
  if (!limited) return std::nullopt;
  // Without a limit by frequency the fastest rate sets the scale.
  const double fastest = rates(e).eigenvalues().cwiseAbs().maxCoeff();
  double stable = 1e-4 / fastest;
  if (!is_stable(rule, e, stable)) return 0.0;
  double unstable = stable;
  while (is_stable(rule, e, unstable)) {
    stable = unstable;
    unstable *= 1.05;
    if (unstable > 1e6 / fastest) return std::nullopt;
  }
  while (unstable > stable * (1.0 + 1e-10)) {
    const double middle = 0.5 * (stable + unstable);
    (is_stable(rule, e, middle) ? stable : unstable) = middle;
  }
  return stable;
}

Eigen::VectorXd linear_motion_m(const LinearElement& e, double load_N,
                                std::span<const double> times_s) {
  // About where it ends, everything relaxed, the motion is homogeneous.
  const double end = load_N / (e.stiffness_N_per_m - e.relaxing_N_per_m);
  const Eigen::EigenSolver<Matrix> modes(rates(e));
  const Eigen::VectorXcd start = modes.eigenvectors().partialPivLu().solve(
      Eigen::Vector3d(-end, 0.0, -end).cast<std::complex<double>>());
  Eigen::VectorXd depth(static_cast<Eigen::Index>(times_s.size()));
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const Eigen::VectorXcd then =
        modes.eigenvectors() *
        ((modes.eigenvalues() * times_s[i]).array().exp() * start.array()).matrix();
    depth[static_cast<Eigen::Index>(i)] = end + then[0].real();
  }
  return depth;
}

}  // namespace tpm::accuracy
